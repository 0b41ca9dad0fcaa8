"""What is said of a log that disagrees with the others."""

from __future__ import annotations

from collections.abc import Mapping

from identify.dataset.dataset import Dataset
from identify.dataset.odd_log import Disagreement, Otherwise, Recorded
from identify.output.numbers import number, quantity
from twin.checks.report import WHOLE, CheckReport, Fault, LogFinding, Severity
from twin.model.units import AxisUnits

NONE = 1e-3  # of the value in a log, below which that of the others is as good as none
_TO_DO = "leave it out, or find what was otherwise"


def odd_in_words(dataset: Dataset) -> str:
    """Of a dataset with an odd log: which it is, how it disagrees, what was done or is to do."""
    assert dataset.odd is not None
    kept = any(log.motion.name == dataset.odd.log for log in dataset.logs)
    what = _TO_DO if kept else "all else is told without it"
    if dataset.odd.at_rest:
        what = "the axis is at rest there, so that no fit uses it: see what happened"
    return f"{dataset.odd.log} {_disagrees(dataset.odd, dataset.units)}; {what}"


def with_odd(
    reports: Mapping[str, CheckReport], found: Mapping[str, Dataset]
) -> dict[str, CheckReport]:
    """Reports on logs, with that one disagrees with the others; found: by axis that has one."""
    out = dict(reports)
    for axis, dataset in found.items():
        if dataset.odd is None:
            continue
        own = LogFinding(
            Severity.WARNING, Fault.ODD, axis, f"it {_disagrees(dataset.odd, dataset.units)}",
            WHOLE, _TO_DO,
        )  # fmt: skip
        report = out[dataset.odd.log]
        out[dataset.odd.log] = CheckReport((*report.findings, own))
    return out


def _disagrees(odd: Disagreement, units: AxisUnits) -> str:
    """By how much a log disagrees with the others, when, and as if what were otherwise in it."""
    error, others = (quantity(size, units.force) for size in (odd.error, odd.others))
    said = "disagrees with the other logs"
    if odd.times > 1.0:
        said += f": {odd.times:.1f} times their error, {error} of {others}"
    if odd.span:
        said += ", above all from " + " to ".join(quantity(instant, "s") for instant in odd.span)
    return f"{said}, as if {_otherwise(odd.otherwise, units)}" if odd.otherwise else said


def _otherwise(own: Otherwise, units: AxisUnits) -> str:
    """What would be otherwise in a log."""
    match own.what:
        case Recorded.GAIN:
            return f"its force were recorded {number(own.there)} times as large"
        case Recorded.CONSTANT:
            return f"a constant {quantity(own.there, units.force)} acted in it alone"
        case Recorded.DELAY:
            late = "later" if own.there > 0.0 else "earlier"
            return f"its force came {quantity(abs(own.there), 's')} {late}"
        case label:
            name = units.mass_name if label == "mass" else units.words(label)
            if abs(own.elsewhere) < NONE * abs(own.there):
                return f"{name} were there in it alone"
            return f"{name} were {number(own.there / own.elsewhere)} times as large in it"
