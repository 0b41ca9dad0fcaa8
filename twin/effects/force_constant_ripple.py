"""Force constant of the motor that varies with position at the magnet pitch.

u_actual = u (1 + sum_{k=1,2} a_k sin(2 pi k x/p) + b_k cos(2 pi k x/p)), p the magnet pitch.
Ripple of the thrust constant in proportion to current, beside the cogging that does not depend on
it: C. Rohrig, A. Jochheim, "Identification and compensation of force ripple in linear permanent
magnet motors", Proc. American Control Conference 2001.
"""

from twin.effect import LEAST, MOST, Effect, Kind, Parameter, U, X
from twin.knee import Imitated
from twin.law_parts import (
    RIPPLE_CYCLES,
    harmonic_terms,
    of_shortest_pitch,
    pitches_to_try,
    repeats_after,
    ripple,
)


def law(p, s, io):
    io[U] += io[U] * ripple(p, io[X])


EFFECT = Effect(
    kind=Kind.ACTUATION,
    summary="force constant varies with position at the magnet pitch",
    equation="u_actual = u (1 + sum_{k=1,2} a_k sin(2 pi k x/p) + b_k cos(2 pi k x/p))",
    source="Rohrig, Jochheim 2001, force ripple in proportion to current",
    parameters=(
        Parameter(
            "p", "m", 0.024, LEAST, MOST, "magnet pitch", period=True,
            scan=lambda e: pitches_to_try(e.thrust_pitches, e.travel, 2, RIPPLE_CYCLES),
        ),
        *harmonic_terms(2, "1", 0.5),
    ),
    law=law,
    knees=(repeats_after("p", Imitated.GAIN),),
    simplest=of_shortest_pitch,
    several=True,
    fingerprint="residual repeats along the track in proportion to the motor force there",
    excited_by="strong accelerations both ways at many places, over many magnet pitches",
)  # fmt: skip
