"""Model mixtures: two frictions at once on one axis, beside each alone and beside elements.

F = weight F_LuGre + (1 - weight) F_modified_Leuven: a bristle without memory, and one whose spring
remembers reversals, both with the same Stribeck curve and viscous friction, each with a stiffness
and a damping of its own. L. Jia 2023 names such mixtures as future work and leaves the form open;
this one is this project's choice. Were the levels not shared, the weight would mean nothing, as a
LuGre force scales with its levels and stiffness. The catalogue does not hold it: it contains two
frictions that are there, so a diagnosis could never tell it from either.

On the machine whose friction is made of elements a mixture must be no better than they are; on one
whose friction is a mixture it must be found. Judged on a log on which nothing was decided. Part of
the chapter "future".
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from identify.dataset.dataset import Dataset
from identify.estimation.fit import Fit, fit_axis
from identify.estimation.intervals import half_widths
from identify.output.numbers import spaced
from identify.selection.trying import try_effect
from studies.thesis import shared
from studies.thesis.shared import Numbers, friction_of
from twin.curve import FRICTION_CURVES
from twin.effect import OUT, Effect, Kind, Parameter
from twin.effects.lugre import EFFECT as FORGETS
from twin.effects.lugre import law as lugre
from twin.effects.modified_leuven import EFFECT as REMEMBERS
from twin.effects.modified_leuven import SHARES
from twin.effects.modified_leuven import law as modified_leuven
from twin.model.machine import AxisModel, Fitted
from twin.model.parameters import free_parameters

PARTS = FORGETS, REMEMBERS
WEIGHT = "weight"
EQUAL = 0.5  # weight, from which a fit begins
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


EFFECT = Effect(
    kind=Kind.FRICTION,
    summary="mixture of a bristle friction and one with memory, by weight",
    equation="F = weight F_LuGre + (1 - weight) F_modified_Leuven",
    source="L. Jia 2023, future work; the form is this project's choice",
    parameters=(
        *REMEMBERS.parameters,
        Parameter(WEIGHT, "1", EQUAL, 0.0, 1.0, "part of the friction without memory",
                  scan=lambda _: (0.25, 0.5, 0.75)),
        *(replace(FORGETS.parameter(theirs), name=ours) for theirs, ours in OWN.items()),
    ),
    states=(*REMEMBERS.states, "z"),
    law=law,
    curves=FRICTION_CURVES,
    fingerprint=REMEMBERS.fingerprint,
    excited_by=REMEMBERS.excited_by,
)  # fmt: skip


def mixed(remembers: Mapping[str, float], forgets: Mapping[str, float], weight: float) -> Fitted:
    """The mixture with the values of two frictions, as far as it knows their names.

    What both have by one name is taken of the first.
    """
    own = {ours: forgets[theirs] for theirs, ours in OWN.items()}
    known = {p.name for p in REMEMBERS.parameters if not p.fixed}
    shared = {n: v for n, v in {**forgets, **remembers}.items() if n in known}
    return Fitted.at_start(EFFECT, {**shared, **own, WEIGHT: weight})


def mixture(
    axis: AxisModel, dataset: Dataset, test: Dataset, elements: Mapping[int, Fit]
) -> Numbers:
    """The frictions fitted to the training logs of a machine: each alone, the mixture, elements.

    The mixture is the better of one as any candidate is tried, and one begun at both parts. weight:
    of the part without memory, with the half width of its 90 % interval, None where the error is
    far above the noise floor; true: None where the machine's friction is no mixture. elements: fits
    of numbers of them.
    """
    alone = [fit_axis(shared.begun(axis, dataset, effect), dataset.training) for effect in PARTS]
    forgets, remembers = (friction_of(fit.axis).values for fit in alone)
    tried = try_effect(alone[0], dataset, EFFECT).fit
    begun = fit_axis(axis.with_effect(mixed(remembers, forgets, EQUAL)), dataset.training)
    both, planted = min(tried, begun, key=lambda fit: fit.error), friction_of(axis)
    where = [(c.effect, c.parameter.name) for c in free_parameters(both.axis)]
    half = half_widths(both)[where.index((EFFECT.name, WEIGHT))] if both.at_floor else np.nan
    return {
        "machine": planted.effect.name,
        "weight": {
            "true": planted.values.get(WEIGHT), "found": friction_of(both.axis).values[WEIGHT],
            "half_width_90": float(half) if np.isfinite(half) else None, "unit": "1",
            "printed": None,
        },
        "error_over_noise_floor": {
            **{friction_of(fit.axis).effect.name: shared.over_floor(fit, test)
               for fit in (*alone, both)},
            "elements": {count: shared.over_floor(fit, test) for count, fit in elements.items()},
        },
    }  # fmt: skip


def mixture_in_words(found: Numbers) -> str:
    """What each leaves, and the weight where one is planted."""
    left, weight = found["error_over_noise_floor"], found["weight"]
    names = [effect.name for effect in PARTS]
    alone = [f"{spaced(name)} alone {left[name]:.3g}" for name in names]
    said = (
        f"on a machine with {spaced(found['machine'])} a mixture of "
        f"{' and '.join(map(spaced, names))} leaves {left[EFFECT.name]:.3g} times the noise floor "
        f"of the test log, {', '.join(alone)}, elements at best "
        f"{min(left['elements'].values()):.3g}"
    )
    if weight["true"] is None or weight["half_width_90"] is None:
        return said
    return (
        f"{said}; weight {weight['found']:.3f} +- {weight['half_width_90']:.1g} (90 %), planted "
        f"{weight['true']:g}"
    )
