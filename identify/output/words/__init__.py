"""Sentences about results, each written once, a module a subject.

Text, JSON, report and ``print`` of a result all use these functions, so that a result reads the
same everywhere. The rooms before hold data only.
"""
