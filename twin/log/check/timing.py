"""Lags between the channels of a log."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twin.log.check.axis import Axis
from twin.log.check.lag import Trend, find_lag
from twin.log.check.report import Fault, Finding, Severity
from twin.signals import Array

ALLOWED = 3e-3  # s
ALLOWED_SAMPLES = 2.0
PHYSICAL = 10e-3  # s, what a slow drive may account for
STEADY = 0.25e-3  # s, what friction that the check does not know may account for
STEADY_SAMPLES = 1.5
SURE = 5.0  # times the error
DRIFT = 60e-6  # s/s
READINGS = ("position", "velocity", "current", "force")
FOLLOWING = 30e-3  # s, what a slow position loop may account for


def check(axis: Axis) -> Iterator[Finding]:
    """Command, measured velocity and setpoint against the position."""
    if not axis.moves:
        return
    allowed = max(ALLOWED, ALLOWED_SAMPLES / axis.sample_rate)
    columns = axis.log.columns
    lag = axis.lag.seconds if axis.lag.clear else 0.0
    if abs(lag) > allowed:
        dead_time = -PHYSICAL <= lag < 0.0
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
        slow = lag > max(allowed, FOLLOWING) and not axis.soft_loop
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
    if abs(trend.drift) > max(DRIFT, SURE * trend.drift_error):
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
    least = max(STEADY_SAMPLES / axis.sample_rate, STEADY, SURE * trend.error)
    return least < abs(trend.seconds) < PHYSICAL


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
