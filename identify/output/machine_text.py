"""What describes a machine as text: the catalogue, and whether logs are fit for identification.

Apart from identify.output.text because these commands need nothing of the identification, whose
modules take a second to load.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

from twin.effect import Effect
from twin.model.units import ROTARY

if TYPE_CHECKING:
    from twin.checks import CheckReport


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


def check_text(reports: Mapping[str, CheckReport]) -> str:
    """One line a finding, or that there is none."""
    lines = []
    for name, report in reports.items():
        lines += [f"{name}: {f.severity.value}: {f}" for f in report.findings]
        if not report.findings:
            lines.append(f"{name}: suitable for identification")
    return "\n".join(lines)
