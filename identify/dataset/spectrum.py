"""Power of a signal over a coordinate, by frequency, and its level about each.

Records may be sampled at any instants or places: the samples are spread over the cells of a grid,
tapered by Hann's window and transformed by FFT, in a time of n log n.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

Array = NDArray[np.float64]

FINEST_CYCLES = 1 << 15  # over the span of a record at most
CELLS_A_PERIOD = 4  # of the highest frequency
BAND = 20  # resolutions over which the level of the spectrum is taken
BANDS_AROUND = 3
EMPTY = 1e-24  # of the highest power, below which there is but rounding
PARTS = 64  # of the span, over which samples are counted
MOST_WEIGHT = 4.0  # of a sample among few, over that of a typical one
EQUAL = 1e-6  # of a spacing, by which equal ones may differ
WIDTH = 2  # resolutions from a line's top to its foot, with Hann's window


@dataclass(frozen=True, eq=False)
class Record:
    """A signal over a coordinate, in any order and spacing: coordinate (n,), values (n,)."""

    coordinate: Array
    values: Array

    @property
    def span(self) -> float:
        """Range of the coordinate, in its unit."""
        return float(np.ptp(self.coordinate)) if len(self.coordinate) else 0.0


@dataclass(frozen=True, eq=False)
class Grid:
    """Frequencies (m,) a resolution apart, at which the power of records is taken.

    Less those near zero, which the removal of the mean empties. cell: of the coordinate, ``cells``
    of them. places, tapers: of each record's samples, (n,) cells and (n,) 1. even: whether all
    samples are equally spaced.
    """

    frequencies: Array
    cells: int
    places: Sequence[Array]
    tapers: Sequence[Array]
    even: bool

    @classmethod
    def of(cls, records: Sequence[Record], highest: float) -> Grid:
        span = max(r.span for r in records)
        spacing = _common_spacing(records)
        cell = spacing or 1.0 / (CELLS_A_PERIOD * highest)
        cells = _fast_length(int(np.ceil(span / cell)) + 1)
        along = [(r.coordinate - r.coordinate.min()) / r.span for r in records]
        return cls(
            np.asarray(np.fft.rfftfreq(cells, cell)[WIDTH:], dtype=float),
            cells,
            [a * (r.span / cell) for a, r in zip(along, records, strict=True)],
            [np.sin(np.pi * a) ** 2 * _sparseness(a) for a in along],
            spacing is not None,
        )

    @property
    def step(self) -> float:
        """Resolution, cycles per unit."""
        return float(self.frequencies[1] - self.frequencies[0])

    def top(self, powers: Array, k: int) -> float:
        """Frequency of the top at place k: by a parabola through logarithms of three powers."""
        if not 0 < k < len(self.frequencies) - 1:
            return float(self.frequencies[k])
        a, b, c = np.log(np.maximum(powers[:, k - 1 : k + 2].sum(axis=0), np.finfo(float).tiny))
        bend = a - 2.0 * b + c
        shift = float(np.clip(0.5 * (a - c) / bend, -0.5, 0.5)) if bend < 0.0 else 0.0
        return float(self.frequencies[k] + shift * self.step)

    def powers(self, records: Sequence[Record]) -> Array:
        """Power of each record at the frequencies, (records, m)."""
        tapered = [r.values * taper for r, taper in zip(records, self.tapers, strict=True)]
        if not self.even:  # else each sample has a cell of its own
            pairs = zip(self.places, tapered, strict=True)
            tapered = [_spread(place, values, self.cells) for place, values in pairs]
        return np.array([np.abs(np.fft.rfft(v, self.cells)[WIDTH:]) ** 2 for v in tapered])


def pieces_of(signal: NDArray[Any], samples: int) -> NDArray[Any]:
    """Pieces (..., k, samples) of a signal (..., n), each half over the next; they are views."""
    step = max(samples - samples // 2, 1)
    return sliding_window_view(signal, samples, axis=-1)[..., ::step, :]


def densities(pieces: Array, period: float) -> Array:
    """One-sided power density of pieces (..., n), unit^2/Hz, (..., n // 2 + 1), by Hann's window.

    Their mean is Welch's estimate (P. D. Welch, 1967). period: s between samples.
    """
    n = pieces.shape[-1]
    taper = np.sin(np.pi * np.arange(n) / n) ** 2
    power = np.abs(np.fft.rfft(pieces * taper)) ** 2 * (2.0 * period / (taper @ taper))
    power[..., 0] /= 2.0
    if n % 2 == 0:
        power[..., -1] /= 2.0
    return np.asarray(power)


def level(powers: Array, empty: Array) -> Array:
    """Mean power (records, m) of noise about each frequency, from medians; at least ``empty``.

    Medians of bands, and of bands with those around: the higher, as a steep spectrum is at its foot
    far above its wider surroundings. At the lowest frequencies, where it may be steep within a
    band, each has a band of its own.
    """
    m = powers.shape[1]
    padded = np.pad(powers, [(0, 0), (0, -m % BAND)], mode="reflect" if m > BAND else "edge")
    near = np.median(padded.reshape(len(powers), -1, BAND), axis=2)
    far = _medians(near, BANDS_AROUND)
    out = np.repeat(np.maximum(near, far), BAND, axis=1)[:, :m]
    low = _medians(powers[:, : 5 * BAND], BAND + 1)[:, : 4 * BAND]
    out[:, : low.shape[1]] = np.maximum(out[:, : low.shape[1]], low)
    out /= np.log(2.0)
    return np.maximum(out, np.maximum(empty, np.finfo(float).tiny))


def _medians(rows: Array, width: int) -> Array:
    """Medians (..., m) of an odd number of values about each of rows (..., m), mirrored at ends."""
    ends = [(0, 0)] * (rows.ndim - 1) + [(width // 2, width // 2)]
    padded = np.pad(rows, ends, mode="symmetric")
    return np.asarray(np.median(sliding_window_view(padded, width, axis=-1), axis=-1))


def _fast_length(least: int) -> int:
    """The smallest length from ``least`` on whose only prime factors are 2, 3 and 5."""
    odd = (3**a * 5**b for a in range(16) for b in range(12))
    return min(n << (-(-least // n) - 1).bit_length() for n in odd)


def _sparseness(along: Array) -> Array:
    """Weights (n,) that make up for samples more dense in one part of the span than in another.

    along: 0..1. An axis dwells where it turns; unweighed, that would widen every line.
    """
    part = np.minimum((along * PARTS).astype(int), PARTS - 1)
    count = np.bincount(part, minlength=PARTS)
    typical = np.median(count[count > 0])
    return np.asarray(np.minimum(typical / count[part], MOST_WEIGHT))


def _common_spacing(records: Sequence[Record]) -> float | None:
    """Spacing of records that are all sampled equally, and alike; else None."""
    first = float(records[0].coordinate[1] - records[0].coordinate[0])
    for r in records:
        if np.abs(np.diff(r.coordinate) - first).max() > EQUAL * abs(first):
            return None
    return first if first > 0.0 else None


def _spread(place: Array, values: Array, cells: int) -> Array:
    """Values (n,) at places (n,) between cells, spread over the four cells about each, (cells,).

    With the weights of cubic interpolation (W. H. Press, G. B. Rybicki, "Fast algorithm for
    spectral analysis of unevenly sampled data", Astrophys. J. 338, 1989).
    """
    first = np.floor(place).astype(int)
    t = place - first
    weights = np.stack(
        [
            -t * (t - 1.0) * (t - 2.0) / 6.0,
            (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
            -(t + 1.0) * t * (t - 2.0) / 2.0,
            (t + 1.0) * t * (t - 1.0) / 6.0,
        ]
    )
    about = (first + np.arange(-1, 3)[:, None]) % cells
    return np.asarray(np.bincount(about.ravel(), (weights * values).ravel(), cells))
