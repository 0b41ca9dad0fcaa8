"""Logs -> one prepared dataset: motion, test functions, noise floor, spectral lines.

What is done to a log before it is fitted is done here, once; nothing here knows a fit.
"""
