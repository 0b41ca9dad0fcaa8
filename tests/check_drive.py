"""A drive in closed form: its signals at any time, so that each may be recorded late or scaled."""

from collections.abc import Callable, Mapping

import numpy as np

from twin.checks import CheckReport, Fault, Finding, check_log
from twin.checks.axis import Axis
from twin.checks.breaks import check_breaks, check_outliers
from twin.checks.channels import check_timing, check_units
from twin.checks.command import check_saturation
from twin.checks.content import check_content, check_excitation
from twin.logs import LINEAR_UNITS, AxisLog, Log
from twin.logs.log import Array

MASS, DAMPING, COULOMB, BIAS = 2.5, 3.5, 1.5, 0.4  # kg, N s/m, N, N
WAVES = ((0.031, 5.3, 0.2), (0.012, 13.7, 1.1), (0.005, 29.9, 2.3))  # m, rad/s, rad


def motion(t: Array, derivative: int = 0) -> Array:
    """Position of the drive in m, or its first or second derivative."""
    return sum(a * w**derivative * np.sin(w * t + p + derivative * np.pi / 2) for a, w, p in WAVES)


def command(t: Array) -> Array:
    """Force in N that this motion takes."""
    v = motion(t, 1)
    return MASS * motion(t, 2) + DAMPING * v + COULOMB * np.tanh(v / 1e-3) + BIAS


def drive(
    rate: float = 1000.0,
    seconds: float = 4.0,
    *,
    late: Mapping[str, float] | None = None,
    factor: Mapping[str, float] | None = None,
    signals: tuple[str, ...] = ("position", "force"),
    kind: Mapping[str, str] = LINEAR_UNITS,
    change: Callable[[dict[str, Array]], None] | None = None,
) -> Log:
    """A log of the drive; signals ``late`` by seconds, multiplied by a ``factor``, or changed."""
    t = 10.0 + np.arange(round(rate * seconds)) / rate
    of: dict[str, Callable[[Array], Array]] = {
        "position": motion,
        "velocity": lambda t: motion(t, 1),
        "force": lambda t: command(t + 0.5 / rate),  # held over the sample
        "current": lambda t: command(t + 0.5 / rate) / 7.0,
        "setpoint_position": motion,
        "setpoint_velocity": lambda t: motion(t, 1),
        "setpoint_acceleration": lambda t: motion(t, 2),
    }
    columns = {
        name: (factor or {}).get(name, 1.0) * of[name](t - (late or {}).get(name, 0.0))
        for name in signals
    }
    if change:
        change(columns)
    return Log(rate, {"x": AxisLog(columns, kind, 7.0)})


CHECKS = {
    Fault.UNIT: check_units,
    Fault.SIGN: check_units,
    Fault.LAG: check_timing,
    Fault.SATURATION: check_saturation,
    Fault.OUTLIERS: lambda axis: [*check_breaks(axis), *check_outliers(axis)],
    Fault.COARSE_POSITION: check_excitation,
    Fault.WEAK_EXCITATION: check_excitation,
}


def findings(log: Log, fault: Fault) -> list[Finding]:
    """What the check of one kind of fault finds on axis x; other checks are not run."""
    check = CHECKS.get(fault, check_content)
    axis = Axis("x", log.sample_rate, log.axes["x"])
    return [f for f in check(axis) if f.fault is fault]


def report(log: Log) -> CheckReport:
    """All that is found."""
    return check_log(log)
