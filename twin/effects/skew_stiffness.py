"""Two drives of one beam, which pull on each other as it skews.

F = stiffness (x_other - x) + damping (v_other - v): two carriages that carry the ends of a beam are
masses joined by the stiffness of its guides against yaw. T.-S. Giam, K. K. Tan, S. Huang,
"Precision coordinated control of multi-axis gantry stages", ISA Transactions 46 (2007).
"""

from twin.effect import MOST, OUT, V_OTHER, X_OTHER, Effect, Kind, Parameter, V, X


def law(p, s, io):
    io[OUT] = p[0] * (io[X_OTHER] - io[X]) + p[1] * (io[V_OTHER] - io[V])


EFFECT = Effect(
    kind=Kind.FORCE,
    summary="two drives of one beam pull on each other",
    equation="F = stiffness (x_other - x) + damping (v_other - v)",
    source="Giam, Tan, Huang, coordinated control of gantry stages, ISA Transactions 46 (2007)",
    parameters=(
        Parameter("stiffness", "N/m", 0.0, 0.0, MOST, "against the skew", strength=True),
        Parameter("damping", "N s/m", 0.0, 0.0, MOST, "of the skew", strength=True),
    ),
    law=law,
    of_joints=False,
    fingerprint="residual follows the distance between both carriages, with opposite signs on them",
    excited_by="moves of both drives whose ends do not stay level",
)
