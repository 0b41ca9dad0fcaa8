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
NEIGHBOURS = 9  # nights, whose median an odd one is compared with
LATER = 10  # nights after it was told that take part in its date
MOST_ALIKE = 0.9  # of neighbouring nights, correlation


@dataclass(frozen=True)
class LevelChange:
    """A change of a series, by the numbers of its nights.

    told: after which night; first: the first night that differs, with the ends of its 90 % band;
    strength: the change beyond the dead band over its standard deviation.
    """

    told: int
    first: int
    earliest: int
    latest: int
    strength: float


def changes(values: Array, variances: Array, dead: float, level: float) -> list[LevelChange]:
    """The changes of a series (n,) of nights, in their order; each is the begin of a new series.

    variances (n,): of the values within their nights; dead: change that is none, in their unit.
    level: standard deviations of a normal distribution at which a change is told (``rates``).
    """
    out, begin = list[LevelChange](), 0
    asked, dated = (without_odd(values, dead, n) for n in (0, NEIGHBOURS // 2 + 1))
    limits = limits_at(level, len(values))
    while (told := _night_of_change(asked[begin:], variances[begin:], dead, limits)) >= 0:
        known = slice(begin, begin + told + 1 + LATER)
        scores = _scores(dated[known], variances[known], dead)
        best = int(np.argmax(scores))
        weights = np.cumsum(np.exp(0.5 * (scores**2 - scores[best] ** 2)) * (scores > 0.0))
        low, high = np.searchsorted(weights, np.array([0.05, 0.95]) * weights[-1])
        out.append(
            LevelChange(begin + told, begin + best, begin + int(low), begin + int(high),
                   float(scores[best]))
        )  # fmt: skip
        begin += best
    return out


def without_odd(values: Array, dead: float, later: int = 0) -> Array:
    """A series (n,) none of whose nights is further from its neighbours than a change needs.

    Of these the last is so many nights later: none, as long as it is asked whether there is one.
    """
    scatter = 1.4826 * np.median(np.abs(np.diff(values))) / np.sqrt(2.0) if len(values) > 1 else 0.0
    if len(values) <= NEIGHBOURS or scatter == 0.0:
        return values
    usual = np.median(sliding_window_view(values, NEIGHBOURS), axis=1)
    first = NEIGHBOURS - later  # the first night that has all of them
    nights, far = slice(first, first + len(usual) - (later == 0)), ODD * scatter + dead
    usual = usual[: nights.stop - nights.start]
    out = values.copy()
    out[nights] = np.clip(values[nights], usual - far, usual + far)
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
def _night_of_change(x, variances, dead, limits):
    """After which night a change is told; -1: none is."""
    sums = np.zeros((6, len(x) + 1))
    jumps = 0.0
    for n in range(1, len(x) + 1):
        if n > 1:
            jumps += _jump(x, variances, n - 1)
        if n >= BEFORE + AFTER:
            _add_up(x, variances, n, jumps, sums)
            for k in range(BEFORE, n - AFTER + 1):
                if _score(sums, k, n, dead) > limits[n]:
                    return n - 1
    return -1


@compiled(nogil=True)
def _scores(x, variances, dead):
    """The statistic of each night (n,) as the first of a change."""
    n = len(x)
    sums, scores = np.zeros((6, n + 1)), np.zeros(n)
    jumps = 0.0
    for i in range(1, n):
        jumps += _jump(x, variances, i)
    _add_up(x, variances, n, jumps, sums)
    for k in range(BEFORE, n):
        scores[k] = _score(sums, k, n, dead)
    return scores


@compiled(nogil=True)
def _jump(x, variances, i):
    """What two neighbours tell of the variance between nights, less that within them."""
    return 0.5 * ((x[i] - x[i - 1]) ** 2 - variances[i] - variances[i - 1])


@compiled(nogil=True)
def _add_up(x, variances, n, jumps, sums):
    """Weights, weighted values and products of neighbours of n nights, each added up."""
    scatter = max(jumps / (n - 1), 1e-3 * variances[:n].mean() + 1e-300)
    root, last = 0.0, 0.0  # of the night before
    for i in range(n):
        w = 1.0 / (variances[i] + scatter)
        y = x[i] - x[0]
        both = np.sqrt(w) * root
        sums[0, i + 1] = sums[0, i] + w
        sums[1, i + 1] = sums[1, i] + w * y
        sums[2, i + 1] = sums[2, i] + w * y * y
        sums[3, i + 1] = sums[3, i] + both
        sums[4, i + 1] = sums[4, i] + both * (y + last)
        sums[5, i + 1] = sums[5, i] + both * y * last
        root, last = np.sqrt(w), y


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
