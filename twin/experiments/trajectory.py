"""Jerk-limited motion within the limits of a machine, and the sampled setpoint of its controller.

A move is a straight line from rest to rest on which all axes start and end together. One scalar
profile along the line, 0 at the start and 1 at the target, is planned by Ruckig under the limits of
every axis and scaled by each axis' displacement. It is planned with the path length as unit of
length and (path length / jerk)^(1/3) as unit of time, because Ruckig's tolerances are absolute: in
metres they amount to 10 nm, too much for a move of micrometres.

Source of the planner: L. Berscheid and T. Kroeger, "Jerk-limited Real-time Trajectory Generation
with Arbitrary Target States", Robotics: Science and Systems XVII, 2021. The profile is this
project's assumption: the thesis prints no generator of its motion platform. A recorded reference
replaces it (``recorded_setpoint`` in twin.simulation.follow).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import numpy.typing as npt
from ruckig import InputParameter, Profile, Result, Ruckig, RuckigError, Trajectory

from twin.errors import CannotRun, InputError
from twin.model.units import LINEAR, AxisUnits

FloatArray = npt.NDArray[np.float64]

BLOCK = 16_384  # samples worked on at once: the temporary arrays stay in the cache


@dataclass(frozen=True)
class Limits:
    """Motion limits of the setpoint of one axis; InputError where they are none.

    travel: lowest and highest position, m. velocity, acceleration, jerk: the largest, m/s, m/s^2,
    m/s^3. units, name: of the axis; on a rotary one lengths are angles.
    """

    travel: tuple[float, float]
    velocity: float
    acceleration: float
    jerk: float
    units: AxisUnits = LINEAR
    name: str = "x"

    def __post_init__(self) -> None:
        low, high = self.travel
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise InputError(
                f"travel {low:g} .. {high:g} {self.units.position} is empty or not finite: "
                f"give the lowest position first, both in {self.units.position}"
            )
        for what, unit in (("velocity", "m/s"), ("acceleration", "m/s^2"), ("jerk", "m/s^3")):
            value = getattr(self, what)
            if not (math.isfinite(value) and value > 0.0):
                raise InputError(
                    f"{what} limit {value:g} {self.units(unit)} is not allowed: "
                    f"give more than 0 {self.units(unit)}"
                )

    def ramp_time(self, speed: float) -> float:
        """Shortest time (s) from rest to `speed` (m/s); the ramp covers speed * time / 2."""
        if speed * self.jerk < self.acceleration**2:
            return 2.0 * math.sqrt(speed / self.jerk)
        return speed / self.acceleration + self.acceleration / self.jerk

    def fastest_plateau(self, distance: float) -> float:
        """Highest speed (m/s) that a move over `distance` (m) holds over half of the distance.

        Both ramps together cover speed * ramp_time(speed), which may be distance / 2.
        """
        ramps = distance / 2.0
        speed = (ramps**2 * self.jerk / 4.0) ** (1.0 / 3.0)
        if speed * self.jerk >= self.acceleration**2:
            half = self.acceleration**2 / self.jerk / 2.0
            # The positive root of speed^2 + 2 half speed = acceleration * ramps.
            speed = math.sqrt(half**2 + self.acceleration * ramps) - half
        return min(speed, self.velocity)

    def require_plateau(self, speed: float, span: float) -> None:
        """Raise CannotRun unless a move over `span` (m) holds `speed` (m/s) over half of it."""
        unit, rate = self.units.position, self.units.velocity
        if speed > self.velocity:
            raise CannotRun(
                f"speed {speed:g} {rate} of axis {self.name} is above its limit of "
                f"{self.velocity:g} {rate}: give a lower speed"
            )
        needed = 2.0 * speed * self.ramp_time(speed)
        if span < needed * (1.0 - 1e-9):
            raise CannotRun(
                f"speed {speed:g} {rate} of axis {self.name} is not held over half of {span:g} "
                f"{unit}: give a span of at least {needed:.4g} {unit} or at most "
                f"{self.fastest_plateau(span):.4g} {rate}"
            )


def travel_box(limits: Sequence[Limits]) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest position of all axes, m, each of shape (n_axes,)."""
    low, high = np.array([axis.travel for axis in limits], dtype=float).T
    return low, high


