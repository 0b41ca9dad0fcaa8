"""What signals say of each other: lags, wrong units and signs, swapped axes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from twin.checks import limits
from twin.checks.axis import Axis
from twin.checks.explain import Trend, find_lag, fit_dynamics
from twin.checks.report import Fault, Finding, Severity
from twin.signals import Array

READINGS = ("position", "velocity", "current", "force")


def check_timing(axis: Axis) -> Iterator[Finding]:
    """Command, measured velocity and setpoint against the position."""
    if not axis.moves:
        return
    allowed = max(limits.ALLOWED, limits.ALLOWED_SAMPLES / axis.sample_rate)
    columns = axis.log.columns
    lag = axis.lag.seconds if axis.lag.clear else 0.0
    if abs(lag) > allowed:
        dead_time = -limits.PHYSICAL <= lag < 0.0
        late = "force" if lag > 0.0 else "position"
        yield Finding(
            Severity.WARNING if dead_time else Severity.ERROR,
            Fault.LAG,
            axis.name,
            f"the force is {_text(axis, lag)} the motion that it causes",
            "whole log",
            f"{_remedy(axis, late, lag)}{', unless the drive has that dead time' * dead_time}",
        )
    else:
        yield from _steady(axis)
    if "velocity" in columns:
        lag = _lag(axis, axis.smoother.rate(columns["velocity"]), axis.velocity)
        if abs(lag) > allowed:
            late = "velocity" if lag > 0.0 else "position"
            yield _disagree(axis, "velocity", "the rate of position", late, lag)
    if "setpoint_position" in columns:
        setpoint = axis.smoother.velocity(columns["setpoint_position"])
        lag = _lag(axis, axis.velocity, setpoint)
        slow = lag > max(allowed, limits.FOLLOWING) and not axis.soft_loop
        if lag < -allowed or slow:
            yield _disagree(axis, "position", "its setpoint", _late(axis, lag, allowed), lag)


def _late(axis: Axis, lag: float, allowed: float) -> str:
    """The columns that are late where the position is so many s behind its setpoint.

    Where the force is not, all readings are: the position alone would then be wrong to correct,
    above all where a slow position loop is the cause.
    """
    if lag < 0.0:
        return "setpoint_position"
    apart = axis.lag.clear and abs(axis.lag.seconds) > allowed
    return "position" if apart else " and ".join(n for n in READINGS if n in axis.log.columns)


def _steady(axis: Axis) -> Iterator[Finding]:
    """A lag or a drift too small to be seen at once, but the same in all parts of the log."""
    trend = axis.trend
    if trend is None or not axis.dynamics.explains:
        return
    if abs(trend.drift) > max(limits.DRIFT, limits.SURE_LAG * trend.drift_error):
        yield Finding(
            Severity.WARNING, Fault.DRIFT, axis.name,
            f"the force gets {abs(trend.drift) * 1e3:.2g} ms a second "
            f"{'later' if trend.drift > 0.0 else 'earlier'} against the position "
            f"({abs(trend.drift) * 1e6:.3g} ppm, +- {trend.drift_error * 1e6:.2g}): two clocks",
            "whole log", "record both with one clock, or import each with time stamps",
        )  # fmt: skip
        return
    if _is_steady(axis, trend) and _is_steady(axis, axis.trend_beside_memory):
        late = "force" if trend.seconds > 0.0 else "position"
        yield Finding(
            Severity.WARNING, Fault.LAG, axis.name,
            f"the force is {_text(axis, trend.seconds)} the motion that it causes, "
            f"+- {trend.error * 1e3:.2g} ms",
            "whole log",
            f"{_remedy(axis, late, trend.seconds)}, unless the drive has that dead time",
        )  # fmt: skip


def _is_steady(axis: Axis, trend: Trend | None) -> bool:
    """Whether a lag is more than its error and than what is usual, and may be a drive's."""
    if trend is None:
        return False
    least = max(
        limits.STEADY_SAMPLES / axis.sample_rate, limits.STEADY, limits.SURE_LAG * trend.error
    )
    return least < abs(trend.seconds) < limits.PHYSICAL


