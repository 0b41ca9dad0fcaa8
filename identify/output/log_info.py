"""What is in logs, as text and as JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from twin.checks.long import AxisInfo, LogInfo


def info_text(found: Mapping[str, LogInfo]) -> str:
    """Some lines a log: length and rate, what its writer said, each axis, and whether it is fit."""
    return "\n".join(line for name, info in found.items() for line in _lines(name, info))


def _lines(name: str, info: LogInfo) -> list[str]:
    lines = [
        f"{name}: {info.duration:.4g} s, {info.samples} samples at {info.sample_rate:g} Hz, "
        f"{'axis' if len(info.axes) == 1 else 'axes'} {', '.join(info.axes)}"
    ]
    said = ", ".join(f"{key} {value}" for key, value in info.metadata.items())
    lines += [f"  written by: {said}"] if said else []
    for axis, own in info.axes.items():
        lines += [f"  axis {axis} ({_about(own)})"]
        width = max(len(c.name) for c in own.channels)
        lines += [
            f"    {c.name:{width}s}  {c.least:.6g} to {c.most:.6g} {c.unit}" for c in own.channels
        ]
    return [*lines, f"  check: {_checked(name, info)}"]


def _about(axis: AxisInfo) -> str:
    if axis.constant is None:
        return axis.kind
    value, unit = axis.constant
    return f"{axis.kind}, force constant {value:g} {unit}"


def _checked(name: str, info: LogInfo) -> str:
    findings = info.check.findings
    if not findings:
        return "suitable for identification"
    worst = "warnings alone" if info.check.ok else "not suitable for identification"
    kinds = dict.fromkeys(f"{f.fault.value} (axis {f.axis})" for f in findings)
    return f"{worst}: {', '.join(kinds)}; `twin check {name}` tells where, and what to do"


def info_json(found: Mapping[str, LogInfo]) -> dict[str, Any]:
    """The same as one object, by the name of the log."""
    return {"logs": {name: _object(info) for name, info in found.items()}}


def _object(info: LogInfo) -> dict[str, Any]:
    return {
        "duration": info.duration,
        "duration_unit": "s",
        "samples": info.samples,
        "sample_rate": info.sample_rate,
        "sample_rate_unit": "Hz",
        "metadata": dict(info.metadata),
        "axes": {name: _axis_object(axis) for name, axis in info.axes.items()},
        "ok": info.check.ok,
        "findings": [
            {"severity": f.severity.value, "fault": f.fault.value, "axis": f.axis, "text": str(f)}
            for f in info.check.findings
        ],
    }


def _axis_object(axis: AxisInfo) -> dict[str, Any]:
    value, unit = axis.constant or (None, None)
    return {
        "kind": axis.kind,
        "force_constant": value,
        "force_constant_unit": unit,
        "channels": {
            c.name: {"unit": c.unit, "least": c.least, "most": c.most} for c in axis.channels
        },
    }
