"""Signals made comparable by a low-pass, and a command explained by the motion, with its lag."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from twin.checks import limits
from twin.signals import Array, between, rate, sliding_products


@dataclass(frozen=True)
class Smoother:
    """Low-pass of signals sampled every ``period`` (s), by which all are put on one slow clock.

    Blocks of whole samples keep position and held command aligned: over a block the command acts,
    the mean velocity is the difference of the positions at its two ends.
    """

    period: float

    @cached_property
    def samples(self) -> int:
        """Samples in a block."""
        return max(round(limits.BLOCK / self.period), 1)

    @property
    def block(self) -> float:
        """Length of a block in s."""
        return self.samples * self.period

    @cached_property
    def weights(self) -> Array:
        """(w,) weights (1 - r^2)^2 of the low-pass, of unit sum."""
        count = max(round(limits.WINDOW / self.block), limits.FEWEST_BLOCKS) | 1
        r = (2.0 * np.arange(count) - (count - 1)) / (count + 1)
        phi = (1.0 - r**2) ** 2
        return np.asarray(phi / phi.sum())

    @property
    def length(self) -> float:
        """Length of the low-pass in s."""
        return len(self.weights) * self.block

    def position(self, x: Array) -> Array:
        """Position (n,) -> low-passed, in the middle of each block (m,)."""
        edges = x[:: self.samples]
        return self._low_pass(0.5 * (edges[1:] + edges[:-1]))

    def velocity(self, x: Array) -> Array:
        """Position (n,) -> low-passed velocity (m,)."""
        return self._low_pass(self._block_velocity(x))

    def acceleration(self, x: Array) -> Array:
        """Position (n,) -> low-passed acceleration (m,); the ends repeat their neighbours."""
        return self._low_pass(rate(self._block_velocity(x), self.block))

    def direction(self, x: Array, slow: float) -> Array:
        """Position (n,) -> low-passed sign of the velocity (m,), rounded off below ``slow``."""
        return self._low_pass(np.tanh(self._block_velocity(x) / slow))

    def held(self, u: Array) -> Array:
        """Signal held over each sample (n,) -> low-passed (m,)."""
        count = (len(u) - 1) // self.samples
        means = u[: count * self.samples].reshape(count, self.samples).mean(axis=1)
        return self._low_pass(means)

    def rate(self, v: Array) -> Array:
        """Signal read at each sample (n,) -> low-passed mean over each block (m,)."""
        return self.held(0.5 * (v + np.append(v[1:], v[-1])))

    def time(self, index: NDArray[np.intp]) -> Array:
        """Times (k,) in s of the middle of low-passed samples ``index`` (k,)."""
        return np.asarray((index + 0.5 * len(self.weights)) * self.block)

    def held_noise(self, noise: float) -> float:
        """Noise of ``held`` where that of the signal is white, of rms ``noise``."""
        return float(noise / self.samples**0.5 * np.linalg.norm(self.weights))

    def velocity_noise(self, noise: float) -> float:
        """Noise of ``velocity`` where that of the position is white, of rms ``noise``."""
        return float(noise / self.block * np.linalg.norm(np.convolve(self.weights, [1.0, -1.0])))

    def acceleration_noise(self, noise: float) -> float:
        """Noise of ``acceleration``, likewise."""
        kernel = np.convolve(np.convolve(self.weights, [1.0, -1.0]), [0.5, 0.0, -0.5])
        return float(noise / self.block**2 * np.linalg.norm(kernel))

    def _block_velocity(self, x: Array) -> Array:
        return between(x[:: self.samples], self.block)

    def _low_pass(self, signal: Array) -> Array:
        return np.convolve(signal, self.weights, "valid")


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
    explains = float(np.std(residual[use])) < limits.EXPLAINED * spread
    mass = float(gains[0] / size[0]) if size[0] > 0.0 else 0.0
    share = float(np.std(gains[0] * scaled[use, 0])) / spread if spread > 0.0 else 0.0
    return Dynamics(mass, explains, share, residual, first)


def find_lag(signal: Array, explained_by: Array, kept: Array, block: float) -> tuple[float, bool]:
    """Lag (s) of ``signal`` (n,) for which regressors (n, k) explain most, and if it is clear.

    It is where another fits much worse. kept: (n,) 1.0 where the regressors may be believed, else
    0.0; block: s from sample to sample.
    """
    reach = min(round(limits.LONGEST_LAG / block), len(signal) // limits.MOTION_OVER_LAG)
    inner = slice(reach, len(signal) - reach)
    columns = explained_by[inner] * kept[inner, None]
    length = np.linalg.norm(columns, axis=0)
    columns = columns / np.where(length > 0.0, length, 1.0)
    inverse = np.linalg.pinv(columns.T @ columns, rcond=1e-12, hermitian=True)
    centred = signal - signal.mean()
    total = sliding_products(centred**2, kept[inner])
    products = sliding_products(centred, columns.T)
    residual = np.maximum(total - np.einsum("ij,ij->j", products, inverse @ products), 0.0)
    dips, fraction, bottom = _dips(residual)
    least = min(bottom.min(initial=np.inf), residual.min())  # the latter where it falls to an end
    good = (bottom <= limits.AS_GOOD_LAG**2 * least) | (bottom <= limits.WRONG_LAG**2 * total[dips])
    if not good.any():
        return 0.0, False
    nearest = int(np.argmin(np.abs(dips[good] - reach)))  # a periodic motion has several
    best = int(dips[good][nearest])
    samples = float(best - reach + fraction[good][nearest])
    clear = (
        residual[best] < limits.CLEAR_LAG**2 * total[best]
        and residual[reach] > limits.WRONG_LAG**2 * total[reach]
        and residual[best] < limits.BETTER_LAG**2 * residual[reach]
        and abs(samples) <= limits.OF_A_PERIOD * _period(centred)
    )
    return samples * block, bool(clear)


def _dips(residual: Array) -> tuple[NDArray[np.intp], Array, Array]:
    """Samples (k,) of the dips; of the parabola through each the place, in samples, and height."""
    dips = 1 + np.flatnonzero((residual[1:-1] <= residual[:-2]) & (residual[1:-1] < residual[2:]))
    below, at, above = residual[dips - 1], residual[dips], residual[dips + 1]
    bend = below - 2.0 * at + above  # above 0, as a dip is lower than the one behind it
    fraction = 0.5 * (below - above) / bend
    return dips, fraction, np.maximum(at - 0.25 * (below - above) * fraction, 0.0)


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
            lag, _ = find_lag(signal[part], explained_by[part], kept[part], block)
            found.append((0.5 * (first + last) * block, lag))
    if len(found) < limits.FEWEST_LAG_PARTS:
        return None
    times, lags = np.array(found).T
    times = times - times.mean()
    middle = float(np.median(lags))
    spread = 1.4826 * float(np.median(np.abs(lags - middle)))
    pairs = combinations(range(len(lags)), 2)
    drift = float(np.median([(lags[j] - lags[i]) / (times[j] - times[i]) for i, j in pairs]))
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
    apart = np.logical_or.accumulate(alike < 0.0)  # from where it is another for the first time
    again = np.flatnonzero(apart & (alike > limits.REPEATS))
    return float(again[0]) if len(again) else float("inf")
