"""Velocity-friction maps of a real machine: chapters "simulation" and "track" on logs.

Nothing is planted there, so what is told is the map, the curve through each direction and their
mean, with intervals; along the track the same at every place that the logs visit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.analysis.maps import only_axis
from identify.dataset.dataset import datasets
from identify.estimation.map_curve import MapCurve, curve_through
from identify.estimation.velocity_map import VelocityMap, velocity_map
from twin.errors import InputError
from twin.log import Log
from twin.model.machine import AxisModel, MachineModel
from twin.model.units import AxisUnits

Array = NDArray[np.float64]

DIRECTIONS = (1.0, -1.0)


@dataclass(frozen=True, eq=False)
class MapOfLogs:
    """The map of some logs, and the curve through each direction (+1, -1)."""

    map: VelocityMap
    curves: Mapping[float, MapCurve]
    units: AxisUnits

    @property
    def both(self) -> dict[str, float]:
        """Parameters by name, the mean of both directions, as in the thesis."""
        ahead, back = (self.curves[way].values for way in DIRECTIONS)
        return {name: 0.5 * (ahead[name] + back[name]) for name in ahead if name in back}


@dataclass(frozen=True, eq=False)
class TrackOfLogs:
    """A map at each place (k,) m."""

    places: Array
    maps: Sequence[MapOfLogs]


def map_of_logs(model: MachineModel, logs: Mapping[str, Log]) -> MapOfLogs:
    """The chapter "simulation" on logs; raises InputError where they hold no map both ways."""
    axis, found = _maps(model, logs)
    return _mapped(axis, VelocityMap.joined(found))


def track_of_logs(model: MachineModel, logs: Mapping[str, Log]) -> TrackOfLogs:
    """The chapter "track" on logs of moves at several places.

    Logs whose plateaus overlap along the track are of one place. Raises InputError for one place.
    """
    axis, found = _maps(model, logs)
    groups = [VelocityMap.joined(group) for group in _places(found)]
    if len(groups) < 2:
        raise InputError(
            "all logs are of one place of the track; give logs of moves at several places, or use "
            "chapter 'simulation' for one map"
        )
    places = np.array([m.position.mean() for m in groups])
    return TrackOfLogs(places, [_mapped(axis, m) for m in groups])


def _maps(model: MachineModel, logs: Mapping[str, Log]) -> tuple[AxisModel, list[VelocityMap]]:
    name, dataset = only_axis(datasets(model, logs, {}), None)
    axis = model.axes[name]
    return axis, [velocity_map(axis, log.motion) for log in dataset.fit]


def _mapped(axis: AxisModel, found: VelocityMap) -> MapOfLogs:
    curves = {way: curve_through(found.towards(way)) for way in DIRECTIONS}
    return MapOfLogs(found, curves, axis.units)


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
