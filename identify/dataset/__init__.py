"""Logs -> one prepared dataset: motion, test functions, noise floor, spectral lines.

Every step from a log to the data of a fit is done here, once; nothing here depends on a fit.
"""
