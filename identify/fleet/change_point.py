"""When a series of nights has changed: a sequential test whose rate of false alarms is known.

After every night each earlier night is tried as the first of a change: the mean since it against
the mean before, over what the nights scatter. Neither mean nor scatter is known beforehand, so none
has to be learnt on machines that are sure to be well: D. M. Hawkins, P. Qiu, C. W. Kang, The
changepoint model for statistical process control, J. Quality Technology 35 (2003). Added here: each
night weighs by its own interval; the scatter is taken as larger where neighbouring nights are alike
(weather); a change has to pass a dead band, below which it is nobody's concern.

Own code, as no kept library holds a stated rate: those of ``river`` (ADWIN, Page-Hinkley, KSWIN)
have no threshold for one, and ``ruptures`` looks back over a series that has ended. Their rates are
in the benchmark beside this one's.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from twin.core.compiled import compiled
from twin.signals import Array

BEFORE, AFTER = 12, 3  # least nights before a change, and with it
ODD = (
    6.0  # deviations from the nights before, to which one is taken: a single odd night is no change
)
REMEMBERED = 9  # nights, whose median an odd one is compared with
MOST_ALIKE = 0.9  # of neighbouring nights, correlation


@dataclass(frozen=True)
class Change:
    """A change of a series, by the numbers of its nights.

    told: after which night; first: the first night that differs, with the ends of its 90 % band;
    strength: the change beyond the dead band over its standard deviation.
    """

    told: int
    first: int
    earliest: int
    latest: int
    strength: float


def changes(values: Array, variances: Array, dead: float, level: float) -> list[Change]:
    """The changes of a series (n,) of nights, in their order; each is the begin of a new series.

    variances (n,): of the values within their nights; dead: change that is none, in their unit.
    level: standard deviations of a normal distribution at which a change is told (``rates``).
    """
    out, begin = list[Change](), 0
    values = without_odd(values, dead)
    limits = limits_at(level, len(values))
    while begin < len(values):
        told, scores = _first_change(values[begin:], variances[begin:], dead, limits)
        if told < 0:
            break
        best = int(np.argmax(scores))
        weights = np.cumsum(np.exp(0.5 * (scores**2 - scores[best] ** 2)) * (scores > 0.0))
        low, high = np.searchsorted(weights, np.array([0.05, 0.95]) * weights[-1])
        out.append(
            Change(begin + told, begin + best, begin + int(low), begin + int(high),
                   float(scores[best]))
        )  # fmt: skip
        begin += best
    return out


def without_odd(values: Array, dead: float) -> Array:
    """A series (n,) none of whose nights is further from those before than a change needs."""
    if len(values) <= REMEMBERED:
        return values
    scatter = 1.4826 * np.median(np.abs(np.diff(values))) / np.sqrt(2.0)
    usual = np.median(sliding_window_view(values, REMEMBERED), axis=1)[:-1]
    out, far = values.copy(), ODD * scatter + dead
    out[REMEMBERED:] = np.clip(values[REMEMBERED:], usual - far, usual + far)
    return out


@lru_cache(maxsize=64)
def limits_at(level: float, count: int) -> Array:
    """What a statistic of n nights has to pass, (count + 1,), by n.

    Their scatter is estimated, so it is that of Student's distribution.
    """
    from scipy.special import ndtr, stdtrit

    n = np.arange(count + 1)
    return np.where(n > 2, -stdtrit(np.maximum(n - 2.0, 1.0), ndtr(-level)), np.inf)


@compiled(nogil=True)
def _first_change(x, variances, dead, limits):
    """After which night a change is told (-1: none), and the statistic of each as its first."""
    n_all = len(x)
    scores = np.zeros(n_all)
    root, w = np.empty(n_all), np.empty(n_all)
    sums = np.zeros((6, n_all + 1))
    jumps = 0.0  # sum of squared differences of neighbours, less what their intervals make
    for n in range(1, n_all + 1):
        if n > 1:
            jumps += 0.5 * ((x[n - 1] - x[n - 2]) ** 2 - variances[n - 1] - variances[n - 2])
        if n < BEFORE + AFTER:
            continue
        scatter = max(jumps / (n - 1), 1e-3 * variances[:n].mean() + 1e-300)
        for i in range(n):
            w[i] = 1.0 / (variances[i] + scatter)
            root[i] = np.sqrt(w[i])
            y = x[i] - x[0]
            before = x[i - 1] - x[0] if i else 0.0
            both = root[i] * root[i - 1] if i else 0.0
            sums[0, i + 1] = sums[0, i] + w[i]
            sums[1, i + 1] = sums[1, i] + w[i] * y
            sums[2, i + 1] = sums[2, i] + w[i] * y * y
            sums[3, i + 1] = sums[3, i] + both
            sums[4, i + 1] = sums[4, i] + both * (y + before)
            sums[5, i + 1] = sums[5, i] + both * y * before
        best = 0.0
        for k in range(BEFORE, n - AFTER + 1):
            scores[k] = _score(sums, k, n, dead)
            best = max(best, scores[k])
        if best > limits[n]:
            scores[n - AFTER + 1 :] = 0.0
            return n - 1, scores[:n]
    return -1, scores


@compiled(nogil=True)
def _score(sums, k, n, dead):
    """The statistic of a change whose first night is k, among n nights."""
    w1, w2 = sums[0, k], sums[0, n] - sums[0, k]
    m1, m2 = sums[1, k] / w1, (sums[1, n] - sums[1, k]) / w2
    size = abs(m2 - m1) - dead
    if size <= 0.0:
        return 0.0
    left = sums[2, n] - m1 * m1 * w1 - m2 * m2 * w2
    # Products of neighbours, less the pair across the change.
    alike = sums[5, k] - m1 * sums[4, k] + m1 * m1 * sums[3, k]
    alike += sums[5, n] - sums[5, k + 1] - m2 * (sums[4, n] - sums[4, k + 1])
    alike += m2 * m2 * (sums[3, n] - sums[3, k + 1])
    left = max(left, 1e-12 * sums[2, n] + 1e-300)
    # The mean that is taken off makes neighbours less alike than they are, by about 1 / n.
    rho = min(max(alike / left + 1.0 / n, 0.0), MOST_ALIKE)
    variance = left / (n - 2) * (1.0 / w1 + 1.0 / w2) * (1.0 + rho) / (1.0 - rho)
    return size / np.sqrt(variance)
