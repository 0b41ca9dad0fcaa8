"""A measured velocity beside the position: the motion that both tell together.

A drive's own velocity is often quieter than the difference of the readings that were logged, above
all where their time stamps jitter. Both tell the same motion, so that their difference holds the
noise of both and nothing else: white noise of the velocity, and that of the position, differenced.
The position p that both make most likely minimises

    sum((p_k - x_k)^2) + w sum((p_{k+1} - p_k - u_k dt)^2)

with w the variance of x over that of u dt, and solves a tridiagonal system. A velocity that is
late, as filtered ones are, is moved back first.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.dataset.spectrum import densities, pieces_of
from identify.dataset.test_function import TestFunction
from identify.dataset.whittle import fitted_levels
from twin.signals import Array, between, white_noise

LOOK = 0.05  # s, of the test functions by which velocity and position are compared
SEGMENT = 4096  # samples of the spectra at most; long, as a quiet velocity shows at low frequencies
FEWEST = 1024  # samples
ALIKE = 0.02  # largest relative difference of the two rates
LATEST = 0.01  # s, that the velocity may be late
INDEPENDENT = 0.5  # of the position's noise must show beside the velocity, which else is made of it


@dataclass(frozen=True, eq=False)
class Together:
    """Position (n,) m of position and velocity, and the weight w (1) that the velocity had."""

    position: Array
    weight: float


def together(position: Array, velocity: Array | None, period: float) -> Together:
    """The position (n,) m that readings and a velocity (n,) m/s tell; the readings where None.

    Also where the velocity does not fit the position, or was computed from it.
    """
    alone = Together(position, 0.0)
    if velocity is None or len(position) < FEWEST or not np.isfinite(velocity).all():
        return alone
    rate, mean = between(position, period), 0.5 * (velocity[1:] + velocity[:-1])
    look = TestFunction.of_length(max(LOOK, 8.0 * period), period)
    columns = np.stack([look.mean(mean), look.acceleration(mean)], axis=1)
    gain, late = np.linalg.lstsq(columns, look.mean(rate), rcond=None)[0]
    if abs(gain - 1.0) > ALIKE or abs(late) > LATEST:
        return alone
    at = np.arange(len(mean), dtype=float)
    on_time = gain * np.interp(at + late / gain / period, at, mean)
    weight = _weight(rate - on_time, period, white_noise(position))
    return Together(_most_likely(position, on_time * period, weight), weight) if weight else alone


def _weight(difference: Array, period: float, noise: float) -> float:
    """Variance of the position over that of the velocity's steps, from their difference m/s.

    0 where the difference does not show the position's own noise (m rms).
    """
    segment = min(SEGMENT, len(difference) // 4)
    pieces = pieces_of(difference - difference.mean(), segment)
    power = np.median(densities(pieces, period), axis=0)
    frequency = np.asarray(np.fft.rfftfreq(segment, period), dtype=float)
    beside = np.cos(np.pi * frequency * period) ** 2  # two velocities are averaged
    shapes = np.stack([beside, rate_gain(frequency, period)], axis=1)
    white, differenced = fitted_levels(shapes[1:-1], power[1:-1])
    shown = float(np.sqrt(differenced / (2.0 * period) / np.log(2.0)))
    if white <= 0.0 or shown < INDEPENDENT * noise:
        return 0.0
    return float(differenced / white) / period**2


def rate_gain(frequency: Array, period: float) -> Array:
    """Power gain (k,) 1/s^2 from a signal to its difference over one period."""
    return np.asarray((2.0 - 2.0 * np.cos(2.0 * np.pi * frequency * period)) / period**2)


def part_left(weight: float, frequency: Array, period: float) -> Array:
    """Power (k,) of the position's noise over that of the readings; 1 without a velocity."""
    heard = weight * rate_gain(frequency, period) * period**2
    # A step has the mean of two velocities, whose noise is less by the squared cosine.
    beside = np.cos(np.pi * frequency * period) ** 2
    return np.asarray((1.0 + heard * beside) / (1.0 + heard) ** 2)


def _most_likely(position: Array, steps: Array, weight: float) -> Array:
    """Position (n,) m of least squares by readings (n,) m and steps (n - 1,) m."""
    from scipy.linalg import solveh_banded  # only logs with a velocity need it

    middle = np.full(len(position), 1.0 + 2.0 * weight)
    middle[[0, -1]] = 1.0 + weight
    beside = np.full(len(position), -weight)
    wanted = position.copy()
    wanted[1:] += weight * steps
    wanted[:-1] -= weight * steps
    return np.asarray(solveh_banded(np.stack([beside, middle]), wanted))
