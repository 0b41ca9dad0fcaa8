"""Sampled signals: their rates, their smoothing, their white noise. One of each for all that asks.

``between`` is exact: over a sample the mean velocity is the difference of the positions at its
ends. ``rate`` keeps the instants. Local polynomials are for signals whose noise both would blow up.
The weak form (identify.dataset.test_function) differentiates its weight, not the signal.
Without scipy: its parts take longer to load than a short fit takes, and no fit needs them.
"""

from __future__ import annotations

from functools import lru_cache
from math import perm

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MANY = 20_000  # values from which on their median is sought between two of a sample


def between(signal: Array, period: float) -> Array:
    """Mean rate (..., n - 1) from each sample to the next, per s; period: s between samples."""
    return np.asarray(np.diff(signal) / period)


def rate(signal: Array, period: float) -> Array:
    """Rate (n,) at each sample, per s, from its two neighbours; at the ends from one.

    0 of a single sample.
    """
    return np.asarray(np.gradient(signal, period)) if len(signal) > 1 else np.zeros_like(signal)


def cubic_through(times: Array, values: Array, at: Array) -> Array:
    """Values (m,) at times ``at`` between the first and the last of these times (n,), n > 2.

    Between two of them by the cubic that has there the slopes of the parabolas through three.
    """
    slope, apart = np.gradient(values, times), np.diff(times)
    gap = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(apart) - 1)
    apart, done = apart[gap], (at - times[gap]) / apart[gap]
    left = 1.0 - done
    first, last = left**2 * (1.0 + 2.0 * done), done**2 * (1.0 + 2.0 * left)
    ends = first * values[gap] + last * values[gap + 1]
    return np.asarray(ends + apart * done * left * (left * slope[gap] - done * slope[gap + 1]))


def moving_mean(signal: Array, samples: int) -> Array:
    """Mean (n,) of ``samples`` around each, an odd number; beyond the ends are the end values."""
    side = samples // 2
    padded = np.concatenate([np.full(side, signal[0]), signal, np.full(side, signal[-1])])
    return np.convolve(padded, np.full(samples, 1.0 / samples), "valid")


def local_parabola(
    signal: Array, samples: int, *, derivative: int = 0, period: float = 1.0
) -> Array:
    """Signal (..., n), or its derivative per s, of the parabola through ``samples`` around each.

    samples: odd, at most n; 1 takes each value as it is. At the ends it is the parabola through the
    first, or the last, ``samples`` (A. Savitzky, M. J. E. Golay, 1964).
    """
    weights = _local_fit(samples, min(2, samples - 1), derivative) / period**derivative
    half = samples // 2
    inner = np.apply_along_axis(np.convolve, -1, signal, weights[half, ::-1], "valid")
    first = signal[..., :samples] @ weights[:half].T
    last = signal[..., -samples:] @ weights[half + 1 :].T
    return np.concatenate([first, inner, last], axis=-1)


def local_cubic(signal: Array, period: float) -> tuple[Array, Array, Array]:
    """Value, rate and second rate (...) in the middle of a signal (n, ...), n odd, by one cubic."""
    n = len(signal)
    value, first, second = (
        np.tensordot(_local_fit(n, 3, k)[n // 2] / period**k, signal, 1) for k in range(3)
    )
    return value, first, second


@lru_cache(maxsize=16)
def _local_fit(samples: int, order: int, derivative: int) -> Array:
    """Weights (samples, samples) of the values in the fitted polynomial's derivative at each."""
    at = np.arange(samples) - samples // 2
    powers = np.arange(order + 1)
    falls = np.array([perm(k, derivative) for k in powers])
    derived = falls * at[:, None].astype(float) ** np.maximum(powers - derivative, 0)
    return np.asarray(derived @ np.linalg.pinv(at[:, None].astype(float) ** powers))


def usual_size(noise: Array) -> float:
    """RMS of Gaussian noise (n,) by the median of its size, which outliers do not move."""
    return median(np.abs(noise)) / 0.6745  # of the size of Gaussian noise, over its RMS


def median(values: Array) -> float:
    """Median of values (n,), of many in a fifth of the time that numpy takes.

    A sample of them tells between which two it lies, and only what is between these is ordered.
    """
    if len(values) < MANY or np.isnan(values.max()):
        return float(np.median(values))
    # values of that sample, of whose ranks 0.45 to 0.55 hold the median by 3 sigma
    sample = np.sort(values[:: len(values) // 1000])
    low, high = sample[int(0.45 * len(sample))], sample[int(0.55 * len(sample))]
    within = values[(values >= low) & (values <= high)]
    middle = np.array([(len(values) - 1) // 2, len(values) // 2]) - np.count_nonzero(values < low)
    if middle[0] < 0 or middle[1] >= len(within):
        return float(np.median(values))
    return float(np.partition(within, middle)[middle].mean())


def stretches(mask: NDArray[np.bool_]) -> NDArray[np.intp]:
    """First sample, and the one after the last, of each stretch of true ones (n,); (k, 2)."""
    return np.flatnonzero(np.diff(mask, prepend=False, append=False)).reshape(-1, 2)


def held_at_extreme(signal: Array, extreme: float, least: int) -> NDArray[np.bool_]:
    """Which samples (n,) are at an extreme of a signal, to rounding, ``least`` of them at once."""
    held = stretches(np.abs(signal - extreme) <= 1e-9 * np.ptp(signal))
    first, end = held[held[:, 1] - held[:, 0] >= least].T
    edges = np.zeros(len(signal) + 1, np.int8)
    edges[first], edges[end] = 1, -1  # two stretches do not touch
    return np.cumsum(edges[:-1]) > 0


def white_noise(signal: Array) -> float:
    """RMS of the white part of a smooth signal (n,): its fourth difference holds little else.

    The fourth difference of white noise is sqrt(70) times as large. 0 of a signal too short for it.
    """
    return usual_size(np.diff(signal, 4)) / 70**0.5 if len(signal) > 4 else 0.0


def sliding_products(signal: Array, patterns: Array) -> Array:
    """Products (..., n - m + 1) of patterns (..., m) with every stretch of a signal (n,)."""
    size = 1 << (len(signal) - 1).bit_length()
    spectra = np.fft.rfft(signal, size) * np.conj(np.fft.rfft(patterns, size))
    return np.fft.irfft(spectra, size)[..., : len(signal) - patterns.shape[-1] + 1]


def count_of(signal: Array) -> float:
    """One count of a signal that stays at some value, and goes by whole counts to the next.

    It passes a few samples between, where it was resampled. 0 where no count shows.
    """
    first, last = stretches(np.diff(signal) != 0.0).T
    passed_in = 4  # samples in which a count is passed
    ways = np.abs(signal[last] - signal[first])[last - first <= passed_in]
    ways = ways[ways > 0.0]
    if len(ways) < 5:  # that tell one
        return 0.0
    # parts of the ways that may be less, as text far from 0 is coarser
    one_count = (0.5, 0.25, 0.1)
    for count in np.quantile(ways, one_count):
        off = np.abs(ways / count - np.round(ways / count))
        whole_way = 0.05  # of a count: how far a way may be off a whole one
        whole = ways[(off < whole_way) & (ways > 0.5 * count)]
        if whole.sum() > 0.9 * ways.sum():  # least part of the ways that are whole ones
            return float(count)
    return 0.0
