"""Mixture of two frictions: a bristle without memory, and one whose spring remembers reversals.

F = weight F_LuGre + (1 - weight) F_modified_Leuven, both with the same Stribeck curve and viscous
friction, each with a stiffness and a damping of its own. L. Jia 2023 names such mixtures as future
work and leaves the form open; this one is this project's choice. Were the levels not shared, the
weight would mean nothing, as a LuGre force scales with its levels and stiffness.

The catalogue does not hold it: it contains two frictions that are there, so a diagnosis could never
tell it from either.
"""

from twin.curve import FRICTION_CURVES
from twin.effect import OUT, Effect, Kind, Parameter
from twin.effects.lugre import law as lugre
from twin.effects.modified_leuven import EFFECT as REMEMBERS
from twin.effects.modified_leuven import SHARES
from twin.effects.modified_leuven import law as modified_leuven


def law(p, s, io):
    count = int(p[0])
    own = SHARES + 2 * count
    modified_leuven(p, s, io)
    remembers = io[OUT]
    bristle = [s[count]]
    lugre((p[1], p[2], p[3], p[4], p[own + 1], p[own + 2], p[10]), bristle, io)
    s[count] = bristle[0]
    io[OUT] = p[own] * io[OUT] + (1.0 - p[own]) * remembers


EFFECT = Effect(
    kind=Kind.FRICTION,
    summary="mixture of a bristle friction and one with memory, by weight",
    equation="F = weight F_LuGre + (1 - weight) F_modified_Leuven",
    source="L. Jia 2023, future work; the form is this project's choice",
    parameters=(
        *REMEMBERS.parameters,
        Parameter("weight", "1", 0.5, 0.0, 1.0, "part of the friction without memory"),
        Parameter(
            "sigma0_bristle", "N/m", 300.0, 1.0, 1e9, "stiffness without memory",
            start_rule=lambda e: 1e3 * e.dry_level,
        ),
        Parameter("sigma1_bristle", "N s/m", 0.5, 1e-6, 1e8, "damping without memory"),
    ),
    states=(*REMEMBERS.states, "z"),
    law=law,
    curves=FRICTION_CURVES,
    fingerprint=REMEMBERS.fingerprint,
    excited_by=REMEMBERS.excited_by,
)  # fmt: skip
