"""The experiment that decides: missing excitation, rival hypotheses, candidate experiments, choice.

A new kind of experiment becomes a candidate in ``candidate_experiments``.
"""
