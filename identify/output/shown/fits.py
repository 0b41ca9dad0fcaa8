"""What is shown of fits: the errors, how the search ended, and the parameters."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

from identify.estimation.intervals import Estimate, ModelWrong
from identify.estimation.simulated_motion import MotionFit
from identify.output.blocks import Block, Row, Sentence, TableBlock, Tone, blocks_of, sentences
from identify.output.numbers import NOTHING, DisplayUnit, number
from identify.output.words.fit import (
    common_reason,
    estimate_in_words,
    fit_in_words,
    motion_fit_in_words,
    no_interval_in_words,
    nonparametric_in_words,
)
from identify.output.words.recording import read_otherwise_in_words
from identify.results.results import FitResult, SimulationFit, refitted
from identify.selection.nonparametric import nonparametric_labels
from twin.model.machine import AxisModel
from twin.model.parameters import all_parameters


@blocks_of.register
def fit_blocks(result: FitResult) -> list[Block]:
    """The fit of each axis, with a table of its parameters."""
    blocks = sentences(read_otherwise_in_words(result.recording))
    for axis, fit in result.fits.items():
        first, *others = fit_in_words(result, axis)
        table = fit_table(fit.axis, {"Value": result.estimates[axis]}, fit.floor)
        curves = (f for f in fit.axis.effects if f.effect.is_nonparametric)
        said = (*others, *table, *map(nonparametric_in_words, curves))
        blocks.append(Sentence.over(first, said))
    return blocks + sentences(
        f"axis {axis}: not fitted, as no log says anything of it" for axis in result.not_fitted
    )


def fit_table(
    axis: AxisModel,
    sides: Mapping[str, Sequence[Estimate]],
    floor: float,
    new: Collection[str] = (),
) -> list[Block]:
    """Values of fits by their headings, with intervals; nothing where curves are all there is.

    new: labels that stand out. floor: the one noise floor that is told, N.
    """
    hidden = nonparametric_labels(axis)
    meanings = {c.label: c.parameter.meaning for c in all_parameters(axis)}
    labels = dict.fromkeys(e.label for known in reversed([*sides.values()]) for e in known)
    titles, remarks, cells = ["Parameter"], [], {n: [n] for n in labels if n not in hidden}
    for heading, known in sides.items():
        # Where all values have the same reason, it is in the caption instead of a column.
        common, by_label = common_reason(known), {e.label: e for e in known}
        titles += [heading] if common else [heading, "90 % interval"]
        if isinstance(common, ModelWrong):
            common = replace(common, floor=floor)
        if common:
            remarks.append(f"{heading}: {no_interval_in_words(common)}.")
        for name, row in cells.items():
            both = estimate_in_words(by_label[name]) if name in by_label else (NOTHING, "")
            row += both[: 1 if common else 2]
    rows = [
        Row((*row, meanings.get(name, "")), Tone.STRONG if name in new else Tone.PLAIN)
        for name, row in cells.items()
    ]
    caption, brief = " ".join(remarks), len(titles)  # what they mean, a terminal has no room for
    return [TableBlock([*titles, "Meaning"], rows, caption, brief)] if rows else []


@blocks_of.register
def simulation_fit_blocks(result: SimulationFit) -> list[Block]:
    """The fit of each axis, with a table of the values and those of the force fit."""
    blocks: list[Block] = []
    for axis, fit in result.axes.items():
        first, *others = motion_fit_in_words(axis, fit, result.holdout_error[axis])
        blocks.append(Sentence.over(first, [*others, _refitted(fit)]))
    return blocks


def _refitted(fit: MotionFit) -> TableBlock:
    rows = []
    for c, before, now in refitted(fit):
        scale = DisplayUnit.of(fit.axis.units(c.parameter.unit), [now])
        texts = (f"{number(v / scale.size, 6)} {scale.unit}".rstrip() for v in (now, before))
        rows.append(Row((c.label, *texts)))
    return TableBlock(("Parameter", "Value", "By the force fit"), rows)
