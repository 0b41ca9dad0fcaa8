"""Pages that are made of the program itself, into docs/_generated/ and docs/gallery/effects/."""

from __future__ import annotations

import json
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from identify.dataset.motion import Motion
from identify.experiment_design.planting import signature
from identify.fleet.columns import VIEWS
from identify.output.machine import draw, itself_in_words
from twin.checks.report import Fault
from twin.effect import Effect, Kind
from twin.effects import Catalogue, load_catalogue
from twin.files import write_atomically

HERE = Path(__file__).resolve().parent
GENERATED = HERE / "_generated"
GALLERY = HERE / "gallery" / "effects"
SCHEMAS = HERE.parent / "twin" / "schemas"
ALIKE = 0.5  # least correlation of forces that are told as alike
MOST_ALIKE = 4

ACTS_ON = {
    Kind.FORCE: "Forces",
    Kind.FRICTION: "Frictions",
    Kind.MODIFIER: "What changes friction",
    Kind.ACTUATION: "Between command and force",
    Kind.SENSING: "Encoder",
    Kind.STRUCTURE: "Attached masses",
}
NO_LAW = "Curves without a law"


def everything() -> None:
    for folder in (GENERATED, GALLERY):
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir(parents=True)
    catalogue = load_catalogue()
    forces = {name: signature(effect, catalogue) for name, effect in catalogue.items()}
    alike = alike_of({name: force for name, (_, force) in forces.items()}, *forces.values())
    for name, effect in catalogue.items():
        draw(effect, *forces[name], GALLERY / f"{name}.png")
        _write(GALLERY / f"{name}.md", effect_page(effect, alike[name]))
    _write(GENERATED / "gallery.md", gallery(catalogue))
    _write(GENERATED / "commands.md", commands())
    _write(GENERATED / "fleet.md", views())
    _write(GENERATED / "faults.md", "".join(f"- {fault.value}\n" for fault in Fault))
    for name in ("model", "map", "answers"):
        schema = json.loads((SCHEMAS / f"{name}.schema.json").read_text(encoding="utf-8"))
        _write(GENERATED / f"{name}.md", schema_tables(schema))


def _write(path: Path, text: str) -> None:
    write_atomically(path, text.encode("utf-8"))


# Effects.


def alike_of(
    forces: Mapping[str, np.ndarray], drawn: tuple[Motion, np.ndarray], *_: Any
) -> dict[str, list[tuple[str, float]]]:
    """By effect, those whose drawn force is most like its own beside what every model has.

    That is what a mass, viscous and Coulomb friction and a constant force take up is left out.
    """
    motion = drawn[0]
    position, velocity, _command = motion.signals
    common = np.stack(
        [np.gradient(velocity), velocity, np.sign(velocity), np.ones_like(position)], axis=1
    )
    basis = np.linalg.qr(common)[0]
    left = {n: f - basis @ (basis.T @ f) for n, f in forces.items()}
    unit = {
        n: r / np.linalg.norm(r)
        for n, r in left.items()
        if np.linalg.norm(r) > 1e-3 * np.linalg.norm(forces[n])
    }
    found: dict[str, list[tuple[str, float]]] = {}
    for name in forces:
        pairs = [(o, abs(float(unit[name] @ unit[o]))) for o in unit if name in unit and o != name]
        pairs = sorted((p for p in pairs if p[1] >= ALIKE), key=lambda p: -p[1])
        found[name] = pairs[:MOST_ALIKE]
    return found


def effect_page(effect: Effect, alike: Sequence[tuple[str, float]]) -> str:
    rows = [
        (f"`{p.name}`", p.meaning, _unit(p.unit), f"{p.start:g}", _bounds(p.lower, p.upper),
         "strength" if p.strength else "held" if p.fixed else "")
        for p in effect.parameters
    ]  # fmt: skip
    if len(rows) > 20:
        rows = [
            *rows[:10],
            ("…", f"{len(rows) - 20} more of the same kind", *("",) * 4),
            *rows[-10:],
        ]
    lines = [
        f"# {effect.name}",
        f"{_sentence(effect.summary)}",
        "```text", effect.equation, "```",
        f"![Force that {effect.name} adds, over time, position and speed]({effect.name}.png)",
        "The force that it adds to passes over the travel in both directions, ever slower.",
        f"**In the residual.** {_sentence(effect.fingerprint)}",
        f"**Excited by.** {_sentence(effect.excited_by)}",
        f"**Is itself.** {_sentence(itself_in_words(effect))}",
        f"**Taken for.** {_alike_in_words(effect, alike)}",
        f"**Source.** {_sentence(effect.source)}",
        "## Parameters",
        _table(("name", "meaning", "unit", "start", "bounds", ""), rows),
        "A strength is zero where the effect is absent; what is held is not fitted. On a rotary "
        "axis m is rad, N is N m and kg is kg m².",
    ]  # fmt: skip
    return _joined(lines)


def _alike_in_words(effect: Effect, alike: Sequence[tuple[str, float]]) -> str:
    late = "A dead time of the force and of the reading give the same log. " * effect.dead_time
    if not alike:
        return f"{late}On the motion drawn no other effect of the catalogue makes a force like it."
    names = ", ".join(f"[{name}]({name}.md) ({100 * r:.0f} %)" for name, r in alike)
    return (
        f"{late}On the motion drawn, most like its force are those of {names}: correlation at the "
        "values drawn, without what mass, viscous and Coulomb friction and a constant force take "
        "up. Another motion may part them."
    )


