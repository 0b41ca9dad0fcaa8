"""Axes whose channels are swapped: the motion of one explains the force of the other."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations

import numpy as np

from twin.log.check.axis import Axis
from twin.log.check.dynamics import fit_dynamics
from twin.log.check.report import Fault, Finding, Severity
from twin.signals import Array

_WORSE = 1.2  # times what the motion of the other axis leaves of a force, its own leaves
_EXPLAINED = 0.6  # largest part that the motion of the other axis leaves
_ALIKE = 0.98  # correlation of a position and the setpoint that it follows


def check(axes: Sequence[Axis]) -> Iterator[Finding]:
    """Swapped positions or forces, for each pair of axes that move."""
    for one, other in combinations([a for a in axes if a.moves], 2):
        if len(one.force) != len(other.force) or one.log.kind != other.log.kind:
            continue
        own = min(_left(one, one), _left(other, other))
        crossed = max(_left(one, other), _left(other, one))
        if own < _WORSE * crossed or crossed > _EXPLAINED:
            continue
        what = "positions" if _follows(one, other) and _follows(other, one) else "forces"
        yield Finding(
            Severity.ERROR, Fault.SWAPPED, one.name,
            f"the motion of axis {other.name} leaves {100 * crossed:.2g} % of this force, "
            f"its own {100 * own:.2g} %: {what} of axes {one.name} and {other.name} are swapped",
            "whole log", f"exchange the columns of the {what} of both axes in the import map",
        )  # fmt: skip


def _left(force: Axis, motion: Axis) -> float:
    """The part of a force that a motion does not explain."""
    kept = np.minimum(force.kept, motion.kept)
    fit = fit_dynamics(force.force, motion.regressors, kept, 0)
    return float(np.median(np.abs(fit.residual)) / np.median(np.abs(_centred(force.force))))


def _follows(position: Axis, setpoint: Axis) -> bool:
    """Whether the position of one axis is where another was told to be."""
    told = setpoint.log.columns.get("setpoint_position")
    if told is None:
        return False
    x, r = _centred(position.log.position), _centred(told)
    return float(x @ r) > _ALIKE * float(np.linalg.norm(x) * np.linalg.norm(r))


def _centred(x: Array) -> Array:
    return np.asarray(x - x.mean())
