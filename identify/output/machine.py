"""What describes a machine, as text: the catalogue, its laws, checks of logs, pictures.

Apart from ``text`` because these commands need nothing of the identification,
whose modules take a second to load.
"""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from identify.output import require_picture, save_picture
from twin.model.units import ROTARY

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from identify.dataset.motion import Motion
    from twin.checks import CheckReport
    from twin.checks.long import AxisInfo, LogInfo
    from twin.effect import Effect
    from twin.export import ExportAgreement, Exported
    from twin.laws.verdict import LawReport

ASSUMES = "the import map assumes"  # begins a finding on what nobody has confirmed


def in_shell(*words: object) -> str:
    """A command as it is typed in a shell, whatever is in the names of its files."""
    return shlex.join(["twin", *map(str, words)])


# --- exports ---------------------------------------------------------------------------------


def export_text(made: Exported) -> str:
    """What an export holds of each axis, and what it lacks, a line for each part."""
    lines = []
    for axis, kept in made.kept.items():
        lines.append(f"axis {axis}: keeps {', '.join(kept) or 'nothing'}")
        kinds = {"nearly": made.approximated, "lost": made.lost, "in the file": made.written}
        for word, remarks in kinds.items():
            lines += [f"  {word}: {r.part}, {r.text}" for r in remarks if r.axis == axis]
    return "\n".join(lines)


def export_agreement_text(found: ExportAgreement, model: str, path: str) -> str:
    """Whether exported files are those of a model, and where they are not."""
    told = "as the model gives it" if found.agrees else "not as the model gives it now"
    lines = [f"{path}: {', '.join(found.formats)} of {model}, {told}"]
    for one in found.outdated:
        if one.line is None:
            lines.append(f"  {one.file}: is another file")
        else:
            lines.append(f"  {one.file}, line {one.line}: has {one.has!r}, the model {one.gives!r}")
    return "\n".join(lines)


# --- the catalogue ---------------------------------------------------------------------------


def effects_text(effects: list[Effect]) -> str:
    """One line an effect."""
    width = max(len(e.name) for e in effects)
    return "\n".join(f"{e.name:{width}s}  {e.kind.name.lower():9s}  {e.summary}" for e in effects)


def itself_in_words(effect: Effect) -> str:
    """Where a law is itself, and what it is where the motion does not pass its knees."""
    told = []
    for knee in effect.knees:
        sides = (("less", knee.below), ("more", knee.above))
        others = (f"with {side} it is {law.value}" for side, law in sides if law)
        told.append(f"where the motion passes its {knee.name}: {', '.join(others)}")
    return "; ".join(told) or "on any motion"


def effect_text(effect: Effect) -> str:
    """One effect in full."""
    rows = [
        f"  {p.name:14s} {p.start:>10.4g} {p.unit:10s} [{p.lower:g}, {p.upper:g}]  {p.meaning}"
        for p in effect.parameters
    ]
    lines = [
        f"{effect.name} ({effect.kind.name.lower()}): {effect.summary}",
        f"equation     {effect.equation}",
        f"source       {effect.source}",
        f"fingerprint  {effect.fingerprint}",
        f"excited by   {effect.excited_by}",
        f"is itself    {itself_in_words(effect)}",
        "parameters   start value, unit, bounds, meaning",
        *rows,
        f"on a rotary axis a unit of m is one of {ROTARY.position}, N of {ROTARY.force}, kg of "
        f"{ROTARY.mass}",
    ]
    return "\n".join(lines)


def draw(effect: Effect, motion: Motion, force: NDArray[np.float64], path: Path) -> None:
    """Write the picture of the effect's force (n,) N along a motion, over time, place and speed.

    Raises InputError for another ending than .png, .svg or .pdf.
    """
    import matplotlib

    require_picture(path)
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
    plt.close(figure)
    save_picture(figure, path)


# --- the laws of effects, and checks of logs -------------------------------------------------


def laws_text(reports: Sequence[LawReport]) -> str:
    """One line a law."""
    return "\n".join(map(str, reports))


def check_text(reports: Mapping[str, CheckReport]) -> str:
    """One line a finding, or that there is none."""
    return "\n".join(f"{name}: {line}" for name, r in reports.items() for line in r.lines())


def minor(findings: Sequence[str]) -> list[str]:
    """Warnings that leave an answer its meaning: no errors, nor what an import map assumes."""
    return [line for line in findings if ": warning: " in line and ASSUMES not in line]


def not_determined_in_words(unknown: Mapping[str, Sequence[str]]) -> list[str]:
    """What the logs do not tell, of axes by the parameter; ``unknown``: labels of each axis."""
    having: dict[str, list[str]] = {}
    for axis, labels in unknown.items():
        for label in labels:
            having.setdefault(label, []).append(axis)
    return [
        f"{'axis' if len(axes) == 1 else 'axes'} {', '.join(axes)}: {label} is not determined, as "
        "no break away from rest takes more than Coulomb friction; it is set to that"
        for label, axes in having.items()
    ]


def briefly(findings: Sequence[str]) -> list[str]:
    """Findings on logs, the minor ones on each log in one line, as `twin check` tells them.

    What the import map of several logs or axes assumes is said of the first of them.
    """
    folded = minor(findings)
    counts = Counter(line.partition(": warning: ")[0] for line in folded)
    told = [line for line in findings if line not in folded]
    assumed = [line for line in told if ASSUMES in line]
    first = [line for line in told if line not in assumed[1:]]
    return first + [
        f"{log}: {n} warning{'s' if n > 1 else ''}; `{in_shell('check', log)}` tells what to do"
        for log, n in counts.items()
    ]


def info_text(found: Mapping[str, LogInfo]) -> str:
    """Some lines a log: length and rate, what its writer said, each axis, and whether it is fit."""
    return "\n".join(line for name, info in found.items() for line in _lines(name, info))


def _lines(name: str, info: LogInfo) -> list[str]:
    lines = [
        f"{name}: {info.duration:.4g} s, {info.samples} samples at {info.sample_rate:g} Hz, "
        f"{'axis' if len(info.axes) == 1 else 'axes'} {', '.join(info.axes)}"
    ]
    if said := ", ".join(f"{key} {_in_a_line(value)}" for key, value in info.metadata.items()):
        lines.append(f"  written by: {said}")
    for axis, own in info.axes.items():
        lines.append(f"  axis {axis} ({_about(own)})")
        width = max(len(c.name) for c in own.channels)
        lines += [
            f"    {c.name:{width}s}  {c.least:.6g} to {c.most:.6g} {c.unit}" for c in own.channels
        ]
    return [*lines, f"  check: {_checked(name, info)}"]


def _in_a_line(value: str) -> str:
    """What a writer said, or of a whole file its length; --json has all of it."""
    lines = value.splitlines()
    return value if len(lines) < 2 else f"({len(lines)} lines)"


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
    return f"{worst}: {', '.join(kinds)}; `{in_shell('check', name)}` tells where, and what to do"
