"""Spectral lines: frequencies, in time or along the track, at which a signal repeats.

One finder for all. A first look by fast Fourier transform of each record, tapered by Hann's window,
against the level of the spectrum around; what stands out is refined and weighed by the periodogram
of N. R. Lomb (1976) and J. D. Scargle (1982) for unequally spaced samples. The false-alarm
probability is that of exponentially distributed noise power at as many frequencies as the range has
independent ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.fft import next_fast_len
from scipy.ndimage import maximum_filter1d, median_filter
from scipy.signal import lombscargle
from scipy.special import betainc

from identify.dataset.motion import Motion

Array = NDArray[np.float64]

MOST_LINES = 60
CHANCE = 0.1  # false-alarm probability of what is worth a try
HIGHEST = 0.4  # of the sample rate
FEWEST_CYCLES = 20  # over the travel, of an error of the reading
MOST_RIPPLES = 24
CELLS_A_PERIOD = 4  # of the highest frequency
FINEST = 1 << 17  # cells of a record at most
AROUND, STEEP = 61, 21  # resolutions that are taken for what surrounds a line; where it is steep
LEVEL_FREEDOM = 30.0  # independent powers that the median of so many correlated ones is worth
WIDTH = 2  # resolutions from a line's top to its foot, with Hann's window
PARTS = 64  # of the span, over which samples are counted
MOST_WEIGHT = 4.0  # of a sample among few, over that of a typical one
EQUAL = 1e-6  # of a spacing, by which equal ones may differ
EMPTY = 1e-24  # of the highest power, below which there is but rounding


@dataclass(frozen=True, eq=False)
class Record:
    """A signal over a coordinate, in any order and spacing: coordinate (n,), values (n,)."""

    coordinate: Array
    values: Array

    @property
    def span(self) -> float:
        """Range of the coordinate, in its unit."""
        return float(np.ptp(self.coordinate)) if len(self.coordinate) else 0.0


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

    chance: highest false-alarm probability of those returned, ``most`` in number.
    """
    records = [r for r in records if len(r.values) > 3 and r.span > 0.0 and np.ptp(r.values) > 0.0]
    if not records or not 0.0 <= lowest < highest:
        return ()
    span = max(r.span for r in records)
    highest = min(highest, FINEST / (CELLS_A_PERIOD * span))
    frequencies, powers = _spectra(records, span, highest)
    inside = np.flatnonzero((frequencies >= lowest) & (frequencies <= highest))
    if len(inside) < 3:
        return ()
    height = np.sum([p / np.maximum(_level(p), EMPTY * p.max()) for p in powers], axis=0)
    alone = _by_chance(height, len(records))
    tried = max((highest - lowest) * span, 1.0)
    false_alarm = -np.expm1(tried * np.log1p(-np.minimum(alone, 1.0 - 1e-12)))
    foot = int(np.ceil(WIDTH * span / min(r.span for r in records)))
    top = height == maximum_filter1d(height, 2 * foot + 1)
    found = inside[top[inside] & (false_alarm[inside] < chance)]
    best = found[np.argsort(height[found])[::-1]][:most]
    step = frequencies[1] - frequencies[0]
    refined = [_refined(records, frequencies[k], step) for k in best]
    return tuple(
        SpectralLine(f, share, float(false_alarm[k]))
        for (f, share), k in zip(refined, best, strict=True)
    )


def _level(power: Array) -> Array:
    """Mean power (m,) of noise about each frequency, from medians; near for a steep spectrum."""
    medians = [median_filter(power, width, mode="reflect") for width in (AROUND, STEEP)]
    return np.asarray(np.maximum(*medians) / np.log(2.0))


def _by_chance(height: Array, records: int) -> Array:
    """Probability that noise at one frequency is as high, (m,).

    height: power over the level around, summed over records; as both are estimated, it follows the
    F distribution.
    """
    freedom = LEVEL_FREEDOM * records
    return np.asarray(betainc(freedom, records, freedom / (freedom + height)))


