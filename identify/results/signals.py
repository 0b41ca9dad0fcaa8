"""What a page draws of an axis: its forces and coordinates by test functions, log after log."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from identify.dataset.dataset import Role
from identify.dataset.prepared_log import PreparedLog, moving, sticks
from identify.estimation.force_balance import effect_forces, residual
from identify.estimation.residual_dependence import unit_of
from identify.validation.misfit_maps import KNOWN_UNITS, coordinates
from twin.errors import InputError
from twin.model.machine import AxisModel
from twin.signals import Array


@dataclass(frozen=True, eq=False)
class Signals:
    """Signals (n,) of one axis by test functions, all logs in a row.

    roles: of the logs; None where they have none. time: s, in its own log. coordinates, units: by
    name, of the motion, of the command and within each period of the model. to_explain: command
    minus mass x acceleration, N. before, after: force residual N without and with what was found
    (None: nothing was), not a number at rest, where static friction is undetermined. effects: by
    name the force of each effect of the final model, N, as the motor has to balance it.
    """

    logs: tuple[PreparedLog, ...]
    roles: tuple[Role | None, ...]
    time: Array
    coordinates: Mapping[str, Array]
    units: Mapping[str, str]
    to_explain: Array
    before: Array
    after: Array | None
    effects: Mapping[str, Array]

    @property
    def size(self) -> float:
        """RMS of the force residual without what was found, N."""
        return float(np.sqrt(np.nanmean(self.before**2)))

    def over(self, coordinate: str) -> Array:
        """A coordinate (n,); raises InputError for one that is not known."""
        known = {"time": self.time, **self.coordinates}
        if coordinate not in known:
            raise InputError(f"unknown coordinate '{coordinate}'; known are {', '.join(known)}")
        return known[coordinate]


def signals_of(
    logs: Mapping[PreparedLog, Role | None], before: AxisModel, after: AxisModel | None
) -> Signals:
    """The signals of some logs, with the model before anything was found, and the final one."""
    every, final = tuple(logs), after or before
    where = coordinates(final, every)
    time = where.pop("time")
    del where["standstill"]
    return Signals(
        logs=every,
        roles=tuple(logs.values()),
        time=time,
        coordinates=where,
        units={name: unit_of(name, every[0].motion, KNOWN_UNITS) for name in where},
        to_explain=where["command"]
        - final.mass * np.concatenate([log.acceleration for log in every]),
        before=_left(before, every),
        after=None if after is None else _left(after, every),
        effects={name: -force for name, force in effect_forces(final, every).items()},
    )


def _left(axis: AxisModel, logs: tuple[PreparedLog, ...]) -> Array:
    return np.where(moving(logs, sticks(axis)), residual(axis, logs), np.nan)


def means(x: Array, y: Array) -> tuple[Array, Array]:
    """Middles of bins of x and the means of y in them, those that are known by a few values."""
    bins = 80  # of a curve of means
    known = np.isfinite(x) & np.isfinite(y)
    count, edges = np.histogram(x[known], bins)
    sums, _ = np.histogram(x[known], bins, weights=y[known])
    middles = (edges[:-1] + edges[1:]) / 2.0
    few = 4  # values, of which a mean is drawn
    return middles, np.where(count >= few, sums / np.maximum(count, 1), np.nan)
