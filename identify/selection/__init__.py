"""Which effect is missing: candidates, ranking, forward selection, residual dependence.

Every decision of a diagnosis is made here; its sentences are made in ``identify.output.words``.
"""
