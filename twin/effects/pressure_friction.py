"""Friction of a seal that a pressure presses on.

Fc, Fs -> Fc, Fs (1 + growth |p| + growth_2 |p_2|), with the pressures as logged.
"""

from twin.effect import DRY, MOST, PRESSURE, PRESSURE_2, Effect, Kind, Parameter


def law(p, s, io):
    grown = 1.0 + p[0] * abs(io[PRESSURE]) + p[1] * abs(io[PRESSURE_2])
    io[DRY] *= max(grown, 0.01)  # friction cannot turn negative


EFFECT = Effect(
    kind=Kind.MODIFIER,
    summary="dry friction grows with a logged pressure",
    equation="Fc, Fs -> Fc, Fs (1 + growth |p| + growth_2 |p_2|)",
    source="H. E. Merritt, Hydraulic Control Systems, 1967, friction of seals under pressure",
    parameters=(
        Parameter("growth", "1/Pa", 0.0, -MOST, MOST, "growth with the pressure", strength=True),
        Parameter(
            "growth_2", "1/Pa", 0.0, -MOST, MOST, "growth with the second pressure", strength=True
        ),
    ),
    law=law,
    fingerprint="residual flips with direction and grows with the pressure",
    excited_by="passes in both directions at several pressures",
)