def inside_travel(limits: Sequence[Limits], positions: FloatArray) -> FloatArray:
    """The positions (m, shape (..., n_axes)), or CannotRun if one lies outside the travel.

    A position outside by rounding alone is set to the end of the travel.
    """
    low, high = travel_box(limits)
    same_place = 1e-9  # m, rounding of a position that lies on the end of the travel
    outside = np.argwhere((positions < low - same_place) | (positions > high + same_place))
    if outside.size:
        where = tuple(outside[0])
        axis = limits[where[-1]]
        unit, slip = axis.units.position, "degrees" if axis.units.rotary else "mm"
        raise CannotRun(
            f"setpoint {positions[where]:.6g} {unit} of axis {axis.name} is outside its travel "
            f"{axis.travel[0]:g} .. {axis.travel[1]:g} {unit}: shorten the move, place it "
            f"elsewhere, or check that positions are in {unit} and not in {slip}"
        )
    return np.clip(positions, low, high)


def require_length(duration: float, sample_rate: float) -> None:
    """Raise CannotRun unless `duration` (s) holds one sample to one hour of them."""
    if not (math.isfinite(duration) and duration > 0.0):
        raise InputError(f"duration {duration:g} s is not allowed: give a number above 0 s")
    samples = duration * sample_rate
    most_samples = 36_000_000  # one hour at 10 kHz, the rate of the thesis's stage
    if samples < 1.0 - 1e-9 or samples > most_samples:
        raise CannotRun(
            f"duration {duration:g} s at {sample_rate:g} Hz is {samples:g} samples, allowed are "
            f"1 to {most_samples}: change the duration, the repeats or the sample rate"
        )


@dataclass(frozen=True, eq=False)
class Phases:
    """Phases of constant jerk, one after the other, each for a duration (s, shape (n_phases,)).

    The others are at the start of each phase, m, m/s, m/s^2, m/s^3, shape (n_phases, n_axes).
    """

    duration: FloatArray
    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    jerk: FloatArray

    @property
    def total(self) -> float:
        """Time from the first phase to the end of the last, s."""
        return float(self.duration.sum())


def rest(position: FloatArray, duration: float) -> Phases:
    """Standing at `position` (m, shape (n_axes,)) for `duration` seconds."""
    still = np.zeros((1, position.size))
    return Phases(np.array([duration]), position[np.newaxis, :], still, still, still)


def move(limits: Sequence[Limits], start: FloatArray, target: FloatArray) -> Phases:
    """Fastest straight move from rest at `start` to rest at `target` (m), all axes together.

    Travel is not checked, as a move stays between its ends. Seven phases, or a rest of no duration
    where start and target are equal. CannotRun where no profile can be computed.
    """
    step = target - start
    moving = np.flatnonzero(step)
    if not moving.size:
        return rest(start, 0.0)

    def along_path(of_axes: list[float]) -> float:
        return float((np.array(of_axes)[moving] / np.abs(step[moving])).min())

    jerk = along_path([axis.jerk for axis in limits])
    pace = jerk ** (1.0 / 3.0)  # 1 / s; with 1 / pace as unit of time the jerk limit is 1
    profile = _unit_profile(
        along_path([axis.velocity for axis in limits]) / pace,
        along_path([axis.acceleration for axis in limits]) / pace**2,
    )
    return Phases(
        np.array(profile.t) / pace,
        start + np.outer(profile.p[:7], step),
        np.outer(profile.v[:7], step * pace),
        np.outer(profile.a[:7], step * pace**2),
        np.outer(profile.j, step * pace**3),
    )


def _unit_profile(velocity: float, acceleration: float) -> Profile:
    """Ruckig's profile from 0 to 1 under a jerk limit of 1, all in the units of the path."""
    request = InputParameter(1)
    request.target_position = [1.0]
    request.max_velocity = [velocity]
    request.max_acceleration = [acceleration]
    request.max_jerk = [1.0]
    trajectory = Trajectory(1)
    try:
        solved = Ruckig(1).calculate(request, trajectory) == Result.Working
    except RuckigError:
        solved = False
    if not solved or not math.isfinite(trajectory.duration):
        raise CannotRun(
            "no jerk-limited move fits these velocity, acceleration and jerk limits: they differ "
            "too much in size; check that they are in m/s, m/s^2 and m/s^3"
        )
    return trajectory.profiles[0][0]


def join(parts: Sequence[Phases]) -> Phases:
    """The phases of all parts in a row; each part starts where the one before ended."""
    columns = zip(*(vars(part).values() for part in parts), strict=True)
    return Phases(*(np.concatenate(column) for column in columns))


