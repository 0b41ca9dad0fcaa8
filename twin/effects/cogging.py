"""Cogging of the linear motor: a force periodic in position, independent of current.

F = sum_{k=1..3} a_k sin(2 pi k x/p) + b_k cos(2 pi k x/p), p the pole pitch, or the slot pitch.
J. F. Gieras, Z. J. Piech, B. Tomczuk, "Linear Synchronous Motors", 2nd ed. (2011): the cogging
force is a Fourier series in position with period set by pole pitch and slot pitch.
"""

from twin.curve import Coordinate, Curve
from twin.effect import LEAST, MOST, OUT, Effect, Kind, Parameter, X
from twin.law_parts import (
    columns_of,
    harmonic_terms,
    harmonics,
    of_shortest_pitch,
    pitches_to_try,
    repeats_after,
)

CYCLES = 120  # most over the travel that are tried before a model tells them


def law(p, s, io):
    sin1, cos1, sin2, cos2, sin3, cos3 = harmonics(io[X], p[0])
    io[OUT] = p[1] * sin1 + p[2] * cos1 + p[3] * sin2 + p[4] * cos2 + p[5] * sin3 + p[6] * cos3


def columns(p, s, io):
    columns_of(io, harmonics(io[X], p[0]))


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="force periodic in position at the magnet pitch, harmonics 1 to 3",
    equation="F = sum_{k=1..3} a_k sin(2 pi k x/p) + b_k cos(2 pi k x/p)",
    source="Gieras, Piech, Tomczuk, Linear Synchronous Motors, 2011 (cogging as a Fourier series)",
    parameters=(
        Parameter(
            "p", "m", 0.024, LEAST, MOST, "magnet pitch", period=True,
            scan=lambda e: pitches_to_try(e.pitches, e.travel, 3, CYCLES),
        ),
        *harmonic_terms(3, "N"),
    ),
    law=law,
    knees=(repeats_after("p"),),
    columns=columns,
    simplest=of_shortest_pitch,
    curves=(Curve(Coordinate.POSITION, period="p"),),
    several=True,
    fingerprint="residual repeats along the track, the same in both directions and at every force",
    excited_by="constant-speed passes over many magnet pitches",
)  # fmt: skip
