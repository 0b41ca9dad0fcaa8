"""All chapters of the study, by name, in the order of the thesis, and how they are told."""

from __future__ import annotations

import difflib
import time
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from identify.output.answers import plain
from identify.output.blocks import AnswerBlock, Tone
from identify.output.numbers import capitalised
from identify.output.report.page import Section, page
from studies.drawing import drawing_style
from studies.telling import tables
from studies.thesis import cable, dynamic, future, models, residuals, simulation, track, twin
from studies.thesis.shared import Chapter, Found
from twin.errors import InputError
from twin.files import write_atomically
from twin.parallel import Progress, parallel, silent
from twin.threads import one_for_matrices

CHAPTERS: Mapping[str, Chapter] = {
    "models": models, "simulation": simulation, "cable": cable, "track": track,
    "dynamic": dynamic, "residuals": residuals, "future": future, "twin": twin,
}  # fmt: skip
TITLE = "Friction identification on the gantry stage, reproduced on its twin"


@dataclass(frozen=True, eq=False)
class Reproduction:
    """Results of the chapters that were run, and the seconds that each took."""

    chapters: Mapping[str, Found]
    seconds: Mapping[str, float]
    small: bool

    def numbers(self) -> dict[str, Any]:
        """The documented object: every chapter that was run, and the seconds that it took."""
        return {
            "chapters": {name: plain(found.numbers) for name, found in self.chapters.items()},
            "small": self.small,
            "seconds": sum(self.seconds.values()),
            "seconds_by_chapter": dict(self.seconds),
        }

    def __str__(self) -> str:
        """The main numbers of each chapter."""
        lines = []
        for name, found in self.chapters.items():
            lines.append(f"{name} ({self.seconds[name]:.0f} s)")
            lines += [f"  {line}" for line in found.words]
        return "\n".join(lines)

    def write(self, path: Path) -> None:
        """Write the chapters as one HTML file without outside references."""
        facts = [
            ("Source", "L. Jia, Friction Identification on the Gantry Stage, TU Delft 2023"),
            ("Time", f"{sum(self.seconds.values()):.0f} s"),
            ("Size", "small: fewer speeds, trials and passes" if self.small else "whole"),
        ]
        with drawing_style():
            shown = [_section(name, found) for name, found in self.chapters.items()]
            text = page(TITLE, facts, shown)
        write_atomically(path, text.encode("utf-8"))


def _section(name: str, found: Found) -> Section:
    title, words = CHAPTERS[name].TITLE, [capitalised(said) for said in found.words]
    answer = AnswerBlock(title, words[0], [], words[1:], Tone.STRONG)
    return Section(name, title, [answer, *found.pictures, *tables(plain(found.numbers), name)])


@one_for_matrices()
def reproduce(
    chapters: Sequence[str] = (),
    *,
    small: bool = False,
    seed: int = 1,
    progress: Progress = silent,
) -> Reproduction:
    """Run chapters of the study, all where none is named.

    small: a quick version, of fewer speeds and trials. The same seed gives the same numbers, and
    each chapter the same whether it runs alone or not. Raises InputError for an unknown chapter.
    """
    for name in chapters:
        if name not in CHAPTERS:
            near = difflib.get_close_matches(name, CHAPTERS, n=1, cutoff=0.4)
            hint = f"did you mean '{near[0]}'? " if near else ""
            raise InputError(f"unknown chapter '{name}'; {hint}there are {', '.join(CHAPTERS)}")
    results, seconds = {}, {}
    asked = [name for name in CHAPTERS if not chapters or name in chapters]
    with parallel(), drawing_style():
        for i, name in enumerate(asked):
            progress(f"chapter {i + 1} of {len(asked)}, {name}", 0, 1)
            start = time.monotonic()
            rng = np.random.default_rng([seed, zlib.crc32(name.encode())])
            results[name] = CHAPTERS[name].run(small, rng)
            seconds[name] = time.monotonic() - start
    return Reproduction(results, seconds, small)
