"""Signals made comparable by a low-pass, and a command explained by the motion, with its lag."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from twin.signals import Array, between, moving_mean, rate, sliding_products

UNUSUAL = 5.0  # times the level that 99 % of the samples stay below
KEPT_PART = 0.2  # of a part, that moves for it to tell a lag; of moves with pauses half is rest
WRONG_LAG = 0.03  # least residual without a lag, as a part of the signal


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
        block = 1e-3  # s: what is faster is noise to an identification of friction
        return max(round(block / self.period), 1)

    @property
    def block(self) -> float:
        """Length of a block in s."""
        return self.samples * self.period

    @cached_property
    def weights(self) -> Array:
        """(w,) weights (1 - r^2)^2 of the low-pass, of unit sum."""
        # s, full length; shorter, the noise of usual encoders hides the acceleration
        window = 20e-3
        fewest_blocks = 8  # in a window, so that its shape is smooth at any rate
        count = max(round(window / self.block), fewest_blocks) | 1
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
        return np.asarray((index + 0.5 * len(self.weights)) * self.block, float)

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

    explains: whether the model holds well. mass: kg, negative where the command is reversed; None
    where acceleration is a sum of the other regressors, as of a sine it is of the position.
    inertial_share: what acceleration makes of the command, RMS about its mean, as a part of it.
    """

    mass: float | None
    explains: bool
    inertial_share: float
    residual: Array
    first: int

    @property
    def mass_matters(self) -> bool:
        """Whether acceleration makes a part of the command worth the name."""
        return self.inertial_share > 0.3  # share of mass x acceleration in the command


def contradicted(error: Array, force: Array, rare: float) -> float:
    """What an error (n,) N of a force (n,) must exceed to be unusual, which a rare part may be."""
    size = float(np.quantile(np.abs(force - np.median(force)), 0.99))
    usual = float(np.quantile(error, 1.0 - rare))
    return max(UNUSUAL * usual, 0.1 * size)  # least contradiction, as a part of the command


def fit_dynamics(force: Array, regressors: Array, kept: Array, first: int, rare: float) -> Dynamics:
    """Least squares of a force (m,) on regressors (m, k), the first the acceleration.

    Where samples contradict the others, the worst are left out, and no others: in a log of constant
    speeds a few samples hold all the acceleration there is. rare: part of the log that they may be.
    """
    use = kept > 0.0
    size = np.sqrt(np.mean(regressors**2, axis=0))
    scaled = regressors / np.where(size > 0.0, size, 1.0)
    gains, residual = _squares(force, scaled, use)
    error = np.abs(residual[use])
    if error.max(initial=0.0) > contradicted(error, force[use], rare):
        acceleration = np.abs(regressors[:, 0])
        leverage = 3.0  # times the acceleration that 99 % of the samples stay below
        use &= acceleration <= leverage * np.quantile(acceleration, 0.99)
        for _ in range(4):  # of such a fit, after which the samples left out stay the same
            gains, residual = _squares(force, scaled, use)
            error = np.abs(residual)
            trimmed = 0.05  # share of the samples that a fit leaves out
            use = (kept > 0.0) & (error <= np.quantile(error[kept > 0.0], 1.0 - trimmed))
    spread = float(np.std(force[use]))
    explains = float(np.std(residual[use])) < 0.3 * spread  # residual as a part of the command
    mass = float(gains[0] / size[0]) if size[0] > 0.0 else 0.0
    share = float(np.std(gains[0] * scaled[use, 0])) / spread if spread > 0.0 else 0.0
    told = _is_independent(scaled[use])
    return Dynamics(mass if told else None, explains, share, residual, first)


def _is_independent(scaled: Array) -> bool:
    """Whether the first of some columns (m, k) is none of the sums of the others."""
    first, others = scaled[:, 0], scaled[:, 1:]
    left = first - others @ np.linalg.lstsq(others, first, rcond=1e-12)[0]
    # 0.1 of it, RMS: less is what friction that the check does not know makes as well
    return bool(np.linalg.norm(left) > 0.1 * np.linalg.norm(first))


