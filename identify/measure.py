"""What logs show without a fit of the whole model: friction by speed, the force of the cable."""

from __future__ import annotations

from collections.abc import Mapping

from identify.dataset.dataset import Dataset, datasets
from identify.estimation.cable_force import CableForce
from identify.estimation.cable_force import cable_force as of_cable
from identify.estimation.velocity_map import VelocityMap
from identify.estimation.velocity_map import velocity_map as of_velocity
from twin.errors import InputError
from twin.log import Log
from twin.model.machine import MachineModel

TEST_FUNCTION = 0.02  # s, short enough for spikes of a few millimetres at 0.1 m/s


def velocity_map(
    model: MachineModel, logs: Mapping[str, Log], *, axis: str | None = None
) -> VelocityMap:
    """Friction against velocity, from logs with stretches of constant speed (L. Jia 2023).

    The forces of the model's other effects are taken off. axis: the only one that moves where None.
    Raises InputError where no log holds a constant speed.
    """
    name, dataset = _only(datasets(model, logs, {}), axis)
    return VelocityMap.joined([of_velocity(model.axes[name], log.motion) for log in dataset.fit])


def cable_force(
    model: MachineModel,
    logs: Mapping[str, Log],
    *,
    axis: str | None = None,
    test_function: float = TEST_FUNCTION,
) -> CableForce:
    """The force of the cable slab, and the spikes of rollers, from passes in both directions.

    Only the mass of the model is used. test_function: s, the finest detail. Raises InputError where
    the logs hold fewer than two passes each way.
    """
    name, dataset = _only(datasets(model, logs, {}, test_function), axis)
    return of_cable(model.axes[name], dataset.fit)


def _only(found: Mapping[str, Dataset], axis: str | None) -> tuple[str, Dataset]:
    """The axis of that name, or the only one that moves; InputError where it is not clear."""
    if axis is None and len(found) > 1:
        raise InputError(f"{', '.join(found)} move in the logs; give the axis")
    name = axis or next(iter(found))
    if name not in found:
        raise InputError(f"axis {name} does not move in the logs; there moves {', '.join(found)}")
    return name, found[name]
