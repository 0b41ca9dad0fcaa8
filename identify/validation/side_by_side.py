"""What was measured, what the model says and what is left, on one clock, for other programs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from identify.dataset.prepared_log import PreparedLog
from identify.estimation.force_balance import residual
from identify.validation.free_run import free_run
from twin.logs import write_topics
from twin.model.machine import MachineModel
from twin.model.units import AxisUnits
from twin.signals import Array


@dataclass(frozen=True, eq=False)
class SideBySide:
    """Of one log. sample_rate: Hz; topics: "/measured/x" -> column -> (n,) in units of the axis.

    The position of the model is that of the free run; its force is averaged by test functions.
    units: by axis.
    """

    sample_rate: float
    topics: Mapping[str, Mapping[str, Array]]
    units: Mapping[str, AxisUnits]

    def write(self, path: Path) -> None:
        """As MCAP, for Foxglove, PlotJuggler or rerun; raises InputError."""
        units = {
            f"{topic}/{column}": getattr(self.units[topic.rpartition("/")[2]], column)
            for topic, columns in self.topics.items()
            for column in columns
        }
        write_topics(self.topics, units, self.sample_rate, path)


def side_by_side(model: MachineModel, parts: Mapping[str, PreparedLog]) -> SideBySide:
    """Measured, model and residual of the axes of one log; raises CannotRun."""
    run = free_run(model, parts)
    first = max(int(np.argmax(np.isfinite(error))) for error in run.error.values())
    topics: dict[str, dict[str, Array]] = {}
    for axis, log in parts.items():
        off = np.nan_to_num(run.error[axis])
        # Blocks of another length may end at another sample; the run is as long as the shorter.
        skip = run.begun - log.motion.left_out
        position, velocity, command = log.motion.at_samples(0.0)[:, skip : skip + len(off)]
        times = log.motion.sample_period * np.arange(skip, skip + len(off))
        left = np.interp(times, log.time - log.motion.time[0], residual(model.axes[axis], [log]))
        force = np.interp(times, log.time - log.motion.time[0], log.command)
        columns = {
            "measured": {"position": position, "velocity": velocity, "force": command},
            "model": {"position": position + off, "force": force - left},
            "residual": {"position": -off, "force": left},
        }
        for kind, signals in columns.items():
            topics[f"/{kind}/{axis}"] = {n: c[first:] for n, c in signals.items()}
    units = {axis: log.motion.units for axis, log in parts.items()}
    return SideBySide(1.0 / next(iter(parts.values())).motion.sample_period, topics, units)
