"""Viscous friction by itself: a damper, a lubricant film, eddy currents, back EMF.

F = -c v. Newton's law of viscosity for a film between plates, e.g. F. M. White, Fluid Mechanics,
7th ed., section 1.7. Where the axis has a friction with a viscous part, that is the same force.
"""

from twin.effect import MOST, OUT, Effect, Kind, Parameter, V


def law(p, s, io):
    io[OUT] = -p[0] * io[V]


def has_viscous_part(effect: Effect) -> bool:
    """Whether it is a friction that holds this force."""
    return effect.kind is Kind.FRICTION and effect.reads("VISCOUS")


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="drag proportional to speed",
    equation="F = -c v",
    source="White, Fluid Mechanics, section 1.7",
    parameters=(Parameter("c", "N s/m", 0.0, 0.0, MOST, "drag coefficient", strength=True),),
    law=law,
    joint_attributes=lambda values: {"damping": values["c"]},
    fingerprint="residual is proportional to speed, in both directions alike",
    excited_by="passes at several speeds, up to the highest",
    suits=lambda present, turns: not any(map(has_viscous_part, present)),
)
