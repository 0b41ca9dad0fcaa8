"""The clean log that faults are planted in, and what the tests of the checks share."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache

from twin.checks import CheckReport, Fault, LogFinding
from twin.effects import load_catalogue
from twin.logs import Log
from twin.logs.log import Array
from twin.model.file import load_model
from twin.model.machine import MachineModel
from twin.simulation.simulate import simulate

Columns = dict[str, Array]


@cache
def stage() -> MachineModel:
    """The Proton stage as it comes."""
    return load_model("proton_xy", load_catalogue())


@cache
def clean_log() -> Log:
    """Tracking for 6 s on both axes."""
    return simulate(stage(), "tracking", seed=5, duration=6.0)


def with_axis(log: Log, name: str, change: Callable[[Columns], Mapping[str, Array]]) -> Log:
    """The log of one axis, its columns changed."""
    axis = log.axes[name]
    columns = dict(change({n: c.copy() for n, c in axis.columns.items()}))
    return replace(log, axes={name: replace(axis, columns=columns)})


def only(report: CheckReport, fault: Fault) -> LogFinding:
    """The one finding of that kind."""
    found = [f for f in report.findings if f.fault is fault]
    assert len(found) == 1, [str(f) for f in report.findings]
    return found[0]


def faults(report: CheckReport) -> set[Fault]:
    """The kinds of fault that were found."""
    return {f.fault for f in report.findings}


def milliseconds(finding: LogFinding) -> float:
    """The lag that is stated, positive where the signal is behind."""
    words = finding.what.split()
    return float(words[words.index("ms") - 1]) * (1.0 if "behind" in words else -1.0)
