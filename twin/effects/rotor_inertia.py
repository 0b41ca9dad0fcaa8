"""Inertia of what turns with the motor before the gear: its rotor, as the joint feels it.

F = -inertia a, with a the acceleration of the joint against its link, and inertia = gear^2 x rotor
inertia. B. Siciliano et al., Robotics: Modelling, Planning and Control (2009), section 7.1.3; what
MuJoCo calls armature. The rotor's small part in what the links take is with the links.
"""

from twin.effect import ACC, MOST, OUT, Effect, Kind, Parameter


def law(p, s, io):
    io[OUT] = -p[0] * io[ACC]


def added_mass(values, mass):
    return values["inertia"]


EFFECT = Effect(
    kind=Kind.STRUCTURE,
    summary="inertia of a geared motor's rotor, at the joint",
    equation="F = -inertia a",
    source="Siciliano et al., Robotics: Modelling, Planning and Control, section 7.1.3",
    parameters=(
        Parameter("inertia", "kg", 0.0, 0.0, MOST, "gear^2 x inertia of the rotor", strength=True),
    ),
    law=law,
    joint_attributes=lambda values: {"armature": values["inertia"]},
    of_joint=lambda attributes: {"inertia": attributes["armature"]},
    added_mass=added_mass,
    of_joints=True,
    fingerprint="residual is proportional to the joint's own acceleration, in every pose",
    excited_by="moves with strong acceleration in several poses",
)
