"""What describes a machine, as text and JSON: the catalogue, its laws, checks of logs, pictures.

Apart from ``text`` and ``as_json`` because these commands need nothing of the identification,
whose modules take a second to load.
"""

from __future__ import annotations

import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from twin.effect import Effect
from twin.errors import InputError
from twin.files import write_atomically
from twin.model.units import ROTARY

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from identify.dataset.motion import Motion
    from twin.checks import CheckReport
    from twin.laws.verdict import LawReport


def plain(value: Any) -> Any:
    """A value as JSON knows it: the one hook for whatever a result holds.

    A dataclass by its fields, arrays as lists, an Enum by its value, not a number as null.
    """
    if is_dataclass(value) and not isinstance(value, type):
        return {f.name: plain(getattr(value, f.name)) for f in fields(value)}
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if hasattr(value, "tolist"):  # of NumPy, which a short command need not load
        return plain(value.tolist())
    if isinstance(value, Enum):
        return value.value
    return None if isinstance(value, float) and not math.isfinite(value) else value


def pick(value: object, *names: str, **renamed: str) -> dict[str, Any]:
    """These attributes of a result by name; renamed: key = name of the attribute."""
    keys = {**{name: name for name in names}, **renamed}
    return {key: getattr(value, name) for key, name in keys.items()}


# --- the catalogue ---------------------------------------------------------------------------


def effects_text(effects: list[Effect]) -> str:
    """One line an effect."""
    width = max(len(e.name) for e in effects)
    return "\n".join(f"{e.name:{width}s}  {e.kind.name.lower():9s}  {e.summary}" for e in effects)


def effect_text(effect: Effect) -> str:
    """One effect in full."""
    rows = [
        f"  {p.name:14s} {p.start:>10.4g} {p.unit:10s} [{p.lower:g}, {p.upper:g}]  {p.meaning}"
        for p in effect.parameters
    ]
    return "\n".join(
        [
            f"{effect.name} ({effect.kind.name.lower()}): {effect.summary}",
            f"equation     {effect.equation}",
            f"source       {effect.source}",
            f"fingerprint  {effect.fingerprint}",
            f"excited by   {effect.excited_by}",
            "parameters   start value, unit, bounds, meaning",
            *rows,
            f"on a rotary axis a unit of m is one of {ROTARY.position}, N of {ROTARY.force}, kg of "
            f"{ROTARY.mass}",
        ]
    )


def effect_json(effect: Effect) -> dict[str, Any]:
    """Everything the catalogue knows of one effect."""
    told = ("name", "is_nonparametric", "summary", "equation", "source", "states", "fingerprint")
    return {
        **pick(effect, *told, "excited_by"),
        "kind": effect.kind.name.lower(),
        "parameters": [
            pick(p, "name", "unit", "start", "lower", "upper", "meaning") for p in effect.parameters
        ],
    }


FORMATS = ("png", "svg", "pdf")


def draw(effect: Effect, motion: Motion, force: NDArray[np.float64], path: Path) -> None:
    """Write the picture of the effect's force (n,) N along a motion, over time, place and speed.

    Raises InputError for another ending than .png, .svg or .pdf.
    """
    import matplotlib

    kind = path.suffix.lstrip(".")
    if kind not in FORMATS:
        raise InputError(f"{path}: cannot draw '{path.suffix}'; end the name in .png, .svg or .pdf")

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, axes = plt.subplots(1, 3, figsize=(11.0, 3.6), sharey=True, layout="constrained")
    across = (
        (motion.time, "Time (s)"),
        (1e3 * motion.position, "Position (mm)"),
        (1e3 * motion.velocity, "Speed (mm/s)"),
    )
    for panel, (values, label) in zip(axes, across, strict=True):
        panel.plot(values, force, linewidth=0.8, color="#2b6cb0")
        panel.set_xlabel(label)
        panel.grid(alpha=0.3)
    axes[0].set_ylabel("Added force (N)")
    figure.suptitle(f"{effect.name}: {effect.fingerprint}", fontsize=10)
    content = io.BytesIO()
    figure.savefig(content, format=kind, dpi=130)
    plt.close(figure)
    write_atomically(path, content.getvalue())


# --- the laws of effects, and checks of logs -------------------------------------------------


def laws_text(reports: Sequence[LawReport]) -> str:
    """One line a law."""
    outcomes = {True: "ok", False: "FAILED", None: "not tried"}
    return "\n".join(
        f"{r.effect}: {outcomes[o.holds]}: {o.law}{'' if o.holds else f': {o.fault}'}"
        for r in reports
        for o in r.outcomes
    )


def laws_json(reports: Sequence[LawReport]) -> dict[str, Any]:
    """Whether all laws hold for all effects, and each law; ``holds`` is null where not tried."""
    return {
        "ok": all(r.ok for r in reports),
        "effects": {
            r.effect: [
                {"law": o.law, "holds": o.holds, "fault": o.fault or None} for o in r.outcomes
            ]
            for r in reports
        },
    }


def check_text(reports: Mapping[str, CheckReport]) -> str:
    """One line a finding, or that there is none."""
    lines = []
    for name, report in reports.items():
        lines += [f"{name}: {f.severity.value}: {f}" for f in report.findings]
        if not report.findings:
            lines.append(f"{name}: suitable for identification")
    return "\n".join(lines)


def check_json(reports: Mapping[str, CheckReport]) -> dict[str, Any]:
    """Whether all logs may be fitted, and the findings of each."""
    told = ("axis", "what", "where", "remedy")
    logs = {
        name: [
            {"severity": f.severity, "fault": f.fault.name.lower(), **pick(f, *told)}
            for f in report.findings
        ]
        for name, report in reports.items()
    }
    return plain({"ok": all(report.ok for report in reports.values()), "logs": logs})
