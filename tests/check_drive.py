"""A drive in closed form: its signals at any time, so that each may be recorded late or scaled."""

from collections.abc import Callable, Mapping

import numpy as np

from twin.checks import Fault, LogFinding, check_log
from twin.checks.axis import Axis
from twin.logs import LINEAR_UNITS, AxisLog, Log
from twin.logs.log import Array

MASS, DAMPING, COULOMB, BIAS = 2.5, 3.5, 1.5, 0.4  # kg, N s/m, N, N
WAVES = ((0.031, 5.3, 0.2), (0.012, 13.7, 1.1), (0.005, 29.9, 2.3))  # m, rad/s, rad


def motion(t: Array, derivative: int = 0) -> Array:
    """Position of the drive in m, or its first or second derivative."""
    return sum(a * w**derivative * np.sin(w * t + p + derivative * np.pi / 2) for a, w, p in WAVES)


def command(t: Array, coulomb: float = COULOMB) -> Array:
    """Force in N that this motion takes; without Coulomb friction it has no edges."""
    v = motion(t, 1)
    return MASS * motion(t, 2) + DAMPING * v + coulomb * np.tanh(v / 1e-3) + BIAS


def drive(
    rate: float = 1000.0,
    seconds: float = 4.0,
    *,
    late: Mapping[str, float] | None = None,
    factor: Mapping[str, float] | None = None,
    signals: tuple[str, ...] = ("position", "force"),
    kind: Mapping[str, str] = LINEAR_UNITS,
    change: Callable[[dict[str, Array]], None] | None = None,
    coulomb: float = COULOMB,
) -> Log:
    """A log of the drive; signals ``late`` by seconds, multiplied by a ``factor``, or changed."""
    t = 10.0 + np.arange(round(rate * seconds)) / rate
    of: dict[str, Callable[[Array], Array]] = {
        "position": motion,
        "velocity": lambda t: motion(t, 1),
        "force": lambda t: command(t + 0.5 / rate, coulomb),  # held over the sample
        "current": lambda t: command(t + 0.5 / rate, coulomb) / 7.0,
        "setpoint_position": motion,
        "setpoint_velocity": lambda t: motion(t, 1),
        "setpoint_acceleration": lambda t: motion(t, 2),
        "pressure": lambda t: 2e5 + 3e3 * np.sin(0.7 * t),
        "pressure_2": lambda t: 1e5 + 2e3 * np.sin(0.9 * t),
        "temperature": lambda t: 295.0 + 0.1 * t,
    }
    columns = {
        name: (factor or {}).get(name, 1.0) * of[name](t - (late or {}).get(name, 0.0))
        for name in signals
    }
    if change:
        change(columns)
    return Log(rate, {"x": AxisLog(columns, kind, 7.0)})


def axis_of(log: Log) -> Axis:
    """What the checks see of axis x."""
    return Axis("x", log.sample_rate, log.axes["x"])


def findings(log: Log, fault: Fault) -> list[LogFinding]:
    """What is found of one kind of fault."""
    return [f for f in check_log(log).findings if f.fault is fault]


def stated(finding: LogFinding, words: str) -> float:
    """The number behind these words."""
    return float(finding.what.partition(words)[2].split()[0])
