"""A feedforward as tables over position, speed and phase of a pitch, and what these lose of it.

The tables are measured on the model as one would on a machine: passes at steady speeds in both
directions. What they lose of an effect is measured, too: along a motion, the force that the effect
makes in the model less the one that it makes in the tables.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from twin.effect import Kind
from twin.errors import InputError
from twin.experiments.named import find_experiment
from twin.experiments.trajectory import AnySetpoint
from twin.export import Exported, Held, Loss, Remark, axis_identifiers
from twin.feedforward import feedforward, followed
from twin.logs import Log
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.signals import Array
from twin.simulation.follow import recorded_setpoint

ENTRIES = 256  # of one period
EXPERIMENT, DURATION, SEED = "moves", 10.0, 1  # the motion that tells losses where no log is given


@dataclass(frozen=True, eq=False)
class Periodic:
    """The force that balances an effect which repeats along the track."""

    name: str
    """Of the effect."""
    period: float
    """m."""
    force: Array
    """(ENTRIES,) N, from position 0 on."""

    def harmonics(self, least: float = 0.01) -> dict[int, complex]:
        """Harmonics of at least that part of the largest: cosine term - i sine term, N."""
        found = np.fft.rfft(self.force)[: ENTRIES // 2] * 2.0 / ENTRIES
        found[0] /= 2.0
        sizes = np.abs(found)
        return {int(k): complex(found[k]) for k in np.flatnonzero(sizes > least * sizes.max())}


@dataclass(frozen=True, eq=False)
class AxisTables:
    """The force that an axis needs, as a sum of tables."""

    mass: float
    """kg, times the acceleration."""
    positions: Array
    """(n,) m."""
    along: Array
    """(n,) N, the same in both directions."""
    speeds: Array
    """(k,) m/s, from 0 on."""
    forwards: Array
    """(k,) N, added while the axis moves forwards."""
    backwards: Array
    """(k,) N, added while it moves backwards: negative for a friction."""
    periodic: tuple[Periodic, ...]
    """What repeats along the track."""

    def force(self, motion: Array) -> Array:
        """Force (n,) N along a motion (3, n): position m, velocity m/s, acceleration m/s^2."""
        x, v, a = motion
        total = self.mass * a + np.interp(x, self.positions, self.along)
        total += np.where(v > 0.0, np.interp(v, self.speeds, self.forwards), 0.0)
        total += np.where(v < 0.0, np.interp(-v, self.speeds, self.backwards), 0.0)
        for p in self.periodic:
            places = p.period * np.arange(ENTRIES) / ENTRIES
            total += np.interp(x, places, p.force, period=p.period)
        return np.asarray(total)

    @property
    def odd(self) -> Array:
        """(k,) N, the part of the speed table that turns with the direction."""
        return 0.5 * (self.forwards - self.backwards)


@dataclass(frozen=True, eq=False)
class SetpointMotion:
    """A motion on which losses are told."""

    name: str
    period: float
    """s."""
    setpoints: Mapping[str, Array]
    """By axis (3, n): position m, velocity m/s, acceleration m/s^2."""


def motions(model: MachineModel, logs: Mapping[str, Log]) -> list[SetpointMotion]:
    """The setpoints of logs, or of moves over the travel where none is given."""
    if model.joints:
        raise InputError(f"{model.name}: its axes are joints; give a model of axes with a mass")
    model.require_mass()
    given: dict[str, AnySetpoint] = {n: recorded_setpoint(model, log) for n, log in logs.items()}
    if not given:
        planned = find_experiment(EXPERIMENT, model, duration=DURATION)
        given[f"simulated {EXPERIMENT}"] = planned.setpoint(model, np.random.default_rng(SEED))
    found = []
    for name, s in given.items():
        by_axis = np.stack(s.part(0, len(s)).columns[:3]).transpose(2, 0, 1).copy()
        found.append(
            SetpointMotion(name, 1.0 / s.sample_rate, dict(zip(model.axes, by_axis, strict=True)))
        )
    return found


def tables(axis: AxisModel, reach: tuple[float, float], speed: float) -> AxisTables:
    """The tables of an axis over ``reach``, m, up to a speed in m/s."""
    shown = [
        f for f in followed(axis).axis.effects
        if f.effect.kind in (Kind.FORCE, Kind.MODIFIER, Kind.FRICTION)
        and not f.effect.reads("TIME")
    ]  # fmt: skip
    passed = replace(axis, effects=tuple(f for f in shown if not _repeats(f)))
    positions = np.linspace(*reach, 1025)  # along the travel: a bump a hundredth of it wide has ten
    # from zero on, denser at low speed, where friction bends
    speeds = speed * np.linspace(0.0, 1.0, 61) ** 2
    runs = np.maximum(speeds, 1e-6 * speed)
    usual = speed / 9.0
    along = 0.5 * (_pass(passed, positions, usual) + _pass(passed, positions, -usual))
    few = np.linspace(*reach, 33)  # places that tell the mean over the travel at each speed
    own = np.interp(few, positions, along)
    forwards, backwards = (
        np.array([float(np.mean(_pass(passed, few, way * v) - own)) for v in runs])
        for way in (1.0, -1.0)
    )
    return AxisTables(
        axis.weighed.mass, positions, along, speeds, forwards, backwards,
        tuple(_of_one_period(axis, f) for f in shown if _repeats(f)),
    )  # fmt: skip


def _repeats(fitted: Fitted) -> bool:
    """Whether its force is one of the phase of a pitch alone."""
    effect = fitted.effect
    alone = effect.kind is Kind.FORCE and not effect.states and not effect.reads("V")
    return alone and effect.repeats


def _pass(axis: AxisModel, positions: Array, velocity: float) -> Array:
    """Force (n,) N at these positions of a pass at a velocity, m/s."""
    along = positions if velocity > 0.0 else positions[::-1]
    # of the travel, run on the spot for friction to forget how it began
    run_in = round(0.25 * len(along))
    x = np.concatenate([np.full(run_in, along[0]), along])
    motion = np.stack([x, np.full_like(x, velocity), np.zeros_like(x)])
    period = (positions[1] - positions[0]) / abs(velocity)
    force = feedforward(axis, motion, np.zeros_like(motion), period)[run_in:]
    return force if velocity > 0.0 else force[::-1]


def _of_one_period(axis: AxisModel, fitted: Fitted) -> Periodic:
    period = next(fitted.values[p.name] for p in fitted.effect.parameters if p.period)
    motion = np.zeros((3, ENTRIES))
    motion[0] = period * np.arange(ENTRIES) / ENTRIES
    alone = replace(axis, effects=(fitted,))
    force = feedforward(alone, motion, np.zeros_like(motion), 1.0)
    return Periodic(fitted.effect.name, period, force)


def fewest_points(speeds: Array, force: Array, count: int) -> tuple[Array, float]:
    """Which of the speeds (k,) a table of so many points keeps, and the largest error left, N.

    Straight lines between them leave less at no other choice (dynamic programming); the first and
    the last speed are kept.
    """
    n = len(speeds)
    left = np.full((n, n), np.inf)
    for i in range(n):
        for j in range(i + 1, n):
            line = np.interp(speeds[i : j + 1], speeds[[i, j]], force[[i, j]])
            left[i, j] = np.abs(line - force[i : j + 1]).max()
    best, came = np.where(np.arange(n) == 0, 0.0, np.inf), []
    for _ in range(count - 1):
        reached = np.maximum(best[:, None], left)
        came.append(reached.argmin(axis=0))
        best = reached.min(axis=0)
    kept, at = [n - 1], n - 1
    for before in reversed(came):
        at = int(before[at])
        kept.append(at)
    return np.unique(kept), float(best[n - 1])


NOTHING = Held((), (), ())


@dataclass(frozen=True)
class TableFormat:
    """A format that holds an axis as tables: what it holds of them is what it reads back."""

    write: Callable[[str, AxisModel, AxisTables, Held], Mapping[str, str]]
    """Files of an axis by its name as one of a program, itself, its tables and what is said."""
    read: Callable[[Mapping[str, str], str, AxisModel], AxisTables]
    """The tables that such files hold, of the axis of that name; zero for what is not in them."""

    def held(self, name: str, axis: AxisModel, given: AxisTables) -> AxisTables:
        """What its files hold of tables."""
        return self.read(self.write(name, axis, given, NOTHING), name, axis)

    def exported(self, model: MachineModel, logs: Mapping[str, Log]) -> Exported:
        """The files of each axis, and by effect what they lose on the logs."""
        given, axes = motions(model, logs), {}
        files: dict[str, str | bytes] = {}
        for axis, name in axis_identifiers(model).items():
            judged = _Judged(self, model, axis, name, given)
            axes[axis] = held = judged.held
            files.update(self.write(name, model.axes[axis], judged.tables(model.axes[axis]), held))
        return Exported(files, axes)


@dataclass(frozen=True)
class _Judged:
    """One axis, whose files are read back to tell what they lose on motions."""

    format: TableFormat
    model: MachineModel
    axis: str
    name: str
    given: list[SetpointMotion]

    def tables(self, of: AxisModel) -> AxisTables:
        """Of the axis with other effects."""
        own = self.model.axes[self.axis]
        ends = np.concatenate([m.setpoints[self.axis][0] for m in self.given])
        reach = own.hardware.travel or (float(ends.min()), float(ends.max()))
        if not reach[0] < reach[1]:
            raise InputError(
                f"axis {self.axis}: stands still in {self._where}, and the model has no travel, so "
                f"that no table over its {own.units.words('position')} can be made; give the model "
                "its travel, or a log in which the axis moves"
            )
        fastest = [float(np.abs(m.setpoints[self.axis][1]).max()) for m in self.given]
        return tables(of, reach, max(*fastest, own.hardware.velocity))

    @property
    def _where(self) -> str:
        return ", ".join(m.name for m in self.given)

    @property
    def _moving(self) -> Array:
        """(3, n) of the axis while it moves in all motions."""
        own = np.concatenate([m.setpoints[self.axis] for m in self.given], axis=1)
        return own[:, own[1] != 0.0]

    def _both(self, of: AxisModel) -> Array:
        """Force (2, n) N of an axis while it moves in all motions: in the model, in the files."""
        others = [a for a in self.model.axes if a != self.axis]
        forces = []
        for m in self.given:
            own = m.setpoints[self.axis]
            beside = m.setpoints[others[0]] if len(others) == 1 else np.zeros_like(own)
            forces.append(feedforward(of, own, beside, m.period)[own[1] != 0.0])
        held = self.format.held(self.name, of, self.tables(of))
        return np.stack([np.concatenate(forces), held.force(self._moving)])

    def _losses(self) -> Iterator[tuple[str, Loss]]:
        """What is lost of the mass, and of each effect that a feedforward follows."""
        axis = self.model.axes[self.axis]
        held = self.format.held(self.name, axis, self.tables(axis)).mass
        moved = self._moving[2]
        whole = axis.weighed.mass
        yield axis.units.mass_name, Loss(_size(whole * moved), _size((whole - held) * moved))
        total = self._both(axis)
        for effect in followed(axis).axis.names:
            own, in_files = total - self._both(axis.without(effect))
            yield effect, Loss(_size(own), _size(own - in_files))

    @property
    def held(self) -> Held:
        """What the files hold of the axis as the model does, what nearly, and what not."""
        axis, found = self.model.axes[self.axis], followed(self.model.axes[self.axis])
        units, kept = axis.units, []
        told = {e: (True, why) for e, why in found.lost.items()}
        told |= {e: (False, why) for e, why in found.approximated.items() if e not in told}
        for part, loss in self._losses():
            told.pop(part, None)
            # A mass that moves at an even speed asks for no force, and is no less in the file.
            if loss.is_negligible and (loss.size or part == units.mass_name):
                kept.append(part)
            elif loss.size:
                told[part] = loss.is_most, loss.on(self._where, units.force)
            else:
                force = units.words("force")
                text = f"it makes no {force} on {self._where}, so its loss is not known"
                told[part] = False, text
        parts = [p for p in (units.mass_name, *axis.names) if p in told]
        nearly, lost = (
            tuple(Remark(self.axis, p, told[p][1]) for p in parts if told[p][0] is gone)
            for gone in (False, True)
        )
        return Held(tuple(kept), nearly, lost)


def _size(force: Array) -> float:
    """RMS of a force (n,) N; 0 where the axis does not move at all."""
    return float(np.sqrt(np.mean(force**2))) if len(force) else 0.0
