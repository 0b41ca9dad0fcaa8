"""Force constant of the motor that varies smoothly along the track (magnets, air gap, commutation).

u_actual = u (1 + P(x)) with the smooth profile P(x) = sum_k c_k cos(k pi (x - start) / length),
slower than the ripple at the magnet pitch: C. Rohrig, A. Jochheim, "Identification and compensation
of force ripple in linear permanent magnet motors", Proc. American Control Conference 2001.
"""

from twin.effect import Effect, Kind, U, X
from twin.knee import Imitated
from twin.law_parts import TRACK, along_track, cosine_terms, turns_with_direction


def law(p, s, io):
    io[U] += io[U] * along_track(p, io[X])


EFFECT = Effect(
    kind=Kind.ACTUATION,
    summary="force constant varies smoothly along the track",
    equation="u_actual = u (1 + P(x));  P(x) = sum_k c_k cos(k pi (x - start)/length)",
    source="Rohrig, Jochheim 2001, thrust constant by position",
    parameters=(*TRACK, *cosine_terms(0.5)),
    law=law,
    # At a place that is passed one way the motor's force is nearly one, and any force does as well.
    knees=(turns_with_direction(Imitated.OF_POSITION),),
    fingerprint="residual varies along the track in proportion to the motor force there",
    excited_by="strong accelerations both ways at many places",
)
