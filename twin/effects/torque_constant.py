"""Motor of a joint that makes more or less torque of its current than it is said to.

u_actual = u (1 + error). The torque of a motor is in proportion to its current, by a constant that
differs from motor to motor and falls as its magnets warm. B. Siciliano et al., Robotics: Modelling,
Planning and Control (2009), section 5.2. Of an axis whose mass is identified it cannot be told from
the mass; of a joint the bodies are known.
"""

from twin.effect import Effect, Kind, Parameter, U


def law(p, s, io):
    io[U] += p[0] * io[U]


EFFECT = Effect(
    kind=Kind.ACTUATION,
    summary="motor makes more or less torque of its current than it is said to",
    equation="u_actual = u (1 + error)",
    source="Siciliano et al., Robotics: Modelling, Planning and Control, section 5.2",
    parameters=(
        Parameter("error", "1", 0.0, -0.9, 0.9, "part by which the torque is more", strength=True),
    ),
    law=law,
    of_joints=True,
    fingerprint="residual is proportional to the motor torque",
    excited_by="any motion under gravity or with strong accelerations",
)
