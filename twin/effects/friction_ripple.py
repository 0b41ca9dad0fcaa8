"""Dry friction level that repeats along the track, as an eccentric gear or a bent screw makes it.

Fc, Fs -> (1 + sum_{k=1,2} a_k sin(2 pi k x/p) + b_k cos(2 pi k x/p)) Fc, Fs, p a turn of the part
that rubs. The preload of a ball screw, and its friction with it, repeats with the turn: S. Frey,
M. Walther, A. Verl, "Periodic variation of preloading in ball screws", Prod. Eng. 4 (2010).
"""

from twin.effect import DRY, LEAST, MOST, Effect, Kind, Parameter, X
from twin.knee import Imitated
from twin.law_parts import (
    RIPPLE_CYCLES,
    harmonic_terms,
    of_shortest_pitch,
    pitches_to_try,
    repeats_after,
    ripple,
    turns_with_direction,
)


def law(p, s, io):
    io[DRY] *= max(1.0 + ripple(p, io[X]), 0.01)  # friction cannot turn negative


EFFECT = Effect(
    kind=Kind.MODIFIER,
    summary="dry friction level repeats along the track",
    equation="Fc, Fs -> (1 + sum_{k=1,2} a_k sin(2 pi k x/p) + b_k cos(2 pi k x/p)) Fc, Fs",
    source="Frey, Walther, Verl 2010, preload of ball screws",
    parameters=(
        Parameter(
            "p", "m", 0.02, LEAST, MOST, "travel of one turn of the part that rubs", period=True,
            scan=lambda e: pitches_to_try(e.friction_pitches, e.travel, 2, RIPPLE_CYCLES),
        ),
        *harmonic_terms(2, "1", 0.5),
    ),
    law=law,
    knees=(
        turns_with_direction(Imitated.OF_POSITION),
        repeats_after("p", Imitated.DRY_FRICTION),
    ),
    simplest=of_shortest_pitch,
    several=True,
    fingerprint="residual repeats along the track and flips with the direction of motion",
    excited_by="constant-speed passes in both directions over several turns of each moving part",
)  # fmt: skip
