"""One log's motion of an axis with its test functions, and the model's force along it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

from identify.dataset.drive import added_on_blocks, parts_of
from identify.dataset.motion import REST_SPEED, Motion
from identify.dataset.test_function import LEAST_BLOCKS, OVERLAP, TestFunction
from twin.core.native import Table
from twin.core.walks import walk_sets
from twin.effect import Kind
from twin.model.machine import AxisModel, axis_table
from twin.model.units import Scale

Array = NDArray[np.float64]

Reach = tuple[float, float]  # lowest and highest position, m
EVERYWHERE: Reach = (-np.inf, np.inf)
TURN = 2.0 * np.pi  # rad, after which a shaft is at the same place again

# Logs -> forces (m, j) N of each, one column for each of j strengths.
Columns: TypeAlias = Callable[[Sequence["PreparedLog"]], list[Array]]


@dataclass(frozen=True, eq=False, repr=False)
class PreparedLog:
    """One log's motion of an axis with its weak form.

    test_function, fine: over the motion's blocks, and the same over the log's samples. command (n,)
    N, of a joint less what its bodies take beyond mass x acceleration, and acceleration (n,) m/s^2
    are means by test functions. force_noise: N RMS by test functions,
    which sensors do not make and nothing predicts; part of the noise floor. reach: positions (m)
    between which its test functions count; of a log that is not fitted those of the training logs.
    """

    motion: Motion
    test_function: TestFunction
    fine: TestFunction
    command: Array
    acceleration: Array
    force_noise: float = 0.0
    reach: Reach = EVERYWHERE

    def __repr__(self) -> str:
        return (
            f"<PreparedLog {self.motion.name}: {len(self)} test functions of "
            f"{self.test_function.length:g} s>"
        )

    @classmethod
    def of(cls, motion: Motion, length: float, reach: Reach = EVERYWHERE) -> PreparedLog:
        """The log with test functions of that length (s)."""
        test_function = TestFunction.of_length(length, motion.period)
        samples = round(motion.period / motion.sample_period)
        fine, test_function = test_function.refined(samples), test_function.sharpened(samples)
        acceleration = fine.acceleration(motion.raw[0])
        command = fine.mean(motion.force)
        if motion.bodies is not None:
            command -= fine.acceleration(motion.bodies.momentum)
        return cls(motion, test_function, fine, command, acceleration, reach=reach)

    def at_length(self, length: float) -> PreparedLog:
        """The same log with test functions of another length (s), in blocks that suit them.

        Raises InputError for one that spans too few samples.
        """
        motion = self.motion
        if length < LEAST_BLOCKS * motion.period:
            motion = motion.in_blocks_of(max(int(length / LEAST_BLOCKS / motion.sample_period), 1))
        return PreparedLog.of(motion, length, self.reach)

    @property
    def reached(self) -> NDArray[np.bool_]:
        """Which test functions (n,) lie within reach."""
        low, high = self.reach
        position = self.test_function.mean(self.motion.position)
        return np.asarray((position >= low) & (position <= high))

    @cached_property
    def clipped(self) -> NDArray[np.bool_]:
        """In which test functions (n,) more force acted at some instant than was recorded."""
        return np.asarray(self.test_function.mean(self.motion.cut_off.astype(float)) != 0.0)

    @property
    def informative_share(self) -> Array:
        """How much of each test function (n,) tells of a model: not what balances by itself."""
        slip = self.motion.slip
        if slip is None:
            return np.ones(len(self))
        return 1.0 - self.test_function.mean(slip.free.astype(float))

    @cached_property
    def extent(self) -> tuple[float, Reach, float]:
        """Largest command (N), lowest and highest position (m), highest speed (m/s)."""
        position, velocity, command = self.motion.signals[:3]
        reach = float(position.min()), float(position.max())
        return float(np.abs(command).max()), reach, float(np.abs(velocity).max())

    @property
    def time(self) -> Array:
        """(n,) s, middle of each test function."""
        return self.test_function.mean(self.motion.time)

    def __len__(self) -> int:
        return len(self.command)


def within_reach(
    logs: Sequence[PreparedLog], fit: Sequence[PreparedLog]
) -> tuple[PreparedLog, ...]:
    """Logs that test a fit of others, where these have been.

    Beyond, a force of position is extrapolated, and says nothing of what is there. All of them
    where they have little in common with the others, and of a shaft that turned round in these:
    after a whole turn it is at the same place again.
    """
    if not logs:
        return ()
    places = [log.motion.position for log in fit]
    low, high = min(p.min() for p in places), max(p.max() for p in places)
    if fit[0].motion.units.rotary and high - low >= TURN:
        return tuple(logs)
    # 0.05 of the range of the fit, by which a log of another role may exceed it
    margin = 0.05 * (high - low)
    within = tuple(replace(log, reach=(low - margin, high + margin)) for log in logs)
    # 0.2 of the logs of a role must lie within it
    enough = sum(np.count_nonzero(w.reached) for w in within) >= 0.2 * sum(map(len, within))
    return within if enough else tuple(logs)


def total_force(table: Table, motion: Motion) -> Array:
    """Sum of the effects' forces on a table's first axis along a measured motion, (n,) N."""
    return total_forces(table, table.parameters[None], motion)[0]


def total_forces(table: Table, sets: Array, motion: Motion) -> Array:
    """The same for several sets of the table's parameters (m, n_p), SI units: (m, n) N."""
    totals = np.zeros((len(sets), motion.signals.shape[1]))
    first, last, _, _, _ = table.axes[0]
    if first < last:
        signals = motion.joint_signals if table.reads_joints else motion.signals
        path = motion.followed if table.remembers.any() else motion.velocity
        walk_sets(
            table.entries, first, last, sets, table.n_states, signals, motion.others,
            motion.period, 0, totals, table.masses[0], motion.time_origin, table.remembers, path,
        )  # fmt: skip
    return totals


