"""Friction that differs by direction: the Coulomb and viscous parts are scaled by 1 +- asymmetry.

F = Fc (1 + coulomb sgn v) sgn v + sigma2 (1 + viscous sgn v) v. It acts on the level of whatever
friction the axis has, so it never gives energy. Direction-dependent friction in the sense of
A. Janot et al., "Data Set and Reference Models of EMPS" (2019), where each direction has its own
Fc and Fv.
"""

from twin.effect import DRY, DT, HOLD, MASS, VISCOUS, Effect, Kind, Parameter, V


def law(p, s, io):
    # At rest the speed is rounding error, so the direction is that of the force on the axis.
    moves = abs(io[MASS] * io[V] / io[DT]) > 1e-9 * abs(io[HOLD])
    direction = io[V] if moves else io[HOLD]
    if direction > 0.0:
        io[DRY] *= 1.0 + p[0]
        io[VISCOUS] *= 1.0 + p[1]
    elif direction < 0.0:
        io[DRY] *= 1.0 - p[0]
        io[VISCOUS] *= 1.0 - p[1]


EFFECT = Effect(
    kind=Kind.MODIFIER,
    summary="Coulomb and viscous friction differ by direction",
    equation="Fc -> Fc (1 + coulomb sgn v);  sigma2 -> sigma2 (1 + viscous sgn v)",
    source="Janot, Gautier, Brunot 2019 (EMPS), direction-dependent friction model",
    parameters=(
        Parameter(
            "coulomb", "1", 0.0, -0.95, 0.95, "asymmetry of the dry part", strength=True
        ),
        Parameter(
            "viscous", "1", 0.0, -0.95, 0.95, "asymmetry of the viscous part", strength=True
        ),
    ),
    law=law,
    fingerprint="residual has one sign in both directions, and grows with speed",
    excited_by="constant-speed passes in both directions at several speeds",
)  # fmt: skip
