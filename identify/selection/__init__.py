"""Which effect is missing: candidates, ranking, forward selection, residual dependence.

Every decision of a diagnosis is made here; how it is worded is not.
"""