def gallery(catalogue: Catalogue) -> str:
    lines: list[str] = []
    for kind, heading in [*ACTS_ON.items(), (None, NO_LAW)]:
        rows = [
            (f"[{e.name}](effects/{e.name}.md)", e.summary, e.excited_by)
            for e in catalogue.values()
            if (e.is_nonparametric and kind is None) or (e.kind is kind and not e.is_nonparametric)
        ]
        lines += [f"## {heading}", _table(("effect", "what it is", "excited by"), rows)]
    pages = "\n".join(f"effects/{name}" for name in catalogue)
    lines += [f"```{{toctree}}\n:hidden:\n\n{pages}\n```"]
    return _joined(lines)


# Commands.


def twin(*arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, "-m", "identify.start", *arguments], capture_output=True, text=True,
        check=True, env=_plain(),
    )  # fmt: skip
    return done.stdout.replace("python -m identify.start", "twin")


def _plain() -> dict[str, str]:
    import os

    return {**os.environ, "COLUMNS": "100", "NO_COLOR": "1", "TERM": "dumb"}


def commands() -> str:
    overview = twin("--help")
    lines = ["```text", overview.rstrip(), "```"]
    for name in _listed(overview):
        lines += _command(name)
    return _joined(lines)


def _command(*names: str) -> list[str]:
    """The help of a command, and of those that it has."""
    shown = twin(*names, "--help").rstrip()
    lines = [f"## twin {' '.join(names)}", "```text", shown, "```"]
    return lines + [line for name in _listed(shown) for line in _command(*names, name)]


def _listed(shown: str) -> list[str]:
    """The commands that a help lists."""
    listed = shown.partition("Commands:")[2].splitlines()
    return [line.split()[0] for line in listed if line[:2] == "  " and line[2:3].strip()]


# Views of a fleet.


def views() -> str:
    lines = []
    for view, columns in VIEWS.items():
        rows = [(f"`{c.name}`", c.kind, _in_column(c.unit), c.meaning) for c in columns]
        lines += [f"**{view}**", _table(("column", "type", "unit", "meaning"), rows)]
    return _joined(lines)


def _in_column(unit: str) -> str:
    """Where the unit of a column stands in another, its name."""
    for other in ("force_unit", "unit"):
        unit = unit.replace(other, f"`{other}`") if unit.startswith(other) else unit
    return unit


# Schemas.


def schema_tables(schema: Mapping[str, Any]) -> str:
    """A table of the entries of a JSON schema, and one of each table in it."""
    lines = [_entries(schema)]
    for name, part in schema.get("$defs", {}).items():
        if "properties" in part:
            about = part.get("description", "")
            lines += [f"### {name}", about, _entries(part)]
    return _joined([line for line in lines if line])


def _entries(part: Mapping[str, Any]) -> str:
    required = part.get("required", ())
    rows = [
        (f"`{name}`", _type(entry), "required" if name in required else _default(entry),
         entry.get("description", ""))
        for name, entry in part.get("properties", {}).items()
    ]  # fmt: skip
    return _table(("entry", "type", "default", "meaning"), rows) if rows else ""


def _default(entry: Mapping[str, Any]) -> str:
    value = entry.get("default")
    return "" if value is None else f"`{json.dumps(value)}`"


def _type(entry: Mapping[str, Any]) -> str:
    if "$ref" in entry:
        return entry["$ref"].rsplit("/", 1)[-1]
    if "enum" in entry:
        return " or ".join(f"`{json.dumps(v)}`" for v in entry["enum"])
    if "anyOf" in entry:
        kinds = [_type(e) for e in entry["anyOf"] if e.get("type") != "null"]
        return " or ".join(dict.fromkeys(kinds))
    if entry.get("type") == "array" and isinstance(entry.get("items"), dict):
        return f"list of {_type(entry['items'])}"
    within = entry.get("additionalProperties") or next(
        iter(entry.get("patternProperties", {}).values()), None
    )
    if isinstance(within, dict):
        return f"table of {_type(within)}"
    return str(entry.get("type", ""))


# Markdown.


def _table(head: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    return "\n".join(
        [_row(head), _row(["---"] * len(head)), *(_row([_cell(c) for c in row]) for row in rows)]
    )


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def _cell(text: str) -> str:
    return text.replace("|", "\\|").replace("\n", " ")


def _unit(unit: str) -> str:
    return "" if unit == "1" else unit.replace("^2", "²").replace("^3", "³")


def _bounds(lower: float, upper: float) -> str:
    low, high = ("" if abs(b) >= 1e15 else f"{b:g}" for b in (lower, upper))
    if low in ("", "1e-15") and not high:
        return "above 0" if low else ""
    return f"{low or '−∞'} to {high or '∞'}"


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}{'' if text.endswith('.') else '.'}"


def _joined(lines: Sequence[str]) -> str:
    """Paragraphs apart, code within its fence."""
    text, fenced = "", False
    for line in lines:
        fence = line.startswith("```") and "\n" not in line
        text += f"{line}\n" if (fenced or fence) and not (fenced and fence) else f"{line}\n\n"
        fenced = fenced != fence
    return text


if __name__ == "__main__":
    everything()
