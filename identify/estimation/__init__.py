"""A model on a dataset: force balance, fit, variable projection, evidence, intervals.

Also what a fit tells of the logs themselves: their channel delay and their time origins.
"""
