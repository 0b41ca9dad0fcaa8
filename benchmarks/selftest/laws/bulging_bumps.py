"""Roller bumps that rise steeply and fall gently, as a roller that runs onto a worn edge.

F = -(ahead + behind)/2 d b(x) - (ahead - behind)/2 b(x), b a raised cosine, a quarter of ``width``
long where it rises and three quarters where it falls; d follows the direction within 60 um.
"""

from math import copysign, cos, expm1, floor, pi

from benchmarks.selftest.laws.gaussian_bumps import EFFECT as GAUSSIAN
from twin.effect import DT, OUT, WHEN, Effect, Kind, V, X

TURN = 6e-5  # m


def law(p, s, io):
    direction = s[0]
    if io[V] != 0.0:
        change = (copysign(1.0, io[V]) - s[0]) * -expm1(-abs(io[V]) * io[DT] / TURN)
        direction += io[WHEN] * change
        s[0] += change
    turns = (io[X] - p[2]) / p[0]
    distance = (turns - floor(turns + 0.5)) * p[0]
    r = distance / (0.25 * p[1]) if distance < 0.0 else distance / (0.75 * p[1])
    bump = 0.5 + 0.5 * cos(pi * r) if abs(r) < 1.0 else 0.0
    io[OUT] = -0.5 * ((p[3] + p[4]) * direction + (p[3] - p[4])) * bump


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="roller bumps that rise steeply and fall gently",
    equation="F = -[(ahead + behind)/2 d + (ahead - behind)/2] b(x);  b a lopsided raised cosine",
    source="this project's choice",
    parameters=GAUSSIAN.parameters,
    states=("direction",),
    law=law,
    curves=GAUSSIAN.curves,
    fingerprint="none",
    excited_by="any motion",
)
