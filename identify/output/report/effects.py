"""Effects: candidates, what was added, the laws that are named, their curves and parameters."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, NullLocator
from numpy.typing import NDArray

from identify.dataset.given_logs import Role
from identify.estimation.intervals import Estimate
from identify.output.numbers import (
    NOTHING,
    Scale,
    capitalised,
    number,
    percent,
    quantity,
    spaced,
    title_case,
)
from identify.output.report.drawing import (
    BLUE,
    GREY,
    INK,
    ORANGE,
    binned_mean,
    draw_bars,
    new_figure,
    plain_tick,
)
from identify.output.report.page import (
    Block,
    Column,
    Facts,
    Heading,
    Listing,
    Picture,
    Row,
    Table,
    Tone,
)
from identify.output.report.subject import AxisView, Subject
from identify.output.words.addition import errors_of_step
from identify.output.words.diagnosis import tested_on, why_not
from identify.output.words.findings import advice, shape_in_words
from identify.output.words.fit import (
    common_reason,
    estimate_in_words,
    no_interval_in_words,
    nonparametric_in_words,
)
from identify.results.addition import Addition
from identify.results.told import Told
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.found_shape import BEHIND, FoundShape
from identify.selection.nonparametric import nonparametric_labels
from twin.effect import Effect
from twin.model.machine import AxisModel, HistoryStep
from twin.model.units import units_of

Array = NDArray[np.float64]
UNBROKEN = "\u00a0"  # space at which no line ends

# --- the shape of a law, and curves without physics ------------------------------------------


def law_shapes(view: AxisView) -> list[Block]:
    """A picture for each law that is found to have another shape."""
    blocks: list[Block] = []
    for finding in view.found.findings if view.found else ():
        if finding.shape is not None:
            caption = (
                f"{shape_in_words(finding.effect, finding.shape)} Where the band holds the dashed "
                "line, these logs do not tell the two apart. "
                f"{capitalised(advice([finding]))}"
            )
            blocks.append(Heading(f"{spaced(finding.effect)} on {view.name}".capitalize()))
            blocks.append(Picture(draw_shape(finding.shape), caption))
    return blocks


def draw_shape(shape: FoundShape) -> Figure:
    """The curve assumed beside the curve found, a panel for each direction."""
    figure = new_figure(3.0)
    every = figure.subplots(1, len(shape.curves), sharey=True, squeeze=False)[0]
    scale = Scale.of(shape.force_unit, [np.nanmax(np.abs(c.found)) for c in shape.curves.values()])
    along, words = Scale.of(shape.unit, shape.coordinate), units_of(shape.force_unit).words
    x = along(shape.coordinate)
    for axes, (direction, curve) in zip(every, shape.curves.items(), strict=True):
        color = ORANGE if direction == BEHIND else BLUE
        low, high = scale(curve.found - curve.band), scale(curve.found + curve.band)
        axes.fill_between(x, low, high, color=color, alpha=0.2, linewidth=0, label="90 % band")
        axes.plot(x, scale(curve.found), color=color, label="found in the logs")
        axes.plot(x, scale(curve.assumed), color=INK, linestyle="--", label="assumed by the law")
        axes.set_title(direction)
        within = " within one period" if shape.period is not None else ""
        axes.set_xlabel(along.label(words(f"{shape.over.value}{within}").capitalize()))
    every[0].set_ylabel(scale.label(words("Force of the law")))
    figure.legend(*every[0].get_legend_handles_labels(), loc="outside upper right", ncols=3)
    return figure


def curves(view: AxisView) -> list[Block]:
    """A picture for each nonparametric effect of the model."""
    caption = (
        "Mean force of the fitted curves along the logs, moving forwards and backwards. Its shape "
        "is a hint at the missing physics."
    )
    blocks: list[Block] = []
    for fitted in view.model.effects:
        if fitted.effect.is_nonparametric:
            name = fitted.effect.name
            blocks += [
                Heading(f"{spaced(name)} on {view.name}".capitalize()),
                Picture(draw_curves(view, view.axis.curves[name]), view.words(caption)),
                Listing([capitalised(nonparametric_in_words(fitted))]),
            ]
    return blocks


def draw_curves(view: AxisView, force: Array) -> Figure:
    """The force (n,) N of fitted curves by position and by speed."""
    position, velocity = (
        np.concatenate([getattr(log.motion, signal) for log in view.axis.logs])
        for signal in ("position", "velocity")
    )
    figure, units = new_figure(3.0), view.units
    left, right = figure.subplots(1, 2, sharey=True)
    scale = Scale.of(units.force, force)
    along, fast = Scale.of(units.position, position), Scale.of(units.velocity, velocity)
    directions = ((velocity > 0.0, BLUE, "forwards"), (velocity < 0.0, ORANGE, "backwards"))
    for mask, color, label in directions:
        for axes, x in ((left, along(position)), (right, fast(velocity))):
            axes.plot(*binned_mean(x[mask], scale(force[mask])), color=color, label=label)
    left.set_xlabel(along.label(units.words("Position")))
    right.set_xlabel(fast.label("Speed"))
    left.set_ylabel(scale.label(units.words("Force of the curves")))
    figure.legend(*left.get_legend_handles_labels(), loc="outside upper left", ncols=2)
    return figure


# --- candidates ------------------------------------------------------------------------------

WITH_VALUES = 3  # candidates whose parameter values are printed
CLIP = 1.6  # of the error before; a bar that is longer is cut


def ranking(view: AxisView) -> list[Block]:
    """A picture and a table of all absent effects, best first."""
    if view.found is None or view.told is None or not view.found.ranking:
        return []
    caption = (
        f"Force error ({tested_on(view.found)}) after each effect was added and everything "
        "refitted: a missing effect brings it from the dashed line towards the noise floor."
    )
    figure = draw_ranking(view.found, view.told)
    return [Picture(figure, view.words(caption)), ranking_table(view.found)]


def draw_ranking(found: AxisDiagnosis, told: Told) -> Figure:
    """The error after each candidate, beside the error before and the noise floor."""
    ranked, units = found.ranking, found.dataset.units
    before, after = ranked[0].gain.before, [c.gain.after for c in ranked]
    scale = Scale.of(units.force, [before])
    end = float(scale(min(max(before, *after), CLIP * before)))
    figure = new_figure(0.9 + 0.27 * len(ranked))
    axes = figure.subplots()
    lengths = [min(float(scale(a)), end) for a in after]
    colors = [ORANGE if c is found.best else BLUE if c.supported else GREY for c in ranked]
    draw_bars(axes, [spaced(c.effect.name) for c in ranked], lengths, colors)
    axes.axvline(float(scale(before)), color=INK, linestyle="--", label="before")
    floor = told.floors[found.dataset.chosen_on]
    axes.axvline(float(scale(floor)), color=INK, linestyle=":", label="noise floor")
    for row, error in enumerate(after):
        cut = "bar cut, " if scale(error) > end else ""
        axes.text(
            1.0, row, f"{cut}{number(float(scale(error)))}", ha="right", va="center", fontsize=8.5,
            transform=axes.get_yaxis_transform(),
        )  # fmt: skip
    axes.set_xlim(0.0, 1.15 * end)
    tested = units.words(f"{tested_on(found).capitalize()} force error, RMS")
    axes.set_xlabel(scale.label(tested))
    axes.set_ylabel("Effect added")
    figure.legend(loc="outside upper right", ncols=2)
    return figure


def ranking_table(found: AxisDiagnosis) -> Table:
    """Evidence, errors, and why a candidate is not proved."""
    units = found.dataset.units
    scale = Scale.of(units.force, [e for c in found.ranking for e in (c.gain.before, c.gain.after)])
    rows = []
    for rank, c in enumerate(found.ranking):
        tone = Tone.PLAIN if c.supported else Tone.MUTED
        cells = (
            title_case(c.effect.name),
            number(c.delta_bic) if c.score else "",
            scale.text(c.gain.before),
            scale.text(c.gain.after),
            percent(max(c.part, 0.0)) if c.score else "",
            spaced(why_not(found, c)),
            values_of(c.effect, c.fit.axis) if rank < WITH_VALUES else "",
        )
        rows.append(Row(cells, Tone.STRONG if c is found.best else tone))
    titles = ("Evidence (ΔBIC)", "Error before", "Error after", "Part removed")
    columns = (
        Column("Effect"), *(Column(title, numeric=True) for title in titles), Column("Why not"),
        Column("Values"),
    )  # fmt: skip
    caption = (
        f"Evidence: difference of BIC. Error: RMS force, {tested_on(found)}. Part removed: of the "
        "squared error above the noise floor, on the training logs or on data left out of the fit, "
        "whichever is less."
    )
    return Table(columns, rows, units.words(caption))


def values_of(effect: Effect, model: AxisModel) -> str:
    """The values of an effect's parameters in a model, with units."""
    values, units = model[effect.name].values, model.units
    texts = (f"{p.name} = {quantity(values[p.name], units(p.unit))}" for p in effect.parameters)
    return ", ".join(t.replace(" ", UNBROKEN) for t in texts)