def _squares(force: Array, columns: Array, use: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Gains (k,) of columns (m, k) in the samples of a force (m,) in use, and all that is left."""
    rows = columns * use[:, None]
    gains = np.asarray(np.linalg.lstsq(rows.T @ columns, rows.T @ force, rcond=1e-12)[0], float)
    return gains, force - columns @ gains


def find_lag(signal: Array, explained_by: Array, kept: Array, block: float) -> tuple[float, bool]:
    """Lag (s) of ``signal`` (n,) for which regressors (n, k) explain most, and if it is clear.

    It is where another fits much worse. kept: (n,) 1.0 where the regressors may be believed, else
    0.0; block: s from sample to sample.
    """
    total, left = _left_at(signal, explained_by, kept, block)
    samples, reach = _least_lag(total, left), len(left) // 2
    best = reach + round(samples)
    clear_lag = 0.5  # largest residual at the best lag, as a part of the signal
    better_lag = 0.6  # largest residual at the best lag, as a part of that without a lag
    # lags beyond that part of a period are told from none by the harmonics alone
    of_a_period = 0.125
    clear = (
        left[best] < clear_lag**2 * total[best]
        and left[reach] > WRONG_LAG**2 * total[reach]
        and left[best] < better_lag**2 * left[reach]
        and abs(samples) <= of_a_period * _period(signal - signal.mean())
    )
    return samples * block, bool(clear)


def slower_refutes(
    lag: float, signal: Array, explained_by: Array, kept: Array, smoother: Smoother
) -> bool:
    """Whether slower motion is explained better without a lag (s) than with it.

    A delay delays all motion; what a loop answers to a disturbance is late at its frequency alone.
    Arrays as in ``find_lag``.
    """
    better = 0.7  # times what the lag leaves: less than that is no matter of noise
    for slower in (2, 4, 8):  # times the low-pass that the signals went through
        count = (slower * len(smoother.weights)) | 1
        whole = (_twice_smoothed(kept, count) > 1.0 - 1e-9).astype(float)
        if np.mean(whole) < KEPT_PART:
            break
        columns = np.stack([_twice_smoothed(c, count) for c in explained_by.T], axis=1)
        _, left = _left_at(_twice_smoothed(signal, count), columns, whole, smoother.block)
        reach, at = len(left) // 2, round(lag / smoother.block)
        if abs(at) <= reach and left[reach] < better**2 * left[reach + at]:
            return True
    return False


def _twice_smoothed(signal: Array, count: int) -> Array:
    return moving_mean(moving_mean(signal, count), count)


def _left_at(signal: Array, explained_by: Array, kept: Array, block: float) -> tuple[Array, Array]:
    """Power (2 r + 1,) of a signal at each lag from -r to r blocks, and what is left of it."""
    longest_lag = 0.25  # s, searched both ways
    # least length of the log over the longest lag, so that it holds several moves
    motion_over_lag = 20
    reach = min(round(longest_lag / block), len(signal) // motion_over_lag)
    inner = slice(reach, len(signal) - reach)
    columns = explained_by[inner] * kept[inner, None]
    length = np.linalg.norm(columns, axis=0)
    columns = columns / np.where(length > 0.0, length, 1.0)
    inverse = np.linalg.pinv(columns.T @ columns, rcond=1e-12, hermitian=True)
    centred = signal - signal.mean()
    total = sliding_products(centred**2, kept[inner])
    products = sliding_products(centred, columns.T)
    return total, np.maximum(total - np.einsum("ij,ij->j", products, inverse @ products), 0.0)


def _least_lag(total: Array, left: Array) -> float:
    """The least lag, in blocks, at which as little is left as anywhere; 0 where there is none."""
    dips, fraction, bottom = _dips(left)
    least = min(bottom.min(initial=np.inf), left.min())  # the latter where it falls to an end
    as_good_lag = 1.5  # times the least residual: lags up to it count as equally good
    good = (bottom <= as_good_lag**2 * least) | (bottom <= WRONG_LAG**2 * total[dips])
    if not good.any():
        return 0.0
    lags = dips[good] - len(left) // 2
    nearest = int(np.argmin(np.abs(lags)))  # a periodic motion has several
    return float(lags[nearest] + fraction[good][nearest])


def _dips(residual: Array) -> tuple[NDArray[np.intp], Array, Array]:
    """Samples (k,) of the dips; of the parabola through each the place, in samples, and height."""
    dips = 1 + np.flatnonzero((residual[1:-1] <= residual[:-2]) & (residual[1:-1] < residual[2:]))
    below, at, above = residual[dips - 1], residual[dips], residual[dips + 1]
    bend = below - 2.0 * at + above  # above 0, as a dip is lower than the one behind it
    fraction = 0.5 * (below - above) / bend
    return dips, fraction, np.maximum(at - 0.25 * (below - above) * fraction, 0.0)


@dataclass(frozen=True)
class Trend:
    """Lag in s over a log: its middle and how well that is known, its drift in s/s, likewise.

    left: N rms that the motion leaves of the command at no lag, at the middle one, and at one that
    drifts.
    """

    seconds: float
    error: float
    drift: float
    drift_error: float
    left: tuple[float, float, float]


def find_trend(signal: Array, explained_by: Array, kept: Array, block: float) -> Trend | None:
    """The lag in each part of a log; None where too few parts tell one."""
    edges = np.linspace(0, len(signal), 8 + 1).astype(int)  # of a log, each with a lag of its own
    lively = 0.04 * np.ptp(signal)  # least range of a part, of that of the whole
    every = [slice(first, last) for first, last in pairwise(edges)]
    parts = [p for p in every if kept[p].mean() > KEPT_PART and np.ptp(signal[p]) > lively]
    if len(parts) < 5:  # lively ones, of which a median is worth the name
        return None
    curves = [_left_at(signal[p], explained_by[p], kept[p], block) for p in parts]
    lags = block * np.array([_least_lag(total, left) for total, left in curves])
    times = np.array([0.5 * (p.start + p.stop) * block for p in parts])
    times = times - times.mean()
    middle = float(np.median(lags))
    spread = 1.4826 * float(np.median(np.abs(lags - middle)))
    pairs = combinations(range(len(lags)), 2)
    drift = float(np.median([(lags[j] - lags[i]) / (times[j] - times[i]) for i, j in pairs]))
    apart = 1.4826 * float(np.median(np.abs(lags - middle - drift * times)))
    reach = len(curves[0][1]) // 2
    count = sum(np.count_nonzero(kept[p][reach : len(kept[p]) - reach]) for p in parts)

    def left(of_each: Array) -> float:
        power = sum(_between(curves[i][1], lag) for i, lag in enumerate(of_each / block))
        return float((power / max(count, 1)) ** 0.5)

    none, steady = np.zeros(len(times)), np.full(len(times), middle)
    remain = (left(none), left(steady), left(steady + drift * times))
    error = 1.25 * spread / len(lags) ** 0.5
    return Trend(middle, error, drift, 1.25 * apart / float(np.linalg.norm(times)), remain)


def _between(curve: Array, lag: float) -> float:
    """A curve over the lags (2 r + 1,), by the parabola about the sample next to a lag."""
    place = lag + len(curve) // 2
    at = min(max(round(place), 1), len(curve) - 2)
    part, below, above = place - at, curve[at - 1], curve[at + 1]
    bend = above - 2.0 * curve[at] + below
    return max(float(curve[at] + 0.5 * part * (above - below + part * bend)), 0.0)


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
    repeats = 0.7  # least correlation of a signal with itself a period later
    again = np.flatnonzero(apart & (alike > repeats))
    return float(again[0]) if len(again) else float("inf")
