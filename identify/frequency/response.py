"""The best linear approximation of force to position, from logs under feedback.

A machine with friction has no transfer function, but at a given excitation a best linear
approximation (R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd
ed., 2012, chapters 3, 4 and 7). Under feedback the command holds the noise of the readings, so that
the ratio of their spectra is biased; the setpoint is the instrument: the responses of command and
of reading to it are estimated together, and divided.

Each is estimated by the local polynomial method: about each frequency the response and the
transient of the record are polynomials of the frequency, and what these leave is the variance of
noise and of what is not linear. Where the setpoint repeats, the scatter from period to period tells
noise alone, and the rest of the variance is what is not linear.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.dataset.spectrum import fast_length
from twin.errors import InputError
from twin.signals import Array

Complex = NDArray[np.complex128]

POWERS = np.arange(3)  # of the polynomials, for the response and for the transient
UNKNOWNS = 2 * len(POWERS)
WEAK = 10.0  # F of the force that the instrument makes, below which the ratio of two responses is
# biased towards that of the noise, which feedback makes (D. Staiger, J. H. Stock, Instrumental
# Variables Regression with Weak Instruments, Econometrica 65, 1997)


@dataclass(frozen=True, eq=False)
class LoopSignals:
    """Signals of one log, (n,) each: setpoint, None where there is none, force, and position."""

    setpoint: Array | None
    force: Array
    position: Array
    period: float
    """s, between samples."""


@dataclass(frozen=True, eq=False)
class Response:
    """Responses at frequencies (k,) Hz, rising.

    Forces are held over a sample, and readings are of its beginning: a plant P(s) has here the
    response of its samples, not P(2 pi i f).
    """

    frequency: Array
    plant: Complex
    """Position over force, m/N."""
    spread: Array
    """Standard deviation of it, m/N: the root of the mean square of its error."""
    noise: Array
    """Part of that which is noise, m/N; no number where no setpoint repeats."""
    closed: Complex
    """Position over setpoint; no number where a log has none."""
    coherence: Array
    """Part of the power of force and of position, the smaller, that the instrument makes, 0..1."""
    band: Array
    """Radius, m/N, of the circle about the plant that holds the true one 9 times in 10."""
    strength: Array
    """F of what the instrument makes of the force."""
    period: float
    """s, between samples."""

    @property
    def distortion(self) -> Array:
        """Part of the spread that is not noise: what is not linear, m/N."""
        return np.sqrt(np.maximum(self.spread**2 - self.noise**2, 0.0))

    @property
    def tells(self) -> NDArray[np.bool_]:
        """Where a band twice as wide would not reach zero: of noise alone hardly any would.

        And where the instrument is not weak.
        """
        return (2.0 * self.band < np.abs(self.plant)) & (self.strength >= WEAK)

    def at(self, kept: NDArray[np.bool_]) -> Response:
        """The same at some of the frequencies."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return Response(**{n: v[kept] if np.ndim(v) else v for n, v in values.items()})


def response(records: Sequence[LoopSignals], count: int = 200, width: float = 0.03) -> Response:
    """The response that records show together, at ``count`` frequencies or fewer.

    width: half of that over which it is taken as a polynomial, of the frequency: a resonance of
    damping z is told where its own half width z is larger. Records are weighed by their variances.
    Raises InputError where the sample periods differ, and where a record is too short.
    """
    periods = {record.period for record in records}
    if len(periods) != 1:
        rates = ", ".join(f"{1.0 / p:g} Hz" for p in sorted(periods))
        raise InputError(f"the logs are sampled at {rates}; give logs of one rate")
    period = periods.pop()
    spectra = [_Spectra.of(record) for record in records]
    longest = max(s.cells for s in spectra) * period
    lowest = (UNKNOWNS + 2) / min(s.cells * period for s in spectra)
    # 0.45 of the rate: nearer to half of it a polynomial has no room on one side
    if not lowest < 0.45 / period:
        raise InputError(
            f"the shortest log holds {min(s.cells for s in spectra)} samples of one period of its "
            "setpoint; give longer ones"
        )
    # the same highest frequency
    grid = np.geomspace(lowest, 0.45 / period, count)
    grid = np.unique(np.rint(grid * longest)) / longest
    if lines := [s.lines / (s.cells * period) for s in spectra if s.is_sparse]:
        excited = np.unique(np.concatenate(lines))
        grid = excited[np.unique(np.abs(excited - grid[:, None]).argmin(axis=1))]
    found = _together(grid, [[s.about(f, width) for f in grid] for s in spectra], period)
    if all(record.setpoint is not None for record in records):
        return found
    return replace(found, closed=np.full(len(grid), np.nan, dtype=complex))


