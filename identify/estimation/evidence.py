"""Evidence for a larger model: BIC on the effective sample size, and selection error by blocks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from twin.signals import Array

BLOCKS = 24  # over which the standard error of a gain on selection logs is taken


def rms(values: Array) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2))) if len(values) else float("nan")


def effective_samples(residual: Array) -> float:
    """Effective sample size of a coloured residual.

    n / (1 + 2 sum rho_k), summed while pairs of autocorrelations stay positive (C. J. Geyer,
    "Practical Markov chain Monte Carlo", Stat. Sci. 7, 1992).
    """
    n = len(residual)
    centred = residual - residual.mean() if n else residual
    if n < 4 or not centred.any():
        return float(max(n, 1))
    size = 1 << (2 * n - 1).bit_length()
    spectrum = np.abs(np.fft.rfft(centred, size)) ** 2
    rho = np.fft.irfft(spectrum, size)[: n // 2]
    rho = rho / rho[0]
    pairs = rho[: len(rho) // 2 * 2].reshape(-1, 2).sum(axis=1)
    stop = np.argmax(pairs <= 0.0) if (pairs <= 0.0).any() else len(pairs)
    tau = max(2.0 * pairs[:stop].sum() - 1.0, 1.0)
    return float(max(n / tau, 2.0))


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
    blocks = min(BLOCKS, len(before))
    edges = np.linspace(0, len(before), blocks + 1).astype(int)
    quiet = floor**2 * np.diff(edges)
    sums = [np.add.reduceat(r**2, edges[:-1]) + quiet for r in (before, after)]
    gains = np.log(sums[0] / sums[1])
    spread = gains.std(ddof=1) / np.sqrt(blocks) if blocks > 1 else np.inf
    t = gains.mean() / spread if spread > 0 else 0.0
    typical = float(np.exp(-gains.mean()))
    return Gain(rms(before), rms(after), float(t), typical)


def noise_gain(residual: Array, before: float, after: float) -> float:
    """Twice the gain in log likelihood per sample by another noise level, for a residual (n,) N.

    before, after: expected noise, N RMS.
    """
    power = np.mean(residual**2)
    return float(power / before**2 - power / after**2 - 2.0 * np.log(after / before))


def left_out(
    residual: Array,
    jacobian: Array,
    scale: Array,
    blocks: int = BLOCKS,
    penalty: Array | float = 0.0,
) -> Array:
    """Residual (n,) by cross-validation: each block predicted by a fit to the other blocks.

    Exact for a model linear in its parameters: (I - H_bb)^-1 r_b with the hat matrix H. scale (k,):
    weight of the priors in units of the columns, which keeps the inverse finite. penalty (k, k): of
    what is smoothed.
    """
    information = jacobian.T @ jacobian + np.diag(scale**2) + penalty
    out = residual.copy()
    for span in blocks_of(len(residual), blocks):
        block = jacobian[span]
        gradient = block.T @ residual[span]
        without = information - block.T @ block
        move = np.linalg.lstsq(without, gradient, rcond=1e-12)[0]
        out[span] = residual[span] + block @ move
    return out


def by_blocks(left: Array, right: Array, blocks: Sequence[slice]) -> Array:
    """Inner products (b, p, q) of columns (n, p) and (n, q), or (b, p) with one (n,), by blocks."""
    return np.stack([left[span].T @ right[span] for span in blocks])


def blocks_of(count: int, blocks: int = BLOCKS) -> list[slice]:
    """Samples of each of some blocks of about equal length, fewer where there are fewer samples."""
    edges = np.linspace(0, count, min(blocks, count) + 1).astype(int)
    return [slice(a, b) for a, b in pairwise(edges)]
