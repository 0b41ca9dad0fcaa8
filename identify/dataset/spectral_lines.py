"""Frequencies at which the force of a log repeats in time, whatever the axis does."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter
from scipy.signal.windows import hann

from identify.dataset.motion import Motion

Array = NDArray[np.float64]

MOST_LINES = 60
PROMINENT = 4.0  # amplitude of a line over that of the spectrum around it
CELLS = 1 << 16  # along the travel
FEWEST_CYCLES = 20  # over the travel, of an error of the reading
MOST_RIPPLES = 24
AROUND = 61  # bins of the spectrum that are taken for what surrounds a line
HIGHEST = 0.4  # of the block rate


def lines(motions: Sequence[Motion]) -> tuple[float, ...]:
    """Frequencies (Hz) of narrow peaks in the spectrum of the force, the most prominent first.

    The force is the command less what acceleration, direction, speed and position explain.
    """
    return lines_of([(_rest(m), m.period) for m in motions])


def lines_of(forces: Sequence[tuple[Array, float]]) -> tuple[float, ...]:
    """The same of forces (n,) N with their sample periods (s)."""
    found = [peak for force, period in forces for peak in _peaks(force, period)]
    found.sort(reverse=True)
    kept: list[float] = []
    for _, frequency, width in found:
        if all(abs(frequency - other) > width for other in kept):
            kept.append(frequency)
    return tuple(kept[:MOST_LINES])


def ripples(motions: Sequence[Motion]) -> tuple[float, ...]:
    """Periods (m) at which an error of the reading would repeat in position, strongest first.

    An error A sin(2 pi x/p) looks like a force m A (2 pi v/p)^2 sin(2 pi x/p), so the force weighed
    by v^2 has a line in position.
    """
    low = min(float(m.position.min()) for m in motions)
    span = max(float(m.position.max()) for m in motions) - low
    if span <= 0.0:
        return ()
    summed = np.zeros(CELLS)
    for m in motions:
        place = np.rint((m.position - low) / span * (CELLS - 1)).astype(int)
        summed += np.bincount(place, _rest(m) * m.velocity**2, CELLS)
    spectrum = np.abs(np.fft.rfft(summed, 2 * CELLS))  # in half cycles over the span
    around = median_filter(spectrum, AROUND, mode="nearest")
    prominence = spectrum / np.maximum(around, 1e-12 * spectrum.max(initial=1e-300))
    first = FEWEST_CYCLES * 2
    best = first + np.argsort(prominence[first : CELLS // 2])[::-1][:MOST_RIPPLES]
    told = best[prominence[best] > PROMINENT]
    return tuple(float(2.0 * span * CELLS / (CELLS - 1) / k) for k in told)


def _rest(motion: Motion) -> Array:
    """Command that a rough model leaves, (n,) N."""
    x, v = motion.position, motion.velocity
    rows = np.stack([motion.acceleration, np.sign(v), v, np.ones_like(x), x, x**2, x**3], axis=1)
    rows /= np.maximum(np.abs(rows).max(axis=0), 1e-300)
    solution = np.linalg.lstsq(rows, motion.command, rcond=None)[0]
    return np.asarray(motion.command - rows @ solution)


def _peaks(force: Array, period: float) -> list[tuple[float, float, float]]:
    """(prominence, frequency Hz, resolution Hz) of the narrow peaks of a force (n,) N."""
    n = len(force)
    spectrum = np.abs(np.fft.rfft(force * hann(n, sym=False)))
    spectrum = spectrum[: max(int(HIGHEST * n), 3)]
    around = median_filter(spectrum, AROUND, mode="nearest")
    prominence = spectrum / np.maximum(around, 1e-12 * spectrum.max(initial=1e-300))
    middle = np.arange(2, len(spectrum) - 1)
    high = middle[
        (prominence[middle] > PROMINENT)
        & (spectrum[middle] >= spectrum[middle - 1])
        & (spectrum[middle] > spectrum[middle + 1])
    ]
    out = []
    for k in high:
        # Vertex of the parabola through three logarithms: near exact for a Hann window.
        a, b, c = np.log(spectrum[k - 1 : k + 2])
        shift = 0.5 * (a - c) / (a - 2.0 * b + c)
        out.append((float(prominence[k]), float((k + shift) / n / period), 1.0 / (n * period)))
    return out
