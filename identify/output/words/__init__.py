"""Sentences about results: one function for each kind of result, one module for each room.

Text, JSON, report and ``print`` of a result all use these functions, so that a result reads the
same everywhere. The rooms before hold data only.
"""