# --- the error, effect by effect -------------------------------------------------------------

COLORS = {Role.TRAINING: BLUE, Role.SELECTION: ORANGE, Role.TEST: GREY}
MARKS = {Role.TRAINING: "o-", Role.SELECTION: "s--", Role.TEST: "^-."}


def growth(subject: Subject) -> list[Block]:
    """A picture and a table for each axis with added effects; their position errors if known."""
    by_axis: dict[str, list[HistoryStep]] = {}
    for step in subject.steps:
        by_axis.setdefault(step.axis, []).append(step)
    caption = (
        "Force error after each effect was added and the model refitted. A real effect lowers the "
        "error on the selection logs as much as the error on the training logs."
    )
    blocks: list[Block] = []
    for axis, steps in by_axis.items():
        if len(by_axis) > 1 or len(subject.views) > 1:
            blocks.append(Heading(f"Axis {axis}"))
        picture = draw_growth(steps, subject.floors(axis))
        blocks += [
            Picture(picture, units_of(steps[0].unit).words(caption)), growth_table(steps),
        ]  # fmt: skip
    if subject.additions:
        blocks.append(_positions(subject.additions))
    return blocks


def draw_growth(steps: Sequence[HistoryStep], floors: Mapping[Role, float]) -> Figure:
    """The error from the start to the last step, on the logs of each role."""
    unit = steps[0].unit
    errors = {role: _course(steps, role) for role in Role}
    scale = Scale.of(unit, errors[Role.TRAINING])
    figure = new_figure(3.2)
    axes = figure.subplots()
    for role, values in errors.items():
        if np.isfinite(values).any():
            style = {"color": COLORS[role], "label": f"{role.value} logs", "linewidth": 1.6}
            axes.plot(scale(values), MARKS[role], **style)  # type: ignore[arg-type]
    fit, held = scale(errors[Role.TRAINING]), scale(errors[Role.SELECTION])
    for i, (a, b) in enumerate(zip(fit, held, strict=True)):
        # The larger above and the smaller below: clear of a falling line.
        for value, color, above in ((a, BLUE, not a < b), (b, ORANGE, not b <= a)):
            if np.isfinite(value):
                side, align = (7.0, "left") if above else (-7.0, "right")
                axes.annotate(
                    number(value), (i, value), (side, side), textcoords="offset points",
                    color=color, fontsize=8.5, ha=align, va="center",
                )  # fmt: skip
    for role in (Role.TRAINING, Role.SELECTION):
        # A history from a file may be of other logs; where it ends below the floor of these, it is.
        if role in floors and errors[role][-1] >= floors[role]:
            label = f"noise floor, {role.value} logs"
            axes.axhline(float(scale(floors[role])), color=COLORS[role], linestyle=":", label=label)
    names = ["at the start", *(_step_name(s, f"+ {spaced(s.effect)}") for s in steps)]
    axes.set_xticks(range(len(names)), names)
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(FuncFormatter(plain_tick))
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_xlim(-0.4, len(names) - 0.6)
    axes.set_xlabel("Effect added")
    axes.set_ylabel(scale.label(units_of(unit).words("Force error, RMS")))
    figure.legend(loc="outside upper right", ncols=3)
    return figure


