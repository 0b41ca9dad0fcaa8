"""Friction in a transmission that two joints share: of a coupled wrist, of a differential.

F = -(Fc sgn w + sigma2 w),  w = v + turns v_joint: the motor of the one turns with both joints, and
its friction acts on both. M. Gautier, A. Janot, P.-O. Vandanjon, "A new closed-loop output error
method for parameter identification of robot dynamics", IEEE TCST 21 (2013), for a coupled wrist.
"""

from math import copysign

from twin.effect import MOST, MOST_JOINTS, OUT, SPEEDS, Effect, Kind, Parameter, V
from twin.knee import Imitated, Knee


def law(p, s, io):
    w = io[V] + p[2] * io[SPEEDS + int(p[3])]
    sliding = copysign(p[0], w) if w != 0.0 else 0.0
    io[OUT] = -(sliding + p[1] * w)


def to_next(values, covered):
    """How far its number is from that of another joint."""
    return min((abs(values["joint"] - j) for j in covered.other_joints), default=MOST)


OTHER_JOINT = Knee("joint", "1", to_next, lambda v, e: (0.0, 0.0), above=Imitated.OF_THIS_JOINT)

EFFECT = Effect(
    kind=Kind.FORCE,
    summary="friction of a transmission that turns with two joints",
    equation="F = -(Fc sgn w + sigma2 w),  w = v + turns v_joint",
    source="Gautier, Janot, Vandanjon 2013 (coupled wrist)",
    parameters=(
        Parameter("Fc", "N", 0.0, 0.0, MOST, "dry friction", strength=True, dry=True),
        Parameter("sigma2", "N s/m", 0.0, 0.0, MOST, "viscous friction", strength=True),
        Parameter(
            "turns", "1", 1.0, -10.0, 10.0, "turns with the other joint, for one with its own",
            fixed=True, scan=lambda e: (1.0, -1.0),
        ),
        Parameter(
            "joint", "1", 0.0, 0.0, MOST_JOINTS - 1.0, "number of the other joint, from 0",
            fixed=True, scan=lambda e: e.other_joints or (0.0,),
        ),
    ),
    law=law,
    knees=(OTHER_JOINT,),
    of_joints=True,
    fingerprint="residual steps where the sum of two joints' speeds changes its sign",
    excited_by="moves of the two joints at different times, with reversals of each",
)  # fmt: skip
