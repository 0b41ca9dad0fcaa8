"""The force balance: log and model -> force residual in newtons on the measured motion.

A residual is told in the force as it was logged: what is left of the motor's force, over the gain
of the axis' actuation (``motor_gain``). A fit minimises just that, so that none can leave less by a
motor that does less.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import lru_cache, partial
from itertools import product
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from identify.dataset.blocks import Blocks
from identify.dataset.dataset import Dataset
from identify.dataset.drive import Valued, actual_force, parts_of, reading_error, true_motion
from identify.dataset.motion import Motion
from identify.dataset.path import Slip
from identify.dataset.prepared_log import (
    PreparedLog,
    motor_gain,
    moving,
    scale_of,
    split_by_log,
    sticks,
    total_force,
    total_forces,
)
from identify.dataset.test_function import SHORTEST
from identify.dataset.time_scale import QUIET
from identify.estimation.force_along import force_along
from identify.estimation.scaling import STEP, difference_step
from twin.core.compiled import P_AT
from twin.core.native import Table
from twin.core.settling import settle
from twin.core.walks import averaged_columns, reading_columns
from twin.effect import RUBBING, Kind
from twin.errors import InputError
from twin.model.machine import AxisModel, axis_table
from twin.model.parameters import ParameterReference, read, write
from twin.parallel import spread
from twin.signals import Array, between
from twin.threads import trim_beside

LOCKS = 0.8  # of a load: a friction that grows by more of it lets the axis hardly move
_Along: TypeAlias = Callable[[PreparedLog], Array]
_Walk: TypeAlias = tuple[list[int], _Along]


def averaged_force(axis: AxisModel, logs: Sequence[PreparedLog]) -> Array:
    """The force that the axis' effects add to the command, averaged by test functions (n,) N.

    Log after log. A sensing effect adds an apparent force, mass x acceleration of the reading's
    error, and the other effects act along the true motion, under the actual force.
    """
    table = _table_between(axis)

    def averaged(log: PreparedLog) -> Array:
        driven, added = _driven(axis, log)
        return np.asarray(log.test_function.mean(total_force(table, driven)) + added)

    return np.concatenate(spread(averaged, logs))


def effect_forces(axis: AxisModel, logs: Sequence[PreparedLog]) -> dict[str, Array]:
    """By name, the force (n,) N that each effect adds to the command: all less all but it."""
    logs = settled(axis, logs)
    whole = averaged_force(axis, logs)
    return {name: whole - averaged_force(axis.without(name), logs) for name in axis.names}


def _is_apart(axis: AxisModel) -> bool:
    """Whether actuation is walked by itself.

    One with memory asks for the log's own rate; a friction with load is walked under that.
    """
    memory = any(f.effect.kind is Kind.ACTUATION and f.effect.states for f in axis.effects)
    return memory or bool(_borne(axis))


def _borne(axis: AxisModel) -> list[str]:
    """Names of the effects by which friction depends on the load."""
    effects = (f.effect for f in axis.effects)
    return [e.name for e in effects if e.kind in RUBBING and e.reads("U")]


def _table_between(axis: AxisModel) -> Table:
    """Table of the effects that act along the motion and force of ``_driven``."""
    apart = {Kind.SENSING, *((Kind.ACTUATION,) if _is_apart(axis) else ())}
    return axis_table({"": parts_of(axis, *(set(Kind) - apart))})


def _driven(
    axis: AxisModel, log: PreparedLog, whole: AxisModel | None = None
) -> tuple[Motion, Array | float]:
    """The motion behind the readings under the actual force, and what both add (n,) N.

    whole: the axis of which this is a part, whose load it bears.
    """
    motion, error_rate = true_motion(axis, log.motion)
    added: Array | float = 0.0
    driven = motion
    if _is_apart(axis):
        driven = motion.with_force(actual_force(axis, motion))
        added = log.fine.mean(driven.raw[1] - motion.raw[1])
    if _borne(axis):
        driven = _under(driven, _load(whole or axis, log))
    if motion is not log.motion:
        added = added + axis.mass * log.fine.acceleration(error_rate)
    return driven, added


def _load(axis: AxisModel, log: PreparedLog) -> Array:
    """Force (n,) N that the motion asks of the motor by the model.

    In each block, from the means by test functions. Not the measured command: of that friction in
    its proportion takes noise as well, and "explains" it.
    """
    return _load_of(Valued.of(_loading(axis)), axis.mass, log)


@lru_cache(maxsize=16)  # whatever is walked at the same values of an axis bears the same load
def _load_of(loading: Valued, mass: float, log: PreparedLog) -> Array:
    """The load: what all else asks, less the friction under it.

    By a step of the secant from no load, which is exact where friction grows in proportion.
    """
    axis, motion = loading.axis, true_motion(loading.axis, log.motion)[0]
    others = parts_of(axis, *(set(Kind) - {*RUBBING}))
    bodies = log.fine.mean(log.motion.raw[1]) - log.command
    asked = mass * log.acceleration - averaged_force(others, [log]) + bodies
    asked = _sharpened(asked[None], log)[0]
    table, none = _table_between(parts_of(axis, *RUBBING, Kind.SENSING)), np.zeros(len(asked))
    bare = total_force(table, _under(motion, none))
    load = asked - bare
    more = total_force(table, _under(motion, load)) - bare
    slope = np.divide(more, load, out=none, where=load != 0.0)
    return load - more / (1.0 + np.maximum(slope, -LOCKS))


def _loading(axis: AxisModel) -> AxisModel:
    """The axis with what makes the load of its friction."""
    return parts_of(axis, *(set(Kind) - {Kind.ACTUATION}))


def _under_load(table: Table, motion: Motion, load: Array) -> tuple[Array, Array]:
    """The force (n,) N of a friction under a load (n,) N, and how it changes with that."""
    step = STEP * (float(np.std(load)) or 1.0)
    now, then = (total_force(table, _under(motion, force)) for force in (load, load + step))
    return now, np.maximum((then - now) / step, -LOCKS)


def _sharpened(means: Array, log: PreparedLog) -> Array:
    """Forces (m, k) N by blocks whose means by test functions are these (m, n) N."""
    time, middles = log.motion.time, log.time
    if len(middles) < 2:
        return np.repeat(means, len(time), axis=1)
    left = np.clip(np.searchsorted(middles, time) - 1, 0, len(middles) - 2)
    share = np.clip((time - middles[left]) / (middles[left + 1] - middles[left]), 0.0, 1.0)

    def on_blocks(each: Array) -> Array:
        return each[:, left] + share * (each[:, left + 1] - each[:, left])

    out = on_blocks(means)
    for _ in range(2):  # averaging smooths the force: add back what it removed
        out += on_blocks(means - log.test_function.mean(out))
    return out


def _under(motion: Motion, force: Array) -> Motion:
    """A motion under another force (n,) N by blocks."""
    return replace(motion, track=Blocks(np.stack([*motion.signals[:2], force]), motion.raw))


def settled(axis: AxisModel, logs: Sequence[PreparedLog]) -> list[PreparedLog]:
    """The logs with what laws with memory hold at rest where the readings do not tell it.

    There it is what balances the force, as far as the noise of the readings leaves room for it. A
    friction that sticks balances it by itself.
    """
    hides = [log.motion.path.room if log.motion.path else 0.0 for log in logs]
    if not any(f.effect.remembers for f in axis.effects) or sticks(axis) or not any(hides):
        return list(logs)
    own = Valued.of(axis)
    holds = Valued.of(replace(axis, effects=tuple(f for f in axis.effects if f.effect.remembers)))
    force = _held_over(holds, logs[int(np.argmax(hides))].motion, max(hides))

    def one(log: PreparedLog) -> PreparedLog:
        motion = log.motion
        matters = motion.slip is None and force > QUIET * motion.net_scatter
        return _settled(own, log) if matters else log

    return spread(one, logs)


@lru_cache(maxsize=16)  # a fit asks for the residual and its derivatives at the same values
def _settled(own: Valued, log: PreparedLog) -> PreparedLog:
    axis, motion = own.axis, log.motion
    table, (driven, _) = _table_between(axis), _driven(axis, log)
    path = motion.path
    if path is None:
        return log
    acting = true_motion(axis, motion)[0]
    if _is_apart(axis):
        acting = acting.with_force(actual_force(axis, acting))
    signals = driven.joint_signals if table.reads_joints else driven.signals
    moved = settle(
        table, signals, driven.others, acting.net, driven.followed, path.stands, path.room,
        SHORTEST, motion.period, motion.time_origin,
    )  # fmt: skip
    slip = Slip(moved / motion.period, path.stands & (moved != 0.0))
    return replace(log, motion=replace(motion, slip=slip))


@lru_cache(maxsize=4)  # most of what a fit moves is none of theirs
def _held_over(holds: Valued, motion: Motion, way: float) -> float:
    """Force (N) by which laws with memory change over so much of a way (m) from the start."""
    moved = np.array([0.0, way, 0.0])
    place = np.full(len(moved), motion.position[0])
    now, _, then = force_along(holds.axis, place, moved / motion.period, motion.period, *Kind)
    return float(abs(then - now))


def unbalanced(axis: AxisModel, logs: Sequence[PreparedLog]) -> Array:
    """Averaged command + effects - mass x acceleration, (n,) N, log after log."""
    inertia = np.concatenate([log.command - axis.mass * log.acceleration for log in logs])
    return np.asarray(inertia + averaged_force(axis, settled(axis, logs)))


def residual(axis: AxisModel, logs: Sequence[PreparedLog]) -> Array:
    """Force residual (n,) N, log after log: what is unbalanced, in the force as it was logged."""
    return unbalanced(axis, logs) / motor_gain(axis, logs)


def require_residual(axis: AxisModel, dataset: Dataset) -> None:
    """Raise InputError where the residual is not a number in a test function that counts."""
    kept = moving(dataset.training, sticks(axis))
    with np.errstate(all="ignore"):
        require_finite(residual(axis, dataset.training)[kept], dataset)


def require_finite(left: Array, dataset: Dataset) -> None:
    """Raise InputError where a residual (n,) N of the test functions that count is not a number."""
    if bad := np.count_nonzero(~np.isfinite(left)):
        names = ", ".join(log.motion.name for log in dataset.training)
        raise InputError(
            f"axis {dataset.axis}: the force of the model is not a finite number in {bad} of "
            f"{len(left)} test functions of {names}; check the values of its effects, "
            "or leave them out to begin with their start values"
        )


def group_of(axis: AxisModel, effect: str) -> AxisModel:
    """The part of the axis whose force can change when a parameter of that effect does.

    Friction and its modifiers form one group, the actuation effects another. Any other effect is a
    group by itself. Sensing effects belong to every group, because they change the motion that all
    others act along.
    """
    kind = axis[effect].effect.kind
    if kind is Kind.SENSING:
        return axis
    for joint in (RUBBING, (Kind.ACTUATION,)):
        if kind in joint:
            return parts_of(axis, *joint, Kind.SENSING)
    return replace(axis, effects=(axis[effect], *parts_of(axis, Kind.SENSING).effects))


def jacobian(
    axis: AxisModel,
    logs: Sequence[PreparedLog],
    where: Sequence[ParameterReference],
    kept: NDArray[np.bool_] | None = None,
) -> Array:
    """Derivative of the residual by these parameters, (n, n_parameters), N per unit.

    kept: which test functions are asked for, where not all are.
    """
    values = read(axis, where)
    scale = scale_of(logs)
    steps = np.array([difference_step(c, v, scale) for c, v in zip(where, values, strict=True)])
    changed = changes(axis, logs, where, steps, kept)
    changed /= steps[:, None]
    trim_beside(changed.nbytes)
    return changed.T


def changes(
    axis: AxisModel,
    logs: Sequence[PreparedLog],
    where: Sequence[ParameterReference],
    steps: Array,
    kept: NDArray[np.bool_] | None = None,
) -> Array:
    """Change (m, n) N of the residual as each of m parameters by itself changes by its step.

    Those of one effect go along the motion in one walk; a parameter may be given several times.
    kept: which test functions are asked for, of which the parameters then lie side by side.
    """
    logs = settled(axis, logs)
    every = np.ones(sum(map(len, logs)), dtype=bool)
    asked = every if kept is None else kept
    out = _walked(axis, logs, where, steps, every if _borne(axis) else asked)
    if _borne(axis):
        out = (out + _by_load(axis, logs, where, steps, out))[:, asked]
    out *= np.concatenate([log.informative_share for log in logs])[asked]
    gain = motor_gain(axis, logs)
    driving = [j for j, c in enumerate(where) if _drives(axis, c)]
    left = unbalanced(axis, logs)[asked] if driving else 0.0
    for j in driving:  # the motor's gain changes with them
        moved = write(axis, [where[j]], read(axis, [where[j]]) + steps[j])
        out[j] = (left + out[j]) * (gain / motor_gain(moved, logs)) - left
    if gain != 1.0:
        out /= gain
    return out


def _walked(
    axis: AxisModel,
    logs: Sequence[PreparedLog],
    where: Sequence[ParameterReference],
    steps: Array,
    asked: NDArray[np.bool_],
) -> Array:
    """The changes (m, n) N of averaged forces along settled logs, the load of friction as it is."""
    own = split_by_log(asked, logs)
    ends = np.cumsum([np.count_nonzero(some) for some in own])
    spans = [slice(end - np.count_nonzero(some), end) for end, some in zip(ends, own, strict=True)]
    out = np.empty((len(where), ends[-1]), order="C" if asked.all() else "F")

    def walk(job: tuple[_Walk, tuple[PreparedLog, NDArray[np.bool_], slice]]) -> None:
        (rows, along), (log, some, span) = job
        out[rows, span] = along(log)[:, some]

    spread(walk, product(_walks(axis, where, steps), zip(logs, own, spans, strict=True)))
    return out


def _drives(axis: AxisModel, c: ParameterReference) -> bool:
    """Whether it is a parameter of what makes the command a force."""
    return bool(c.effect) and axis[c.effect].effect.kind is Kind.ACTUATION


def _by_load(
    axis: AxisModel,
    logs: Sequence[PreparedLog],
    where: Sequence[ParameterReference],
    steps: Array,
    walked: Array,
) -> Array:
    """Change (m, n) N of the residual as parameters move the load of the friction.

    walked: N under the load as it is (m, n), which hardly changes while bristles slip.
    """
    out, loading = np.zeros_like(walked), _loading(axis)
    own = [j for j, c in enumerate(where) if _loads(loading, c.effect)]
    if not own:
        return out
    rubbing = parts_of(axis, *RUBBING, Kind.SENSING)
    table = _table_between(rubbing)

    def followed(job: tuple[PreparedLog, Array]) -> Array:
        log, means = job
        motion = _driven(rubbing, log, axis)[0]
        slope = _under_load(table, motion, motion.signals[2])[1]
        by = _sharpened(-means.T, log) * (slope / (1.0 + slope))  # more load, more friction
        return log.test_function.mean(by)

    each = zip(logs, split_by_log(walked[own].T, logs), strict=True)
    out[own] = np.concatenate(spread(followed, each), axis=1)
    return out


def _loads(loading: AxisModel, effect: str) -> bool:
    """Whether an effect, "" the mass, is a part of the load; of sensing the whole is walked."""
    return not effect or (
        effect in loading.names and loading[effect].effect.kind is not Kind.SENSING
    )


def _walks(axis: AxisModel, where: Sequence[ParameterReference], steps: Array) -> Iterator[_Walk]:
    """For each walk along a log the parameters that it is for, and the change that they make."""
    by_effect: dict[str, list[int]] = {}
    for j, c in enumerate(where):
        by_effect.setdefault(c.effect, []).append(j)
    for effect, index in by_effect.items():
        if not effect:
            yield index, partial(_by_mass, axis, steps[index, None])
            continue
        law = axis[effect].effect
        at_once = law.columns is not None and law.kind is Kind.FORCE
        linear = [j for j in index if at_once and where[j].parameter.strength]
        if linear:
            yield linear, partial(_by_strengths, axis, [where[j] for j in linear], steps[linear])
        bent = [j for j in index if j not in linear]
        if bent:
            group, own = group_of(axis, effect), [where[j] for j in bent]
            moved = [
                write(group, [c], [v + step])
                for c, v, step in zip(own, read(group, own), steps[bent], strict=True)
            ]
            yield bent, _difference(axis, group, moved, effect)


def _by_strengths(
    axis: AxisModel, where: Sequence[ParameterReference], steps: Array, log: PreparedLog
) -> Array:
    """Change (m, n) N of the averaged force by strengths of one effect that has columns."""
    own = axis[where[0].effect]
    names = [p.name for p in own.effect.strengths]
    rows = [names.index(c.parameter.name) for c in where]
    motion, test = true_motion(axis, log.motion)[0], log.test_function
    columns = averaged_columns(
        own.effect, own.vector(), motion.signals, motion.period, motion.time_origin,
        test.weights, test.stride,
    )  # fmt: skip
    columns = columns[rows]
    columns *= steps[:, None]
    return np.asarray(columns)


def _difference(
    axis: AxisModel, group: AxisModel, moved: Sequence[AxisModel], effect: str
) -> _Along:
    """Change (m, n) N of the averaged force along a log when one effect's values move."""
    kind = group[effect].effect.kind
    # An effect alone of no strength gives no force, which need not be walked for.
    strengths = [group[effect].values[p.name] for p in group[effect].effect.strengths]
    absent = len(group.effects) == 1 and bool(strengths) and not any(strengths)
    if kind is Kind.SENSING and absent:
        return partial(_apparent_forces, moved, effect)
    if kind is Kind.SENSING or (kind is Kind.ACTUATION and _is_apart(group)):
        return partial(_one_by_one, moved, None if absent else group)
    # The motion and the force behind it stay; all sets of values go along it in one walk.
    table = _table_between(group)
    first = int(table.entries[table.labels.index(("", effect)), P_AT])
    sets = np.tile(table.parameters, (len(moved), 1))
    for row, other in zip(sets, moved, strict=True):
        vector = other[effect].vector()
        row[first : first + len(vector)] = vector
    return partial(_together, axis, group, table, sets, absent)


