"""Friction that follows a logged temperature: the viscosity of a lubricant, the preload of a rail.

Fc, Fs -> Fc, Fs (1 - dry (T - T0)), sigma2 -> sigma2 (1 - viscous (T - T0)), the law of small
changes of Andrade's exponential; T0 is held.
"""

from twin.effect import DRY, LEAST, MOST, TEMPERATURE, VISCOUS, Effect, Kind, Parameter


def law(p, s, io):
    warmer = io[TEMPERATURE] - p[0]
    io[DRY] *= max(1.0 - p[1] * warmer, 0.01)  # friction cannot turn negative
    io[VISCOUS] *= max(1.0 - p[2] * warmer, 0.01)


EFFECT = Effect(
    kind=Kind.MODIFIER,
    summary="friction falls with a logged temperature",
    equation="Fc, Fs -> Fc, Fs (1 - dry (T - T0));  sigma2 -> sigma2 (1 - viscous (T - T0))",
    source="E. N. da C. Andrade, The viscosity of liquids, Nature 125, 1930, for small changes",
    parameters=(
        Parameter(
            "T0",
            "K",
            293.15,
            LEAST,
            MOST,
            "temperature of the given friction",
            fixed=True,
            start_rule=lambda e: e.temperature,
        ),
        Parameter("dry", "1/K", 0.0, -MOST, MOST, "fall of the dry part", strength=True),
        Parameter("viscous", "1/K", 0.0, -MOST, MOST, "fall of the viscous part", strength=True),
    ),
    law=law,
    fingerprint="residual flips with direction and follows the temperature",
    excited_by="the same passes at several temperatures",
)
