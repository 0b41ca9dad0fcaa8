"""Results as text, JSON and HTML report; every sentence that a user reads is written here.

Nothing here computes a result. A section of the report is one module of ``report``.
"""
