"""Forces that repeat along the track in every run, but not at the same places from run to run.

A term of one turn of a screw or a ball is real in each log; where its phase differs between logs no
function of position holds for both, and a model with it would not generalise. That is said.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import PreparedLog, on_blocks, total_force
from identify.dataset.spectral_lines import SpectralLine, find_lines
from identify.dataset.spectrum import Record
from identify.estimation.decision import RULE
from identify.estimation.fit import Fit
from twin.model.units import LINEAR, AxisUnits

Array = NDArray[np.float64]

FEWEST_CYCLES = 10  # over the travel
MOST_CYCLES = 4096  # over the travel
TRIED = 6  # lines that are no chance, of which the strongest counts
SHARED = 0.02  # relative difference of two periods that are one
SAME = 0.5  # difference of two terms over the larger, below which they are one


@dataclass(frozen=True)
class Repeat:
    """A force of one period in position: amplitude (N) and phase (rad, at one place) in each log.

    units: of the axis, by which N and m are to be read.
    """

    period: float
    amplitude: Mapping[str, float]
    phase: Mapping[str, float]
    units: AxisUnits = LINEAR

    @property
    def general(self) -> bool:
        """Whether one sine of position holds for all logs."""
        terms = [a * np.exp(1j * self.phase[n]) for n, a in self.amplitude.items()]
        size = max(self.amplitude.values())
        return all(abs(t - terms[0]) < SAME * size for t in terms)


def not_general(fit: Fit, dataset: Dataset) -> Repeat | None:
    """The strongest force that repeats in position in every log with another phase, if any."""
    logs = (*dataset.fit, *dataset.holdout)
    if len(logs) < 2:
        return None
    records = [Record(log.motion.position, _left(fit, log)) for log in logs]
    lines = [_strongest([record]) for record in records]
    periods = [line.period for line in lines if line is not None]
    if len(periods) < len(logs) or np.ptp(periods) > SHARED * periods[0]:
        return None
    common = _strongest(records)
    period = float(np.median(periods))
    if common is not None and abs(common.period - period) <= SHARED * period:
        period = common.period
    # Far from the data a phase would hold the error of the period, times the periods between.
    middle = float(np.mean(np.concatenate([r.coordinate for r in records])))
    terms = {
        log.motion.name: _term(record.values, record.coordinate - middle, period)
        for record, log in zip(records, logs, strict=True)
    }
    found = Repeat(
        period,
        {n: float(abs(z)) for n, z in terms.items()},
        {n: float(np.angle(z)) for n, z in terms.items()},
        dataset.units,
    )
    return None if found.general else found


def _left(fit: Fit, log: PreparedLog) -> Array:
    """Force (n,) N that the model leaves in each block."""
    m = log.motion
    inertia = fit.axis.mass * m.acceleration
    return np.asarray(m.command + total_force(on_blocks(fit.axis), m) - inertia)


def _strongest(records: Sequence[Record]) -> SpectralLine | None:
    """The strongest line in position that all the records share, if one stands out."""
    span = max(r.span for r in records)
    if span <= 0.0:
        return None
    lowest, highest = FEWEST_CYCLES / span, MOST_CYCLES / span
    found = find_lines(records, lowest, highest, most=TRIED, chance=RULE.line_chance)
    return max(found, key=lambda line: line.share, default=None)


def _term(force: Array, position: Array, period: float) -> complex:
    """Complex amplitude (N) of exp(2 pi i x/period) in a force."""
    phase = 2.0 * np.pi * position / period
    columns = np.stack([np.cos(phase), np.sin(phase), np.ones_like(phase)], axis=1)
    a, b, _ = np.linalg.lstsq(columns, force, rcond=None)[0]
    return complex(a, -b)
