"""Effects: what each explains, candidates, what was added, laws that are named, parameters."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

from identify.dataset.dataset import Role
from identify.estimation.found_shape import FoundShape
from identify.output.blocks import (
    Block,
    Chart,
    Drawn,
    Facts,
    Heading,
    Ink,
    LineStyle,
    Listing,
    Row,
    TableBlock,
    Tone,
)
from identify.output.candidates import CandidateRow, columns_of, row_of, values_in_words
from identify.output.numbers import (
    NOTHING,
    DisplayUnit,
    capitalised,
    percent,
    quantity,
    spaced,
    title_case,
)
from identify.output.shown.fits import fit_table
from identify.output.shown.subject import AxisView, Subject
from identify.output.words.diagnosis import tested_on
from identify.output.words.findings import shape_in_words
from identify.output.words.fit import (
    nonparametric_in_words,
)
from identify.output.words.next_step import errors_of_step
from identify.results.grown import Addition
from identify.selection.candidates import Candidate
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.findings import Finding
from identify.selection.nonparametric import nonparametric_labels
from twin.effect import Effect
from twin.model.machine import AxisModel, HistoryStep
from twin.model.parameters import all_parameters, read
from twin.model.units import units_of

# --- what each effect explains ---------------------------------------------------------------


def found(view: AxisView) -> list[Block]:
    """A row for each finding, and one for all together."""
    if view.found is None or not view.found.findings:
        return []
    findings, tested, unit = view.found.findings, view.found.tested, view.units.force
    scale = DisplayUnit.of(unit, [tested.before, *(f.tested.before for f in findings)])
    columns: dict[str, Callable[[Finding], str]] = {
        "Effect": lambda f: title_case(f.effect),
        "Error without it": lambda f: scale.text(f.tested.before),
        "Error with all": lambda f: scale.text(f.tested.after),
        "Share of squared error": lambda f: percent(f.explains),
        "Of what the others leave": lambda f: percent(max(f.score.part, 0.0)),
        "Shifted in time, at most": lambda f: percent(max(f.score.control, 0.0)),
        "Such answers right": lambda f: NOTHING if f.confidence is None else percent(f.confidence),
    }
    caption = (
        f"RMS force error on the {tested.on.value} logs. Each effect is taken out alone and the "
        "others refitted, which can stand in for it: the shares need not add up. Of what the "
        "others leave above the noise floor, it removes that part on the logs that chose it; the "
        "same force shifted in time, which cannot be real, at most the next. Right: of answers as "
        "well supported, on machines whose missing effect is known."
    )
    table = TableBlock.of(
        findings, columns, view.words(caption), bar=lambda f: min(max(f.explains, 0.0), 1.0)
    )
    if len(findings) == 1:
        return [table]
    every = (scale.text(tested.before), scale.text(tested.after))
    together = Row(("All together", *every, percent(view.found.explained), *[NOTHING] * 3))
    return [replace(table, rows=[*table.rows, together])]


# --- the shape of a law, and curves without physics ------------------------------------------


def law_shapes(view: AxisView) -> list[Block]:
    """A picture for each law that is found to have another shape."""
    blocks: list[Block] = []
    for f in view.found.findings if view.found else ():
        if f.shape is not None:
            caption = (
                f"{shape_in_words(f.effect, f.shape)} Where the band holds the dashed line, these "
                "logs do not tell the two apart."
            )
            blocks.append(Heading(f"{spaced(f.effect)} on {view.name}".capitalize()))
            blocks += [*shape_charts(f.shape), Listing([caption])]
    return blocks


def shape_charts(shape: FoundShape) -> list[Chart]:
    """The curve assumed beside the curve found, a chart for each direction."""
    curves = shape.curves.values()
    scale = DisplayUnit.of(shape.unit, [(c.found, c.assumed) for c in curves])
    along = DisplayUnit.of(shape.coordinate_unit, shape.coordinate)
    words = units_of(shape.unit).words
    within = " within one period" if shape.period is not None else ""
    label = along.label(words(f"{shape.over.value}{within}").capitalize())
    return [
        Chart(
            (label, along(shape.coordinate)),
            scale.label(words(f"Force of the law, {direction}")),
            [
                Drawn("90 % band", scale(curve.found - curve.band_90), LineStyle.BAND),
                Drawn("90 % band", scale(curve.found + curve.band_90), LineStyle.BAND),
                Drawn("found in the logs", scale(curve.found)),
                Drawn("assumed by the law", scale(curve.assumed), LineStyle.DASH, Ink.INK),
            ],
        )
        for direction, curve in shape.curves.items()
    ]


# --- candidates ------------------------------------------------------------------------------


def ranking(view: AxisView) -> list[Block]:
    """A table of all absent effects that were refitted, best first, and the others' names."""
    if view.found is None:
        return []
    refitted = [c for c in view.found.ranking if c.score]
    blocks: list[Block] = [_ranked(view.found, refitted)] if refitted else []
    if others := ", ".join(spaced(c.effect.name) for c in view.found.ranking if not c.score):
        said = f"Not refitted, as by one linear step they gain too little: {others}."
        blocks.append(Listing([said]))
    return blocks


def _ranked(found: AxisDiagnosis, refitted: Sequence[Candidate]) -> TableBlock:
    """Evidence, errors, and why a candidate is not proved."""
    rows = [row_of(c, found) for c in refitted]
    shown = 3  # with their values
    rows = [*rows[:shown], *(replace(row, parameters={}) for row in rows[shown:])]
    best = found.best.effect.name if found.best else ""
    caption = (
        f"Each effect alone beside the given ones, with its values there. Evidence: difference of "
        f"BIC. Error: RMS force, {tested_on(found)}. Part removed: of the squared error above the "
        "noise floor, on the training logs or on data left out of the fit, whichever is less."
    )

    def tone(row: CandidateRow) -> Tone:
        return Tone.STRONG if row.effect == best else Tone.PLAIN if row.supported else Tone.MUTED

    return TableBlock.of(
        rows, columns_of(rows), found.dataset.units.words(caption), tone,
        lambda row: min(max(row.part, 0.0), 1.0),
    )  # fmt: skip


