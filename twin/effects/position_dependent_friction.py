"""Dry friction level that varies along the track (lubrication, preload).

Fc, Fs -> (1 + P(x)) Fc, Fs with the smooth profile P(x) = sum_k c_k cos(k pi (x - start) / length).
L. Jia 2023, section on the velocity maps: Fc and Fs fall along the track, v0 and sigma2 show no
trend.
"""

from twin.curve import Coordinate, Curve
from twin.effect import DRY, Effect, Kind, X
from twin.knee import Imitated
from twin.law_parts import TRACK, along_track, cosine_terms, turns_with_direction


def law(p, s, io):
    io[DRY] *= max(1.0 + along_track(p, io[X]), 0.01)  # friction cannot turn negative


EFFECT = Effect(
    kind=Kind.MODIFIER,
    summary="dry friction level varies smoothly along the track",
    equation="Fc, Fs -> (1 + P(x)) Fc, Fs;  P(x) = sum_k c_k cos(k pi (x - start)/length)",
    source="L. Jia 2023, velocity maps at nine positions",
    parameters=(*TRACK, *cosine_terms(2.0)),
    law=law,
    knees=(turns_with_direction(Imitated.OF_POSITION),),
    curves=(Curve(Coordinate.POSITION, by_direction=True, rubs=True),),
    fingerprint="residual flips with direction and has the same shape along the track",
    excited_by="constant-speed passes over the whole travel in both directions",
)
