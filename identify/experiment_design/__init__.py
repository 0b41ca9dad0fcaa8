"""Experiment design: missing excitation, rival hypotheses, candidate experiments, the choice.

A new kind of experiment becomes a candidate in ``candidate_experiments``.
"""
