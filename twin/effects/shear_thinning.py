"""Viscous friction that rises less and less with speed, as a lubricant thins with shear.

sigma2 -> sigma2 (1 - loss |v|/(vt + |v|)): at the speed vt half of the loss, at high speed all of
it. The viscosity of a lubricant by the flow equation of M. M. Cross, "Rheology of non-Newtonian
fluids", Journal of Colloid Science 20 (1965), 417-437, with the exponent 1, whose shear rate is in
proportion to speed; gears with grease have it. It scales the viscous part of whatever friction the
axis has, so it never gives energy.
"""

from twin.effect import LEAST, MOST, VISCOUS, Effect, Kind, Parameter, V
from twin.knee import Imitated
from twin.law_parts import at_speed


def law(p, s, io):
    speed = abs(io[V])
    io[VISCOUS] *= 1.0 - p[0] * speed / (p[1] + speed)


EFFECT = Effect(
    kind=Kind.MODIFIER,
    summary="viscous friction rises less and less with speed",
    equation="sigma2 -> sigma2 (1 - loss |v|/(vt + |v|))",
    source="Cross 1965, flow equation of fluids that thin with shear, exponent 1",
    parameters=(
        Parameter(
            "loss", "1", 0.0, 0.0, 0.99, "part of the viscous friction lost at speed", strength=True
        ),
        Parameter(
            "vt", "m/s", 0.05, LEAST, MOST, "speed at which half of it is lost", fixed=True,
            start_rule=lambda e: e.speed_max,
        ),
    ),
    law=law,
    knees=(at_speed("vt", Imitated.OF_SPEED),),
    fingerprint="residual follows the lowest and the highest speeds, and opposes those between",
    excited_by="passes at several constant speeds, from the lowest to the highest",
)  # fmt: skip
