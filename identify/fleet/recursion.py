"""Slow parameters of a machine that runs, followed window by window.

Recursive least squares in square-root form: what is known is kept as the triangular root of its
information, and each window is added to it by a QR decomposition, so that it stays positive however
long that goes on (G. J. Bierman, Factorization Methods for Discrete Sequential Estimation, 1977,
chapter V). What is known fades with the way travelled, not with time, as wear goes with the way: an
axis at rest forgets nothing. The fitted model is a prior that does not fade, so that a parameter
which the motion does not tell returns to it, and none runs away.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from identify.dataset.prepared_log import PreparedLog
from identify.estimation.evidence import effective_samples
from identify.estimation.force_balance import jacobian
from identify.results.fleet import LiveParameter
from twin.model.machine import AxisModel
from twin.model.parameters import ParameterReference, free_parameters, read, write
from twin.signals import Array

PRIOR = 0.5  # of a parameter: how far it may be from the fitted one without any log
MEMORY = 60.0  # windows of the usual way, over which a window fades to 1 / e: about a minute
LEAST = 1e-15  # N, so that no noise is none
TO_BAND = 1.645  # half a 90 % band over its standard deviation


@dataclass
class Recursion:
    """The strengths of an axis as they are now, beside those of its fitted model.

    root (p, p), aim (p,): of what the windows tell of p parameters, as parts of their prior.
    """

    axis: AxisModel
    where: tuple[ParameterReference, ...]
    root: Array
    aim: Array
    ways: list[float] = field(default_factory=list)

    @classmethod
    def of(cls, axis: AxisModel) -> Recursion:
        """That knows the fitted model alone."""
        where = tuple(
            c
            for c in free_parameters(axis)
            if (c.parameter.strength or not c.effect) and read(axis, [c])[0] != 0.0
        )
        return cls(axis, where, np.zeros((len(where), len(where))), np.zeros(len(where)))

    @property
    def scale(self) -> Array:
        """Of each parameter one standard deviation of its prior (p,)."""
        return PRIOR * np.abs(read(self.axis, self.where))

    def take(
        self, logs: Sequence[PreparedLog], left: Array, some: NDArray[np.bool_], way: float
    ) -> None:
        """Add a window.

        left (n,): residual of the fitted model, N, in these test functions; some (n,): which of
        them count; way: travelled in the window, m or rad. One with fewer of them than parameters
        says nothing.
        """
        seen, free = left[some], np.count_nonzero(some) - len(self.where)
        if not self.where or free <= 0:
            return
        columns = jacobian(self.axis, logs, self.where)[some] * self.scale
        basis = np.linalg.qr(columns)[0]
        noise = seen - basis @ (basis.T @ seen)  # what no value of them takes away
        # Neighbours overlap: as many are counted as there would be of independent ones.
        size = max(float(np.linalg.norm(noise)) / np.sqrt(free), LEAST)
        weight = np.sqrt(effective_samples(noise) / len(seen)) / size
        kept = np.exp(-0.5 * way / (MEMORY * self._usual(way)))
        old = np.column_stack([self.root, self.aim]) * kept
        new = np.column_stack([columns, -seen]) * weight
        whole = _root(np.vstack([old, new]))
        size = len(self.where)
        self.root, self.aim = whole[:size, :size], whole[:size, size]

    def _usual(self, way: float) -> float:
        """The way of a usual window: of the first ones, so that a slow day fades slowly."""
        first = 30  # windows, from which on it is known
        if len(self.ways) < first:
            self.ways.append(way)
        return max(float(np.median(self.ways)), 1e-12)

    def parameters(self) -> tuple[LiveParameter, ...]:
        """The parameters now, each with half its 90 % band."""
        size = len(self.where)
        if not size:
            return ()
        both = np.vstack([np.column_stack([self.root, self.aim]), np.eye(size, size + 1)])
        whole = _root(both)
        root = np.linalg.inv(whole[:size, :size])
        moved, deviations = root @ whole[:size, size], np.linalg.norm(root, axis=1)
        fitted = read(self.axis, self.where)
        values = read(write(self.axis, self.where, fitted + self.scale * moved), self.where)
        return tuple(
            LiveParameter(c.label, float(value), float(TO_BAND * d * s), float(was), unit)
            for c, value, d, s, was, unit in zip(
                self.where, values, deviations, self.scale, fitted, self._units(), strict=True
            )
        )

    def _units(self) -> list[str]:
        return [self.axis.units(c.parameter.unit) for c in self.where]


def _root(rows: Array) -> Array:
    """The triangular root of the information of rows (m, n), of which there are at least n."""
    return np.asarray(np.linalg.qr(rows).R)
