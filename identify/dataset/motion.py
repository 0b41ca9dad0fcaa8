"""A log seen as motion of one axis: its signals in blocks, and its readings."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from identify.dataset.blocks import Blocks, Columns, OtherAxis, Track, samples_of
from identify.dataset.bodies import Bodies
from identify.dataset.path import Path, Slip
from identify.dataset.readings import (
    ENOUGH,
    resolution_of,
    ripple,
    ripple_periods,
    rounding,
    together,
)
from identify.dataset.test_function import LEAST_BLOCKS
from twin.effect import CHANNELS
from twin.errors import InputError
from twin.logs import AxisLog, Log
from twin.model.machine import MOST_AXES_OF_A_PAIR
from twin.model.units import LINEAR, AxisUnits
from twin.signals import Array, between, count_of, local_parabola, rate, usual_size, white_noise

SMOOTHED = 11  # samples over which readings are smoothed to undo their errors
SHORTEST_BLOCK = 1e-3  # s
LONGEST_BLOCK = 1e-2  # s
REST_SPEED = 1e-3  # of the highest; below, an axis may stick, and no velocity need be known better
SHORTEST_LOG = 0.5  # s, a few test functions


@dataclass(frozen=True, eq=False, repr=False)
class Motion:
    """Motion of one axis over one log, in blocks.

    name: of the log. track: its signals. others (3, n): position, velocity, acceleration of the
    other axis (zero where there is none, or more than one), and with channels (6, n) these in SI.
    channels: fields of the log that are among these, such as "pressure"; others are zero. period:
    s, of a block. start: s, middle of the first block. sample_period: s, of the log.
    position_noise: m rms. count: m, of the encoder as logged, which a resampling or a measured
    velocity takes out of the readings; 0 where none shows. time_origin: s, when the log began, by
    the phase of what repeats in time. follows: whether the position follows a logged setpoint; None
    where none was logged. units, other_units: of the axis and of the other one, by which m, N and
    so on are to be read. beside: on a machine with more than two axes the others, by name.
    velocity_weight: 1, of a measured velocity beside the readings (identify.dataset.readings); 0
    where there is none. ripples: m, periods at which the readings err along the track
    (identify.dataset.readings). ahead: s, by which the command was moved ahead of how it was
    logged, as_logged (n * samples a block,) N; None where it was not. bodies: of a joint of a
    mechanism, over as many samples as raw; None for a plain axis, whose mass is all that it moves.
    path: what laws with memory follow; None: the readings as they are. slip: what a model moves
    such laws beside it at rest. clipped: (n * samples a block,), where the force that acted was
    more than was recorded (identify.dataset.clipped); None where nowhere.
    """

    name: str
    axis: str
    track: Track
    others: Array
    period: float
    start: float
    sample_period: float
    position_noise: float
    time_origin: float = 0.0
    follows: bool | None = None
    units: AxisUnits = LINEAR
    other_units: AxisUnits = LINEAR
    beside: Mapping[str, OtherAxis] = field(default_factory=dict)
    velocity_weight: float = 0.0
    ripples: tuple[float, ...] = ()
    ahead: float = 0.0
    as_logged: Array | None = None
    bodies: Bodies | None = None
    path: Path | None = None
    slip: Slip | None = None
    channels: tuple[str, ...] = ()
    count: float = 0.0
    clipped: NDArray[np.bool_] | None = None

    def __repr__(self) -> str:
        return (
            f"<Motion of {self.axis} in {self.name}: {self.signals.shape[1] * self.period:.4g} s>"
        )

    def head(self, duration: float) -> Motion:
        """Its first ``duration`` seconds."""
        n = min(max(round(duration / self.period), 1), self.signals.shape[1])
        return self._of_blocks(slice(n))

    def after(self, instant: float) -> Motion:
        """What follows its first ``instant`` seconds; its times stay those of the log."""
        first = min(round(instant / self.period), self.signals.shape[1] - 1)
        return replace(self._of_blocks(slice(first, None)), start=self.start + first * self.period)

    @property
    def left_out(self) -> int:
        """Samples of the log before its first block."""
        return round((self.start - 0.5 * self.period) / self.sample_period)

    def _of_blocks(self, blocks: slice) -> Motion:
        count = self.signals.shape[1]
        at = samples_of(blocks, self.raw.shape[1] // count, count)
        return replace(
            self,
            track=self.track.during(blocks),
            others=np.ascontiguousarray(self.others[:, blocks]),
            bodies=None if self.bodies is None else self.bodies.during(at),
            as_logged=None if self.as_logged is None else self.as_logged[at],
            path=None if self.path is None else self.path.during(at.start, at.stop),
            slip=None,
            clipped=None if self.clipped is None else self.clipped[at],
            beside={a: o.during(blocks) for a, o in self.beside.items()},
        )

    def in_blocks_of(self, samples: int) -> Motion:
        """The same in other blocks, of so many samples each."""
        period = samples * self.sample_period
        count = self.raw.shape[1] // samples
        at, raw = slice(count * samples), self.raw[:, : count * samples]
        track = np.stack([self.position_at_samples(0.5)[at], *raw])
        start = self.start + 0.5 * (period - self.period)
        times = start + period * np.arange(count)
        return replace(
            self,
            track=Blocks(track.reshape(3, count, samples).mean(axis=2), raw),
            others=np.stack([np.interp(times, self.time, other) for other in self.others]),
            period=period,
            start=start,
            bodies=None if self.bodies is None else self.bodies.during(at),
            as_logged=None if self.as_logged is None else self.as_logged[at],
            beside={a: replace(o, samples=samples) for a, o in self.beside.items()},
            path=self.path and replace(self.path.during(0, count * samples), samples=samples),
            slip=None,
            clipped=None if self.clipped is None else self.clipped[at],
        )

    def with_force_ahead(self, shift: float) -> Motion:
        """The same with its command moved ahead by ``shift`` seconds.

        Always from how it was logged: to move it there and back between samples would smooth it.
        """
        logged = self.raw[1].copy() if self.as_logged is None else self.as_logged
        ahead, at = self.ahead + shift, np.arange(len(logged), dtype=float)
        moved = self.with_force(np.interp(at + ahead / self.sample_period, at, logged))
        return replace(moved, ahead=ahead, as_logged=logged)

    def with_force(self, force: Array) -> Motion:
        """The same under another force (n * samples a block,) N, at the log's own rate."""
        signals = self.signals.copy()
        signals[2] = force.reshape(signals.shape[1], -1).mean(axis=1)
        return replace(self, track=Blocks(signals, np.stack([self.raw[0], force])))

    def forget(self) -> None:
        """Let go of what is made of a log's columns in memory, which is as long as they are."""
        if isinstance(self.track, Columns):
            self.track.forget()
            if self.bodies is not None:
                self.bodies.forget()
            if self.path is not None:
                self.path.forget()
            for name in ("smoothed_position", "unrippled"):
                self.__dict__.pop(name, None)

    @property
    def signals(self) -> Array:
        """Position m, velocity m/s and command N, (3, n)."""
        return self.track.signals

    @property
    def raw(self) -> Array:
        """Velocity m/s and command N at the log's own rate, (2, n * samples a block)."""
        return self.track.raw

    @property
    def time(self) -> Array:
        """(n,) s."""
        return np.asarray(self.start + self.period * np.arange(self.signals.shape[1]))

    @property
    def position(self) -> Array:
        """(n,) m."""
        return self.signals[0]

    @property
    def velocity(self) -> Array:
        """(n,) m/s."""
        return self.signals[1]

    @property
    def followed(self) -> Array:
        """Velocity (n,) m/s that laws with memory follow."""
        own = self.velocity if self.path is None else self.path.velocity
        return own if self.slip is None else own + self.slip.velocity

    @property
    def cut_off(self) -> NDArray[np.bool_]:
        """In which blocks (n,) more force acted than was recorded."""
        count = self.signals.shape[1]
        if self.clipped is None:
            return np.zeros(count, bool)
        return np.asarray(self.clipped.reshape(count, -1).any(axis=1))

    @property
    def acceleration(self) -> Array:
        """(n,) m/s^2, of the mean velocities of the blocks beside: as noisy as they are short."""
        return rate(self.velocity, self.period)

    @property
    def command(self) -> Array:
        """(n,) N."""
        return self.signals[2]

    @property
    def force(self) -> Array:
        """Command less the bias force of a mechanism's bodies, N at the log's own rate."""
        return self.raw[1] if self.bodies is None else self.raw[1] - self.bodies.force

    def momentum(self, mass: float, velocity: Array) -> Array:
        """Of a mass (kg) at a velocity (n,) m/s, and of a mechanism's bodies beyond it, N s."""
        own = mass * velocity
        return own if self.bodies is None else own + self.bodies.momentum

    @property
    def net(self) -> Array:
        """Command less what a mechanism's bodies take beyond mass x acceleration, (n,) N."""
        if self.bodies is None:
            return self.command
        momentum, force = self._block_means(np.stack([self.bodies.momentum, self.bodies.force]))
        return np.asarray(self.command - force - rate(momentum, self.period))

    @cached_property
    def net_scatter(self) -> float:
        """By how much that changes, N RMS about its mean: a weight that is held counts nothing."""
        return float(np.std(self.net))

    @property
    def joint_signals(self) -> Array:
        """The signals, and of a joint its load N and the speeds of all joints, (4 + n_axes, n)."""
        if self.bodies is None:
            return self.signals
        more = self._block_means(np.vstack([self.bodies.load, self.bodies.speeds]))
        return np.vstack([self.signals[:3], more])

    def _block_means(self, signals: Array) -> Array:
        """Signals (k, n * samples a block) as means over the blocks (k, n)."""
        return np.asarray(signals.reshape(len(signals), len(self.command), -1).mean(axis=2))

    def at_samples(self, instant: float) -> Array:
        """Position m, velocity m/s and command N at the log's own rate, (3, n).

        instant: where in the sample the position is taken, 0 its start, 1/2 its middle.
        """
        return np.stack([self.position_at_samples(instant), *self.raw])

    def position_at_samples(self, instant: float) -> Array:
        """The position alone of these, (n,) m."""
        travelled = self.raw[0] * self.sample_period
        middle = np.cumsum(travelled)
        middle -= 0.5 * travelled
        middle += self.position[0] - middle[: len(middle) // len(self.position)].mean()
        travelled *= instant - 0.5
        return middle + travelled

    @cached_property
    def smoothed_position(self) -> Array:
        """Position (n,) m at the start of each sample, smoothed."""
        return local_parabola(self.position_at_samples(0.0), SMOOTHED)

    @cached_property
    def command_noise(self) -> float:
        """White noise in the command that its controller did not make of the readings, N^2/Hz.

        One-sided. Second differences leave little of a setpoint; what a linear controller makes of
        its last readings is taken off, and the median passes by what is not linear.
        """
        velocity, command = self.raw[:, :ENOUGH]
        command, bend = np.diff(command, 2), np.diff(velocity)
        lags = min(32, len(command) // 8)  # readings that a controller is supposed to use
        past = sliding_window_view(bend[: len(command)], lags)
        scale = np.sqrt(np.mean(past**2)) or 1.0
        rows, wanted = past / scale, command[lags - 1 :]
        # 1e-12, below which a combination of readings is rounding
        gains = np.linalg.lstsq(rows.T @ rows, rows.T @ wanted, rcond=1e-12)[0]
        left = usual_size(wanted - rows @ gains)
        return 2.0 * self.sample_period * left**2 / 6.0

    @cached_property
    def resolution(self) -> float:
        """Step between the readings, m; 0 where their noise, or the lack of one, hides it."""
        return resolution_of(self.raw[0] * self.sample_period)

    @property
    def readings(self) -> Array:
        """Readings (n + 1,) m at the log's own rate, from the first on."""
        return np.concatenate([[0.0], np.cumsum(self.raw[0] * self.sample_period)])

    @cached_property
    def unrippled(self) -> Array:
        """Velocity (n,) m/s of the readings less their error that repeats along the track."""
        if not self.ripples:
            return self.raw[0]
        return self.raw[0] - between(ripple(self.readings, self.ripples), self.sample_period)

    @property
    def rounding(self) -> Array:
        """What rounding to the readings' step made of the position, (n + 1,) m, about."""
        return rounding(self.readings, self.resolution)


def motion_of(
    log: Log,
    axis: str,
    name: str,
    machine: Sequence[str] = (),
    longest_block: float = LONGEST_BLOCK,
    ripples: tuple[float, ...] | None = None,
    bodies: Bodies | None = None,
    encoder_noise: float = np.inf,
    clipped: NDArray[np.bool_] | None = None,
) -> Motion:
    """The motion of one axis of a log.

    machine: the axes of the machine; on one of two axes others that were logged do not matter.
    longest_block: s; a noisy position asks for long blocks. ripples: m, sought where None. bodies:
    of a joint. encoder_noise: m rms, where other logs tell it; more than it asks for no longer
    blocks, in which a reversal is smeared. clipped: as Motion has it, of all samples.
    Raises InputError where the axis is not in the log, does not move, or is too short.
    """
    _require_motion(log, axis, name)
    readings = log.axes[axis].position
    position, weight = together(readings, log.axes[axis].columns.get("velocity"), log.period)
    ripples = ripple_periods(position) if ripples is None else ripples
    noise = white_noise(position - ripple(position, ripples))
    step = resolution_of(np.diff(readings))
    block = _block_samples(position, min(noise, encoder_noise), log.period, longest_block)
    whole = (len(position) - 1) // block * block
    if bodies is not None:
        position = bodies.readings[bodies.index]  # the same, which is in memory already
    columns = Columns(position[: whole + 1], log.axes[axis].force[:whole], block, log.period)
    found = {
        a: OtherAxis(log.axes[a].position, block, log.period, log.axes[a].kind)
        for a in other_axes(log, axis, machine)
    }
    several = len(found) > 1 or len(machine) > MOST_AXES_OF_A_PAIR
    other = None if several else next(iter(found.values()), None)
    return Motion(
        name=name,
        axis=axis,
        track=columns.kept if bodies is None else columns,  # of joints there are many
        others=_beside(log.axes[axis], other, whole, block),
        channels=_channels(log.axes[axis]),
        period=block * log.period,
        start=0.5 * block * log.period,
        sample_period=log.period,
        units=log.axes[axis].kind,
        other_units=LINEAR if other is None else other.units,
        beside=found if several else {},
        position_noise=noise,
        count=step or count_of(readings),
        follows=_follows(log.axes[axis]),
        velocity_weight=weight,
        ripples=ripples,
        bodies=None if bodies is None else bodies.during(slice(whole)),
        # of a step nothing is told, however little noise turns one over
        path=Path(
            columns.readings, block, log.period, max(min(noise, encoder_noise), step / 12.0**0.5)
        ),
        clipped=None if clipped is None else clipped[:whole],
    )


def _require_motion(log: Log, axis: str, name: str) -> None:
    """Raise InputError where the axis is not in the log, does not move, or it is too short."""
    if axis not in log.axes:
        raise InputError(f"{name}: has no axis '{axis}'; it has {', '.join(log.axes)}")
    least = shortest_log(log.period)
    if len(log) * log.period < least:
        raise InputError(
            f"{name}: lasts {len(log) * log.period:.3g} s; identification needs {least:.3g} s at "
            f"{log.sample_rate:g} Hz, so record longer"
        )
    if np.ptp(log.axes[axis].position) == 0.0:
        raise InputError(f"{name}: axis {axis} stands still; give a log in which it moves")


def shortest_log(period: float) -> float:
    """Least length (s) of a log for identification, of samples of a period (s)."""
    return max(SHORTEST_LOG, LEAST_BLOCKS**2 * period)


def _channels(own: AxisLog) -> tuple[str, ...]:
    """What a log holds of an axis beside its motion."""
    return tuple(field for field in CHANNELS.values() if field in own.columns)


def _beside(own: AxisLog, other: OtherAxis | None, whole: int, block: int) -> Array:
    """Signals of the other axis and of channels, by blocks of so many samples of ``whole``."""
    signals = _none(whole // block) if other is None else other.signals
    if not _channels(own):
        return signals
    none = np.zeros(whole + 1)
    readings = np.stack([own.columns.get(f, none)[: whole + 1] for f in CHANNELS.values()])
    middle = 0.5 * (readings[:, 1:] + readings[:, :-1])
    return np.vstack([signals, middle.reshape(len(middle), -1, block).mean(axis=2)])


@lru_cache(maxsize=2)  # the axes of a log share it, and those of its head
def _none(count: int) -> Array:
    """Signals (3, count) of another axis where there is none."""
    return np.zeros((3, count))


def _follows(signals: AxisLog) -> bool | None:
    """Whether position and setpoint share at least half of their variance; None without setpoint.

    A setpoint that stands still is not followed.
    """
    if "setpoint_position" not in signals.columns:
        return None
    wanted, position = signals.columns["setpoint_position"], signals.position
    if np.ptp(wanted) == 0.0 or np.ptp(position) == 0.0:
        return False
    return bool(np.corrcoef(wanted, position)[0, 1] ** 2 > 0.5)


def other_axes(log: Log, axis: str, machine: Sequence[str]) -> list[str]:
    """The other axes of the log, of the machine alone where that has two."""
    pair = len(machine) == MOST_AXES_OF_A_PAIR
    return [a for a in log.axes if a != axis and (a in machine or not pair)]


def _block_samples(position: Array, noise: float, period: float, longest: float) -> int:
    """Samples a block: 1 ms, or as long as the encoder's noise asks for, up to a length (s)."""
    span = max(round(SHORTEST_BLOCK / period), 1)
    fastest = np.abs(position[span:] - position[:-span]).max() / (span * period)
    quiet = np.sqrt(2.0) * noise / (REST_SPEED * fastest)
    most = int(longest / period * (1.0 + 8.0 * np.finfo(float).eps))
    return max(min(round(max(SHORTEST_BLOCK, quiet) / period), most), 1)
