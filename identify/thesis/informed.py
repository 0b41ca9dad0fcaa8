"""What a record says of the dynamic part of a friction: its uncertainty at the planted values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from identify.dataset.prepared_log import PreparedLog
from identify.estimation.fit import Outcome, finished, fit_axis
from identify.estimation.intervals import half_widths
from twin.effect import Kind
from twin.log import Log
from twin.model.machine import AxisModel
from twin.model.parameters import free_parameters, read


@dataclass(frozen=True)
class Informed:
    """What one record says of the dynamic part.

    friction, noise: RMS change of the friction, and RMS noise of the measured force a sample, N.
    half_widths: of the 90 % intervals at the planted values, over those; found: over them as well.
    """

    friction: float
    noise: float
    half_widths: Mapping[str, float]
    found: Mapping[str, float]


def informed(axis: AxisModel, name: str, log: Log, prepared: Sequence[PreparedLog]) -> Informed:
    """Uncertainty at the planted values, and what a fit of the force residual from them finds."""
    friction = next(f.effect.name for f in axis.effects if f.effect.kind is Kind.FRICTION)
    where = free_parameters(axis)
    true = read(axis, where)
    half = half_widths(finished(axis, axis, prepared, Outcome.CONVERGED))
    found = read(fit_axis(axis, prepared).axis, where)
    force = log.truth[name][friction]
    noise = axis.hardware.current_noise * axis.hardware.force_constant
    names = [c.parameter.name for c in where]
    return Informed(
        friction=float(np.std(force)), noise=noise,
        half_widths=dict(zip(names, (half / true).tolist(), strict=True)),
        found=dict(zip(names, (found / true).tolist(), strict=True)),
    )  # fmt: skip
