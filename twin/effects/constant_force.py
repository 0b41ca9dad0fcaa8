"""A constant force on the axis: tilt of the base, preload, or offset of the amplifier.

F = F0; for a tilt by angle alpha, F0 = -m g sin(alpha).
"""

from twin.effect import MOST, OUT, Effect, Kind, Parameter


def law(p, s, io):
    io[OUT] = p[0]


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="constant force: tilt, preload or amplifier offset",
    equation="F = F0",
    source="statics; in EMPS (Janot et al. 2019) the 'offset' of the drive force",
    parameters=(Parameter("F0", "N", 0.0, -MOST, MOST, "the force", strength=True),),
    law=law,
    fingerprint="residual has the same mean everywhere, in both directions",
    excited_by="any motion in both directions",
)
