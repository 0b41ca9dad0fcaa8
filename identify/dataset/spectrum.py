"""Power of a signal by frequency: levels of noise in it, and spectral lines.

Spectral lines are frequencies, in time or along the track, at which a signal repeats. One finder
for all. Records may be sampled at any instants or places: the samples are spread over the cells of
a grid, tapered by Hann's window and transformed by FFT, in a time of n log n. What stands out of
the level around is fitted by a sine (N. R. Lomb, 1976), and taken off before the next is sought.
The false-alarm probability is that of noise whose power follows an exponential distribution, at as
many frequencies as the range has independent ones.

Without SciPy, which takes longer to load than a short fit takes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from math import exp, lgamma, log, log1p
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from identify.rules import RULE
from twin.parallel import spread
from twin.signals import Array

MOST_LINES = 24  # of one spectrum; a machine with more has no lines, but noise
WIDTH = 2  # resolutions from a line's top to its foot, with Hann's window
BAND = 20  # resolutions whose median tells the level of the spectrum


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


def median_spectrum(
    signal: Array, segment: int, dt: float, left_out: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Welch's one-sided density with medians: frequency Hz, power unit^2/Hz, (segment // 2 + 1,).

    At least a quarter of the segments is used, those with the fewest left-out samples, and of very
    many as many as make the median sure.
    Medians are biased, see B. Allen et al., Phys. Rev. D 85, 122006 (2012).
    """
    out = pieces_of(left_out, segment).mean(axis=1)
    # 0.25 of the segments, where an axis rests in most
    usable = np.flatnonzero(out <= np.quantile(out, 0.25))
    # The median of 64 is sure enough: with as many frequencies, to 1 % of the power
    pieces = pieces_of(signal, segment)[usable[:: -(-len(usable) // 64)]]
    ramp = np.linspace(-1.0, 1.0, segment)
    slope = (pieces @ ramp) / (ramp @ ramp)
    power = densities(pieces - (pieces.mean(axis=1, keepdims=True) + slope[:, None] * ramp), dt)
    odd = np.arange(2, (len(pieces) - 1) // 2 * 2 + 1, 2)
    bias = 1.0 + np.sum(1.0 / (odd + 1.0) - 1.0 / odd)
    frequency = np.asarray(np.fft.rfftfreq(segment, dt), float)
    return frequency, np.asarray(np.median(power, axis=0) / bias)


def fitted_levels(shapes: Array, power: Array) -> Array:
    """Non-negative levels (k,) of shapes (m, k) in a power (m,), by repeated least squares.

    Errors of an estimated power are in proportion to it (P. Whittle, "Estimation and information in
    stationary time series", Ark. Mat. 2, 1953), so that relative errors are fitted. A frequency
    above the fit, such as a resonance, has the less weight the higher it is: the first fit is the
    smallest power at this or any higher frequency, as noise of such shapes never falls. Zero, where
    there is no power: what is far below the highest is rounding, and counts as that.
    """
    levels = np.zeros(shapes.shape[1])
    rounding = np.finfo(float).eps ** 2 * float(power.max(initial=0.0))
    if rounding < np.sqrt(np.finfo(float).tiny):  # whose square, by which it is divided, is none
        return levels
    power = np.maximum(power, rounding)
    model = least = np.minimum.accumulate(power[::-1])[::-1]
    rounds, resting = 12, 1e-4  # of least squares, at most; the relative change of levels that rest
    for _ in range(rounds):
        # A frequency whose log of power over fit is 0.5 has half its weight
        above = np.maximum(np.log(power / model), 0.0) / 0.5
        weight = 1.0 / (1.0 + above**2)
        before = levels
        levels = _not_negative(shapes * (weight / model)[:, None], power / model * weight)
        if (np.abs(levels - before) <= resting * before).all():
            break
        model = np.maximum(shapes @ levels, least[0])
    return levels


def _not_negative(columns: Array, wanted: Array) -> Array:
    """Gains (k,) of least squares; a column whose gain would be the most negative is left out."""
    square, met = columns.T @ columns, columns.T @ wanted
    own = square.diagonal()
    gains, kept, size = np.zeros(len(own)), np.flatnonzero(own), np.sqrt(np.where(own, own, 1.0))
    unit, aim = square / np.outer(size, size), met / size
    while len(kept):
        found = np.linalg.lstsq(unit[kept][:, kept], aim[kept], rcond=None)[0]
        if found.min() >= 0.0:
            gains[kept] = found / size[kept]
            break
        kept = np.delete(kept, np.argmin(found))
    return gains


@dataclass(frozen=True, eq=False)
class ScatteredSignal:
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
    records: Sequence[ScatteredSignal],
    lowest: float,
    highest: float,
    *,
    most: int = MOST_LINES,
    chance: float | None = None,
) -> tuple[SpectralLine, ...]:
    """Lines from ``lowest`` to ``highest`` (cycles per unit), the least likely by chance first.

    chance: highest false-alarm probability of those returned, ``most`` in number; that of the rule
    where None. Of n samples the highest is n cycles over their span at most.
    """
    chance = RULE.chance if chance is None else chance
    records = [r for r in records if len(r.values) > 3 and r.span > 0.0 and np.ptp(r.values) > 0.0]
    if not records or not 0.0 <= lowest < highest:
        return ()
    grid = _Grid.of(records, min(highest, max(len(r.values) / r.span for r in records)))
    inside = np.flatnonzero((grid.frequencies >= lowest) & (grid.frequencies <= highest))
    if len(inside) < 3:
        return ()
    left = [replace(r, values=r.values - r.values.mean()) for r in records]
    whole = _energy(left)
    # Rounding of a phase grows with the cycles; below its power there is nothing to be found.
    rounding = (np.finfo(float).eps * grid.cells) ** 2
    empty = rounding * grid.powers(left).max(axis=1, keepdims=True) + np.finfo(float).tiny
    found, rest = _peeled(grid, left, inside, empty, most, chance)
    noise = level(grid.powers(rest), empty)
    heights = [float(np.sum(line.powers / noise[:, line.at])) for line in found]
    out = [
        (height, SpectralLine(line.frequency, line.energy / whole, alarm))
        for height, line in zip(heights, found, strict=True)
        if (alarm := _false_alarm(height, len(records), len(inside))) < chance
    ]
    return tuple(line for _, line in sorted(out, key=lambda pair: -pair[0]))


def strongest_line(
    record: ScatteredSignal, lowest: float, highest: float, least: float
) -> tuple[float, float]:
    """Frequency from ``lowest`` to ``highest`` of the strongest sine, and its share of variance.

    In noise that is white, as its level is not looked at: one transform, for very many samples.
    Where its power shows that the share is far below ``least`` both are as the transform has them.
    """
    if record.span <= 0.0 or not record.values.any():
        return lowest, 0.0
    grid = _Grid.of([record], highest)
    powers = grid.powers([record])
    inside = (grid.frequencies >= lowest) & (grid.frequencies <= highest)
    k = int(np.argmax(powers[0] * inside))
    top = grid.top(powers, k)
    # Of a sine of height A a taper w passes |A sum(w)/2|^2. Between two bins it sees two thirds of
    # that, and of what errs near the ends, where an axis that turns has most samples, far less.
    share = float(2.0 * powers[0, k] / grid.tapers[0].sum() ** 2 / np.mean(record.values**2))
    # 0.1: so far below the least that counts, the finer look changes nothing
    if share < 0.1 * least:
        return top, share
    frequency, rest = _less_sine([record], top, grid.step)
    return frequency, 1.0 - _energy(rest) / _energy([record])


def lines_in_time(
    forces: Sequence[tuple[Array, float]], most: int = MOST_LINES
) -> tuple[float, ...]:
    """Frequencies (Hz) at which forces (n,) N repeat, with their sample periods (s)."""
    records = [ScatteredSignal(period * np.arange(len(f), dtype=float), f) for f, period in forces]
    longest = max((r.span for r in records), default=0.0)
    if longest == 0.0:
        return ()
    nyquist = 0.5 / max(period for _, period in forces)
    return tuple(
        line.frequency for line in find_lines(records, WIDTH / longest, nyquist, most=most)
    )


@dataclass(frozen=True, eq=False)
class _Grid:
    """Frequencies (m,) a resolution apart, at which the power of records is taken.

    Less those near zero, which the removal of the mean empties. cells: of the coordinate. places,
    tapers: of each record's samples, (n,) cells and (n,) 1. even: whether all samples are equally
    spaced, so that each has a cell of its own.
    """

    frequencies: Array
    cells: int
    places: Sequence[Array]
    tapers: Sequence[Array]
    even: bool

    @classmethod
    def of(cls, records: Sequence[ScatteredSignal], highest: float) -> _Grid:
        first = float(records[0].coordinate[1] - records[0].coordinate[0])
        even = first > 0.0 and all(
            np.allclose(np.diff(r.coordinate), first, atol=0.0) for r in records
        )
        # 4 a period of the highest frequency, where samples are not equally spaced
        cell = first if even else 1.0 / (4 * highest)
        cells = fast_length(int(np.ceil(max(r.span for r in records) / cell)) + 1)
        along = [(r.coordinate - r.coordinate.min()) / r.span for r in records]
        return cls(
            np.asarray(np.fft.rfftfreq(cells, cell)[WIDTH:], dtype=float),
            cells,
            [a * (r.span / cell) for a, r in zip(along, records, strict=True)],
            [np.sin(np.pi * a) ** 2 for a in along],
            even,
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

    def powers(self, records: Sequence[ScatteredSignal]) -> Array:
        """Power of each record at the frequencies, (records, m)."""
        tapered = [r.values * taper for r, taper in zip(records, self.tapers, strict=True)]
        if not self.even:
            pairs = zip(self.places, tapered, strict=True)
            tapered = [_spread(place, values, self.cells) for place, values in pairs]
        return np.array([np.abs(np.fft.rfft(v, self.cells)[WIDTH:]) ** 2 for v in tapered])


@dataclass(frozen=True, eq=False)
class _Found:
    """A line before it was subtracted: its place in the grid, its powers (records,), its energy."""

    at: int
    frequency: float
    powers: Array
    energy: float


def _peeled(
    grid: _Grid,
    left: list[ScatteredSignal],
    inside: NDArray[np.int64],
    empty: Array,
    most: int,
    chance: float,
) -> tuple[list[_Found], list[ScatteredSignal]]:
    """Lines at places ``inside`` a grid, one after the other, and the records less all of them.

    The search ends where even white noise, which shows the weakest lines, would show one as strong.
    """
    found: list[_Found] = []
    tried, samples = len(inside), sum(len(r.values) for r in left)
    for turn in range(2 * most):
        powers = grid.powers(left)
        # In turn by height over the level, and by power: few cycles are a part of their own level.
        order = powers if turn % 2 and not grid.even else powers / level(powers, empty)
        if len(found) == most or not len(inside):
            break
        k = int(inside[np.argmax(order.sum(axis=0)[inside])])
        inside = inside[np.abs(inside - k) > WIDTH]
        before = _energy(left)
        frequency, rest = _less_sine(left, grid.top(powers, k), grid.step)
        after = _energy(rest)
        log_alone = 0.5 * samples * np.log(max(after, np.finfo(float).tiny) / before)
        if before == 0.0 or np.log(tried) + log_alone > np.log(chance):
            if grid.even or turn % 2:
                break
            continue
        found.append(_Found(k, frequency, powers[:, k], before - after))
        left = rest
    return found, left


def _less_sine(
    records: Sequence[ScatteredSignal], frequency: float, step: float
) -> tuple[float, list[ScatteredSignal]]:
    """Frequency of the best sine near one, at most a step away, and the records less it."""
    for _ in range(2):  # steps of Gauss and Newton are enough from a line's top
        parts = spread(partial(_sine, frequency=frequency), records)
        pull, stiffness = (sum(part[i] for part in parts) for i in (1, 2))
        if stiffness > 0.0:
            frequency += float(np.clip(pull / stiffness, -0.5 * step, 0.5 * step))
    parts = spread(partial(_sine, frequency=frequency), records)
    return frequency, [replace(r, values=p[0]) for r, p in zip(records, parts, strict=True)]


def _sine(record: ScatteredSignal, frequency: float) -> tuple[Array, float, float]:
    """What the best sine and a constant leave of a record, (n,), and products of its slope.

    The slope of that sine over its frequency, less what its phase and height can make of it: with
    what is left, and with itself.
    """
    along = record.coordinate - record.coordinate.mean()
    turn = 2.0 * np.pi * frequency * along
    columns = np.stack([np.cos(turn), np.sin(turn), np.ones_like(turn)])
    square = columns @ columns.T
    gains = np.linalg.lstsq(square, columns @ record.values, rcond=None)[0]
    left = record.values - gains @ columns
    slope = 2.0 * np.pi * along * (gains[1] * columns[0] - gains[0] * columns[1])
    slope -= np.linalg.lstsq(square, columns @ slope, rcond=None)[0] @ columns
    return left, float(slope @ left), float(slope @ slope)


def _false_alarm(height: float, records: int, tried: int) -> float:
    """Probability that noise is as high at any of the frequencies tried.

    height: power over the level around, summed over records; as both are estimated, it follows the
    F distribution, whose tail is a finite sum where one of its freedoms is even.
    """
    freedom = 1.5 * BAND * records  # a median of three bands is worth half of their powers
    tiny, eps = np.finfo(float).tiny, np.finfo(float).eps
    part = min(max(height / (freedom + height), tiny), 1.0 - eps)
    logs = (
        lgamma(freedom + i) - lgamma(freedom) - lgamma(i + 1) + i * log(part)
        for i in range(records)
    )
    alone = sum(exp(freedom * log1p(-part) + term) for term in logs)
    return float(-np.expm1(tried * np.log1p(-min(alone, 1.0 - eps))))


def _energy(records: Sequence[ScatteredSignal]) -> float:
    return float(sum(np.sum(r.values**2) for r in records))


def level(powers: Array, empty: Array) -> Array:
    """Mean power (records, m) of noise about each frequency, from medians; at least ``empty``.

    Medians of bands, and of three bands: the higher, as a steep spectrum is at its foot far above
    its wider surroundings. At the lowest frequencies, where it may be steep within a band, each has
    a band of its own.
    """
    m = powers.shape[1]
    padded = np.pad(powers, [(0, 0), (0, -m % BAND)], mode="reflect" if m > BAND else "edge")
    near = np.median(padded.reshape(len(powers), -1, BAND), axis=2)
    out = np.repeat(np.maximum(near, _medians(near, 3)), BAND, axis=1)[:, :m]
    low = _medians(powers[:, : 5 * BAND], BAND + 1)[:, : 4 * BAND]
    out[:, : low.shape[1]] = np.maximum(out[:, : low.shape[1]], low)
    return np.maximum(out / np.log(2.0), empty)


def _medians(rows: Array, width: int) -> Array:
    """Medians (..., m) of an odd number of values about each of rows (..., m), mirrored at ends."""
    ends = [(0, 0)] * (rows.ndim - 1) + [(width // 2, width // 2)]
    padded = np.pad(rows, ends, mode="symmetric")
    return np.asarray(np.median(sliding_window_view(padded, width, axis=-1), axis=-1))


def fast_length(least: int) -> int:
    """The smallest length from ``least`` on whose only prime factors are 2, 3 and 5."""
    # up to 3^15 and 5^11, each above any length of a log
    odd = (3**a * 5**b for a in range(16) for b in range(12))
    return min(n << (-(-least // n) - 1).bit_length() for n in odd)


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
    return np.asarray(np.bincount(about.ravel(), (weights * values).ravel(), cells), float)