@dataclass(frozen=True)
class _Local:
    """Responses of force and position to the instrument at one frequency: mean, covariance, ..."""

    mean: Complex  # (2,): of force, of position
    covariance: Complex  # (2, 2) of their errors
    noise: Complex  # (2, 2), the part of noise; no number where nothing repeats
    explained: Array  # (2,) part of the power
    freedom: int

    @property
    def strength(self) -> float:
        """F of the force's response."""
        force, variance = abs(self.mean[0]) ** 2, float(np.real(self.covariance[0, 0]))
        return float(force / variance) if variance > 0.0 else np.inf


@dataclass(frozen=True, eq=False)
class _Spectra:
    """Spectra of instrument (m,) and signals (m, 2), differenced twice; scatter of periods."""

    instrument: Complex
    signals: Complex
    noise: Complex | None  # (m, 2, 2), covariance of the mean over periods
    cells: int  # samples of one transform
    period: float

    @classmethod
    def of(cls, record: LoopSignals) -> _Spectra:
        drive = record.force if record.setpoint is None else record.setpoint
        signals = np.stack([drive, record.force, record.position])
        bent = np.diff(signals, 2)  # which has no trend: what drifts would leak everywhere
        n = bent.shape[1]
        cells = n if record.setpoint is None else _repeats_after(bent[0], drive)
        periods = n // cells - 2  # the first holds a transient, the last may end
        if periods < 2:
            turned = np.fft.rfft(bent) / np.sqrt(n)
            return cls(turned[0], turned[1:].T, None, n, record.period)
        # What repeats has no ends, and is differenced by its spectrum.
        inner = signals[:, cells : (periods + 1) * cells].reshape(3, periods, cells)
        bend = (1.0 - np.exp(-2j * np.pi * np.arange(cells // 2 + 1) / cells)) ** 2
        each = np.fft.rfft(inner) * bend / np.sqrt(cells)
        mean, own = each.mean(axis=1), each[1:] - each[1:].mean(axis=1, keepdims=True)
        noise = np.einsum("ipm,jpm->mij", own, own.conj()) / ((periods - 1) * periods)
        return cls(mean[0], mean[1:].T, noise, cells, record.period)

    @cached_property
    def lines(self) -> NDArray[np.intp]:
        """The lines that the setpoint has, where it repeats; else all."""
        every = np.arange(1, len(self.instrument))
        if self.noise is None:
            return every
        # Of the largest in its octave and those beside it, and of all: less is rounding.
        near, least, size = 1e-2, 1e-4, np.abs(self.instrument[1:])
        octave = np.log2(every).astype(int)
        most = np.maximum.reduceat(size, 2 ** np.arange(octave[-1] + 1) - 1)
        about = np.pad(most, 1)
        largest = np.max([about[octave + beside] for beside in range(3)], axis=0)
        return every[size > np.maximum(near * largest, least * size.max())]

    @cached_property
    def is_sparse(self) -> bool:
        """Whether most lines of the band are none of the setpoint, as of odd or few lines."""
        return bool(2 * (len(self.lines) - 1) <= self.lines[-1] - self.lines[0])

    def _near(self, centre: float, width: float) -> NDArray[np.intp]:
        """The lines as near as ``width`` to one, enough for the polynomials."""
        half = max(round(width * centre), UNKNOWNS)
        if self.is_sparse:
            least = UNKNOWNS - 1  # two more than a response has terms; nothing is transient
            low, here, high = np.searchsorted(self.lines, [centre - half, centre, centre + half])
            if high - low > least:
                return self.lines[low:high]
            about = self.lines[max(here - least, 0) : here + least]
            return np.sort(about[np.argsort(np.abs(about - centre))[:least]])
        first = max(min(round(centre) - half, len(self.instrument) - 1 - 2 * half), 1)
        return np.arange(first, min(first + 2 * half + 1, len(self.instrument)))

    def about(self, frequency: float, width: float) -> _Local:
        """The responses about a frequency, by least squares over what is as near as ``width``."""
        centre = frequency * self.cells * self.period
        at = self._near(centre, width)
        size = np.abs(self.instrument[at])
        # times its surroundings, above which a line, of a slow motion, is left out: what friction
        # makes of it would decide there
        loudest = 10.0
        at = at[size <= loudest * np.median(size)]
        powers = ((at - centre) / max(np.ptp(at) / 2.0, 1.0))[:, None].astype(complex) ** POWERS
        transient = powers[:, :0] if self.is_sparse else powers
        columns = np.hstack([self.instrument[at, None] * powers, transient])
        size = np.linalg.norm(columns, axis=0)
        size[size == 0.0] = 1.0
        unit = (columns / size).conj().T
        # 1e-12, below which a combination of columns is rounding
        inverse = np.linalg.pinv(unit @ unit.conj().T, rcond=1e-12, hermitian=True) @ unit
        inverse /= size[:, None]
        rows = self.signals[at]
        found = inverse @ rows
        left = rows - columns @ found
        freedom = max(len(at) - columns.shape[1], 1)
        weights = inverse[0]
        if self.is_sparse:  # the line itself: between distant ones no polynomial is a response
            here = int(np.abs(at - centre).argmin())
            weights = np.zeros(len(at), dtype=complex)
            weights[here] = 1.0 / self.instrument[at[here]]
        covariance = left.T @ left.conj() / freedom * np.sum(np.abs(weights) ** 2)
        noise = np.full((2, 2), np.nan, dtype=complex)
        if self.noise is not None:
            noise = np.einsum("m,mij->ij", np.abs(weights) ** 2, self.noise[at])
        moved = rows - columns[:, len(POWERS) :] @ found[len(POWERS) :]
        whole = np.maximum(np.sum(np.abs(moved) ** 2, axis=0), np.finfo(float).tiny)
        explained = 1.0 - np.sum(np.abs(left) ** 2, axis=0) / whole
        return _Local(weights @ rows, covariance, noise, np.clip(explained, 0.0, 1.0), freedom)


def _repeats_after(signal: Array, setpoint: Array) -> int:
    """Samples after which a setpoint without noise repeats; n where it does not.

    In its first and its last period it may begin and end. signal (n,): its second difference, in
    which what is fast shows, and slow motion does not.
    """
    n = len(signal)
    alike = np.fft.irfft(np.abs(np.fft.rfft(signal, fast_length(2 * n))) ** 2)[: n // 3]
    inner = alike[1:-1]
    # 0.3 of the whole: of three periods a repeat overlaps by two thirds, less its ends
    tops = np.flatnonzero((inner >= alike[:-2]) & (inner >= alike[2:]) & (inner > 0.3 * alike[0]))
    for cells in tops + 1:
        inside = [whole[cells:-cells] for whole in (signal, setpoint)]
        # 1e-3 of the setpoint, by which a text of a few digits rounds it
        if all(np.abs(w[cells:] - w[:-cells]).max() < 1e-3 * np.ptp(w) for w in inside):
            return int(cells)
    return n


def _together(grid: Array, found: Sequence[Sequence[_Local]], period: float) -> Response:
    """Responses of several logs as one, each weighed by its variance."""
    plant, closed = np.zeros((2, len(grid)), dtype=complex)
    spread, noise, coherence, band, strength = np.zeros((5, len(grid)))
    for k, each in enumerate(zip(*found, strict=True)):
        at: Sequence[_Local] = each
        strength[k] = max(one.strength for one in at)
        at = [one for one in at if one.strength >= min(WEAK, strength[k])]
        quotients = [_ratio(one) for one in at]
        weight = np.array([1.0 / max(v, np.finfo(float).tiny) for _, v, _ in quotients])
        weight /= weight.sum()
        plant[k] = sum(w * q[0] for w, q in zip(weight, quotients, strict=True))
        spread[k], noise[k] = (
            np.sqrt(sum(w**2 * q[i] for w, q in zip(weight, quotients, strict=True)))
            for i in (1, 2)
        )
        closed[k] = sum(w * one.mean[1] for w, one in zip(weight, at, strict=True))
        coherence[k] = sum(w * one.explained.min() for w, one in zip(weight, at, strict=True))
        freedom = sum(one.freedom for one in at)
        # The 90 % quantile of Fisher's F of 2 and 2 freedom degrees, in closed form.
        band[k] = spread[k] * np.sqrt(freedom * (0.1 ** (-1.0 / freedom) - 1.0))
    return Response(grid, plant, spread, noise, closed, coherence, band, strength, period)


def _ratio(one: _Local) -> tuple[complex, float, float]:
    """Position over force, its variance, and that of noise."""
    force, position = one.mean
    plant = position / force if force else complex(np.nan)

    def variance(c: Complex) -> float:
        # Of the quotient, to first order: position less plant times force, over the force.
        left = c[1, 1] - 2.0 * np.real(np.conj(plant) * c[1, 0]) + abs(plant) ** 2 * c[0, 0]
        return max(float(np.real(left)), 0.0) / abs(force) ** 2 if np.isfinite(left) else np.nan

    return plant, variance(one.covariance), variance(one.noise)
