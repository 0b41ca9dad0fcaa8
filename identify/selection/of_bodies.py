"""Whether other bodies or another rotor explain what a law of one joint of a mechanism does.

Masses and centres of a file are seldom exact, and those that logs corrected are as good as what was
known of the joints by then. What a joint lacks is judged beside them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.dataset.body import ACCURACY, Body
from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import PreparedLog, moving, sticks
from identify.estimation.errors import error_on
from identify.estimation.evidence import rms
from identify.estimation.force_balance import jacobian
from identify.estimation.least_squares import RIDGE, orthonormal, unabsorbed
from identify.selection.acceptance import Judged
from identify.selection.law_or_curve import NEARLY
from identify.selection.what import What
from twin.effect import Effect, Kind
from twin.signals import Array


def is_of_bodies(less: Judged, final: Judged, effect: Effect) -> bool:
    """Whether bodies within their accuracy take nearly as much as a law does, of all its logs.

    And the rotor, of which a file knows little. Beside the parameters of the fit without the law,
    which are free in each group of logs. less, final: the fits without the law and with it. A
    friction, which turns with the velocity, is none, and of what is asked of all joints at once it
    is known.
    """
    if effect.kind is Kind.FRICTION or any(what.covers(effect) for what in What):
        return False
    if not (bodies := _carried_by(less.dataset)):
        return False
    fit, chosen = less.fit, less.dataset.selection
    groups = [(less.dataset.training, fit.basis, fit.residual, final.fit.residual)]
    if chosen:
        columns = jacobian(fit.axis, chosen, fit.scaling.where)[moving(chosen, sticks(fit.axis))]
        left, after = (error_on(one.fit.axis, chosen) for one in (less, final))
        groups.append((chosen, orthonormal(columns), left, after))
    asked = [
        tuple(unabsorbed(force, own) for force in (_of(bodies, less, logs), left, after))
        for logs, own, left, after in groups
    ]
    change = _within_accuracy(*asked[0][:2])
    return all(
        _falls(left, left + columns @ change) >= NEARLY * _falls(left, after)
        for columns, left, after in asked
    )


def _carried_by(dataset: Dataset) -> list[Body]:
    """The bodies that change the force of a joint; none of a machine of plain axes."""
    if (own := dataset.training[0].motion.bodies) is None:
        return []
    mechanism = own.mechanism
    carried = (k for k in range(len(mechanism.axes)) if own.index in mechanism.moved_by(k))
    return [Body(mechanism, k) for k in carried]


def _of(bodies: Sequence[Body], less: Judged, logs: Sequence[PreparedLog]) -> Array:
    """Change (n, 1 + 10 k) of the residual, N per unit of the rotor's inertia.

    And per accuracy of each parameter of k bodies.
    """

    def of(log: PreparedLog) -> Array:
        each = (body.forces(log) * ACCURACY * body.scale for body in bodies)
        return np.column_stack([-log.acceleration, *each])

    return np.concatenate([of(log) for log in logs])[moving(logs, sticks(less.fit.axis))]


def _within_accuracy(columns: Array, left: Array) -> Array:
    """The changes (1 + 10 k,) of the rotor, and of bodies within a tenth, that leave least."""
    from scipy.optimize import lsq_linear  # SciPy takes long to load

    size = np.linalg.norm(columns, axis=0)
    weak = np.diag(RIDGE * np.where(size > 0.0, size, 1.0))
    rows = np.column_stack([np.concatenate([columns, weak]), np.pad(-left, (0, len(weak)))])
    root = np.asarray(np.linalg.qr(rows, mode="r"))[:-1]  # as short as there are columns
    most = np.concatenate([[np.inf], np.ones(len(size) - 1)])
    return np.asarray(lsq_linear(root[:, :-1], root[:, -1], (-most, most)).x, float)


def _falls(before: Array, after: Array) -> float:
    """By how much the mean square falls, N^2."""
    return rms(before) ** 2 - rms(after) ** 2