def _course(steps: Sequence[HistoryStep], role: Role) -> Array:
    """Errors (n + 1,) N at the start and after each step, nan where there are none."""
    none = (np.nan, np.nan)
    pairs = [errors_of_step(s).get(role, none) for s in steps]
    return np.array([pairs[0][0], *(after for _, after in pairs)])


def _step_name(step: HistoryStep, added: str) -> str:
    return added if step.action == "add" else f"{step.action} {spaced(step.effect)}"


def growth_table(steps: Sequence[HistoryStep]) -> Table:
    """The errors before and after each step."""
    roles = (Role.TRAINING, Role.SELECTION, Role.TEST)
    shown = [r for r in roles if r is not Role.TEST or any(r in errors_of_step(s) for s in steps)]
    scale = Scale.of(steps[0].unit, [e for s in steps for e in errors_of_step(s)[Role.TRAINING]])
    rows = []
    for s in steps:
        pairs = [errors_of_step(s).get(role, (None, None)) for role in shown]
        cells = (scale.text(error) for pair in pairs for error in pair)
        rows.append(Row((_step_name(s, title_case(s.effect)), *cells)))
    titles = (f"{role.value.capitalize()}, {w}" for role in shown for w in ("before", "after"))
    columns = (Column("Effect added"), *(Column(title, numeric=True) for title in titles))
    caption = "RMS force error on the logs of each role; everything is refitted at each step."
    return Table(columns, rows, units_of(steps[0].unit).words(caption))


