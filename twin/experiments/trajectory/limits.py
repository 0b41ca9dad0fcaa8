"""Motion limits of an axis, and the checks that keep a setpoint within them."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from numbers import Integral

import numpy as np
import numpy.typing as npt

from twin.errors import CannotRun, InputError
from twin.model.units import LINEAR, AxisUnits

FloatArray = npt.NDArray[np.float64]

_SAME_PLACE = 1e-9  # m, rounding of a position that lies on the end of the travel


@dataclass(frozen=True)
class Limits:
    """Motion limits of the setpoint of one axis.

    Attributes:
        travel: lowest and highest position, m.
        velocity: largest speed, m/s.
        acceleration: largest acceleration, m/s^2.
        jerk: largest jerk, m/s^3.
        units: of the axis; on a rotary one lengths are angles.

    Raises:
        InputError: the travel is empty, or a limit is not a positive finite number.
    """

    travel: tuple[float, float]
    velocity: float
    acceleration: float
    jerk: float
    units: AxisUnits = LINEAR

    def __post_init__(self) -> None:
        low, high = self.travel
        if not (math.isfinite(low) and math.isfinite(high) and low < high):
            raise InputError(
                f"travel {low:g} .. {high:g} {self.units.position} is empty or not finite: "
                f"give the lowest position first, both in {self.units.position}"
            )
        require_positive("velocity limit", self.velocity, self.units.velocity)
        require_positive("acceleration limit", self.acceleration, self.units.acceleration)
        require_positive("jerk limit", self.jerk, self.units("m/s^3"))

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


def require_positive(name: str, value: float, unit: str) -> None:
    """Raise InputError unless `value` is finite and above zero."""
    if not (math.isfinite(value) and value > 0.0):
        raise InputError(f"{name} {value:g} {unit} is not allowed: give a number above 0 {unit}")


def require_not_negative(name: str, value: float, unit: str) -> None:
    """Raise InputError unless `value` is finite and at least zero."""
    if not (math.isfinite(value) and value >= 0.0):
        raise InputError(f"{name} {value:g} {unit} is not allowed: give 0 {unit} or more")


def require_count(name: str, value: int) -> None:
    """Raise InputError unless `value` is a whole number of at least one."""
    if not (isinstance(value, Integral) and value >= 1):
        raise InputError(f"{name} {value!r} is not allowed: give a whole number of at least 1")


def axis_name(axis: int) -> str:
    """Name of the axis in messages: x, y, z, then the index."""
    return "xyz"[axis] if axis < 3 else str(axis)


def require_axis(axis: int, n_axes: int) -> None:
    """Raise InputError unless `axis` is the index of one of `n_axes` axes."""
    if not (isinstance(axis, Integral) and 0 <= axis < n_axes):
        raise InputError(f"there is no axis {axis!r}: give an index from 0 to {n_axes - 1}")


def as_positions(name: str, values: npt.ArrayLike) -> FloatArray:
    """`values` as a new array of finite positions in m, or InputError; `name` is a plural."""
    try:
        positions = np.array(values, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} are not an array of numbers: give positions in m") from None
    if not np.isfinite(positions).all():
        raise InputError(f"{name} hold a position that is not finite: give positions in m")
    return positions


def travel_box(limits: Sequence[Limits]) -> tuple[FloatArray, FloatArray]:
    """Lowest and highest position of all axes, m, each of shape (n_axes,)."""
    if not limits:
        raise InputError("no axis given: give the limits of at least one axis")
    low, high = np.array([axis.travel for axis in limits], dtype=float).T
    return low, high


def inside_travel(limits: Sequence[Limits], positions: FloatArray) -> FloatArray:
    """The positions (m, shape (..., n_axes)), or CannotRun if one lies outside the travel.

    A position outside by rounding alone is set to the end of the travel.
    """
    low, high = travel_box(limits)
    if positions.ndim == 0 or positions.shape[-1] != low.size:
        raise InputError(
            f"positions of shape {positions.shape} do not fit {low.size} axes: "
            f"give {low.size} positions, one per axis"
        )
    outside = np.argwhere((positions < low - _SAME_PLACE) | (positions > high + _SAME_PLACE))
    if outside.size:
        where = tuple(outside[0])
        axis = int(where[-1])
        unit = limits[axis].units.position
        slip = "degrees" if limits[axis].units.rotary else "mm"
        raise CannotRun(
            f"setpoint {positions[where]:.6g} {unit} of axis {axis_name(axis)} is outside its "
            f"travel {low[axis]:g} .. {high[axis]:g} {unit}: shorten the move, place it elsewhere, "
            f"or check that positions are in {unit} and not in {slip}"
        )
    return np.clip(positions, low, high)


def require_plateau(limits: Sequence[Limits], axis: int, speed: float, span: float) -> None:
    """Raise CannotRun unless a move over `span` (m) holds `speed` (m/s) over half of the span."""
    require_axis(axis, len(limits))
    name, limit = axis_name(axis), limits[axis]
    unit, rate = limit.units.position, limit.units.velocity
    require_positive("span", span, unit)
    require_positive("speed", speed, rate)
    if speed > limit.velocity:
        raise CannotRun(
            f"speed {speed:g} {rate} of axis {name} is above its limit of {limit.velocity:g} "
            f"{rate}: "
            "give a lower speed"
        )
    needed = 2.0 * speed * limit.ramp_time(speed)
    if span < needed * (1.0 - 1e-9):
        raise CannotRun(
            f"speed {speed:g} {rate} of axis {name} is not held over half of {span:g} {unit}: give "
            f"a span of at least {needed:.4g} {unit} or at most "
            f"{limit.fastest_plateau(span):.4g} {rate}"
        )
