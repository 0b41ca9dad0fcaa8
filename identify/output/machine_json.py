"""What describes a machine as JSON: the catalogue, and whether logs are fit for identification."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from twin.effect import Effect

if TYPE_CHECKING:
    from twin.checks import CheckReport


def effect_json(effect: Effect) -> dict[str, Any]:
    """Everything the catalogue knows of one effect."""
    return {
        "name": effect.name,
        "kind": effect.kind.name.lower(),
        "is_nonparametric": effect.is_nonparametric,
        "summary": effect.summary,
        "equation": effect.equation,
        "source": effect.source,
        "states": list(effect.states),
        "fingerprint": effect.fingerprint,
        "excited_by": effect.excited_by,
        "parameters": [
            {
                "name": p.name, "unit": p.unit, "start": p.start, "lower": p.lower,
                "upper": p.upper, "meaning": p.meaning,
            }
            for p in effect.parameters
        ],
    }  # fmt: skip


def check_json(reports: Mapping[str, CheckReport]) -> dict[str, Any]:
    """Whether all logs may be fitted, and the findings of each."""
    return {
        "ok": all(report.ok for report in reports.values()),
        "logs": {
            name: [
                {
                    "severity": f.severity.value, "fault": f.fault.name.lower(), "axis": f.axis,
                    "what": f.what, "where": f.where, "remedy": f.remedy,
                }
                for f in report.findings
            ]
            for name, report in reports.items()
        },
    }  # fmt: skip
