"""What logs show without a fit of the whole model: friction by speed and place, the cable's force.

A velocity-friction map has no planted values beside it, so what is told is the map, the curve
through each direction with intervals, and the mean of both, as in L. Jia 2023.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from identify.dataset.dataset import Dataset, datasets
from identify.estimation.cable_force import CableForce
from identify.estimation.cable_force import cable_force as of_cable
from identify.estimation.velocity_map import VelocityMap
from identify.estimation.velocity_map import velocity_map as of_velocity
from twin.errors import InputError
from twin.logs import GivenLogs, logs_by_name
from twin.model.machine import AxisModel, MachineModel
from twin.model.units import AxisUnits

if TYPE_CHECKING:
    from identify.estimation.map_curve import MapCurve

TEST_FUNCTION = 0.02  # s, short enough for spikes of a few millimetres at 0.1 m/s
DIRECTIONS = (1.0, -1.0)


@dataclass(frozen=True, eq=False, repr=False)
class FrictionMap:
    """A velocity-friction map, and the curve through each direction (+1, -1)."""

    map: VelocityMap
    curves: Mapping[float, MapCurve]
    units: AxisUnits

    def __repr__(self) -> str:
        return f"<FrictionMap of {len(self.map)} plateaus: {self.both}>"

    @property
    def position(self) -> float:
        """The middle of its plateaus, m."""
        return float(self.map.position.mean())

    @property
    def both(self) -> dict[str, float]:
        """Parameters by name, the mean of both directions."""
        ahead, back = (self.curves[way].values for way in DIRECTIONS)
        return {name: 0.5 * (ahead[name] + back[name]) for name in ahead if name in back}

    @property
    def differing(self) -> list[str]:
        """Parameters whose two 90 % intervals, by direction, do not meet."""
        ahead, back = (self.curves[way] for way in DIRECTIONS)
        apart = {n: abs(ahead.values[n] - back.values[n]) for n in self.both}
        return [n for n, value in apart.items() if value > ahead.half[n] + back.half[n]]


def velocity_map(model: MachineModel, logs: GivenLogs, *, axis: str | None = None) -> VelocityMap:
    """Friction against velocity, from logs with stretches of constant speed (L. Jia 2023).

    The forces of the model's other effects are taken off. axis: the only one that moves where None.
    Raises InputError where no log holds a constant speed.
    """
    return VelocityMap.joined(_maps(model, logs, axis)[1])


def friction_map(model: MachineModel, logs: GivenLogs, *, axis: str | None = None) -> FrictionMap:
    """The map of all logs with its curves; raises InputError where they hold none both ways."""
    own, found = _maps(model, logs, axis)
    return _with_curves(own, VelocityMap.joined(found))


def along_track(
    model: MachineModel, logs: GivenLogs, *, axis: str | None = None
) -> list[FrictionMap]:
    """A map for each place of the track that logs of moves visit, from one end to the other.

    Logs whose plateaus overlap along the track are of one place. Raises InputError for one place.
    """
    own, found = _maps(model, logs, axis)
    groups = [VelocityMap.joined(group) for group in _places(found)]
    if len(groups) < 2:
        raise InputError(
            "all logs are of one place of the track; give logs of moves at several places, or use "
            "friction_map for one map"
        )
    return [_with_curves(own, m) for m in groups]


def cable_force(
    model: MachineModel,
    logs: GivenLogs,
    *,
    axis: str | None = None,
    test_function: float = TEST_FUNCTION,
) -> CableForce:
    """The force of the cable slab, and the spikes of rollers, from passes in both directions.

    Only the mass of the model is used. test_function: s, the finest detail. Raises InputError where
    the logs hold fewer than two passes each way.
    """
    name, dataset = only_axis(datasets(model, logs_by_name(logs), {}, test_function), axis)
    return of_cable(model.axes[name], dataset.fit)


def only_axis(found: Mapping[str, Dataset], axis: str | None) -> tuple[str, Dataset]:
    """The axis of that name, or the only one that moves; InputError where it is not clear."""
    if axis is None and len(found) > 1:
        raise InputError(f"{', '.join(found)} move in the logs; give the axis")
    name = axis or next(iter(found))
    if name not in found:
        raise InputError(f"axis {name} does not move in the logs; there moves {', '.join(found)}")
    return name, found[name]


def _maps(
    model: MachineModel, logs: GivenLogs, axis: str | None
) -> tuple[AxisModel, list[VelocityMap]]:
    """The axis, and the map of each log."""
    name, dataset = only_axis(datasets(model, logs_by_name(logs), {}), axis)
    return model.axes[name], [of_velocity(model.axes[name], log.motion) for log in dataset.fit]


def _with_curves(axis: AxisModel, found: VelocityMap) -> FrictionMap:
    from identify.estimation.map_curve import curve_through  # with SciPy, for those who ask

    curves = {way: curve_through(found.towards(way)) for way in DIRECTIONS}
    return FrictionMap(found, curves, axis.units)


def _places(maps: Sequence[VelocityMap]) -> list[list[VelocityMap]]:
    """Maps in groups whose plateaus overlap along the track, from one end to the other."""
    groups: list[list[VelocityMap]] = []
    reached = -np.inf
    for one in sorted(maps, key=lambda m: float(m.position.min())):
        if one.position.min() > reached:
            groups.append([])
        groups[-1].append(one)
        reached = max(reached, float(one.position.max()))
    return groups
