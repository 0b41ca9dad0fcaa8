"""Sampled signals: their rates, their smoothing, their white noise. One of each for all that asks.

``between`` is exact: over a sample the mean velocity is the difference of the positions at its
ends. ``rate`` keeps the instants. Local polynomials are for signals whose noise both would blow up.
The weak form (identify.dataset.test_function) differentiates its weight, not the signal.
scipy is imported where it is used, as checking a log, which needs none of it, starts without.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

_MEDIAN = 0.6745  # of the size of Gaussian noise, over its RMS


def between(signal: Array, period: float) -> Array:
    """Mean rate (..., n - 1) from each sample to the next, per s; period: s between samples."""
    return np.asarray(np.diff(signal) / period)


def rate(signal: Array, period: float) -> Array:
    """Rate (n,) at each sample, per s, from its two neighbours; at the ends from one."""
    return np.asarray(np.gradient(signal, period))


def local_parabola(
    signal: Array, samples: int, *, derivative: int = 0, period: float = 1.0
) -> Array:
    """Signal (..., n), or its derivative per s, of the parabola through ``samples`` around each.

    samples: odd, at most n; 1 takes each value as it is.
    """
    from scipy.signal import savgol_filter

    order = min(2, samples - 1)
    return np.asarray(savgol_filter(signal, samples, order, deriv=derivative, delta=period))


def local_cubic(signal: Array, period: float) -> tuple[Array, Array, Array]:
    """Value, rate and second rate (...) in the middle of a signal (n, ...), n odd, by one cubic."""
    from scipy.signal import savgol_coeffs

    value, first, second = (
        savgol_coeffs(len(signal), 3, deriv=k, delta=period, use="dot") @ signal for k in range(3)
    )
    return value, first, second


def usual_size(noise: Array) -> float:
    """RMS of Gaussian noise (n,) by the median of its size, which outliers do not move."""
    return float(np.median(np.abs(noise))) / _MEDIAN


def white_noise(signal: Array) -> float:
    """RMS of the white part of a smooth signal (n,): its fourth difference holds little else.

    The fourth difference of white noise is sqrt(70) times as large.
    """
    return usual_size(np.diff(signal, 4)) / 70**0.5


def sliding_products(signal: Array, pattern: Array) -> Array:
    """Product of a pattern (m,) with every stretch of a signal (n,), m <= n: (n - m + 1,)."""
    size = 1 << (len(signal) - 1).bit_length()
    spectrum = np.fft.rfft(signal, size) * np.conj(np.fft.rfft(pattern, size))
    return np.fft.irfft(spectrum, size)[: len(signal) - len(pattern) + 1]