def _one_by_one(moved: Sequence[AxisModel], unmoved: AxisModel | None, log: PreparedLog) -> Array:
    """Change (m, n) N of the averaged force by walks of their own, from an axis or from none."""
    if unmoved is None:
        return np.stack([averaged_force(axis, [log]) for axis in moved])
    base = averaged_force(unmoved, [log])
    return np.stack([averaged_force(axis, [log]) - base for axis in moved])


def _together(
    axis: AxisModel, group: AxisModel, table: Table, sets: Array, absent: bool, log: PreparedLog
) -> Array:
    """The change by sets (m, p) of the table's parameters in one walk; absent: from no force."""
    motion = _driven(group, log, axis)[0]
    every = sets if absent else np.concatenate([table.parameters[None], sets])
    # forces of several sets of parameters that are held until they are averaged
    at_once = max(500_000 // motion.signals.shape[1], 2)
    means, unmoved = [], 0.0
    for i in range(0, len(every), at_once):
        forces = total_forces(table, every[i : i + at_once], motion)
        if not i and not absent:
            unmoved, forces = forces[0], forces[1:]
        forces -= unmoved
        means.append(log.test_function.mean(forces))
    return np.concatenate(means)


def _apparent_forces(sensing: Sequence[AxisModel], effect: str, log: PreparedLog) -> Array:
    """Force (m, n) N that one sensing effect alone seems to add, to first order in its error.

    Linear in its strengths, where the effect gives their columns.
    """
    motion, mass, own = log.motion, sensing[0].mass, [axis[effect] for axis in sensing]
    path, period = motion.smoothed_position, motion.sample_period
    if own[0].effect.columns is None:
        rates = (reading_error(axis, motion, path, passes=1)[1] for axis in sensing)
        return np.stack([mass * log.fine.acceleration(rate) for rate in rates])
    track = np.stack([path, motion.raw[0]])
    errors = reading_columns(own[0].effect, own[0].vector(), track, period)
    rates = (np.append(between(error, period), 0.0) for error in errors)
    strengths = np.array([[f.values[p.name] for p in f.effect.strengths] for f in own])
    return np.asarray(strengths @ [mass * log.fine.acceleration(rate) for rate in rates])


def _by_mass(axis: AxisModel, steps: Array, log: PreparedLog) -> Array:
    """Change (m, n) N by the moved mass, to which sensing errors and most attached masses scale."""
    attached = parts_of(axis, Kind.STRUCTURE, Kind.SENSING)
    alike = (
        f for f in attached.effects if f.effect.kind is Kind.SENSING or f.effect.reads("MOVED")
    )
    attached = replace(attached, effects=tuple(alike))
    return np.asarray(steps * (averaged_force(attached, [log]) / axis.mass - log.acceleration))
