"""A proposed import map as a table of columns, and the proof of a map in a sentence."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from identify.output.answers.machine import MapAnswer
from identify.output.numbers import quantity

if TYPE_CHECKING:
    from identify.analysis.map_proof import MapProof
    from twin.importers.guess import ColumnRow, Proposal
    from twin.importers.proposal.text import Answers
    from twin.signals import Array

_BARS = "▁▂▃▄▅▆▇█"
_WIDTH = 20  # characters of a small plot
_LONGEST = 36  # characters of a name


def map_answer(found: Proposal, answers: Answers) -> MapAnswer:
    """What is proposed as JSON, with what the user knows."""
    return MapAnswer.of(
        map=found.map_text(answers), missing=found.lacks(answers), columns=found.rows
    )


def proposal_text(found: Proposal) -> str:
    """A line for each column: range, course, what it is taken for, how sure that is, and why."""
    head = ("column", "unit", "range", "course", "taken for", "how sure", "why")
    rows = [head, *map(_cells, found.rows)]
    widths = [max(len(row[k]) for row in rows) for k in range(len(head) - 1)]
    lines = [
        "  ".join([*(f"{cell:{w}s}" for cell, w in zip(row, widths, strict=False)), row[-1]])
        for row in rows
    ]
    assumed = ["?: assumed, as nothing tells it"] if any(r.assumed for r in found.rows) else []
    return "\n".join([*found.head[1:], "", *(line.rstrip() for line in lines), *assumed])


def _cells(row: ColumnRow) -> tuple[str, ...]:
    name = row.column if len(row.column) <= _LONGEST else f"...{row.column[3 - _LONGEST :]}"
    taken = "" if row.field is None else f"{row.axis}: {row.field}"
    span = f"{row.low:.4g} to {row.high:.4g}"
    sure = row.certainty or ""
    unit = f"{row.unit or ''}{'?' if row.assumed else ''}"
    return name, unit, span, plot(row.course), taken, sure, row.why


def plot(column: Array) -> str:
    """A column (n,) as a line of bars, each the mean of its part."""
    parts = np.array_split(column, min(_WIDTH, len(column)))
    means = np.array([float(part.mean()) for part in parts])
    low, span = means.min(), float(np.ptp(means))
    places = np.zeros(len(means)) if span == 0.0 else (means - low) / span * (len(_BARS) - 1)
    return "".join(_BARS[round(p)] for p in places)


def proof_text(axis: str, proof: MapProof) -> str:
    """What a map makes of an axis: mass, friction, and how much of the force they explain."""
    motion, values, units = proof.motion, proof.values, proof.units
    if not proof.has_force:
        said = "no force yet: give force_constant in the map"
    elif values is None:
        said = "hardly moves, so that neither mass nor friction is told"
    else:
        mass = "not told" if values.mass is None else quantity(values.mass, units.mass)
        friction = values.coulomb or values.viscous
        unit = units.force if values.coulomb else units("N s/m")
        rubs = f"friction {quantity(friction, unit)}" if friction else "no friction told"
        said = f"moved {units.mass_name} {mass}, {rubs}"
    share = f"force explained to {_percent(motion.forward)}"
    other = f"with the sign reversed it would be {_percent(motion.backward)}"
    if not motion.both_ways:
        other = "it moves one way only, which tells no sign"
    return f"axis {axis}, with this map: {said}, {share}; {other}"


def _percent(share: float) -> str:
    return f"{100.0 * max(share, 0.0):.0f} %"
