"""How results print, keep and draw themselves: the hooks of ``identify.printed``.

Templates and pictures are loaded when they are asked for.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from identify.output.blocks import blocks_of
from identify.output.shown import comparisons, diagnoses, fits, frequency, grown  # noqa: F401
from identify.output.text import to_text
from identify.printed import Printed, figure_of, html_of, report_of, save_of, text_of
from identify.results.results import Comparison, Diagnosis

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure


@text_of.register(Printed)
def _text(result: Printed) -> str:
    return to_text(blocks_of(result))


@html_of.register(Printed)
def _html(result: Printed) -> str:
    from identify.output.report.page import fragment

    return fragment(blocks_of(result))


@html_of.register(Comparison | Diagnosis)
def _tables(result: Comparison | Diagnosis) -> str:
    from identify.output.shown.report import tables

    return tables(result)


@report_of.register(Comparison | Diagnosis)
def _page(result: Comparison | Diagnosis, path: Path) -> None:
    from identify.output.shown.report import write_report
    from identify.output.shown.subject import Subject

    write_report(path, Subject.of(result))


@save_of.register(Printed)
def _json(result: Printed, path: Path) -> None:
    from identify.output.as_json import save  # whose classes take a tenth of a second

    save(result, path)


@figure_of.register(Comparison | Diagnosis)
def _picture(result: Comparison | Diagnosis, coordinate: str | None, axis: str | None) -> Figure:
    from identify.output.shown.explorer import residual

    return residual(result, coordinate, axis)
