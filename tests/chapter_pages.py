"""A chapter's section of the reproduced study, taken apart for the tests."""

from __future__ import annotations

from functools import cache

import built_chapters as made
import numpy as np

from identify.output.report.blocks import Answer, Picture, Table, Tone
from identify.output.report.drawing import drawing_style
from identify.output.report.thesis import SECTIONS


class Page:
    """The blocks of a chapter's section: tiles by name, tables by row and column, figures."""

    def __init__(self, result):
        with drawing_style():
            self.section = SECTIONS[type(result)](result)
        kinds = {kind: [b for b in self.section.blocks if isinstance(b, kind)]
                 for kind in (Answer, Table, Picture)}  # fmt: skip
        (self.answer,), self.tables, pictures = kinds.values()
        self.tiles = {t.name: t.value for t in self.answer.tiles}
        self.remarks = [t.remark for t in self.answer.tiles]
        self.figures = [p.figure for p in pictures]
        assert self.answer.tone is Tone.STRONG
        assert all(c.numeric for t in self.tables for c in t.columns[1:] if c.title != "Unit")

    def cells(self, index: int) -> list[tuple[str, ...]]:
        return [tuple(row.cells) for row in self.tables[index].rows]

    def heads(self, index: int) -> list[str]:
        return [c.title for c in self.tables[index].columns]


@cache
def pages() -> dict[str, Page]:
    """The pages of all chapters."""
    return {name: Page(result) for name, result in made.CHAPTERS.items()}


def drawn(axes, label: str) -> tuple[np.ndarray, np.ndarray, str]:
    (line,) = (found for found in axes.get_lines() if found.get_label() == label)
    return *np.asarray(line.get_data()), line.get_color()


def holds(axes, label: str, x, y, color: str | None = None) -> None:
    """The line of that label goes through these points, in that colour."""
    found_x, found_y, found_color = drawn(axes, label)
    np.testing.assert_allclose(found_x, x)
    np.testing.assert_allclose(found_y, y)
    assert color in (None, found_color)


def band(axes) -> np.ndarray:
    """Corners of the first filled area."""
    return axes.collections[0].get_paths()[0].vertices
