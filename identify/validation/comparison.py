"""A model beside logs: its errors of force and of motion, where they are, and the signals."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset, by_log
from identify.dataset.noise_floor import known_floor
from identify.dataset.prepared_log import (
    PreparedLog,
    moving,
    on_blocks,
    split_by_log,
    sticks,
    total_force,
)
from identify.estimation.evidence import effective_samples, rms
from identify.estimation.force_balance import residual, unbalanced
from identify.validation.free_run import (
    drift_of_noise,
    free_run,
    left_out_if_it_cannot_run,
    rms_error,
)
from identify.validation.misfit_maps import (
    MisfitMap,
    Region,
    coordinates,
    misfit_by_frequency,
    misfit_maps,
    worst_regions,
)
from identify.validation.whiteness import ResidualTests, loop_of, residual_tests
from twin.logs import write_topics
from twin.model.machine import AxisModel, MachineModel
from twin.model.units import AxisUnits
from twin.parallel import spread
from twin.signals import Array

Parts = Mapping[str, PreparedLog]  # of one log, by axis
T = TypeVar("T")


@dataclass(frozen=True, eq=False, repr=False)
class AxisComparison:
    """One axis over some logs.

    force_error: N RMS of the force residual, by log. floor: N. position_error: m RMS of the free
    run, by log; position_drift_of_noise: the same from measurement noise alone. residual (n,) N,
    coordinates name -> (n,). kept: which test functions of the logs in a row (all,) tell something,
    n of them. curves: force (m,) N of each nonparametric effect along the motion of the logs, by
    its name.
    """

    axis: str
    force_error: Mapping[str, float]
    floor: float
    position_error: Mapping[str, float]
    position_drift_of_noise: Mapping[str, float]
    residual: Array
    logs: Sequence[PreparedLog]
    coordinates: Mapping[str, Array]
    maps: Sequence[MisfitMap]
    worst: Sequence[Region]
    tests: ResidualTests
    kept: NDArray[np.bool_]
    curves: Mapping[str, Array] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"<AxisComparison of {self.axis}: {self.total_error:.4g} N>"

    @property
    def units(self) -> AxisUnits:
        """The units of the axis."""
        return self.logs[0].motion.units

    @property
    def position_fit(self) -> dict[str, float]:
        """By log 1 - RMS error / RMS of the position about its mean: 1 of a model that is right.

        As a percentage it is the NRMSE fit of MATLAB's compare, of the free run with its restarts.
        """
        spread = {log.motion.name: float(np.std(log.motion.position)) for log in self.logs}
        return {name: 1.0 - error / spread[name] for name, error in self.position_error.items()}

    @property
    def total_error(self) -> float:
        """RMS force error over all logs, N."""
        return rms(self.residual)

    @property
    def ratio(self) -> float:
        """Force error over the noise floor."""
        return self.total_error / self.floor


def compare_axis(
    model: MachineModel,
    dataset: Dataset,
    position_error: Mapping[str, float],
    position_drift_of_noise: Mapping[str, float],
    floor: float | None = None,
) -> AxisComparison:
    """Force errors of one axis over the dataset's training logs, with maps of where they are.

    floor: noise floor, N RMS; as the model and what it leaves tell it where None.
    """
    axis, logs = model.axes[dataset.axis], dataset.training
    kept = moving(logs, sticks(axis))
    every = residual(axis, logs)
    force = every[kept]
    if floor is None:
        floor = known_floor(axis, logs, np.where(kept, every, 0.0))
    by_log = zip(logs, split_by_log(every, logs), split_by_log(kept, logs), strict=True)
    where = {k: v[kept] for k, v in coordinates(axis, logs).items()}
    maps = [*misfit_maps(axis, logs, floor, force, where), misfit_by_frequency(axis, logs)]
    return AxisComparison(
        axis=dataset.axis,
        force_error={log.motion.name: rms(left[own]) for log, left, own in by_log},
        floor=floor,
        position_error=position_error,
        position_drift_of_noise=position_drift_of_noise,
        residual=force,
        logs=logs,
        coordinates=where,
        maps=maps,
        worst=worst_regions(maps, effective_samples(force)),
        tests=residual_tests(logs, every, kept, floor, loop_of(logs)),
        kept=kept,
        curves=_nonparametric_forces(axis, logs),
    )


def _nonparametric_forces(axis: AxisModel, logs: Sequence[PreparedLog]) -> dict[str, Array]:
    """The force (m,) N of each nonparametric effect along the motion of logs in a row."""
    found = {}
    for f in (f for f in axis.effects if f.effect.is_nonparametric):
        alone = on_blocks(AxisModel(1.0, effects=(f,), rotary=axis.rotary))
        found[f.effect.name] = np.concatenate([total_force(alone, log.motion) for log in logs])
    return found


def position_errors(
    model: MachineModel, found: Mapping[str, Dataset], progress: Callable[[int, int], None]
) -> tuple[dict[str, dict[str, float]], dict[str, dict[str, float]]]:
    """Free-running position error, and that of noise alone: axis -> log -> m RMS.

    There is none where the motion is imposed, and of a log on whose command the model runs away.
    """

    def both(parts: Parts) -> dict[str, tuple[float, float]]:
        own = free_run(model, parts)
        noise = drift_of_noise(model, parts, own)
        return {axis: (rms_error(own, axis), rms_error(noise, axis)) for axis in parts}

    every = _of_each_log(both, model, found, progress)
    errors, floors = (
        {axis: {name: pair[i] for name, pair in own.items()} for axis, own in every.items()}
        for i in (0, 1)
    )
    return errors, floors


def free_run_errors(
    model: MachineModel, found: Mapping[str, Dataset], progress: Callable[[int, int], None]
) -> dict[str, dict[str, float]]:
    """The first of these alone, without the runs of noise."""

    def error(parts: Parts) -> dict[str, float]:
        own = free_run(model, parts)
        return {axis: rms_error(own, axis) for axis in parts}

    return _of_each_log(error, model, found, progress)


def _of_each_log(
    errors: Callable[[Parts], Mapping[str, T]],
    model: MachineModel,
    found: Mapping[str, Dataset],
    progress: Callable[[int, int], None],
) -> dict[str, dict[str, T]]:
    """What free runs on each log tell of its axes: axis -> log; nothing where there is no run."""
    logs = {} if model.is_imposed else by_log(found)
    if model.joints:  # whose motion asks for the torques of all
        logs = {name: parts for name, parts in logs.items() if len(parts) == len(model.axes)}

    def run(parts: Parts) -> Mapping[str, T]:
        with left_out_if_it_cannot_run(next(iter(parts.values())).motion.name):
            return errors(parts)
        return {}

    out: dict[str, dict[str, T]] = {a: {} for a in found}
    for name, by_axis in zip(logs, spread(run, logs.values(), progress), strict=True):
        for axis, own in by_axis.items():
            out[axis][name] = own
    return out


@dataclass(frozen=True, eq=False)
class SideBySide:
    """Of one log what was measured, what the model says and what is left, at the same samples.

    sample_rate: Hz; topics: "/measured/x" -> column -> (n,) in units of the axis. The position of
    the model is that of the free run; its force is averaged by test functions. units: by axis.
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
        left = np.interp(times, log.time - log.motion.time[0], unbalanced(model.axes[axis], [log]))
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
