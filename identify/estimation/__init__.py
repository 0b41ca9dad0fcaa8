"""A model on a dataset: force balance, fit, variable projection, evidence, intervals.

Also what a fit tells beside: channel delay and time origins of logs, free curves of its laws.
"""
