"""Results in a notebook: tables in place of text, and the residual over any coordinate."""

from __future__ import annotations

from typing import TYPE_CHECKING

from identify.output import INKS
from identify.output.numbers import Scale, capitalised
from identify.output.report import SECTIONS, sections
from identify.output.report.effects import fit_table
from identify.output.report.explorer import coordinate_of_answer, named_signals
from identify.output.report.page import Block, Chart, Heading, Listing, fragment
from identify.output.report.subject import Subject
from identify.output.words.fit import fit_in_words
from identify.results.results import Comparison, Diagnosis, FitResult
from identify.results.signals import means
from twin.errors import InputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHOWN = ("answer", "found", "regions", "parameters", "logs")  # sections of a report


def tables(result: Diagnosis | Comparison) -> str:
    """The answer and the tables of a report, without its plots."""
    parts = [part for part in SECTIONS if part.anchor in SHOWN]
    blocks: list[Block] = []
    for section in sections(Subject.of(result), parts):
        blocks += [Heading(section.title)] if section.anchor != "answer" else []
        blocks += [block for block in section.blocks if not isinstance(block, Chart)]
    return fragment(blocks)


def parameters(result: FitResult) -> str:
    """What is said of each axis, with its parameters in a table."""
    blocks: list[Block] = []
    for axis, fit in result.fits.items():
        said = [capitalised(line) for line in fit_in_words(result, axis)]
        table = fit_table(fit.axis, {"Value": result.estimates[axis]}, fit.floor)
        blocks += [Listing(said), *table]
    return fragment(blocks)


def residual(result: Diagnosis | Comparison, coordinate: str | None, axis: str | None) -> Figure:
    """The residual without and with what was found, as dots and as means over a coordinate."""
    import matplotlib.pyplot as plt

    views = {view.name: view for view in Subject.of(result).views}
    if axis is not None and axis not in views:
        raise InputError(f"no axis '{axis}' in the result; it has {', '.join(views)}")
    view = views[axis] if axis else next(iter(views.values()))
    signals = view.signals
    name = coordinate or coordinate_of_answer(view, list(signals.coordinates))
    values = signals.over(name)
    shown = named_signals(view)
    _, _, left = shown["before"]
    label, _, along = shown.get(name, ("Time", values, Scale.of("s", values)))
    figure, place = plt.subplots(figsize=(8.0, 4.0), layout="constrained")
    plt.close(figure)  # a notebook shows what is returned, once
    floor = float(left(view.axis.floor))
    place.axhspan(-floor, floor, color="#dfe4e9", label="noise floor")
    for which, ink in zip(("before", "after"), INKS, strict=True):
        if which in shown:
            title, error, _ = shown[which]
            place.plot(along(values), left(error), ".", markersize=2, alpha=0.25, color=ink)
            place.plot(*means(along(values), left(error)), color=ink, label=f"mean {title}")
    place.set(xlabel=along.label(label), ylabel=left.label(view.words("Unexplained force")))
    place.legend()
    return figure
