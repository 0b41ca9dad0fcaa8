"""The dynamic part of a friction from small reversals, its static part being known.

Stiffness and damping of the bristles by Levenberg-Marquardt on the force residual. L. Jia (2023)
starts from stiffness = Fs / largest deflection and a damping drawn below it, which is far off where
the reversals are small; so the search begins from several parts of that stiffness.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.dataset.prepared_log import PreparedLog
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.levenberg_marquardt import Solution, minimise
from twin.model.machine import AxisModel
from twin.model.parameters import ParameterReference, write

Array = NDArray[np.float64]

PARTS = (1.0, 0.3, 0.1, 0.03, 0.01)  # of the stiffness of the start rule
HEAD = 3.0  # s of each log, on which the start is chosen
FIRST_EVALUATIONS = 3  # of the search from each, after which the best goes on with all
MOST_EVALUATIONS = 200
TOLERANCE = 1e-6


@dataclass(frozen=True, eq=False)
class Presliding:
    """The dynamic part of one axis' friction: references to its stiffness and damping."""

    stiffness: ParameterReference
    damping: ParameterReference

    @property
    def where(self) -> list[ParameterReference]:
        """Stiffness, then damping."""
        return [self.stiffness, self.damping]

    def fit(
        self, axis: AxisModel, logs: Sequence[PreparedLog], static: float, rng: np.random.Generator
    ) -> AxisModel:
        """The axis with its stiffness and damping fitted.

        static: static friction in N, for the start rule. rng draws the damping to start from.
        """
        deflection = max(float(np.ptp(log.motion.position)) for log in logs) / 2.0
        first = static / deflection
        starts = [np.array([p * first, rng.uniform(0.0, p * first)]) for p in PARTS]
        heads = [PreparedLog.of(w.motion.head(HEAD), w.test_function.length) for w in logs]
        tried = [self._search(axis, heads, start, FIRST_EVALUATIONS) for start in starts]
        best = min(tried, key=lambda s: self._cost(axis, heads, s.x))
        found = self._search(axis, logs, best.x, MOST_EVALUATIONS)
        return write(axis, self.where, found.x)

    def _search(
        self, axis: AxisModel, logs: Sequence[PreparedLog], start: Array, evaluations: int
    ) -> Solution:
        bounds = np.array([[c.parameter.lower, c.parameter.upper] for c in self.where]).T
        return minimise(
            lambda x: residual(write(axis, self.where, x), logs),
            lambda x: jacobian(write(axis, self.where, x), logs, self.where),
            start, (bounds[0], bounds[1]), tolerance=TOLERANCE, most_evaluations=evaluations,
        )  # fmt: skip

    def _cost(self, axis: AxisModel, logs: Sequence[PreparedLog], x: Array) -> float:
        left = residual(write(axis, self.where, x), logs)
        return float(left @ left)
