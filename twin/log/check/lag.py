"""Lag of a signal behind others that explain it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.signals import Array, sliding_products

LONGEST = 0.25  # s, searched both ways
_MOTION = 20  # least length of the log over the longest lag, so that it holds several moves
_CLEAR = 0.5  # largest residual at the best lag, as a part of the signal
_WRONG = 0.03  # least residual without a lag, as a part of the signal
_BETTER = 0.6  # largest residual at the best lag, as a part of that without a lag
_AS_GOOD = 1.5  # times the least residual: lags up to it count as equally good


@dataclass(frozen=True)
class Lag:
    """seconds: positive where the signal is late. clear: whether another lag fits much worse."""

    seconds: float
    clear: bool


def find_lag(signal: Array, explained_by: Array, kept: Array, block: float) -> Lag:
    """Lag of ``signal`` (n,) for which regressors (n, k) explain most of it by least squares.

    kept: (n,) 1.0 where the regressors may be believed, else 0.0; block: s from sample to sample.
    """
    reach = min(round(LONGEST / block), len(signal) // _MOTION)
    inner = slice(reach, len(signal) - reach)
    weights = kept[inner]
    basis = np.linalg.qr(_unit_columns(explained_by[inner] * weights[:, None]))[0]
    centred = signal - signal.mean()
    total = sliding_products(centred**2, weights)
    found = sum(sliding_products(centred, column) ** 2 for column in basis.T)
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
    good = (bottom <= _AS_GOOD**2 * least) | (bottom <= _WRONG**2 * total[dips])
    if not good.any():
        return Lag(0.0, False)
    dips, fraction = dips[good], fraction[good]
    nearest = int(np.argmin(np.abs(dips - reach)))  # a periodic motion has several
    best, at = int(dips[nearest]), residual[dips[nearest]]
    clear = (
        at < _CLEAR**2 * total[best]
        and residual[reach] > _WRONG**2 * total[reach]
        and at < _BETTER**2 * residual[reach]
    )
    return Lag(float((best - reach + fraction[nearest]) * block), bool(clear))


def _unit_columns(matrix: Array) -> Array:
    length = np.linalg.norm(matrix, axis=0)
    return matrix / np.where(length > 0.0, length, 1.0)
