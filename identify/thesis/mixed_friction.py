"""Mixture of two frictions: a bristle without memory, and one whose spring remembers reversals.

F = weight F_LuGre + (1 - weight) F_modified_Leuven, both with the same Stribeck curve and viscous
friction, each with a stiffness and a damping of its own. L. Jia 2023 names such mixtures as future
work and leaves the form open; this one is this project's choice. Were the levels not shared, the
weight would mean nothing, as a LuGre force scales with its levels and stiffness.

The catalogue does not hold it: it contains two frictions that are there, so a diagnosis could never
tell it from either.
"""

from collections.abc import Mapping
from dataclasses import replace

from twin.curve import FRICTION_CURVES
from twin.effect import OUT, Effect, Kind, Parameter
from twin.effects.lugre import EFFECT as FORGETS
from twin.effects.lugre import law as lugre
from twin.effects.modified_leuven import EFFECT as REMEMBERS
from twin.effects.modified_leuven import SHARES
from twin.effects.modified_leuven import law as modified_leuven
from twin.model.machine import Fitted

PARTS = FORGETS, REMEMBERS
WEIGHT = "weight"
OWN = {"sigma0": "sigma0_bristle", "sigma1": "sigma1_bristle"}  # of the bristle without memory


def law(p, s, io):
    count = int(p[0])
    own = SHARES + 2 * count
    modified_leuven(p, s, io)
    remembers = io[OUT]
    bristle = [s[count]]
    lugre((p[1], p[2], p[3], p[4], p[own + 1], p[own + 2], p[10]), bristle, io)
    s[count] = bristle[0]
    io[OUT] = p[own] * io[OUT] + (1.0 - p[own]) * remembers


def mixed(remembers: Mapping[str, float], forgets: Mapping[str, float], weight: float) -> Fitted:
    """The mixture with the values of two frictions, as far as it knows their names.

    What both have by one name is taken of the first.
    """
    own = {ours: forgets[theirs] for theirs, ours in OWN.items()}
    known = {p.name for p in REMEMBERS.parameters if not p.fixed}
    shared = {n: v for n, v in {**forgets, **remembers}.items() if n in known}
    return Fitted.at_start(EFFECT, {**shared, **own, WEIGHT: weight})


def _weights(_: object) -> tuple[float, ...]:
    return 0.25, 0.5, 0.75


EFFECT = Effect(
    kind=Kind.FRICTION,
    summary="mixture of a bristle friction and one with memory, by weight",
    equation="F = weight F_LuGre + (1 - weight) F_modified_Leuven",
    source="L. Jia 2023, future work; the form is this project's choice",
    parameters=(
        *REMEMBERS.parameters,
        Parameter(
            WEIGHT, "1", 0.5, 0.0, 1.0, "part of the friction without memory", scan=_weights
        ),
        *(replace(FORGETS.parameter(theirs), name=ours) for theirs, ours in OWN.items()),
    ),
    states=(*REMEMBERS.states, "z"),
    law=law,
    curves=FRICTION_CURVES,
    fingerprint=REMEMBERS.fingerprint,
    excited_by=REMEMBERS.excited_by,
)  # fmt: skip
