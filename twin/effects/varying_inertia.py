"""Inertia that varies with the position: a crank, a linkage, a chain that is lifted on its way.

m(x) q'' + m'(x) q'^2 / 2 = F with m(x) = m (1 + J(x)), Lagrange's equation of one coordinate: what
a part of the mass moves by follows from the geometry. J(x) = sum_{k=1,2,3} a_k sin(2 pi k x/p) +
b_k cos(2 pi k x/p); p: a turn of a crank, whose rod makes the first and the third beside the
second. J. J. Uicker, G. R. Pennock, J. E. Shigley, Theory of Machines and Mechanisms (2011),
chapter 16 (equivalent mass).
"""

from math import pi

from twin.effect import ACC, LEAST, MOST, MOVED, OUT, Effect, Kind, Parameter, V, X
from twin.knee import Imitated
from twin.law_parts import COUNTS, at, harmonic_terms, harmonics, of_shortest_pitch

CYCLES = 8  # most over the travel that are tried; the pitch of a motor is no linkage


def law(p, s, io):
    sin1, cos1, sin2, cos2, sin3, cos3 = harmonics(io[X], p[0])
    more = p[1] * sin1 + p[2] * cos1 + p[3] * sin2 + p[4] * cos2 + p[5] * sin3 + p[6] * cos3
    slope = p[1] * cos1 - p[2] * sin1 + 2.0 * (p[3] * cos2 - p[4] * sin2)
    slope += 3.0 * (p[5] * cos3 - p[6] * sin3)
    io[OUT] = -io[MOVED] * (more * io[ACC] + pi / p[0] * slope * io[V] ** 2)


EFFECT = Effect(
    kind=Kind.STRUCTURE,
    summary="inertia varies with the position, as of a crank, a linkage or a chain",
    equation="F = -m (J(x) a + J'(x) v^2/2);  J = sum_{k=1,2,3} a_k sin(2 pi k x/p) + "
    "b_k cos(2 pi k x/p)",
    source="Uicker, Pennock, Shigley, Theory of Machines and Mechanisms, chapter 16",
    parameters=(
        Parameter(
            "p", "m", 0.1, LEAST, MOST, "travel after which it repeats", period=True,
            scan=lambda e: tuple(2.0 * e.travel / k for k in range(1, 2 * CYCLES + 1)),
        ),
        *harmonic_terms(3, "1", 0.9),
    ),
    law=law,
    knees=(
        # over a tenth of a period it is as good as constant; before that it is a curve that rises
        at(
            "p", "m", lambda e: (COUNTS * e.resolution, 10.0 * (e.been[1] - e.been[0])),
            Imitated.ROUNDING, Imitated.INERTIA,
        ),
    ),
    of_joints=False,
    simplest=of_shortest_pitch,
    fingerprint="residual follows acceleration and squared speed, by place",
    excited_by="strong accelerations both ways at many places, and fast passes",
)  # fmt: skip
