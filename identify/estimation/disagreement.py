"""Which log disagrees with the others, where, and as if what were otherwise in it.

One log that was aliased, touched, or made with another payload or at another temperature spoils
what is told of all. Each log is predicted by a fit of the others (one linear step), and stands out
where it leaves several times what any of them leaves. What a model lacks may do that as well, where
one log alone excites it: so a log counts where others have been too, in position, speed,
acceleration and its rate. What stands out for a moment alone, as a blow or a slipped encoder, does
so against all moments of all logs.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset
from identify.dataset.drive import parts_of
from identify.dataset.odd_log import FEWEST, Disagreement, Otherwise, Recorded
from identify.dataset.prepared_log import PreparedLog, moving, split_by_log, sticks
from identify.dataset.test_function import LOOK
from identify.estimation.evidence import rms
from identify.estimation.force_balance import averaged_force, jacobian, residual
from identify.estimation.least_squares import RIDGE
from identify.estimation.scaling import Scaling
from twin.effect import RUBBING
from twin.model.machine import AxisModel
from twin.model.parameters import ParameterReference, read
from twin.signals import Array, rate

OUT = 2.5  # times the error of any other log, where they have been, from which one stands out
FEW = 2.0  # times as much asked of three logs, as of two others nobody knows how alike they are
PEAK = 3.0  # times the largest error of any other moment, from which one stands out
CLEAR = 10.0  # times its scatter between the others, from which a parameter has another value
CHANGED = 0.2  # of its value; a law of a slightly wrong shape moves it by less from log to log
MOMENT = 0.1  # of a log; what lasts longer is no moment


@dataclass(frozen=True, eq=False)
class _Rows:
    """Of one log what tells: residual (n,) N, its columns (n, k), states (n, 5), times (n,) s.

    recorded (n, 3): N per unit of each of Recorded. size (k + 3,): N per unit, by which the columns
    were divided; 1 of those of the recording. named (k + 3,): which of these may be another value
    of one log; a point of a free curve is none. kept: which test functions tell. going (n,): in
    which of these no friction holds the axis at rest, of which no other log tells how much.
    """

    log: PreparedLog
    left: Array
    columns: Array
    recorded: Array
    states: Array
    time: Array
    size: Array
    named: NDArray[np.bool_]
    kept: NDArray[np.bool_]
    going: NDArray[np.bool_]

    @cached_property
    def every(self) -> Array:
        """The columns (n, k + 3) of the model, then of the recording."""
        return np.column_stack([self.columns, self.recorded])

    def predicted_by(self, others: Sequence[_Rows]) -> _Rows:
        """Those that a fit of other logs predicts no worse than they were measured.

        By their leverage; a part of a free curve where others have not been, nobody predicts, nor
        what friction holds.
        """
        weak = RIDGE**2 * np.eye(self.columns.shape[1])
        gram = sum((r.columns.T @ r.columns for r in others), weak)
        leverage = np.sum(self.columns * np.linalg.solve(gram, self.columns.T).T, axis=1)
        which = (leverage < 1.0) & self.going
        names = ("left", "columns", "recorded", "states", "time", "going")
        return replace(self, **{name: getattr(self, name)[which] for name in names})


def disagreeing(axis: AxisModel, logs: Sequence[PreparedLog]) -> Disagreement | None:
    """The log that disagrees with the others, by a model with its values; None where none does.

    It is looked for with test functions of their length and with longer ones, which are quiet.
    Where the two tell two logs, the one that is sure counts. Where the others do not agree without
    it, the model is what is wrong, and no log, unless it alone is sure. Of a mechanism, whose
    joints share their logs, none is told.
    """
    if any(log.motion.bodies is not None for log in logs):
        return None
    each = [_at_one_length(axis, some) for some in (logs, _longer(logs)) if some]
    found = [d for d in each if d is not None]
    found = [d for d in found if d.is_sure] or found
    same = len({d.log for d in found}) == 1
    return max(found, key=lambda d: d.times) if same else None


def odd_in(axis: AxisModel, dataset: Dataset) -> Disagreement | None:
    """The log that disagrees with the others of a dataset, by a model with its values.

    Test logs decide nothing: which of the others does is told without them, and that one of them
    does only where none of the others does.
    """
    deciding = (*dataset.training, *dataset.selection)
    if (odd := disagreeing(axis, deciding)) is not None:
        return odd
    odd = disagreeing(axis, dataset.logs) if dataset.test else None
    if odd and dataset.is_test(odd.log):
        return odd
    return _at_rest(axis, deciding)


def odd_in_all(axis: AxisModel, dataset: Dataset) -> Disagreement | None:
    """The log that surely disagrees with all others, the test logs among them.

    It may be told where those that decide are too few to tell it; as test logs decide nothing, no
    log is left out for what this says.
    """
    odd = disagreeing(axis, dataset.logs) if dataset.test else None
    return odd if odd and odd.is_sure else None


def _at_rest(axis: AxisModel, logs: Sequence[PreparedLog]) -> Disagreement | None:
    """The log with one moment of its rests that stands out against all of all logs, if any.

    A force that no motion follows, beyond what friction holds anywhere: a glitch of the recording,
    a stop, a hand. What friction holds at rest, no other log tells.
    """
    if len(logs) < FEWEST or not _rests(axis) or any(log.motion.bodies is not None for log in logs):
        return None
    held = averaged_force(parts_of(axis, *RUBBING), logs)
    left = [residual(axis, [log]) for log in logs]
    for k, (log, own) in enumerate(zip(logs, left, strict=True)):
        if moving([log], sticks=True)[np.argmax(np.abs(own))]:
            continue
        others = [*left[:k], *left[k + 1 :], held]
        if (moment := _moment(log, log.time, own, others, 1.0)) is not None:
            return replace(moment, at_rest=True)
    return None


def _rests(axis: AxisModel) -> bool:
    """Whether a friction holds it where it does not move."""
    return axis.friction is not None


def suspect(axis: AxisModel, dataset: Dataset) -> str | None:
    """The log that a fit of the others leaves more of than of any of them, most of all such logs.

    It may be spoiled, or excite alone what the model lacks: that is to be asked. None where there
    are too few logs that decide, or where it is a mechanism's.
    """
    logs = (*dataset.training, *dataset.selection)
    if any(log.motion.bodies is not None for log in logs):
        return None
    rows = _rows(axis, logs, Scaling.of(axis, logs).where)
    if len(rows) < FEWEST:
        return None
    times = dict[str, float]()
    for k, own in enumerate(rows):
        left, theirs = _predicted(own, [*rows[:k], *rows[k + 1 :]])
        times[own.log.motion.name] = rms(left) / max(map(rms, theirs))
    worst = max(times, key=lambda name: times[name])
    return worst if times[worst] > 1.0 else None


def _longer(logs: Sequence[PreparedLog]) -> list[PreparedLog]:
    """The logs by test functions of a usual length, where theirs is clearly shorter."""
    # 1.5 times: a length that is hardly another tells nothing else
    if not logs or 1.5 * logs[0].test_function.length > LOOK:
        return []
    return [log.at_length(LOOK) for log in logs]


def _at_one_length(axis: AxisModel, logs: Sequence[PreparedLog]) -> Disagreement | None:
    where = Scaling.of(axis, logs).where
    rows = _rows(axis, logs, where)
    worst = _worst(rows, axis, where)
    if worst is None:
        return None
    beside = _worst([r for r in rows if r.log.motion.name != worst.log], axis, where)
    return worst if beside is None or (worst.is_sure and not beside.is_sure) else None


def _worst(
    rows: Sequence[_Rows], axis: AxisModel, where: Sequence[ParameterReference]
) -> Disagreement | None:
    if len(rows) < FEWEST:
        return None
    each = [_against(k, rows, axis, where) for k in range(len(rows))]
    return max((d for d in each if d is not None), key=lambda d: d.times, default=None)


def _rows(
    axis: AxisModel, logs: Sequence[PreparedLog], where: Sequence[ParameterReference]
) -> list[_Rows]:
    kept = split_by_log(moving(logs, sticks(axis)), logs)
    going = split_by_log(moving(logs, _rests(axis)), logs)
    left = split_by_log(residual(axis, logs), logs)
    slopes = jacobian(axis, logs, where)
    size = np.linalg.norm(slopes, axis=0)
    size = np.where(size > 0.0, size, 1.0)
    columns = split_by_log(slopes / size, logs)
    states = [_states(log) for log in logs]
    usual = np.sqrt(np.mean(np.concatenate(states) ** 2, axis=0))
    usual = np.where(usual > 0.0, usual, 1.0)
    size = np.append(size, np.ones(len(Recorded)))
    curves = {f.effect.name for f in axis.effects if f.effect.is_nonparametric}
    named = np.array([*(w.effect not in curves for w in where), *(True for _ in Recorded)])
    parts = zip(logs, left, columns, states, kept, going, strict=True)
    return [
        _Rows(g, r[k], c[k], _recorded(g)[k], s[k] / usual, g.time[k], size, named, k, go[k])
        for g, r, c, s, k, go in parts if k.any()
    ]  # fmt: skip


def _recorded(log: PreparedLog) -> Array:
    """What one of each of Recorded adds to what is unbalanced in a log (n, 3) N per unit."""
    w, force = log.test_function, log.command
    return np.stack([force, np.ones_like(force), -rate(force, w.stride * w.period)], axis=1)


def _states(log: PreparedLog) -> Array:
    """Position, velocity, acceleration and its rate by test functions, and whether it turns back.

    (n, 5); the last is 1 where it does, of which what a law of friction lacks may be all.
    """
    w, motion = log.test_function, log.motion
    x, v, speed = w.mean(np.stack([motion.position, motion.velocity, np.abs(motion.velocity)]))
    jerk = rate(log.acceleration, w.stride * w.period)
    back = speed - np.abs(v) > 0.02 * speed  # of the way, which noise alone goes back and forth
    return np.stack([x, v, log.acceleration, jerk, back], axis=1)


def _against(
    k: int, rows: Sequence[_Rows], axis: AxisModel, where: Sequence[ParameterReference]
) -> Disagreement | None:
    """How a log disagrees with the others; None where it does not."""
    others = [r for i, r in enumerate(rows) if i != k]
    own = rows[k].predicted_by(others)
    if not len(own.left):
        return None
    more = FEW if len(rows) == FEWEST else 1.0
    left, theirs = _predicted(own, others)
    most = max(map(rms, theirs))
    if (moment := _moment(own.log, own.time, left, theirs, more)) is not None:
        return moment
    near, name = _near(own, others), own.log.motion.name
    best, gain = _best(own, left)
    own_value = None
    if gain is not None:
        usual, scatter = _among(best, others, theirs)
        own_value = _otherwise(best, gain - usual, own, axis, where)
        # What a model lacks looks like some delay, gain or mass of a log that hardly tells them.
        if rms(left) < most:
            own_value = None
        change = abs(_gains(own, left, near)[0][best] - usual) if near.any() else 0.0
        far = change > more * CLEAR * scatter
        if own_value and far and change > _least_change(best, own, own_value, where):
            return Disagreement(name, rms(left), most, None, own_value)
    seen = min(rms(left), rms(left[near])) if near.any() else 0.0
    # Values that explain all logs together leave none that is otherwise: some it told alone.
    if seen > more * OUT * most and max(map(rms, _together(own, others))) > OUT * most:
        return Disagreement(name, rms(left), most, _span(own.time, left), own_value)
    return None


def _predicted(own: _Rows, others: Sequence[_Rows]) -> tuple[Array, list[Array]]:
    """What a fit of other logs leaves of a log (n,) N, and of each of them."""
    step = _step(
        np.concatenate([r.columns for r in others]), np.concatenate([r.left for r in others])
    )
    return own.left - own.columns @ step, [r.left - r.columns @ step for r in others]


def _together(own: _Rows, others: Sequence[_Rows]) -> list[Array]:
    """What a fit of a log and the others leaves of each (n,) N."""
    return _predicted(own, [own, *others])[1]


def _gains(
    own: _Rows, left: Array, among: slice | NDArray[np.bool_] = slice(None)
) -> tuple[Array, Array]:
    """How much of each column (k + 3,) alone takes most of what is left (n,) N.

    And the sum of squares of each. among: which rows are asked.
    """
    columns = own.every[among]
    size = np.sum(columns**2, axis=0)
    return columns.T @ left[among] / np.where(size > 0.0, size, np.inf), size


def _least_change(
    at: int, own: _Rows, value: Otherwise, where: Sequence[ParameterReference]
) -> float:
    """By how much the gain of a column must change at least: of what is usual a part.

    Usual is its value, or the command, where it may have either sign. A delay is told by a sample,
    whatever time the command takes to change.
    """
    if value.what is Recorded.DELAY:
        return own.log.motion.sample_period
    if at < len(where) and where[at].parameter.lower >= 0.0:
        return CHANGED * abs(value.elsewhere) * float(own.size[at])
    size = np.linalg.norm(own.every[:, at]) or np.inf
    return CHANGED * float(np.linalg.norm(own.log.command[own.kept]) / size)


def _among(at: int, others: Sequence[_Rows], theirs: Sequence[Array]) -> tuple[float, float]:
    """The mean gain of one column in other logs and its scatter, by how much each tells it.

    The mean is not zero where it is of the recording, of which a fit has no column.
    """
    gains, sizes = zip(
        *(_gains(r, left) for r, left in zip(others, theirs, strict=True)), strict=True
    )
    gain, size = np.stack(gains)[:, at], np.stack(sizes)[:, at]
    # 1e-300: of no logs that tell the column, no division by zero
    whole = max(float(size.sum()), 1e-300)
    mean = float(np.sum(size * gain)) / whole
    freedom = (len(others) - 1) / len(others)
    return mean, float(np.sqrt(np.sum(size * (gain - mean) ** 2) / whole / freedom))


def _best(own: _Rows, left: Array) -> tuple[int, float | None]:
    """The column that alone takes most of what is left (n,) N; the last are of the recording.

    With its gain, where that explains it.
    """
    most = 0.5  # of the squared error, that it takes by itself
    gains, size = _gains(own, left)
    taken = np.where(own.named, gains**2 * size / np.sum(left**2), 0.0)
    best = int(np.argmax(taken))
    return best, float(gains[best]) if taken[best] > most else None


def _otherwise(
    best: int, gain: float, own: _Rows, axis: AxisModel, where: Sequence[ParameterReference]
) -> Otherwise | None:
    """The value of a column in a log and in others; None where it can have none there."""
    if best >= len(where):
        what = [*Recorded][best - len(where)]
        if what is Recorded.GAIN:  # what acted is the recorded force over its gain
            return Otherwise(what, 1.0 / (1.0 - gain), 1.0) if gain < 1.0 else None
        return Otherwise(what, gain, 0.0)
    value = float(read(axis, where[best : best + 1])[0])
    other, least = value - gain / float(own.size[best]), where[best].parameter.lower
    return Otherwise(where[best].label, other, value) if other >= least else None


def _step(columns: Array, force: Array) -> Array:
    """The strengths (k,) of unit columns that explain a force (n,) N, with a weak penalty."""
    weak = RIDGE**2 * np.eye(columns.shape[1])
    return np.asarray(np.linalg.solve(columns.T @ columns + weak, columns.T @ force), float)


def _near(own: _Rows, others: Sequence[_Rows]) -> NDArray[np.bool_]:
    """Which rows (n,) of a log are in a state where others have been: in one cell of a grid."""
    cell, most = 0.5, 1 << 11  # of the RMS of each coordinate; cells on either side of its zero
    states = np.concatenate([own.states, *(r.states for r in others)])
    places = np.clip(np.floor(states / cell), -most, most - 1).astype(np.int64) + most
    # 12 bits for each of the five coordinates
    cells = np.bitwise_or.reduce(places << np.array([0, 12, 24, 36, 48]), axis=1)
    return np.asarray(np.isin(cells[: len(own.left)], cells[len(own.left) :]))


def _moment(
    log: PreparedLog, time: Array, left: Array, theirs: Sequence[Array], more: float
) -> Disagreement | None:
    """One moment that stands out against all others of all logs; None where there is none.

    left (n,): N, of the log at these times (n,) s. theirs: N, of the others.
    """
    size = np.abs(left)
    peak = int(np.argmax(size))
    large = np.flatnonzero(size > size[peak] / PEAK)
    length = log.test_function.length
    first = last = peak
    for at in large[large > peak]:
        if time[at] - time[last] > 2.0 * length:
            break
        last = int(at)
    for at in large[large < peak][::-1]:
        if time[first] - time[at] > 2.0 * length:
            break
        first = int(at)
    span = float(time[first]), float(time[last])
    beside = (time < span[0] - length) | (time > span[1] + length)
    rest = max(np.abs(r).max(initial=0.0) for r in (*theirs, size[beside]))
    lasts = span[1] - span[0] > MOMENT * (time[-1] - time[0])
    if lasts or size[peak] < more * PEAK * rest:
        return None
    return Disagreement(log.motion.name, float(size[peak]), float(rest), span)


def _span(time: Array, left: Array) -> tuple[float, float] | None:
    """From when to when (s) most of the squared error is, where that is a part of the time."""
    most, short = 0.8, 0.5  # of the squared error, and of the time
    power = np.cumsum(left**2) / np.sum(left**2)
    # 1e-9: the last sum is one but for rounding
    ends = np.searchsorted(power, np.minimum(power - left**2 / np.sum(left**2) + most, 1.0 - 1e-9))
    spans = time[np.minimum(ends, len(time) - 1)] - time
    spans = np.where(power - left**2 / np.sum(left**2) + most <= 1.0, spans, np.inf)
    first = int(np.argmin(spans))
    if spans[first] > short * (time[-1] - time[0]):
        return None
    return float(time[first]), float(time[first] + spans[first])