def _spectra(records: Sequence[Record], span: float, highest: float) -> tuple[Array, list[Array]]:
    """Frequencies (m,) a resolution apart, and the power (m,) of each record at them.

    Less those near zero, which the removal of the mean empties.
    """
    cell = _common_spacing(records) or 1.0 / (CELLS_A_PERIOD * highest)
    cells = next_fast_len(int(np.ceil(span / cell)) + 1, real=True)
    powers = []
    for r in records:
        along = (r.coordinate - r.coordinate.min()) / r.span
        taper = np.sin(np.pi * along) ** 2 * _sparseness(along)
        values = (r.values - r.values.mean()) * taper
        spread = _spread(along * (r.span / cell), values, cells)
        powers.append(np.abs(np.fft.rfft(spread)[WIDTH:]) ** 2)
    return np.asarray(np.fft.rfftfreq(cells, cell)[WIDTH:], dtype=float), powers


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
    weights = (
        -t * (t - 1.0) * (t - 2.0) / 6.0,
        (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0,
        -(t + 1.0) * t * (t - 2.0) / 2.0,
        (t + 1.0) * t * (t - 1.0) / 6.0,
    )
    out = np.zeros(cells)
    for k, weight in enumerate(weights):
        out += np.bincount((first + k - 1) % cells, values * weight, cells)
    return out


def _refined(records: Sequence[Record], frequency: float, step: float) -> tuple[float, float]:
    """Frequency of highest power within a resolution of one, and the share of variance there."""
    about = frequency + step * np.array([-0.5, 0.0, 0.5])
    for width in (0.5, 0.2, 0.05):
        a, b, c = _share(records, about)
        bend = a - 2.0 * b + c
        shift = 0.5 * (a - c) / bend if bend < 0.0 else np.sign(c - a)
        middle = about[1] + width * step * float(np.clip(shift, -1.0, 1.0))
        middle = float(np.clip(middle, frequency - step, frequency + step))
        about = middle + 0.4 * width * step * np.array([-1.0, 0.0, 1.0])
    return middle, float(_share(records, np.array([middle]))[0])


def _share(records: Sequence[Record], frequencies: Array) -> Array:
    """Share of the records' variance that a sine of each frequency (m,) takes, (m,) 0..1."""
    taken, energy = np.zeros(len(frequencies)), 0.0
    turns = 2.0 * np.pi * np.maximum(frequencies, 1e-300)
    for r in records:
        own = float(np.sum((r.values - r.values.mean()) ** 2))
        power = lombscargle(
            r.coordinate, r.values, turns, normalize="normalize", floating_mean=True
        )
        taken += own * np.asarray(power)
        energy += own
    return taken / energy


def lines(motions: Sequence[Motion]) -> tuple[float, ...]:
    """Frequencies (Hz) at which the force of logs repeats in time, the surest first.

    The force is the command less what acceleration, direction, speed and position explain.
    """
    return lines_in_time([(_rest(m), m.period) for m in motions])


def lines_in_time(
    forces: Sequence[tuple[Array, float]], most: int = MOST_LINES
) -> tuple[float, ...]:
    """The same of forces (n,) N with their sample periods (s)."""
    if not forces:
        return ()
    records = [
        Record(period * np.arange(len(force), dtype=float), force) for force, period in forces
    ]
    longest = max(r.span for r in records)
    highest = HIGHEST / max(step for _, step in forces)
    found = find_lines(records, WIDTH / max(longest, 1e-300), highest, most=most)
    return tuple(line.frequency for line in found)


def ripples(motions: Sequence[Motion]) -> tuple[float, ...]:
    """Periods (m) at which an error of the reading would repeat in position, strongest first.

    An error A sin(2 pi x/p) looks like a force m A (2 pi v/p)^2 sin(2 pi x/p), so the force weighed
    by v^2 has a line in position.
    """
    position = np.concatenate([m.position for m in motions])
    record = Record(position, np.concatenate([_rest(m) * m.velocity**2 for m in motions]))
    if record.span <= 0.0:
        return ()
    lowest, highest = FEWEST_CYCLES / record.span, FINEST / (CELLS_A_PERIOD * record.span)
    found = find_lines([record], lowest, highest, most=MOST_RIPPLES)
    return tuple(line.period for line in found)


def _rest(motion: Motion) -> Array:
    """Command that a rough model leaves, (n,) N."""
    x, v = motion.position, motion.velocity
    rows = np.stack([motion.acceleration, np.sign(v), v, np.ones_like(x), x, x**2, x**3], axis=1)
    rows /= np.maximum(np.abs(rows).max(axis=0), 1e-300)
    solution = np.linalg.lstsq(rows, motion.command, rcond=None)[0]
    return np.asarray(motion.command - rows @ solution)