def _positions(additions: Sequence[Addition]) -> Table:
    rows = []
    for a in additions:
        alike = (b for b in additions if b.units.position == a.units.position)
        scale = Scale.of(a.units.position, [e for b in alike for e in b.position_error or ()])
        errors = (*(a.position_error or (None, None)), a.replayed)
        name = f"{title_case(a.step.effect)} on {a.step.axis}"
        rows.append(Row((name, *map(scale.text, errors), "kept" if a.kept else "not supported")))
    titles = ("Free run, before", "Free run, after", "Replayed by MuJoCo")
    columns = (
        Column("Effect added"), *(Column(title, numeric=True) for title in titles),
        Column("Outcome"),
    )  # fmt: skip
    what = " and ".join(dict.fromkeys(a.units.words("position") for a in additions))
    return Table(columns, rows, f"RMS {what} error of the model driven by the logged command.")


# --- the laws that are named -----------------------------------------------------------------


def equations(view: AxisView) -> list[Block]:
    """The named effects, and those that the data cannot separate from them."""
    return [block for effect, model in _named(view) for block in _law(effect, model, view.name)]


def _named(view: AxisView) -> Iterator[tuple[Effect, AxisModel]]:
    """Effects with the model that has values for them."""
    if view.found is None:
        return
    final, tried = view.found.final.axis, {c.effect.name: c for c in view.found.ranking}
    for name, *tied in view.found.answers:
        if name in final.names:
            yield final[name].effect, final
        yield from ((tried[n].effect, tried[n].fit.axis) for n in tied if n in tried)


def _law(effect: Effect, model: AxisModel, axis: str) -> list[Block]:
    pairs = (
        ("What it is", effect.summary),
        ("Fingerprint", effect.fingerprint),
        ("Excited by", effect.excited_by),
        ("Fitted", values_of(effect, model)),
        ("Source", effect.source),
    )
    return [Heading(f"{title_case(effect.name)} on {axis}"), Facts(effect.equation, pairs)]


# --- parameters ------------------------------------------------------------------------------


def parameters(view: AxisView) -> list[Block]:
    """A table: with intervals where the model was fitted here."""
    if view.found and view.told:
        return [_fitted(view.found, view.told, view.label)]
    return [given_table(view.model)]


def given_table(axis: AxisModel) -> Table:
    """Values of a model that was not fitted here."""
    meanings, units, mass = _meanings(axis), axis.units, axis.mass_parameter
    values = {mass.name: quantity(axis.mass, units(mass.unit))} | {
        f"{f.effect.name}.{p.name}": quantity(f.values[p.name], units(p.unit))
        for f in axis.effects
        for p in f.effect.parameters
    }
    hidden = nonparametric_labels(axis)
    rows = [Row((k, value, meanings[k])) for k, value in values.items() if k not in hidden]
    columns = (Column("Parameter"), Column("Value", numeric=True), Column("Meaning"))
    return Table(columns, rows, "Values of the given model; twin fit adds intervals.")


def _fitted(found: AxisDiagnosis, told: Told, label: str) -> Table:
    """Values of the fitted model, beside those of the model with what was found."""
    sides = {f"Without {label}": told.before, f"With {label}": told.after}
    if not label:
        sides = {"Value": told.before}
    labels = list(dict.fromkeys(e.label for e in (*told.after, *told.before)))
    meanings = _meanings(found.final.axis)
    columns, remarks, cells = [Column("Parameter")], [], {name: [name] for name in labels}
    for heading, known in sides.items():
        columns.append(Column(heading, numeric=True))
        # Where all values have the same reason, it is in the caption instead of a column.
        if common := common_reason(known):
            remarks.append(f"{heading}: {no_interval_in_words(common)}.")
        else:
            columns.append(Column("90 % interval"))
        by_label = {e.label: e for e in known}
        for name in labels:
            cells[name] += _cells(by_label.get(name))[: 1 if common else 2]
    new = {c.label for c in found.final.scaling.where} - {c.label for c in found.base.scaling.where}
    rows = [
        Row((*row, meanings.get(name, "")), Tone.STRONG if name in new else Tone.PLAIN)
        for name, row in cells.items()
    ]
    return Table([*columns, Column("Meaning")], rows, " ".join(remarks))


def _cells(estimate: Estimate | None) -> tuple[str, str]:
    return (NOTHING, "") if estimate is None else estimate_in_words(estimate)


def _meanings(axis: AxisModel) -> dict[str, str]:
    own = {
        f"{f.effect.name}.{p.name}": p.meaning for f in axis.effects for p in f.effect.parameters
    }
    return {axis.mass_parameter.name: axis.mass_parameter.meaning, **own}
