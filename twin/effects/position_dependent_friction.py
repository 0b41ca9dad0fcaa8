"""Dry friction level that varies along the track (lubrication, preload).

Fc, Fs -> (1 + P(x)) Fc, Fs with the smooth profile P(x) = sum_k c_k cos(k pi (x - start) / length).
A cosine series has zero mean over the track, so that it does not compete with Fc. L. Jia 2023,
section on the velocity maps: Fc and Fs fall along the track, v0 and sigma2 show no trend.
"""

from math import cos, pi

from twin.curve import Coordinate, Curve
from twin.effect import DRY, LEAST, MOST, Effect, Kind, Parameter, X
from twin.knee import Imitated
from twin.law_parts import turns_with_direction


def law(p, s, io):
    along = min(max((io[X] - p[0]) / p[1], 0.0), 1.0)  # beyond the track it stays as it is
    double = 2.0 * cos(pi * along)
    # Clenshaw's recurrence for a cosine series
    last = p[6]
    b4 = p[5] + double * last
    b3 = p[4] + double * b4 - last
    b2 = p[3] + double * b3 - b4
    b1 = p[2] + double * b2 - b3
    profile = 0.5 * double * b1 - b2
    io[DRY] *= max(1.0 + profile, 0.01)  # friction cannot turn negative


EFFECT = Effect(
    kind=Kind.MODIFIER,
    summary="dry friction level varies smoothly along the track",
    equation="Fc, Fs -> (1 + P(x)) Fc, Fs;  P(x) = sum_k c_k cos(k pi (x - start)/length)",
    source="L. Jia 2023, velocity maps at nine positions",
    parameters=(
        Parameter(
            "start", "m", -0.17, -MOST, MOST, "where the profile begins", fixed=True,
            start_rule=lambda e: e.position_low,
        ),
        Parameter(
            "length", "m", 0.34, LEAST, MOST, "length of the profile", fixed=True,
            start_rule=lambda e: e.travel,
        ),
        *(
            Parameter(f"c{k}", "1", 0.0, -2.0, 2.0, f"cosine term {k}", strength=True)
            for k in range(1, 6)
        ),
    ),
    law=law,
    knees=(turns_with_direction(Imitated.OF_POSITION),),
    curves=(Curve(Coordinate.POSITION, by_direction=True, rubs=True),),
    fingerprint="residual flips with direction and has the same shape along the track",
    excited_by="constant-speed passes over the whole travel in both directions",
)  # fmt: skip
