"""A command explained by the motion: a rough model of the axis, and lags."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from twin.checks import limits
from twin.signals import Array, sliding_products


@dataclass(frozen=True)
class Dynamics:
    """residual: (m,) command less the model, N, its first sample being number ``first``.

    explains: whether the model holds well. mass: kg, negative where the command is reversed.
    inertial_share: what acceleration makes of the command, RMS about its mean, as a part of it.
    """

    mass: float
    explains: bool
    inertial_share: float
    residual: Array
    first: int

    @property
    def mass_matters(self) -> bool:
        """Whether acceleration makes a part of the command worth the name."""
        return self.inertial_share > limits.NOTICED


def fit_dynamics(force: Array, regressors: Array, kept: Array, first: int) -> Dynamics:
    """Least trimmed squares of a force (m,) on regressors (m, k), the first the acceleration."""
    acceleration = np.abs(regressors[:, 0])
    use = (kept > 0.0) & (acceleration <= limits.LEVERAGE * np.quantile(acceleration, 0.99))
    size = np.sqrt(np.mean(regressors**2, axis=0))
    scaled = regressors / np.where(size > 0.0, size, 1.0)
    for _ in range(limits.ROUNDS):
        rows = scaled * use[:, None]
        gains = np.linalg.lstsq(rows.T @ scaled, rows.T @ force, rcond=1e-12)[0]
        residual = force - scaled @ gains
        error = np.abs(residual)
        use = (kept > 0.0) & (error <= np.quantile(error[kept > 0.0], 1.0 - limits.TRIMMED))
    spread = float(np.std(force[use]))
    inertial = float(np.std(gains[0] * scaled[use, 0]))
    return Dynamics(
        mass=float(gains[0] / size[0]) if size[0] > 0.0 else 0.0,
        explains=float(np.std(residual[use])) < limits.EXPLAINED * spread,
        inertial_share=inertial / spread if spread > 0.0 else 0.0,
        residual=residual,
        first=first,
    )


@dataclass(frozen=True)
class Lag:
    """seconds: positive where the signal is late. clear: whether another lag fits much worse."""

    seconds: float
    clear: bool


def find_lag(signal: Array, explained_by: Array, kept: Array, block: float) -> Lag:
    """Lag of ``signal`` (n,) for which regressors (n, k) explain most of it by least squares.

    kept: (n,) 1.0 where the regressors may be believed, else 0.0; block: s from sample to sample.
    """
    reach = min(round(limits.LONGEST_LAG / block), len(signal) // limits.MOTION_OVER_LAG)
    inner = slice(reach, len(signal) - reach)
    weights = kept[inner]
    columns = _unit_columns(explained_by[inner] * weights[:, None])
    inverse = np.linalg.pinv(columns.T @ columns, rcond=1e-12, hermitian=True)
    centred = signal - signal.mean()
    total = sliding_products(centred**2, weights)
    products = sliding_products(centred, columns.T)
    found = np.einsum("ij,ij->j", products, inverse @ products)
    residual = np.maximum(total - found, 0.0)
    dips = 1 + np.flatnonzero((residual[1:-1] <= residual[:-2]) & (residual[1:-1] < residual[2:]))
    if not len(dips):
        return Lag(0.0, False)
    # a dip lies between two samples: the parabola through three of them has its bottom there
    below, at, above = residual[dips - 1], residual[dips], residual[dips + 1]
    bend = below - 2.0 * at + above  # above 0, as a dip is lower than the one behind it
    fraction = 0.5 * (below - above) / bend
    bottom = np.maximum(at - 0.25 * (below - above) * fraction, 0.0)
    least = min(bottom.min(), residual.min())  # the latter where it falls to an end
    good = (bottom <= limits.AS_GOOD_LAG**2 * least) | (bottom <= limits.WRONG_LAG**2 * total[dips])
    if not good.any():
        return Lag(0.0, False)
    dips, fraction = dips[good], fraction[good]
    nearest = int(np.argmin(np.abs(dips - reach)))  # a periodic motion has several
    best, at = int(dips[nearest]), residual[dips[nearest]]
    clear = (
        at < limits.CLEAR_LAG**2 * total[best]
        and residual[reach] > limits.WRONG_LAG**2 * total[reach]
        and at < limits.BETTER_LAG**2 * residual[reach]
    )
    samples = float(best - reach + fraction[nearest])
    return Lag(
        samples * block, bool(clear) and abs(samples) <= limits.OF_A_PERIOD * _period(centred)
    )


@dataclass(frozen=True)
class Trend:
    """Lag in s over a log: its middle and how well that is known, its drift in s/s, likewise."""

    seconds: float
    error: float
    drift: float
    drift_error: float


def find_trend(signal: Array, explained_by: Array, kept: Array, block: float) -> Trend | None:
    """The lag in each part of a log; None where too few parts tell one."""
    edges = np.linspace(0, len(signal), limits.LAG_PARTS + 1).astype(int)
    found = []
    for first, last in pairwise(edges):
        part = slice(first, last)
        if kept[part].mean() > 0.5 and np.ptp(signal[part]) > limits.LIVELY_PART * np.ptp(signal):
            lag = find_lag(signal[part], explained_by[part], kept[part], block)
            found.append((0.5 * (first + last) * block, lag.seconds))
    if len(found) < limits.FEWEST_LAG_PARTS:
        return None
    times, lags = np.array(found).T
    times = times - times.mean()
    middle = float(np.median(lags))
    spread = 1.4826 * float(np.median(np.abs(lags - middle)))
    slopes = [
        (lags[j] - lags[i]) / (times[j] - times[i])
        for i in range(len(lags)) for j in range(i + 1, len(lags))
    ]  # fmt: skip
    drift = float(np.median(slopes))
    left = 1.4826 * float(np.median(np.abs(lags - middle - drift * times)))
    length = float(np.linalg.norm(times))
    return Trend(middle, 1.25 * spread / len(lags) ** 0.5, drift, 1.25 * left / length)


def _period(signal: Array) -> float:
    """Samples (inf where it does not) after which a signal (n,) of zero mean repeats itself."""
    half = len(signal) // 2
    power = np.concatenate([[0.0], np.cumsum(signal**2)])
    spectrum = np.fft.rfft(signal, 1 << (2 * len(signal) - 1).bit_length())
    total = np.fft.irfft(np.abs(spectrum) ** 2)[:half]
    lags = np.arange(half)
    overlap = np.sqrt((power[len(signal) - lags]) * (power[-1] - power[lags]))
    alike = total / np.maximum(overlap, np.finfo(float).tiny)
    below = np.flatnonzero(alike < 0.0)
    if not len(below):
        return float("inf")
    again = np.flatnonzero(alike[below[0] :] > limits.REPEATS)
    return float(below[0] + again[0]) if len(again) else float("inf")


def _unit_columns(matrix: Array) -> Array:
    length = np.linalg.norm(matrix, axis=0)
    return matrix / np.where(length > 0.0, length, 1.0)
