"""The path that a law with memory follows: the readings less what noise alone may have made.

Noise makes path. Where readings of a standing axis scatter, the sum of their steps is no motion,
but a bristle, a layer or a contact follows every one of them, and what it held is forgotten. So a
law that remembers follows a smoother path: of the details of the readings, on every time scale,
those that are surely more than noise; where the axis stands, more than the largest of as many
values of noise. On a scale of 2^j samples details are the difference of two means with the weights
of a cubic spline (the starlet transform; J.-L. Starck, F. Murtagh, Astronomical Image and Data
Analysis, 2006), so that what is kept is not shifted. What the largest of n values of noise is:
D. L. Donoho, I. M. Johnstone, Ideal spatial adaptation by wavelet shrinkage, Biometrika 81 (1994).
Without noise the path is that of the readings, to rounding.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.typing import NDArray

from identify.dataset.test_function import SHORTEST
from twin.core.compiled import compiled
from twin.signals import Array, between

FEWEST = 5  # samples that tell whether an axis stands
SURE = 3.0  # standard deviations of noise beyond which a detail of a motion is one
SPLINE = (1.0 / 16.0, 1.0 / 4.0, 3.0 / 8.0)  # of a cubic spline, from an end to the middle


@dataclass(frozen=True, eq=False)
class Path:
    """What the readings of a log tell of the path, in blocks of some of its samples.

    readings (n * samples + 1,): m. samples: of a block. period: s, of a sample. noise: m rms, the
    white noise of a reading.
    """

    readings: Array
    samples: int
    period: float
    noise: float

    @cached_property
    def velocity(self) -> Array:
        """(n,) m/s of the path over each block."""
        return np.asarray(self.at_samples.reshape(-1, self.samples).mean(axis=1))

    @property
    def at_samples(self) -> Array:
        """(n * samples,) m/s of the path, at the log's own rate."""
        if self.noise == 0.0:
            return between(self.readings, self.period)
        sure = np.where(self._still, largest(len(self.readings)), SURE)
        return between(quieted(self.readings, self.noise * sure, _scales(self.period)), self.period)

    @property
    def room(self) -> float:
        """How far the readings of an axis that stands may lie apart by noise, m."""
        return 2.0 * largest(len(self.readings)) * self.noise

    @cached_property
    def stands(self) -> NDArray[np.bool_]:
        """In which blocks (n,) all readings around lie no farther apart than by noise."""
        return np.asarray(self._still_samples.all(axis=1))

    @property
    def pauses(self) -> NDArray[np.bool_]:
        """In which blocks (n,) the axis may stand for some of their samples."""
        return np.asarray(self._still_samples.any(axis=1))

    def calm(self, blocks: int) -> NDArray[np.bool_]:
        """In which runs (n - blocks + 1,) of blocks readings lie no farther apart than by noise."""
        span = _span(self.readings, blocks * self.samples + 1)
        return np.asarray(span[:: self.samples] < self.room)

    @property
    def _still_samples(self) -> NDArray[np.bool_]:
        still = self._still
        return (still[:-1] & still[1:]).reshape(-1, self.samples)

    @cached_property
    def _still(self) -> NDArray[np.bool_]:
        """At which readings (n * samples + 1,) all around lie no farther apart than by noise.

        Around: within half the shortest test function, as nothing is looked at more closely.
        """
        around = max(round(SHORTEST / self.period), FEWEST) // 2
        x = np.pad(self.readings, around, mode="edge")
        return np.asarray(_span(x, 2 * around + 1) < self.room)

    def during(self, first: int, end: int) -> Path:
        """The same of the samples from one to another."""
        return replace(self, readings=self.readings[first : end + 1])

    def less(self, error: Array) -> Path:
        """The path behind readings with an error (n * samples,) m."""
        return replace(self, readings=self.readings - np.append(error, error[-1]))

    @cached_property
    def by_halves(self) -> Array:
        """(2, n) m/s over each block of the paths that every second reading tells.

        From the first, and from the second reading on.
        """
        return np.stack([self._of_every_second(first).velocity for first in (0, 1)])

    def _of_every_second(self, first: int) -> Path:
        fewer, between_them = self.readings.copy(), slice(1 + first, -1, 2)
        fewer[between_them] = 0.5 * (fewer[first:-2:2] + fewer[2 + first :: 2])
        return replace(self, readings=fewer)

    def forget(self) -> None:
        """Let go of what is made of the readings."""
        for name in ("velocity", "by_halves", "stands", "_still"):
            self.__dict__.pop(name, None)


@dataclass(frozen=True, eq=False)
class Slip:
    """What a model moves its laws with memory beside the path of the readings at rest.

    velocity (n,): m/s, by blocks. free (n,): in which blocks the readings let it be any.
    """

    velocity: Array
    free: NDArray[np.bool_]


def quieted(readings: Array, most: Array, scales: int) -> Array:
    """Readings (n,) m less details on so many time scales of which noise makes so much (n,) m.

    most: of noise that is not averaged.
    """
    return np.asarray(_without_details(readings, most, _gains(scales)))


@compiled(nogil=True)
def _without_details(readings, most, gains):
    mean, smooth = readings - readings[0], np.empty(len(readings))
    out = readings.copy()
    for j in range(len(gains)):
        _smooth(mean, 1 << j, smooth)
        for i in range(len(out)):
            detail = mean[i] - smooth[i]
            if not abs(detail) > gains[j] * most[i]:
                out[i] -= detail
        mean, smooth = smooth, mean
    return out


def largest(count: int) -> float:
    """What the largest of so many values of Gaussian noise is about, over their RMS."""
    return float(np.sqrt(2.0 * np.log(max(count, 2))))


def _scales(period: float) -> int:
    """How many scales of samples of a period (s) are shorter than any test function."""
    return max(int(np.ceil(np.log2(SHORTEST / period))), 1)


@lru_cache(maxsize=8)
def _gains(scales: int) -> Array:
    """RMS (scales,) of the details of white noise of RMS 1 on each scale."""
    mean, gains = np.zeros(1 << (scales + 3)), []
    mean[len(mean) // 2] = 1.0
    for j in range(scales):
        smooth = np.empty_like(mean)
        _smooth(mean, 1 << j, smooth)
        gains.append(float(np.linalg.norm(mean - smooth)))
        mean = smooth
    return np.array(gains)


@compiled(nogil=True)
def _smooth(signal, apart, out):
    """Mean (n,) of five values so many samples apart; beyond the ends are the end values."""
    last = len(signal) - 1
    for i in range(last + 1):
        if 2 * apart <= i <= last - 2 * apart:
            near = signal[i - apart] + signal[i + apart]
            far = signal[i - 2 * apart] + signal[i + 2 * apart]
        else:
            near = signal[max(i - apart, 0)] + signal[min(i + apart, last)]
            far = signal[max(i - 2 * apart, 0)] + signal[min(i + 2 * apart, last)]
        out[i] = SPLINE[2] * signal[i] + SPLINE[1] * near + SPLINE[0] * far


def _span(signal: Array, samples: int) -> Array:
    """How far apart (n - samples + 1,) so many values in a row of a signal (n,) lie."""
    return _highest(signal, samples) + _highest(-signal, samples)


def _highest(signal: Array, samples: int) -> Array:
    """The largest (n - samples + 1,) of so many values in a row of a signal (n,)."""
    size = 1
    while 2 * size <= samples:
        signal = np.maximum(signal[:-size], signal[size:])
        size *= 2
    rest = samples - size
    return np.maximum(signal[: len(signal) - rest], signal[rest:])
