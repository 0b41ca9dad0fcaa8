"""The static part of a friction: a Stribeck curve through a velocity-friction map.

F(v) = Fc + (Fs - Fc) exp(-(v/v0)^n) + sigma2 v for v > 0; L. Jia 2023, eq. 2.5, with its start
rules: Fc is the least friction, v0 the speed there, Fs the friction at the lowest speed, sigma2 the
slope from the least friction to that at the highest speed. Noise at high speeds can put the least
friction far from the Stribeck velocity, so the search also begins from parts of that speed.
"""

from __future__ import annotations

from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from identify.estimation.levenberg_marquardt import minimise
from twin.errors import InputError

Array = NDArray[np.float64]

TOLERANCE = 1e-14  # of the sum of squares: the map of a simulation has hardly any noise
MOST_EVALUATIONS = 200
PARTS = (1.0, 0.3, 0.1)  # of the start rule's v0, from which the search begins
SLOWEST = 1e-3  # of the lowest speed, least Stribeck velocity that is tried


@dataclass(frozen=True)
class StribeckCurve:
    """Fc, Fs in N, v0 in m/s, sigma2 in N s/m; the exponent n is given."""

    Fc: float
    Fs: float
    v0: float
    sigma2: float
    n: float = 2.0

    def __call__(self, speed: Array) -> Array:
        """Friction (k,) N at speeds (k,) m/s."""
        fall = np.exp(-((speed / self.v0) ** self.n))
        return np.asarray(self.Fc + (self.Fs - self.Fc) * fall + self.sigma2 * speed)

    def slopes(self, speed: Array) -> Array:
        """Derivative (k, 4) of the friction by Fc, Fs, v0, sigma2."""
        depth = (speed / self.v0) ** self.n
        fall = np.exp(-depth)
        by_v0 = (self.Fs - self.Fc) * fall * self.n * depth / self.v0
        return np.stack([1.0 - fall, fall, by_v0, speed], axis=1)


def start_rule(speed: Array, friction: Array, n: float = 2.0) -> StribeckCurve:
    """The thesis's start values from a map: speeds (k,) m/s and friction (k,) N, k >= 2."""
    least, highest = int(np.argmin(friction)), int(np.argmax(speed))
    run = speed[highest] - speed[least]
    slope = (friction[highest] - friction[least]) / run if run > 0.0 else 0.0
    return StribeckCurve(
        Fc=float(friction[least]),
        Fs=float(friction[np.argmin(speed)]),
        v0=float(speed[least]),
        sigma2=float(max(slope, 0.0)),
        n=n,
    )


def fit_stribeck(
    speed: Array, friction: Array, weight: Array | None = None, n: float = 2.0
) -> StribeckCurve:
    """The curve through a map by Levenberg-Marquardt from the start rules.

    speed (k,) m/s > 0, friction (k,) N, weight (k,) 1/N or None for equal ones. Raises InputError
    for fewer speeds than parameters.
    """
    if len(np.unique(speed)) < 4:
        raise InputError(
            f"a Stribeck curve has four parameters, the map {len(np.unique(speed))} speeds; give "
            "a log with more speeds"
        )
    scale = np.ones_like(speed) if weight is None else weight
    start = np.array(astuple(start_rule(speed, friction, n))[:4])

    def residual(x: Array) -> Array:
        return np.asarray(scale * (_curve(x, n)(speed) - friction))

    def jacobian(x: Array) -> Array:
        return np.asarray(scale[:, None] * _curve(x, n).slopes(speed))

    low = np.array([0.0, 0.0, SLOWEST * speed.min(), 0.0])
    high = np.array([np.inf, np.inf, 10.0 * speed.max(), np.inf])
    ends = [
        minimise(
            residual, jacobian, start * (1.0, 1.0, part, 1.0), (low, high),
            tolerance=TOLERANCE, most_evaluations=MOST_EVALUATIONS,
        ).x
        for part in PARTS
    ]  # fmt: skip
    return _curve(min(ends, key=lambda x: float(np.sum(residual(x) ** 2))), n)


def _curve(x: Array, n: float) -> StribeckCurve:
    coulomb, static, stribeck, viscous = map(float, x)
    return StribeckCurve(coulomb, static, stribeck, viscous, n)
