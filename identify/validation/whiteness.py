"""Tests of the residual: is it white, and uncorrelated with command and speed?

The force residual is tested on test functions that do not overlap, where it is white if the model
is right. Bounds are +-1.645/sqrt(n) for n test functions: 90 of 100 values of a white residual lie
within (L. Jia 2023, residual analysis; L. Ljung, System Identification, 16.6). The loop decides
which lags are tested.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

from identify.dataset.prepared_log import PreparedLog, split_by_log
from twin.record import Flags, Number, Values, computed, record
from twin.signals import Array

NORMAL = NormalDist()

WITHIN = 0.90  # part of a white residual's correlations within the bounds


class Feedback(Enum):
    """Whether the logs were recorded under feedback."""

    CLOSED = "closed"
    OPEN = "open"
    UNKNOWN = "unknown"


@record
class Correlation:
    """Correlation (k,) of the residual with a signal, by lag; positive: the signal was earlier."""

    signal: str
    lag: Values
    value: Values
    """-1..1"""
    tested: Flags
    """Which lags a right model must keep small."""
    bound_90: Number
    """Of 90 % of a white residual's values."""
    limit_all_99: Number
    """Of all tested ones in 99 of 100 white residuals."""
    lag_unit: str = "s"

    @computed
    def share_outside(self) -> Number:
        """Part of the tested values beyond the bound; 0.1 is expected of a white residual."""
        return float(np.mean(np.abs(self._tried) > self.bound_90))

    @computed
    def passed(self) -> bool:
        """Whether no tested value is beyond the limit."""
        return bool(np.all(np.abs(self._tried) < self.limit_all_99))

    @property
    def _tried(self) -> Array:
        return np.asarray(self.value)[np.asarray(self.tested)]


@dataclass(frozen=True, eq=False)
class ResidualTests:
    """Residual tests of one axis.

    samples: test functions that do not overlap. floor: N. edges (b + 1,) N and density (b,) 1/N of
    the histogram. share_within_90: part of the samples within 1.645 noise floors, 0.9 for pure
    noise.
    """

    loop: Feedback
    samples: int
    floor: float
    edges: Array
    density: Array
    share_within_90: float
    correlations: tuple[Correlation, ...]

    @property
    def passed(self) -> bool:
        """Whether the residual is white and uncorrelated with command and speed."""
        return all(c.passed for c in self.correlations)


def loop_of(logs: Sequence[PreparedLog]) -> Feedback:
    """Whether an axis was under feedback: closed where its position follows a logged setpoint.

    Open where a logged setpoint is not followed in any log; unknown where one was not logged.
    """
    found = [log.motion.follows for log in logs]
    if any(follows is None for follows in found):
        return Feedback.UNKNOWN
    return Feedback.CLOSED if any(found) else Feedback.OPEN


def residual_tests(
    logs: Sequence[PreparedLog], force: Array, kept: NDArray[np.bool_], floor: float, loop: Feedback
) -> ResidualTests:
    """Tests of the force residual (n,) N of some logs; kept (n,): which values are used."""
    # From one test function to the next that does not overlap with it.
    apart = [-(-len(w.test_function.weights) // w.test_function.stride) for w in logs]
    series = {
        "residual": split_by_log(np.where(kept, force, np.nan), logs),
        "command": [log.command for log in logs],
        "velocity": [log.test_function.mean(log.motion.velocity) for log in logs],
    }
    series = {
        name: [row[::step] for row, step in zip(rows, apart, strict=True)]
        for name, rows in series.items()
    }
    left = np.concatenate(series["residual"])
    left = left[np.isfinite(left)]
    spacing = logs[0].test_function.stride * apart[0] * logs[0].motion.period
    # noise floors that the histogram spans at least
    reach = max(5.0 * floor, float(np.quantile(np.abs(left), 0.995)))
    edges = np.linspace(-reach, reach, 41 + 1)  # of the histogram; odd, so that one is at zero
    count, _ = np.histogram(left, edges)
    return ResidualTests(
        loop=loop,
        samples=len(left),
        floor=floor,
        edges=edges,
        density=count / (len(left) * np.diff(edges)),
        share_within_90=float(np.mean(np.abs(left) < NORMAL.inv_cdf(0.5 + WITHIN / 2.0) * floor)),
        correlations=tuple(
            correlation(name, series["residual"], rows, spacing, loop)
            for name, rows in series.items()
        ),
    )


def correlation(
    signal: str, residual: Sequence[Array], other: Sequence[Array], spacing: float, loop: Feedback
) -> Correlation:
    """Correlation of residual and signal, log by log (n_i,) each; nan values are left out.

    spacing: s, from one value to the next.
    """
    most_lags = 40  # that are tested and drawn; what is slower is seen at these, too
    most = max(min(most_lags, min(map(len, residual)) // 4), 1)
    own = signal == "residual"
    lags = np.arange(1 if own else -most, most + 1)
    a, b = (_centred(rows) for rows in (residual, other))
    n = sum(int(np.count_nonzero(row)) for row in a)
    power = np.sqrt(sum(np.sum(row**2) for row in a) * sum(np.sum(row**2) for row in b))
    products = sum(_products(x, y, lags) for x, y in zip(a, b, strict=True))
    tested = np.ones(len(lags), bool)
    if not own and loop is not Feedback.OPEN:
        tested = lags > 0  # under feedback the command of the same instant depends on the noise
    count = int(tested.sum())
    root = np.sqrt(max(n, 1))
    sure = 0.99  # part of white residuals whose every correlation is within the wider limit
    return Correlation(
        signal=signal,
        lag=np.asarray(spacing * lags, float),
        value=np.asarray(products / max(power, 1e-300)),
        tested=tested,
        bound_90=float(NORMAL.inv_cdf(0.5 + WITHIN / 2.0) / root),
        limit_all_99=float(NORMAL.inv_cdf(1.0 - (1.0 - sure) / 2.0 / count) / root),
    )


def _centred(rows: Sequence[Array]) -> list[Array]:
    """Rows less their common mean; zero where there is no number."""
    mean = np.nanmean(np.concatenate(rows))
    return [np.nan_to_num(row - mean) for row in rows]


def _products(residual: Array, other: Array, lags: NDArray[np.int64]) -> Array:
    """Sum over k of residual[k] other[k - lag] for each lag, (n_lags,)."""
    n = len(residual)
    return np.array(
        [residual[max(k, 0) : n + min(k, 0)] @ other[max(-k, 0) : n - max(k, 0)] for k in lags]
    )
