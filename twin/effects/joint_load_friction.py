"""Dry friction of a geared joint that follows the load it carries.

Fc, Fs -> Fc, Fs (1 + growth |load|), with load what the bodies take of the joint by their weight
and their acceleration (M(q) a + c(q, v)), from the mechanism's model and never from the measured
force, which would explain itself. Teeth and bearings are pressed by what they pass on: A. C.
Bittencourt, S. Gunnarsson, "Static friction in a robot joint: modeling and identification of load
and temperature effects", J. Dyn. Sys. Meas. Control 134 (2012).
"""

from twin.effect import DRY, LOAD, MOST, Effect, Kind, Parameter


def law(p, s, io):
    io[DRY] *= 1.0 + p[0] * abs(io[LOAD])


EFFECT = Effect(
    kind=Kind.MODIFIER,
    summary="dry friction of a joint grows with the load that the bodies put on it",
    equation="Fc, Fs -> Fc, Fs (1 + growth |load|)",
    source="Bittencourt, Gunnarsson 2012 (load in a robot joint)",
    parameters=(Parameter("growth", "1/N", 0.0, 0.0, MOST, "growth by the load", strength=True),),
    law=law,
    of_joints=True,
    fingerprint="residual opposes motion, the more the heavier the joint's load is in that pose",
    excited_by="slow passes in both directions where the joint carries much and where it does not",
)