def _lag(axis: Axis, signal: Array, other: Array) -> float:
    """Seconds by which a signal trails the one it should equal; 0 where that is not clear."""
    regressors = np.column_stack([other, np.ones_like(other)])
    lag = find_lag(signal, regressors, axis.kept, axis.smoother.block)
    return lag.seconds if lag.clear else 0.0


def _disagree(axis: Axis, name: str, other: str, late: str, lag: float) -> Finding:
    return Finding(
        Severity.WARNING,
        Fault.LAG,
        axis.name,
        f"{name} is {_text(axis, lag)} {other}",
        "whole log",
        _remedy(axis, late, lag),
    )


def _text(axis: Axis, lag: float) -> str:
    side = "behind" if lag > 0.0 else "ahead of"
    return f"{abs(lag) * 1e3:.3g} ms ({abs(lag) * axis.sample_rate:.3g} samples) {side}"


def _remedy(axis: Axis, late: str, lag: float) -> str:
    samples = round(abs(lag) * axis.sample_rate)
    return f"give {late} delay_samples = {samples} in the import map"


_SLIPS: Mapping[float, str] = {
    1e3: "a unit a thousand times smaller, as mm for m",
    1e6: "a unit a million times smaller, as um for m",
    180.0 / np.pi: "degrees for radians",
}
UNKNOWN_SLIP = "a scale or the sample rate is wrong"


@dataclass(frozen=True)
class _Pair:
    """A signal and the one that states the same; low, high: their allowed ratio.

    follows: whether the one states where the other should be, and not where it is.
    """

    name: str
    signal: Array
    other_name: str
    other: Array
    low: float
    high: float
    follows: bool = False
    zero: bool = False  # whether 0 is the same on both sides, as of speeds and not of positions


def check_units(axis: Axis) -> Iterator[Finding]:
    """Unit slips and reversed signs."""
    yield from _travel(axis)
    for pair in _pairs(axis):
        yield from _compare(axis, pair)
    yield from _reversed_force(axis)


def _travel(axis: Axis) -> Iterator[Finding]:
    for name in ("position", "setpoint_position"):
        travel = np.ptp(axis.log.columns[name]) if name in axis.log.columns else 0.0
        if travel > limits.LONGEST_TRAVEL and not axis.log.kind.rotary:
            yield Finding(
                Severity.ERROR,
                Fault.UNIT,
                axis.name,
                f"{name} travels {travel:.4g} m, more than {limits.LONGEST_TRAVEL:g} m; "
                f"in mm it would be {travel / 1e3:.4g} m",
                "whole log",
                "correct its unit in the import map",
            )


def _pairs(axis: Axis) -> Iterator[_Pair]:
    columns, smoother = axis.log.columns, axis.smoother
    setpoint, velocity = columns.get("setpoint_position"), columns.get("setpoint_velocity")
    acceleration = columns.get("setpoint_acceleration")
    if setpoint is not None:
        # a controller may follow badly; one that is off by more than 2 does not follow at all
        yield _Pair("position", smoother.position(columns["position"]), "setpoint_position",
                    smoother.position(setpoint), 0.5, 2.0, follows=True)  # fmt: skip
    if "velocity" in columns:
        yield _Pair("velocity", smoother.rate(columns["velocity"]),
                    "the rate of position", axis.velocity, 0.95, 1.05, zero=True)  # fmt: skip
    if setpoint is not None and velocity is not None:
        yield _Pair("setpoint_velocity", smoother.rate(velocity),
                    "the rate of setpoint_position", smoother.velocity(setpoint),
                    0.95, 1.05, zero=True)  # fmt: skip
    if setpoint is not None and acceleration is not None:
        yield _Pair("setpoint_acceleration", smoother.rate(acceleration),
                    "the second rate of setpoint_position", smoother.acceleration(setpoint),
                    0.9, 1.1)  # fmt: skip
    if {"force", "current"} <= set(columns) and axis.log.force_constant is not None:
        yield _Pair("force", columns["force"], "force constant x current",
                    axis.log.force_constant * columns["current"], 0.98, 1.02)  # fmt: skip


