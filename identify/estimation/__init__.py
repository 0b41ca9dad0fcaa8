"""A model on a dataset: force balance, fit, variable projection, evidence, intervals.

Also the properties of logs that need a fit: their channel delay and their time origins.
"""
