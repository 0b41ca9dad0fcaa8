"""Whether other values of the bodies of a mechanism explain what a law of one joint does.

Masses and centres of a file are seldom better than a tenth: two models of one machine by its own
makers differ by as much. And those that logs corrected are as good as what was known of the joints
by then. What a joint lacks is judged beside them.
"""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

import numpy as np

from identify.dataset.body import LINK_MASS, Body
from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import PreparedLog, moving, sticks
from identify.estimation.errors import error_on
from identify.estimation.evidence import rms
from identify.estimation.force_balance import jacobian
from identify.estimation.least_squares import RIDGE
from identify.selection.acceptance import Judged
from identify.selection.search import NEARLY
from twin.effect import Effect, Kind
from twin.effects import Catalogue
from twin.signals import Array

ACCURACY = 0.1  # relative, of an inertial parameter


class What(Enum):
    """What of a mechanism is asked of all joints at once, beside the bodies, in words."""

    BODY = LINK_MASS
    ROTOR = "rotor"
    GAIN = "motor constant"
    LOAD = "friction by load"
    CURVE = "torque by place"

    def covers(self, effect: Effect) -> bool:
        """Whether an effect of one joint is a law of that.

        A motor that saturates below most of its torque, or has a deadband, is nearly another
        constant.
        """
        if effect.is_nonparametric or effect.states:
            return False
        if self is What.ROTOR:
            return effect.added_mass is not None
        if self is What.GAIN:
            return effect.kind is Kind.ACTUATION and not _reads_any(effect, "X", "V", "TIME")
        if self is What.LOAD:
            return effect.kind is Kind.MODIFIER and effect.reads("LOAD")
        repeats = any(p.period for p in effect.parameters)
        of_place = effect.reads("X") and not _reads_any(effect, "V", "TIME") and not repeats
        return self is What.CURVE and effect.kind is Kind.FORCE and of_place

    def named(self, catalogue: Catalogue) -> str:
        """The law by which it is told first: that of joints, or that of the fewest parameters."""
        own = [e for e in catalogue.values() if self.covers(e)]
        first = sorted(own, key=lambda e: (not e.of_joints, len(e.parameters)))
        return first[0].name if first else self.value


def _reads_any(effect: Effect, *slots: str) -> bool:
    return any(map(effect.reads, slots))


def is_of_bodies(less: Judged, final: Judged, effect: Effect) -> bool:
    """Whether bodies within their accuracy take nearly as much as a law does, of all its logs.

    less, final: the fits without the law and with it. A friction, which turns with the velocity, is
    none, and of what is asked of all joints at once it is known.
    """
    bodies = _carried_by(less.dataset)
    known = effect.kind is Kind.FRICTION or any(what.covers(effect) for what in What)
    if known or not bodies:
        return False
    fit, chosen = less.fit, less.dataset.selection
    step = _step(fit.jacobian, _of(bodies, less, less.dataset.training), fit.residual, final)
    pairs = [(fit.residual, fit.jacobian, final.fit.residual, less.dataset.training)]
    if chosen:
        left, after = (error_on(one.fit.axis, chosen) for one in (less, final))
        own = jacobian(fit.axis, chosen, fit.scaling.where)[moving(chosen, sticks(fit.axis))]
        pairs.append((left, own, after, chosen))
    return all(
        _falls(left, left + np.hstack([columns, _of(bodies, less, logs)]) @ step)
        >= NEARLY * _falls(left, after)
        for left, columns, after, logs in pairs
    )


def _carried_by(dataset: Dataset) -> list[Body]:
    """The bodies that change the force of a joint; none of a machine of plain axes."""
    if (own := dataset.training[0].motion.bodies) is None:
        return []
    mechanism = own.mechanism
    carried = (k for k in range(len(mechanism.axes)) if own.index in mechanism.moved_by(k))
    return [Body(mechanism, k) for k in carried]


def _of(bodies: Sequence[Body], less: Judged, logs: Sequence[PreparedLog]) -> Array:
    """Change (n, 10 k) of the residual, N per accuracy of each parameter of k bodies."""
    rows = (
        np.hstack([body.forces(log) * ACCURACY * body.scale for body in bodies]) for log in logs
    )
    return np.concatenate([*rows])[moving(logs, sticks(less.fit.axis))]


def _step(columns: Array, of_bodies: Array, left: Array, final: Judged) -> Array:
    """The change of a fit's parameters, and of bodies in units of accuracy, that leaves least.

    Of the bodies each is as likely by itself as what the law leaves is of noise.
    """
    weak = RIDGE * np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    prior = np.diag(np.concatenate([weak, np.full(of_bodies.shape[1], final.fit.error)]))
    rows = np.concatenate([np.hstack([columns, of_bodies]), prior])
    force = np.pad(-left, (0, len(prior)))
    return np.asarray(np.linalg.lstsq(rows, force, rcond=None)[0], float)


def _falls(before: Array, after: Array) -> float:
    """By how much the mean square falls, N^2."""
    return rms(before) ** 2 - rms(after) ** 2