def _compare(axis: Axis, pair: _Pair) -> Iterator[Finding]:
    one, other = pair.signal, pair.other
    if not pair.zero:
        one, other = one - one.mean(), other - other.mean()
    power = float(other @ other)
    if power == 0.0 or not axis.moves:
        return
    product = float(one @ other)
    if abs(product) < limits.RELATED * np.sqrt(power * float(one @ one)):
        return
    ratio = product / power
    if pair.low <= ratio <= pair.high:
        return
    if ratio < 0.0:
        fault, looks = Fault.SIGN, "one of them is reversed"
    else:
        fault, looks = Fault.UNIT, _looks_like(ratio)
        if looks == UNKNOWN_SLIP and pair.follows and axis.soft_loop:
            return
    yield Finding(
        Severity.ERROR,
        fault,
        axis.name,
        f"{pair.name} is {ratio:.4g} times {pair.other_name}: {looks}",
        "whole log",
        "correct unit, scale, sign or sample rate in the import map",
    )


def _looks_like(ratio: float) -> str:
    for size, text in _SLIPS.items():
        if abs(np.log(ratio * size)) < 0.3 or abs(np.log(ratio / size)) < 0.3:
            return f"it looks like {text}"
    return UNKNOWN_SLIP


def _reversed_force(axis: Axis) -> Iterator[Finding]:
    if not axis.moves:
        return
    fit = axis.dynamics
    if fit.explains and fit.mass_matters and fit.mass < 0.0:
        units = axis.log.kind
        yield Finding(
            Severity.ERROR,
            Fault.SIGN,
            axis.name,
            f"the force acts against the acceleration, as if the "
            f"{units.mass_name} were {fit.mass:.3g} {units.mass}",
            "whole log",
            "give the force or the position the sign -1 in the import map",
        )


def check_crossed(axes: Sequence[Axis]) -> Iterator[Finding]:
    """Swapped positions or forces, for each pair of axes that move."""
    for one, other in combinations([a for a in axes if a.moves], 2):
        if len(one.force) != len(other.force) or one.log.kind != other.log.kind:
            continue
        own = min(_left(one, one), _left(other, other))
        crossed = max(_left(one, other), _left(other, one))
        if own < limits.WORSE * crossed or crossed > limits.EXPLAINED_CROSSED:
            continue
        what = "positions" if _follows(one, other) and _follows(other, one) else "forces"
        yield Finding(
            Severity.ERROR, Fault.SWAPPED, one.name,
            f"the motion of axis {other.name} leaves {100 * crossed:.2g} % of this force, "
            f"its own {100 * own:.2g} %: {what} of axes {one.name} and {other.name} are swapped",
            "whole log", f"exchange the columns of the {what} of both axes in the import map",
        )  # fmt: skip


def _left(force: Axis, motion: Axis) -> float:
    """The part of a force that a motion does not explain."""
    kept = np.minimum(force.kept, motion.kept)
    fit = fit_dynamics(force.force, motion.regressors, kept, 0)
    return float(np.median(np.abs(fit.residual)) / np.median(np.abs(_centred(force.force))))


def _follows(position: Axis, setpoint: Axis) -> bool:
    """Whether the position of one axis is where another was told to be."""
    told = setpoint.log.columns.get("setpoint_position")
    if told is None:
        return False
    x, r = _centred(position.log.position), _centred(told)
    return float(x @ r) > limits.ALIKE_SETPOINT * float(np.linalg.norm(x) * np.linalg.norm(r))


def _centred(x: Array) -> Array:
    return np.asarray(x - x.mean())
