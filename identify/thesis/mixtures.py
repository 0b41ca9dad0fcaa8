"""Model mixtures: two frictions at once on one axis, beside each alone and beside elements.

On the machine whose friction is made of elements a mixture must be no better than they are; on one
whose friction is a mixture it must be found. Judged on a log on which nothing was decided.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from identify.dataset.dataset import Dataset
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit, error_on, fit_axis
from identify.estimation.intervals import half_widths
from identify.selection.trying import try_effect
from identify.thesis.mixed_friction import EFFECT, PARTS, WEIGHT, mixed
from identify.thesis.residuals import friction_of
from twin.effect import Effect
from twin.model.machine import AxisModel, Fitted
from twin.model.parameters import free_parameters

EQUAL = 0.5  # weight, from which a fit begins


@dataclass(frozen=True)
class Tried:
    """One friction: its free parameters, and its test error over the noise floor."""

    name: str
    parameters: int
    over_floor: float


@dataclass(frozen=True)
class Mixture:
    """Frictions fitted to one machine: each alone, the mixture, and numbers of elements.

    weight: of the part without memory, found; half: half width of its 90 % interval, None where the
    error is far above the noise floor. planted: None where the machine's friction is no mixture.
    """

    machine: str
    alone: Sequence[Tried]
    both: Tried
    elements: Sequence[Tried]
    weight: float
    half: float | None
    planted: float | None


def tried(fit: Fit, test: Dataset) -> Tried:
    """A fit judged on the test log."""
    friction = friction_of(fit.axis)
    free = sum(c.effect == friction.effect.name for c in free_parameters(fit.axis))
    return Tried(friction.effect.name, free, rms(error_on(fit.axis, test.fit)) / fit.floor)


def mixture(axis: AxisModel, dataset: Dataset, test: Dataset, elements: Sequence[Fit]) -> Mixture:
    """The frictions fitted to the training logs of a machine. elements: fits of numbers of them."""
    alone = [_alone(axis, dataset, effect) for effect in PARTS]
    both = _both(axis, dataset, alone)
    planted = friction_of(axis)
    where = [(c.effect, c.parameter.name) for c in free_parameters(both.axis)]
    half = half_widths(both)[where.index((EFFECT.name, WEIGHT))] if both.at_floor else np.nan
    return Mixture(
        machine=planted.effect.name,
        alone=[tried(fit, test) for fit in alone],
        both=tried(both, test),
        elements=[tried(fit, test) for fit in elements],
        weight=friction_of(both.axis).values[WEIGHT],
        half=float(half) if np.isfinite(half) else None,
        planted=planted.values.get(WEIGHT),
    )


def _alone(axis: AxisModel, dataset: Dataset, effect: Effect) -> Fit:
    begun = Fitted.at_start(effect, effect.starts(dataset.excitation))
    return fit_axis(axis.with_effect(begun), dataset.fit)


def _both(axis: AxisModel, dataset: Dataset, alone: Sequence[Fit]) -> Fit:
    """The better of the mixture as any candidate is tried, and begun at both parts fitted alone."""
    forgets, remembers = (friction_of(fit.axis).values for fit in alone)
    begun = axis.with_effect(mixed(remembers, forgets, EQUAL))
    fits = try_effect(alone[0], dataset, EFFECT).fit, fit_axis(begun, dataset.fit)
    return min(fits, key=lambda fit: fit.error)
