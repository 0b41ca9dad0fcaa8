"""Spectral lines: frequencies, in time or along the track, at which a signal repeats.

One finder for all. A first look at the spectrum of each record, against the level around; what
stands out is refined and weighed by the periodogram of N. R. Lomb (1976) and J. D. Scargle (1982)
for unequally spaced samples. The false-alarm probability is that of noise whose power follows an
exponential distribution, at as many frequencies as the range has independent ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import exp, lgamma, log, log1p

import numpy as np
from numpy.typing import NDArray

from identify.dataset.spectrum import EMPTY, FINEST_CYCLES, WIDTH, Grid, Record, level
from twin.parallel import spread

Array = NDArray[np.float64]

MOST_LINES = 24
CHANCE = 0.1  # false-alarm probability of what is worth a try
HIGHEST = 0.4  # of the sample rate
LEVEL_FREEDOM = 30.0  # independent powers that the median of so many correlated ones is worth
HOPELESS = 0.5  # false-alarm probability in white noise from which a frequency is passed over
MOST_REFUSED = 5  # such frequencies, after which the search ends
NEAR = 0.15  # resolutions, within which a line's frequency is refined


@dataclass(frozen=True)
class SpectralLine:
    """A line that records share, each with a phase of its own.

    frequency: cycles per unit of the coordinate. share: of the records' variance that a sine takes,
    0..1. false_alarm: probability that noise shows a line as strong in the range.
    """

    frequency: float
    share: float
    false_alarm: float

    @property
    def period(self) -> float:
        """In the unit of the coordinate."""
        return 1.0 / self.frequency


def find_lines(
    records: Sequence[Record],
    lowest: float,
    highest: float,
    *,
    most: int = MOST_LINES,
    chance: float = CHANCE,
) -> tuple[SpectralLine, ...]:
    """Lines from ``lowest`` to ``highest`` (cycles per unit), the least likely by chance first.

    chance: highest false-alarm probability of those returned, ``most`` in number. Each line is
    subtracted before the next is sought, as unevenly spaced samples spread one over all others.
    """
    records = [r for r in records if len(r.values) > 3 and r.span > 0.0 and np.ptp(r.values) > 0.0]
    if not records or not 0.0 <= lowest < highest:
        return ()
    grid = Grid.of(records, min(highest, FINEST_CYCLES / max(r.span for r in records)))
    inside = np.flatnonzero((grid.frequencies >= lowest) & (grid.frequencies <= highest))
    if len(inside) < 3:
        return ()
    left = [replace(r, values=r.values - r.values.mean()) for r in records]
    empty = EMPTY * grid.powers(left).max(axis=1, keepdims=True)
    found, rest = _peeled(grid, left, inside, empty, most)
    noise = level(grid.powers(rest), empty)
    heights = [float(np.sum(line.powers / noise[:, line.at])) for line in found]
    out = [
        (height, SpectralLine(line.frequency, line.energy / _energy(left), alarm))
        for height, line in zip(heights, found, strict=True)
        if (alarm := _false_alarm(height, len(records), len(inside))) < chance
    ]
    return tuple(line for _, line in sorted(out, key=lambda pair: -pair[0]))


def strongest_line(record: Record, lowest: float, highest: float) -> tuple[float, float]:
    """Frequency from ``lowest`` to ``highest`` of the strongest sine, and its share of variance.

    In noise that is white, as its level is not looked at: one transform, for very many samples.
    """
    if record.span <= 0.0 or not record.values.any():
        return lowest, 0.0
    grid = Grid.of([record], highest)
    inside = (grid.frequencies >= lowest) & (grid.frequencies <= highest)
    powers = grid.powers([record])
    return _refined([record], grid.top(powers, int(np.argmax(powers[0] * inside))), grid.step)


@dataclass(frozen=True, eq=False)
class _Found:
    """A line before it was subtracted: its place in the grid, its powers (records,), its energy."""

    at: int
    frequency: float
    powers: Array
    energy: float


def _peeled(
    grid: Grid, left: list[Record], inside: NDArray[np.int64], empty: Array, most: int
) -> tuple[list[_Found], list[Record]]:
    """Lines at places ``inside`` a grid, one after the other, and the records less all of them."""
    found: list[_Found] = []
    tried, refused = len(inside), 0
    powers = grid.powers(left)
    while len(found) < most and refused < MOST_REFUSED and len(inside) and powers.max() > 0.0:
        # In turn by height over the level, and by power: few cycles are a part of their own level.
        by_height = grid.even or (len(found) + refused) % 2 == 0
        order = np.sum(powers / level(powers, empty) if by_height else powers, axis=0)
        k = int(inside[np.argmax(order[inside])])
        frequency, share = _refined(left, grid.top(powers, k), grid.step)
        hopeless = _is_hopeless(share, tried, left)
        if hopeless or any(abs(frequency - f.frequency) <= WIDTH * grid.step for f in found):
            # What an error of a line's frequency left of it is no other line.
            inside, refused = inside[np.abs(inside - k) > WIDTH], refused + 1
        else:
            found.append(_Found(k, frequency, powers[:, k], share * _energy(left)))
        if not hopeless:
            left = [_without(r, frequency) for r in left]
            powers = grid.powers(left)
    return found, left


def _false_alarm(height: float, records: int, tried: int) -> float:
    """Probability that noise is as high at any of the frequencies tried.

    height: power over the level around, summed over records; as both are estimated, it follows the
    F distribution, whose tail is a finite sum where one of its freedoms is even.
    """
    freedom = LEVEL_FREEDOM * records
    part = max(height / (freedom + height), np.finfo(float).tiny)
    logs = (
        lgamma(freedom + i) - lgamma(freedom) - lgamma(i + 1) + i * log(part)
        for i in range(records)
    )
    alone = sum(exp(freedom * log1p(-part) + term) for term in logs)
    return float(-np.expm1(tried * np.log1p(-min(alone, 1.0 - 1e-12))))


def _is_hopeless(share: float, tried: int, records: Sequence[Record]) -> bool:
    """Whether even white noise, which shows the weakest lines, would show one as strong."""
    samples = sum(len(r.values) for r in records)
    log_alone = 0.5 * samples * np.log1p(-min(max(share, 0.0), 1.0 - 1e-12))
    return bool(np.log(tried) + log_alone > np.log(HOPELESS))


def _energy(records: Sequence[Record]) -> float:
    return float(sum(np.sum(r.values**2) for r in records))


def _without(record: Record, frequency: float) -> Record:
    """The record less its best sine of a frequency and its mean."""
    turn = 2.0 * np.pi * frequency * record.coordinate
    columns = np.stack([np.cos(turn), np.sin(turn), np.ones_like(turn)], axis=1)
    gains = np.linalg.lstsq(columns.T @ columns, columns.T @ record.values, rcond=None)[0]
    return replace(record, values=record.values - columns @ gains)


def _refined(records: Sequence[Record], frequency: float, step: float) -> tuple[float, float]:
    """Frequency of highest power near one, and the share of variance there."""
    width = NEAR * step
    a, b, c = _share(records, frequency + width * np.array([-1.0, 0.0, 1.0]))
    bend = a - 2.0 * b + c
    shift = float(np.clip(0.5 * (a - c) / bend, -2.0, 2.0)) if bend < 0.0 else np.sign(c - a)
    share = b - 0.25 * (a - c) * shift  # of the parabola's top
    return float(frequency + width * shift), float(min(max(share, 0.0), 1.0))


def _share(records: Sequence[Record], frequencies: Array) -> Array:
    """Share of the records' variance that a sine of each frequency (m,) takes, (m,) 0..1."""
    taken = spread(lambda record: _taken(record, frequencies), records)
    return np.sum(taken, axis=0) / _energy(records)


