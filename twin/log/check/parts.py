"""The check of a log that is too long for memory: part by part, and what the parts agree on."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from twin.log.check.report import CheckReport, Fault, Finding

_OF_THE_WHOLE = (Fault.FLAT, Fault.WEAK_EXCITATION, Fault.COARSE_POSITION)  # not of each part
_WHOLE = "whole log"


@dataclass(frozen=True)
class Part:
    """The report on the samples from ``start`` to ``stop``, s."""

    start: float
    stop: float
    report: CheckReport


def together(parts: Sequence[Part]) -> CheckReport:
    """One report; a fault of an axis is said once, with the first place.

    That an axis stands still or moves one way in a part is none: it counts where all parts say so.
    """
    if len(parts) == 1:
        return parts[0].report
    found: dict[tuple[str, Fault], list[tuple[Part, Finding]]] = {}
    for part in parts:
        for finding in _once(part.report.findings):
            found.setdefault((finding.axis, finding.fault), []).append((part, finding))
    return CheckReport(
        tuple(
            _said(seen, len(parts))
            for (_, fault), seen in found.items()
            if fault not in _OF_THE_WHOLE or len(seen) == len(parts)
        )
    )


def _once(findings: Iterable[Finding]) -> list[Finding]:
    return list({(f.axis, f.fault): f for f in reversed(list(findings))}.values())[::-1]


def _said(seen: Sequence[tuple[Part, Finding]], parts: int) -> Finding:
    """A fault that was seen in some parts, of its worst severity."""
    part, first = next(((p, f) for p, f in seen if f.severity.value == "error"), seen[0])
    if first.where == _WHOLE and len(seen) == parts:
        return first
    place = f"{part.start:g} to {part.stop:g} s"
    where = place if first.where == _WHOLE else f"{first.where} into the part from {place}"
    more = len(seen) - 1
    return replace(first, where=where + (f", and in {more} other parts" if more else ""))
