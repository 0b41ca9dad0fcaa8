"""What a feedforward is worth: the tracking error of a simulated machine with it and without.

The machine follows the motion of a log under the feedback of its model. The feedforward is that of
a model of it (twin.feedforward), of the middle of the period over which a command is held, and as
much earlier as the machine's drive is late.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import reduce

import numpy as np

from identify.dataset.given_logs import shortness
from identify.estimation.evidence import rms
from twin.checks import moves
from twin.effect import Kind
from twin.experiments.trajectory import Setpoint
from twin.feedforward import feedforward, followed
from twin.logs import Log
from twin.model.machine import AxisModel, MachineModel
from twin.parallel import Progress, silent
from twin.record import Number, record
from twin.signals import Array, between, moving_mean, rate
from twin.simulation.loop import POSITION_COLUMN, Controller
from twin.simulation.simulators import ReducedSimulator, run


@record
class TrackingError:
    """Setpoint minus true position over all logs, in the unit of the axis."""

    rms: Number
    largest: Number


@record
class AxisTracking:
    """Tracking errors of an axis in simulation."""

    unit: str
    without: TrackingError
    """Under feedback alone."""
    before: TrackingError | None
    """With the feedforward of the model before."""
    diagnosed: TrackingError
    """With that of the model itself."""
    gains: Mapping[str, Number]
    """By effect, by how much the RMS error grows where the feedforward leaves it out."""
    lost: Mapping[str, str]
    """Effects that the feedforward cannot hold, and why."""

    @property
    def by_feedforward(self) -> dict[str, TrackingError]:
        """The errors by what is fed forward, in words."""
        named = {
            "feedback alone": self.without,
            "with the feedforward of the model before": self.before,
            "with that of the model": self.diagnosed,
        }
        return {name: error for name, error in named.items() if error is not None}


def tracking(
    machine: MachineModel,
    model: MachineModel,
    before: MachineModel | None,
    logs: Mapping[str, Log],
    progress: Progress = silent,
) -> dict[str, AxisTracking]:
    """By axis that moves the tracking errors of a machine under the feedforward of a model of it.

    logs: in each of which an axis is moved (``unmoved``). gains: of the effects that the model
    before lacks, of all where there is none. Raises InputError for an axis that the model before
    lacks, CannotRun where the machine cannot be simulated.
    """
    machine.require_mass()
    motions = [_motion(model, log) for log in logs.values()]
    names = [a for a in model.axes if any(_is_moved(log, a) for log in logs.values())]
    variants: dict[tuple[str, str], MachineModel] = {}
    for name in names:
        axis, earlier = model.axes[name], before.axis(name) if before else None
        for effect in _named(axis, earlier):
            variants[name, effect] = model.with_axis(name, _less(axis, effect, earlier))
    models: list[MachineModel | None] = [None, before, model, *variants.values()]
    errors: list[dict[str, TrackingError]] = []
    for i, one in enumerate(models):
        progress("simulating", i, len(models))
        errors.append({} if i == 1 and one is None else _errors(machine, one, motions, names))
    without, with_before, diagnosed, *others = errors
    grown = dict(zip(variants, others, strict=True))
    return {
        a: AxisTracking(
            model.axes[a].units.position,
            without[a],
            with_before.get(a),
            diagnosed[a],
            {e: own[a].rms - diagnosed[a].rms for (axis, e), own in grown.items() if axis == a},
            followed(model.axes[a]).lost,
        )
        for a in names
    }


def unmoved(model: MachineModel, log: Log) -> str | None:
    """Why a log has no motion for the axes of a model to follow; None where it has."""
    if short := shortness(log):
        return short
    if any(_is_moved(log, axis) for axis in model.axes):
        return None
    return f"no axis of the model ({', '.join(model.axes)}) moves in it; give one in which one does"


def _is_moved(log: Log, axis: str) -> bool:
    """Whether an axis of a log is moved: its setpoint where it has one, else the axis."""
    if axis not in log.axes:
        return False
    wanted = log.axes[axis].columns.get("setpoint_position")
    return moves(log, axis) if wanted is None else bool(np.ptp(wanted))


def _at(model: MachineModel, axis: str) -> int:
    return list(model.axes).index(axis)


def _named(axis: AxisModel, before: AxisModel | None) -> list[str]:
    """The effects whose gain is told."""
    present = [f.effect.name for f in axis.effects if f.effect.is_present(f.values)]
    return [n for n in present if before is None or n not in before.names]


def _less(axis: AxisModel, effect: str, before: AxisModel | None) -> AxisModel:
    """The axis without an effect; in the place of a friction it has the one that was there."""
    less = axis.without(effect)
    friction = before and before.friction
    own = axis[effect].effect.kind is Kind.FRICTION
    return less.with_effect(friction) if own and friction else less


def _motion(model: MachineModel, log: Log) -> Setpoint:
    """The motion of a log, of its setpoint where it has one, smooth enough to be followed."""
    smoothed = 5e-3  # s, over which a motion is averaged thrice: of a reading nothing else is left
    width = 2 * round(0.5 * smoothed * log.sample_rate) + 1
    # s, within which a motion that the log begins amidst is begun from rest
    columns, done = [], np.clip(np.arange(len(log)) * log.period / 0.2, 0.0, 1.0)
    # the polynomial of fifth degree from rest to rest
    begun = done**3 * (10.0 - 15.0 * done + 6.0 * done**2)
    for name in model.axes:
        own = log.axes[name].columns if name in log.axes else {"position": np.zeros(len(log))}
        position = own.get("setpoint_position", own["position"])
        position = reduce(lambda x, _: moving_mean(x, width), range(3), position)
        position = position[0] + begun * (position - position[0])
        velocity = rate(position, log.period)
        columns.append((position, velocity, rate(velocity, log.period)))
    x, v, a = np.stack(columns, axis=2)
    return Setpoint(x, v, a, np.zeros_like(x), log.sample_rate)


def _errors(
    machine: MachineModel, model: MachineModel | None, motions: list[Setpoint], names: list[str]
) -> dict[str, TrackingError]:
    """By axis the error over all motions, with the feedforward of a model or of none."""
    feedback = {a: replace(Controller.for_axis(m), mass=0.0) for a, m in machine.axes.items()}
    found: dict[str, list[Array]] = {name: [] for name in names}
    for motion in motions:
        speeds = [
            _as_read(motion.position[:, i], feedback[a].filter_bandwidth, motion.sample_rate)
            for i, a in enumerate(machine.axes)
        ]
        force = motion.force if model is None else _force(model, motion)
        seed = 0  # of the encoders' noise, the same in every run
        done = run(
            replace(machine, sample_rate=motion.sample_rate),
            replace(motion, velocity=np.stack(speeds, axis=1), force=force),
            np.random.default_rng(seed), simulator=ReducedSimulator, controllers=feedback,
        )  # fmt: skip
        for name in names:
            i = _at(machine, name)
            found[name].append(motion.position[:, i] - done.signals[:, i, POSITION_COLUMN])
    every = {name: np.concatenate(parts) for name, parts in found.items()}
    return {name: TrackingError(rms(e), float(np.abs(e).max())) for name, e in every.items()}


def _as_read(position: Array, bandwidth: float, sample_rate: float) -> Array:
    """Velocity (n,) of a motion as the controller's filter gives it, m/s.

    With that as its setpoint a controller does not act against a motion that is as it should be.
    """
    kept = float(np.exp(-2.0 * np.pi * bandwidth / sample_rate))
    forgotten = 1e-9  # what is left of a value in the speed filter when it is left out
    taps = 1 + int(np.ceil(np.log(forgotten) / np.log(kept))) if kept > forgotten else 1
    speed = np.concatenate([np.zeros(taps), between(position, 1.0 / sample_rate)])
    return np.convolve(speed, (1.0 - kept) * kept ** np.arange(taps), "valid")


def _force(model: MachineModel, motion: Setpoint) -> Array:
    """Feedforward of all axes along a motion, (n, n_axes) N."""
    period = 1.0 / motion.sample_rate
    time = period * np.arange(len(motion))
    forces = []
    for i, axis in enumerate(model.axes.values()):
        due = time + followed(axis).ahead(period)
        columns = motion.position, motion.velocity, motion.acceleration
        ahead = [
            [np.interp(due, time, c[:, j]) for c in columns]
            for j in (i, 1 - i if len(model.axes) == 2 else i)
        ]
        own, other = map(np.array, ahead)
        forces.append(feedforward(axis, own, other, period))
    return np.stack(forces, axis=1)