# --- the error, effect by effect -------------------------------------------------------------


def growth(subject: Subject) -> list[Block]:
    """A picture and a table for each axis with added effects; their position errors if known."""
    blocks: list[Block] = []
    floors = {view.name: view.floors for view in subject.views}
    axes = dict.fromkeys(step.axis for step in subject.history)
    for axis in axes:
        steps = [step for step in subject.history if step.axis == axis]
        several = len(axes) > 1 or len(subject.views) > 1
        blocks += [Heading(f"Axis {axis}")] if several else []
        blocks.append(growth_table(steps, floors.get(axis, {})))
    return [*blocks, _positions(subject.additions)] if subject.additions else blocks


def growth_table(steps: Sequence[HistoryStep], floors: Mapping[Role, float]) -> TableBlock:
    """The errors before and after each step, and the noise floors of the logs of this page."""
    errors = [errors_of_step(step) for step in steps]
    tested = [Role.TEST] if any(Role.TEST in own for own in errors) else []
    shown = [Role.TRAINING, Role.SELECTION, *tested]
    scale = DisplayUnit.of(steps[0].unit, [own[Role.TRAINING] for own in errors])
    rows = []
    for s, own in zip(steps, errors, strict=True):
        cells = (scale.text(error) for role in shown for error in own.get(role, (None, None)))
        name = title_case(s.effect) if s.action == "add" else f"{s.action} {spaced(s.effect)}"
        rows.append(Row((name, *cells)))
    if floors:
        cells = (text for role in shown for text in ("", scale.text(floors.get(role))))
        rows.append(Row(("Noise floor of these logs", *cells), Tone.MUTED))
    when = (f"{role.value.capitalize()}, {w}" for role in shown for w in ("before", "after"))
    caption = (
        "RMS force error on the logs of each role when the effect was added and everything "
        "refitted. A real effect lowers the error on the selection logs as much as that on the "
        "training logs."
    )
    return TableBlock(["Effect added", *when], rows, units_of(steps[0].unit).words(caption))


def _positions(additions: Sequence[Addition]) -> TableBlock:
    rows = []
    for a in additions:
        alike = (b for b in additions if b.units.position == a.units.position)
        scale = DisplayUnit.of(a.units.position, [e for b in alike for e in b.position_error or ()])
        errors = (*(a.position_error or (None, None)), a.position_error_in_mujoco)
        name = f"{title_case(a.step.effect)} on {a.step.axis}"
        rows.append(Row((name, *map(scale.text, errors), "kept" if a.kept else "not supported")))
    titles = (
        "Effect added", "Free run, before", "Free run, after", "Replayed by MuJoCo", "Outcome",
    )  # fmt: skip
    what = " and ".join(dict.fromkeys(a.units.words("position") for a in additions))
    return TableBlock(titles, rows, f"RMS {what} error of the model driven by the logged command.")


# --- the laws that are named -----------------------------------------------------------------


def equations(view: AxisView) -> list[Block]:
    """The named effects, those that the data cannot separate from them, and fitted curves."""
    blocks: list[Block] = []
    for effect, model in _named(view):
        pairs = (
            ("What it is", effect.summary),
            ("Fingerprint", effect.fingerprint),
            ("Excited by", effect.excited_by),
            (
                "Fitted",
                values_in_words(model[effect.name].values, model.parameter_units(effect.name)),
            ),
            ("Source", effect.source),
        )
        heading = Heading(f"{title_case(effect.name)} on {view.name}")
        blocks += [heading, Facts(effect.equation, pairs)]
    curves = [f for f in view.model.effects if f.effect.is_nonparametric]
    said = [capitalised(nonparametric_in_words(f)) for f in curves]
    return [*blocks, Listing(said)] if said else blocks


def _named(view: AxisView) -> Iterator[tuple[Effect, AxisModel]]:
    """Effects with the model that has values for them."""
    if (found := view.found) is None:
        return
    tried = {c.effect.name: c.fit.axis for c in found.ranking}
    for name, *tied in found.answers:
        models = [(name, found.final.axis), *((n, tried[n]) for n in tied if n in tried)]
        yield from ((model[n].effect, model) for n, model in models if n in model.names)


# --- parameters ------------------------------------------------------------------------------


def parameters(view: AxisView) -> list[Block]:
    """A table: with intervals where the model was fitted here."""
    if not (view.found and view.summary):
        return given_table(view.model)
    found, summary, known = view.found, view.summary, {"Value": view.summary.before}
    if view.label:
        known = {f"Without {view.label}": summary.before, f"With {view.label}": summary.after}
    free, before = ({c.label for c in fit.scaling.where} for fit in (found.final, found.base))
    return fit_table(found.final.axis, known, summary.floor, free - before)


def given_table(axis: AxisModel) -> list[Block]:
    """Values of a model that was not fitted here."""
    every, hidden = all_parameters(axis), nonparametric_labels(axis)
    rows = [
        Row((c.label, quantity(float(value), axis.units(c.parameter.unit)), c.parameter.meaning))
        for c, value in zip(every, read(axis, every), strict=True)
        if c.label not in hidden
    ]
    caption = "Values of the given model; twin fit adds intervals."
    return [TableBlock(("Parameter", "Value", "Meaning"), rows, caption)]