def sample(
    phases: Phases, samples: int, sample_rate: float, begin: int = 0
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Position (m), velocity (m/s) and acceleration (m/s^2) at t = k / sample_rate, k from `begin`.

    Each is an exact evaluation of the cubic of the phase that holds at t, shape
    (samples, n_axes); a sample after the end belongs to the last phase.
    """
    starts = np.concatenate([[0.0], np.cumsum(phases.duration)[:-1]])
    shape = (samples, phases.position.shape[1])
    position, velocity, acceleration = np.empty(shape), np.empty(shape), np.empty(shape)
    for first in range(0, samples, BLOCK):
        block = slice(first, min(first + BLOCK, samples))
        time = np.arange(begin + block.start, begin + block.stop) / sample_rate
        phase = np.searchsorted(starts, time, side="right") - 1
        t = (time - starts[phase])[:, np.newaxis]
        p, v = phases.position[phase], phases.velocity[phase]
        a, j = phases.acceleration[phase], phases.jerk[phase]
        position[block] = p + t * (v + t * (a / 2.0 + t * (j / 6.0)))
        velocity[block] = v + t * (a + t * (j / 2.0))
        acceleration[block] = a + t * j
    return position, velocity, acceleration


@dataclass(frozen=True, eq=False)
class Setpoint:
    """Setpoint of all axes; sample k is that of t = k / sample_rate (Hz).

    position, velocity, acceleration: m, m/s, m/s^2, shape (n, n_axes). force: open-loop force to
    command, N, likewise; zero in closed loop.
    """

    position: FloatArray
    velocity: FloatArray
    acceleration: FloatArray
    force: FloatArray
    sample_rate: float

    def __post_init__(self) -> None:
        shapes = {column.shape for column in self.columns}
        if len(shapes) > 1 or self.position.ndim != 2:
            raise InputError(
                f"setpoint arrays of shapes {sorted(shapes)} do not belong together: "
                "give all four the shape (samples, axes)"
            )

    @property
    def columns(self) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Position, velocity, acceleration and force, each of shape (n, n_axes)."""
        return self.position, self.velocity, self.acceleration, self.force

    @property
    def duration(self) -> float:
        """Number of samples / sample rate, s."""
        return len(self) / self.sample_rate

    def __len__(self) -> int:
        return self.position.shape[0]

    def part(self, first: int, stop: int) -> Setpoint:
        """Its samples from number `first` to before `stop`."""
        position, velocity, acceleration, force = (c[first:stop] for c in self.columns)
        return Setpoint(position, velocity, acceleration, force, self.sample_rate)


@dataclass(frozen=True, eq=False)
class PlannedSetpoint:
    """A closed-loop setpoint that is sampled where it is asked for: half an hour takes no memory.

    samples: how many, at sample_rate (Hz).
    """

    phases: Phases
    samples: int
    sample_rate: float

    @property
    def duration(self) -> float:
        """Number of samples / sample rate, s."""
        return self.samples / self.sample_rate

    def __len__(self) -> int:
        return self.samples

    def part(self, first: int, stop: int) -> Setpoint:
        """Its samples from number `first` to before `stop`."""
        count = min(stop, self.samples) - first
        columns = sample(self.phases, count, self.sample_rate, first)
        return Setpoint(*columns, np.zeros_like(columns[0]), self.sample_rate)


AnySetpoint = Setpoint | PlannedSetpoint


def whole_motion(parts: Sequence[Phases], sample_rate: float) -> PlannedSetpoint:
    """All parts in a row; the last sample is at the end of the last part.

    CannotRun where the motion is longer than an hour at 10 kHz, or takes no time at all.
    """
    require_length(sum(part.total for part in parts), sample_rate)
    phases = join(parts)
    return PlannedSetpoint(phases, math.ceil(phases.total * sample_rate) + 1, sample_rate)


def point_to_point(
    limits: Sequence[Limits], waypoints: FloatArray, dwell: float, sample_rate: float
) -> PlannedSetpoint:
    """Fastest straight moves from waypoint to waypoint (m, shape (k, n_axes)), all axes together.

    dwell: rest at every waypoint, the first and the last included, s.
    """
    places = inside_travel(limits, waypoints)
    parts = [rest(places[0], dwell)]
    for start, target in pairwise(places):
        parts += [move(limits, start, target), rest(target, dwell)]
    return whole_motion(parts, sample_rate)


def concatenate(setpoints: Sequence[AnySetpoint]) -> Setpoint:
    """One setpoint after the other; each starts at rest where the one before ended at rest."""
    parts = [setpoint.part(0, len(setpoint)).columns for setpoint in setpoints]
    position, velocity, acceleration, force = map(np.concatenate, zip(*parts, strict=True))
    return Setpoint(position, velocity, acceleration, force, setpoints[0].sample_rate)
