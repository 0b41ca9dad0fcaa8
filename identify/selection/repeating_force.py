"""Forces that repeat along the track in every run, but not at the same places from run to run.

A term of one turn of a screw or a ball is real in each log; where its phase differs between logs no
function of position holds for both, and a model with it would not generalise. That is said.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import PreparedLog, on_blocks, total_force
from identify.estimation.fit import Fit
from twin.model.units import LINEAR, AxisUnits

Array = NDArray[np.float64]

CELLS = 1 << 14  # along the travel
FEWEST_CYCLES = 10  # over the travel
AROUND = 61  # half cycles that are taken for what surrounds a line
PROMINENT = 5.0  # amplitude of a line over that around it
SHARED = 0.02  # relative difference of two periods that are one
SAME = 0.5  # difference of two terms over the larger, below which they are one


@dataclass(frozen=True)
class Repeat:
    """A force of one period in position: amplitude (N) and phase (rad, at x = 0) in each log.

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
    forces = [_left(fit, log) for log in logs]
    lines = [_line(f, log.motion.position) for f, log in zip(forces, logs, strict=True)]
    periods = [p for p in lines if p is not None]
    if len(periods) < len(logs) or np.ptp(periods) > SHARED * periods[0]:
        return None
    period = float(np.median(periods))
    terms = {
        log.motion.name: _term(force, log.motion.position, period)
        for force, log in zip(forces, logs, strict=True)
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
    inertia = fit.axis.mass * np.gradient(m.velocity, m.period)
    return np.asarray(m.command + total_force(on_blocks(fit.axis), m) - inertia)


def _line(force: Array, position: Array) -> float | None:
    """Period (m) of the strongest line in position, if one stands out."""
    low, span = float(position.min()), float(np.ptp(position))
    if span <= 0.0:
        return None
    place = np.rint((position - low) / span * (CELLS - 1)).astype(int)
    spectrum = np.abs(np.fft.rfft(np.bincount(place, force, CELLS), 2 * CELLS))
    around = median_filter(spectrum, AROUND, mode="nearest")
    first = 2 * FEWEST_CYCLES
    prominence = spectrum[first : CELLS // 4] / np.maximum(around[first : CELLS // 4], 1e-300)
    best = int(np.argmax(prominence))
    if prominence[best] < PROMINENT:
        return None
    return 2.0 * span * CELLS / (CELLS - 1) / (first + best)


def _term(force: Array, position: Array, period: float) -> complex:
    """Complex amplitude (N) of exp(2 pi i x/period) in a force."""
    phase = 2.0 * np.pi * position / period
    columns = np.stack([np.cos(phase), np.sin(phase), np.ones_like(phase)], axis=1)
    a, b, _ = np.linalg.lstsq(columns, force, rcond=None)[0]
    return complex(a, -b)