def on_blocks(axis: AxisModel) -> Table:
    """Table of the effects between actuator and encoder, which need no finer steps than blocks."""
    return axis_table(
        {"": parts_of(axis, Kind.FORCE, Kind.MODIFIER, Kind.FRICTION, Kind.STRUCTURE)}
    )


def sticks(axis: AxisModel) -> bool:
    """Whether the axis has static friction, whose force at rest the motion does not determine."""
    return any(f.effect.sticks for f in axis.effects)


def scale_of(logs: Sequence[PreparedLog]) -> Scale:
    """The size of the machine as some logs show it; one of each unit that they do not show."""
    forces, reaches, speeds = zip(*(log.extent for log in logs), strict=True)
    travel = (max(high for _, high in reaches) - min(low for low, _ in reaches)) or 1.0
    return Scale(max(forces) or 1.0, travel, travel / (max(speeds) or 1.0))


def motor_gain(axis: AxisModel, logs: Sequence[PreparedLog]) -> float:
    """RMS force that an axis' motor makes of the commands of some logs, over that of the commands.

    Both averaged by test functions. An error is told in the force as it was logged: what is left of
    the motor's force, over this. So a law that weakens the motor, and all other forces with it,
    explains nothing. Never 0, so that one can divide by it.
    """
    if not any(f.effect.kind is Kind.ACTUATION for f in axis.effects):
        return 1.0
    asked = [log.test_function.mean(log.motion.command) for log in logs]
    given = (log.test_function.mean(added_on_blocks(axis, log.motion)) for log in logs)
    made = [u + added for u, added in zip(asked, given, strict=True)]
    gain = np.linalg.norm(np.concatenate(made)) / (np.linalg.norm(np.concatenate(asked)) or 1.0)
    return max(float(gain), float(np.finfo(float).eps))


def split_by_log(values: NDArray[Any], logs: Sequence[PreparedLog]) -> list[NDArray[Any]]:
    """Values of all test functions of some logs (n, ...), log after log, as those of each."""
    return np.split(values, np.cumsum([len(log) for log in logs])[:-1])


def at_rest(velocity: Array) -> NDArray[np.bool_]:
    """Where velocities (n,) m/s are so small beside the highest that the axis may stick."""
    speed = np.abs(velocity)
    return np.asarray(speed < REST_SPEED * speed.max())


def stands(motion: Motion) -> NDArray[np.bool_]:
    """In which blocks (n,) of a motion the axis may stick.

    Where noise alone makes velocities as large, the mean over as many blocks as it takes tells it:
    an axis that sticks for some of them seems to dither. One that swings comes back too, but its
    readings around, and meanwhile, lie farther apart than by noise.
    """
    still = at_rest(motion.velocity)
    least = REST_SPEED * float(np.abs(motion.velocity).max()) * motion.period
    # 3 standard deviations of the readings' noise, by which a motion is more than it
    noise = 3.0 * np.sqrt(2.0) * motion.position_noise
    over = min(int(noise / least) + 1, len(still)) if least > 0.0 else 1
    if over > 1:
        gone = np.cumsum(np.pad(motion.velocity * motion.period, (1, 0)))
        back = np.abs(gone[over:] - gone[:-over]) < over * least
        if motion.path is None:
            return still | _within(back, over)
        still |= _within(back, over) & motion.path.pauses
        still |= _within(back & motion.path.calm(over), over)
    return still


def _within(runs: NDArray[np.bool_], blocks: int) -> NDArray[np.bool_]:
    """Which of all blocks (n,) are within one of these runs (n - blocks + 1,) of some blocks."""
    edges = np.zeros(len(runs) + blocks)
    edges[: len(runs)] += runs
    edges[blocks:] -= runs
    return np.asarray(np.cumsum(edges)[:-1] > 0.0)


def last_direction(velocity: Array) -> Array:
    """Sign (n,) of the velocity m/s, at rest as it was before; 0 before the first motion."""
    direction = np.where(at_rest(velocity), 0.0, np.sign(velocity))
    index = np.maximum.accumulate(np.where(direction != 0.0, np.arange(len(direction)), 0))
    return np.asarray(direction[index])


def independent(logs: Sequence[PreparedLog], sticks: bool) -> int:
    """How many test functions that carry information share no instant, about."""
    kept = (np.flatnonzero(moving([log], sticks)) for log in logs)
    return sum(len(np.unique(each // OVERLAP)) for each in kept)


def moving(logs: Sequence[PreparedLog], sticks: bool) -> NDArray[np.bool_]:
    """Which test functions carry information: those within reach whose force was recorded.

    With static friction, those without standstill.
    """
    masks = []
    for log in logs:
        mask = np.ones(len(log), bool) if log.reach == EVERYWHERE else log.reached
        mask &= ~log.clipped
        if sticks:
            still = stands(log.motion).astype(float)
            # 0.02 of a test function, as at a reversal without a rest
            mask &= log.test_function.mean(still) < 0.02
        masks.append(mask)
    return np.concatenate(masks)
