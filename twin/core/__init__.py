"""The compiled core: calling convention, effect table, attached masses, walks.

Compiled functions are made with ``compiled``, not with numba's own decorators, because only its
caches are keyed by everything that is compiled into a function. A new effect needs no change here.
"""
