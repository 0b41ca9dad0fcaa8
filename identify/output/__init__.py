"""Results as text, JSON and HTML report; every sentence about a result is made here.

Nothing here computes a result. ``words`` makes the sentences that text, JSON and report share; a
section of the report is one module of ``report``.
"""
