"""Force on one axis from the acceleration and speed of the other.

F = -(mass a_other + damping v_other). Axes that are not quite square, or a centre of mass beside
the drive, couple the equations of motion through off-diagonal terms of the mass and damping
matrices: M q'' + D q' = F, e.g. A. Preumont, Vibration Control of Active Structures, section 2.2.
"""

from twin.effect import A_OTHER, MOST, OUT, V_OTHER, Effect, Kind, Parameter


def law(p, s, io):
    io[OUT] = -(p[0] * io[A_OTHER] + p[1] * io[V_OTHER])


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="force from the acceleration and speed of the other axis",
    equation="F = -(mass a_other + damping v_other)",
    source="off-diagonal terms of M q'' + D q' = F; Preumont, Vibration Control of Active "
    "Structures, section 2.2",
    parameters=(
        Parameter("mass", "kg", 0.0, -MOST, MOST, "coupling mass", strength=True),
        Parameter("damping", "N s/m", 0.0, -MOST, MOST, "coupling damping", strength=True),
    ),
    law=law,
    of_joints=False,
    fingerprint="residual follows the acceleration or speed of the other axis, also at rest",
    excited_by="moves of the other axis alone, and of both axes with different timing",
)