def _taken(record: Record, frequencies: Array) -> Array:
    """Sum of squares that a sine and a constant take of one record, less the constant's, (m,).

    M. Zechmeister, M. Kuerster, Astron. Astrophys. 496 (2009), eq. 5.
    """
    angle = 2.0 * np.pi * frequencies[:, None] * record.coordinate
    sine, cosine = np.sin(angle), np.cos(angle)
    sine -= sine.mean(axis=1, keepdims=True)
    cosine -= cosine.mean(axis=1, keepdims=True)
    values = record.values - record.values.mean()
    pairs = (sine, sine), (cosine, cosine), (sine, cosine)
    ss, cc, cs = (np.einsum("ij,ij->i", a, b) for a, b in pairs)
    ys, yc, both = sine @ values, cosine @ values, ss * cc - cs**2
    gain = ys**2 * cc + yc**2 * ss - 2.0 * ys * yc * cs
    known = both > np.finfo(float).eps * ss * cc
    return np.asarray(np.where(known, gain / np.where(known, both, 1.0), 0.0))


def lines_in_time(
    forces: Sequence[tuple[Array, float]], most: int = MOST_LINES
) -> tuple[float, ...]:
    """Frequencies (Hz) at which forces (n,) N repeat, with their sample periods (s)."""
    if not forces:
        return ()
    records = [
        Record(period * np.arange(len(force), dtype=float), force) for force, period in forces
    ]
    longest = max(r.span for r in records)
    highest = HIGHEST / max(step for _, step in forces)
    found = find_lines(records, WIDTH / max(longest, 1e-300), highest, most=most)
    return tuple(line.frequency for line in found)
