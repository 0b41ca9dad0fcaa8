"""The compiled core: calling convention, effect table, attached masses, control loop.

Compiled functions are made with ``compiled``, never with numba's own decorators: their caches know
what is compiled into them. A new effect needs no change here.
"""
