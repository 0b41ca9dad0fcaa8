"""The curve through one direction of a velocity-friction map, with intervals of its parameters.

F(v) = Fc + (Fs - Fc) exp(-(v/v0)^n) + sigma2 v for v > 0; L. Jia 2023, eq. 2.5, with its start
rules: Fc is the least friction, v0 the speed there, Fs the friction at the lowest speed, sigma2 the
slope from the least friction to that at the highest speed. Noise at high speeds can put the least
friction far from the Stribeck velocity, so the search also begins from parts of that speed.

The Stribeck curve is taken where the map asks for it by evidence, else a straight line of Coulomb
and viscous friction: a few fast speeds say nothing of a Stribeck velocity.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import astuple, dataclass

import numpy as np

from identify.estimation.evidence import evidence
from identify.estimation.intervals import CONFIDENCE_LEVEL
from identify.estimation.least_squares import minimise
from twin.errors import InputError
from twin.signals import Array

NAMES = ("Fc", "Fs", "v0", "sigma2")
LINE = ("Fc", "sigma2")


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


@dataclass(frozen=True, eq=False)
class MapCurve:
    """The curve, and half widths of the 90 % intervals of the parameters that were fitted."""

    curve: StribeckCurve
    half: Mapping[str, float]

    @property
    def values(self) -> dict[str, float]:
        """What was fitted, by name."""
        return {name: getattr(self.curve, name) for name in self.half}

    def __call__(self, speed: Array) -> Array:
        """Friction (k,) N at speeds (k,) m/s."""
        return self.curve(speed)


def curve_through(speed: Array, friction: Array, samples: Array) -> MapCurve:
    """The curve through plateaus in one direction: speed (k,) m/s, friction (k,) N, samples (k,).

    Raises InputError for fewer than two speeds, or no more plateaus than parameters.
    """
    rising = np.sort(speed)
    alike = 0.02  # of a speed, within which two plateaus count as one speed
    speeds = 1 + int(np.sum(np.diff(rising) > alike * rising[1:])) if len(rising) else 0
    if speeds < 2 or len(speed) <= len(LINE):
        raise InputError(
            f"the map holds {len(speed)} plateaus at {speeds} "
            f"speed{'' if speeds == 1 else 's'} in one direction; a curve needs three at two "
            "speeds, and a Stribeck curve six speeds or more"
        )
    weight = np.sqrt(samples)
    rows = weight[:, None] * np.stack([np.ones_like(speed), speed], axis=1)
    (level, slope), *_ = np.linalg.lstsq(rows, weight * friction, rcond=None)
    line = StribeckCurve(float(level), float(level), float(speed.min()), float(slope))
    curve, names = line, list(LINE)
    if speeds > len(NAMES) + 1:
        stribeck = fit_stribeck(speed, friction, weight)
        before, after = (weight * (found(speed) - friction) for found in (line, stribeck))
        if evidence(before, after, len(NAMES) - len(LINE)).delta_bic > 0.0:
            curve, names = stribeck, list(NAMES)
    return _with_intervals(curve, names, speed, friction, samples)


def stribeck_through(speed: Array, friction: Array, samples: Array) -> MapCurve:
    """The Stribeck curve through plateaus in one direction, whether they ask for it or not."""
    curve = fit_stribeck(speed, friction, np.sqrt(samples))
    return _with_intervals(curve, list(NAMES), speed, friction, samples)


def _with_intervals(
    curve: StribeckCurve, names: list[str], speed: Array, friction: Array, samples: Array
) -> MapCurve:
    """Half widths by the scatter of the plateaus about the curve."""
    from scipy.special import stdtrit  # no fit needs it

    weight = np.sqrt(samples)
    slopes = dict(zip(NAMES, curve.slopes(speed).T, strict=True))
    if "Fs" not in names:  # there Fs is Fc
        slopes["Fc"] = slopes["Fc"] + slopes["Fs"]
    columns = weight[:, None] * np.stack([slopes[n] for n in names], axis=1)
    left, freedom = weight * (curve(speed) - friction), len(speed) - len(names)
    covariance = np.linalg.pinv(columns.T @ columns) * float(left @ left) / freedom
    quantile = float(stdtrit(freedom, 0.5 + CONFIDENCE_LEVEL / 2.0))
    half = (quantile * np.sqrt(np.diag(covariance))).tolist()
    return MapCurve(curve, dict(zip(names, half, strict=True)))


def start_rule(speed: Array, friction: Array) -> StribeckCurve:
    """The thesis's start values from a map: speeds (k,) m/s and friction (k,) N, k >= 2."""
    least, highest = int(np.argmin(friction)), int(np.argmax(speed))
    run = speed[highest] - speed[least]
    slope = (friction[highest] - friction[least]) / run if run > 0.0 else 0.0
    static = float(friction[np.argmin(speed)])
    return StribeckCurve(
        float(friction[least]), static, float(speed[least]), float(max(slope, 0.0))
    )


def fit_stribeck(speed: Array, friction: Array, weight: Array | None = None) -> StribeckCurve:
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
    start = np.array(astuple(start_rule(speed, friction))[:4])

    def residual(x: Array) -> Array:
        return np.asarray(scale * (StribeckCurve(*x)(speed) - friction))

    slowest = 1e-3  # of the lowest speed, least Stribeck velocity that is tried
    low = np.array([0.0, 0.0, slowest * speed.min(), 0.0])
    high = np.array([np.inf, np.inf, 10.0 * speed.max(), np.inf])
    ends = [
        minimise(
            residual, lambda x: scale[:, None] * StribeckCurve(*x).slopes(speed),
            start * (1.0, 1.0, part, 1.0), (low, high),
        ).x
        for part in (1.0, 0.3, 0.1)  # of the start rule's v0, from which the search begins
    ]  # fmt: skip
    return StribeckCurve(*min(ends, key=lambda x: float(np.sum(residual(x) ** 2))))
