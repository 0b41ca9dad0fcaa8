"""Evidence for a larger model: BIC on the effective sample size, and errors by blocks of time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from statistics import NormalDist

import numpy as np

from identify.estimation.least_squares import RIDGE, ROUNDING, solve
from twin.signals import Array

BLOCKS = 24  # of time, for a standard error: many for Student's t, each longer than the memory
SURE = 3.0  # standard errors from which a value is the data's: of noise one in 700 is as far off
AT_ONCE = 16  # columns of whole logs at once: they are most of the memory
BETTER = 0.99  # of an error, from which another one is hardly better


def rms(values: Array) -> float:
    """Root of the mean square; infinite of a motion without end, no number of no values."""
    with np.errstate(over="ignore"):
        return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


def effective_samples(residual: Array) -> float:
    """Effective sample size of a coloured residual.

    n / (1 + 2 sum rho_k), summed while pairs of autocorrelations stay positive (C. J. Geyer,
    "Practical Markov chain Monte Carlo", Stat. Sci. 7, 1992).
    """
    n = len(residual)
    return float(max(n / samples_alike(colour_of(residual)), min(2.0, max(n, 1))))


def samples_alike(colour: Array) -> float:
    """How many samples of a residual tell as much as one: by its autocorrelations (m,)."""
    return max(2.0 * float(colour.sum()) - 1.0, 1.0)


def colour_of(residual: Array) -> Array:
    """Autocorrelations (m,) of a residual (n,) N, 1 first, while pairs of them stay positive."""
    n = len(residual)
    centred = residual - residual.mean() if n else residual
    if n < 4 or not centred.any():
        return np.ones(1)
    size = _padded(n)
    spectrum = np.abs(np.fft.rfft(centred, size)) ** 2
    rho = np.fft.irfft(spectrum, size)[: n // 2]
    rho = rho / rho[0]
    pairs = rho[: len(rho) // 2 * 2].reshape(-1, 2).sum(axis=1)
    stop = np.argmax(pairs <= 0.0) if (pairs <= 0.0).any() else len(pairs)
    return np.asarray(rho[: max(2 * stop, 1)])


def _padded(count: int) -> int:
    """Samples of a fast transform in which so many do not meet themselves."""
    return 1 << (2 * count - 1).bit_length()


def taken_by_lag(columns: Array, penalty: Array) -> Array:
    """Part of the square of noise that columns (n, k) take, by the lag (n,) of what they take.

    penalty (k, k): of what is smoothed. For lag j tr((C'C + S)^-1 C' D_j C) / n, D_j a shift by j
    samples; see ``by_chance``.
    """
    count, gram = len(columns), columns.T @ columns
    size = np.sqrt(np.where(np.diag(gram) > 0.0, np.diag(gram), 1.0))
    squares, ways = np.linalg.eigh((gram + penalty) / np.outer(size, size))
    apart = squares > ROUNDING * len(size)  # a column that others hold adds nothing
    independent = ways[:, apart] / np.sqrt(squares[apart]) / size[:, None]
    padded, power = _padded(count), np.zeros(_padded(count) // 2 + 1)
    for some in range(0, independent.shape[1], AT_ONCE):
        forces = columns @ independent[:, some : some + AT_ONCE]
        power += np.sum(np.abs(np.fft.rfft(forces.T, padded)) ** 2, axis=0)
    return np.asarray(np.fft.irfft(power, padded)[:count]) / count


def by_chance(by_lag: Array, colour: Array) -> float:
    """Part of the square of noise that is taken on average, where nothing is to be had.

    by_lag (n,): as ``taken_by_lag`` has it. colour (m,): autocorrelations of the noise, m at most
    n; of white noise it is the part of effective parameters in the samples. The mean of a quadratic
    form of noise of covariance R: tr((C'C + S)^-1 C'RC) / n.
    """
    return float(2.0 * colour @ by_lag[: len(colour)] - by_lag[0])


@dataclass(frozen=True)
class Evidence:
    """Evidence for a larger model.

    log_gain: logarithm of the squared error before over after. parameters: how many were added.
    samples: effective sample size of the residual.
    """

    log_gain: float
    parameters: int
    samples: float

    @property
    def delta_bic(self) -> float:
        """BIC before minus BIC after the addition; positive supports it."""
        return float(self.samples * self.log_gain - self.parameters * np.log(self.samples))


def evidence(before: Array, after: Array, parameters: int) -> Evidence:
    """Evidence from residuals before and after (n,) N on the same samples."""
    tiny = np.finfo(float).tiny
    gain = np.log(max(np.sum(before**2), tiny) / max(np.sum(after**2), tiny))
    return Evidence(float(gain), parameters, effective_samples(after))


@dataclass(frozen=True)
class Gain:
    """Held-out errors (RMS N) before and after, and the gain's t value across blocks.

    typical: part of the squared error of a typical block that is left; see held_out_gain.
    """

    before: float
    after: float
    t: float
    typical: float = 1.0

    @property
    def left(self) -> float:
        """Part of the squared error that is left."""
        return (self.after / self.before) ** 2 if self.before > 0.0 else 1.0


def held_out_gain(before: Array, after: Array, floor: float) -> Gain:
    """Compare two models on the same selection residual samples (n,) N, with noise floor (N).

    t and the typical part are those of the logarithm of squared error plus squared floor, block by
    block, so that a few blocks with large errors do not decide alone.
    """
    if not len(before):  # at rest within every test function
        return Gain(np.nan, np.nan, 0.0)
    spans = blocks_of(len(before))
    sums = [[np.sum(r[span] ** 2 + floor**2) for span in spans] for r in (before, after)]
    gains = np.log(sums[0]) - np.log(sums[1])
    spread = gains.std(ddof=1) / np.sqrt(len(spans)) if len(spans) > 1 else np.inf
    t = gains.mean() / spread if spread > 0 else 0.0
    typical = float(np.exp(-gains.mean()))
    return Gain(rms(before), rms(after), float(t), typical)


def noise_gain(residual: Array, before: float, after: float) -> float:
    """Twice the gain in log likelihood per sample by another noise level, for a residual (n,) N.

    before, after: expected noise, N RMS.
    """
    power = np.mean(residual**2)
    return float(power / before**2 - power / after**2 - 2.0 * np.log(after / before))


def left_out(residual: Array, columns: Array, penalty: Array | float = 0.0) -> Array:
    """Residual (n,) by cross-validation: each block predicted by a fit to the other blocks.

    Exact for a model linear in its parameters, with columns (n, k): (I - H_bb)^-1 r_b with the hat
    matrix H. penalty (k, k): of what is smoothed; a weak one on all keeps the inverse finite.
    """
    spans = blocks_of(len(residual))
    grams, pulls = by_blocks(columns, columns, spans), by_blocks(columns, residual, spans)
    whole = grams.sum(axis=0)
    weak = RIDGE**2 * np.diag(np.diag(whole))
    moves = solve(whole - grams + weak + penalty, pulls[..., None])[..., 0]
    steps = (columns[span] @ move for span, move in zip(spans, moves, strict=True))
    return residual + np.concatenate([*steps, np.zeros(0)])


def by_blocks(left: Array, right: Array, blocks: Sequence[slice]) -> Array:
    """Inner products (b, p, q) of columns (n, p) and (n, q), or (b, p) with one (n,), by blocks."""
    return np.stack([left[span].T @ right[span] for span in blocks])


def blocks_of(count: int) -> list[slice]:
    """Samples of each block, all of about equal length, fewer where there are fewer samples."""
    edges = np.linspace(0, count, min(BLOCKS, count) + 1).astype(int)
    return [slice(a, b) for a, b in pairwise(edges)]


def students_t(chance: float, freedom: int) -> float:
    """Quantile of Student's t that is exceeded with a chance, for 8 degrees of freedom and more.

    To 1 in 1000: R. A. Fisher, E. A. Cornish, Technometrics 2 (1960); SciPy takes as long to load
    as a fit to run.
    """
    z = NormalDist().inv_cdf(1.0 - chance)
    # coefficients of the expansion in 1/freedom
    first, second = (z**3 + z) / 4.0, (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / 96.0
    # the next of them
    third = (3.0 * z**7 + 19.0 * z**5 + 17.0 * z**3 - 15.0 * z) / 384.0
    return z + first / freedom + second / freedom**2 + third / freedom**3
