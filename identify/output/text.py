"""Results as text for a terminal: the sentences of ``words``, line by line."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from identify.dataset.dataset import Role
from identify.experiment_design.plan import Plan
from identify.output.candidates import line_of, row_of
from identify.output.numbers import (
    DisplayUnit,
    arrow,
    by_how_much,
    listed,
    number,
    quantity,
)
from identify.output.words.diagnosis import said_of, tested_on
from identify.output.words.fit import (
    LOOPS,
    agreement_in_words,
    causes_in_words,
    common_reason,
    correlation_in_words,
    difference_in_words,
    estimate_in_words,
    fit_in_words,
    motion_fit_in_words,
    nonparametric_in_words,
    over_floor,
    region_in_words,
)
from identify.output.words.next_step import (
    UNKNOWN,
    Source,
    all_not_run_in_words,
    body_in_words,
    disputed_in_words,
    errors_of_step,
    experiment_in_words,
    gap_in_words,
    in_order,
    model_in_words,
    names_of,
    next_step_in_words,
    question_in_words,
    supposed_in_words,
    wrong_body_in_words,
)
from identify.output.words.recording import read_otherwise_in_words
from identify.output.words.verdict import all_found, named_in_words
from identify.printed import Printed, figure_of, html_of, report_of, save_of, text_of
from identify.results.grown import Addition, AllAdded, CorrectedBody, Removal
from identify.results.results import (
    Comparison,
    Diagnosis,
    Feedforward,
    FitResult,
    SimulationFit,
    refitted,
)
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.nonparametric import nonparametric_labels
from identify.validation.agreement import Agreement
from identify.validation.comparison import AxisComparison
from twin.experiments.file import in_short
from twin.model.machine import HistoryStep

if TYPE_CHECKING:
    from pathlib import Path

    from matplotlib.figure import Figure

SHOWN = 4  # candidates of a diagnosis, and experiments of a plan, that are printed


@text_of.register
def fit_text(result: FitResult) -> str:
    """The fit of each axis, one parameter a line."""
    lines = read_otherwise_in_words(result.recording)
    for axis in result.fits:
        first, *others = fit_in_words(result, axis)
        lines += [first, *(f"  {line}" for line in others), *_estimates(result, axis)]
    lines += [
        f"axis {axis}: not fitted, as no log says anything of it" for axis in result.not_fitted
    ]
    return "\n".join(lines)


def _estimates(result: FitResult, axis: str) -> Iterator[str]:
    """The parameters of an axis, a line each; those of a fitted curve together."""
    model, found = result.fits[axis].axis, result.estimates[axis]
    common, hidden = common_reason(found), nonparametric_labels(model)
    for e in found:
        if e.label not in hidden:
            value, interval = estimate_in_words(e, common)
            tail = f"90 % in {interval}" if e.low is not None else interval
            yield f"  {e.label:34s} {value:>16s}  {tail}".rstrip()
    curves = (f for f in model.effects if f.effect.is_nonparametric)
    yield from (f"  {nonparametric_in_words(f)}" for f in curves)


@text_of.register
def simulation_fit_text(result: SimulationFit) -> str:
    """The fit of each axis, one parameter a line: the value, and that of the force fit."""
    lines = []
    for axis, fit in result.axes.items():
        said = motion_fit_in_words(axis, fit, result.holdout_error[axis])
        lines += [said[0], *(f"  {line}" for line in said[1:])]
        for c, before, now in refitted(fit):
            scale = DisplayUnit.of(fit.axis.units(c.parameter.unit), [now])
            value = f"{number(now / scale.size, 6)} {scale.unit}".rstrip()
            lines.append(f"  {c.label:34s} {value} (force fit {number(before / scale.size, 6)})")
    return "\n".join(lines)


@text_of.register
def compare_text(result: Comparison) -> str:
    """Errors by log, and the three worst regions of each axis."""
    lines = read_otherwise_in_words(result.recording)
    for axis, c in result.axes.items():
        words = c.units.words
        for name, error in c.force_error.items():
            lines.append(
                f"axis {axis}, {name}: {words('force error')} {quantity(error, c.units.force)} "
                f"({error / c.floor:.1f} times the noise floor){_position_error(c, name)}"
            )
        worst = "worst of all logs" if len(c.force_error) > 1 else "worst"
        lines += [f"  {worst}: {region_in_words(region)}" for region in c.worst]
        if not c.worst:
            lines.append("  in no region is the error above the noise")
        lines += [f"  {words(correlation_in_words(test))}" for test in c.tests.correlations]
    lines += dict.fromkeys(c.units.words(LOOPS[c.tests.loop]) for c in result.axes.values())
    return "\n".join(lines)


def _position_error(c: AxisComparison, log: str) -> str:
    """The position error of a log, as the rest of a sentence; nothing of imposed motion."""
    if log not in c.position_error:
        return ""
    error = quantity(c.position_error[log], c.units.position)
    fit = f" (fit {100.0 * c.position_fit[log]:.4g} %, NRMSE)"
    return f", {c.units.words('free-running position error')} {error}{fit}"


@text_of.register
def diagnose_text(result: Diagnosis, source: Source = UNKNOWN) -> str:
    """The answer for each axis, its best candidates, and what else is said.

    source: what stands for MODEL in the next command.
    """
    lines = body_in_words(result, source)
    lines[1:] = [f"  {line}" for line in lines[1:]]
    first = [*read_otherwise_in_words(result.recording), *disputed_in_words(result.disputed)]
    lines = [*first, *lines]
    for axis, d in result.axes.items():
        said, units, tested = said_of(result, axis), d.base.axis.units, d.tested
        named = f" Missing: {named_in_words(d)}." if d.named else ""
        fits = [d.base.error] if d.final is d.base else [d.base.error, d.final.error]
        floor = over_floor(units.force, result.summaries[axis].floor, *fits)
        errors = [f"{_errors(d, Role.TRAINING, fits[0], fits[-1])}, {floor}"]
        if tested.on is not Role.TRAINING:
            errors.append(_errors(d, tested.on, tested.before, tested.after))
        lines.append(f"axis {axis}: {said.verdict}{named}")
        lines += [f"  {units.words('force error')} {error}" for error in errors]
        for first, *others in said.findings:
            lines += [f"  {first}", *(f"    {other}" for other in others)]
        rest = (said.beside, said.shapes, said.left, said.advice)
        lines += [f"  {sentence}" for sentences in rest for sentence in sentences]
        if axis in result.next_experiments:
            lines.append(f"  {next_step_in_words(result.next_experiments[axis])}")
        steps = source.still_to_do(said.commands, names_of(d.dataset))
        lines += [f"  next: {text}" for text in steps]
        lines += _candidates(d)
        lines += [f"  {line}" for line in said.steps]
        lines += [f"  note: {note}" for note in said.notes]
    if source.written:
        lines.append(f"{source.written}: {model_in_words(result)}")
    still = (axis for axis in result.fitted.axes if axis not in result.axes)
    lines += [f"axis {axis}: not diagnosed, as it moves in no log" for axis in still]
    return "\n".join(lines)


def _errors(found: AxisDiagnosis, on: Role, before: float, after: float) -> str:
    """Errors on the logs of a role without and with what was found."""
    unit = found.base.axis.units.force
    errors = quantity(before, unit)
    if found.final is not found.base:
        errors = f"{arrow(before, after, unit)} with {all_found(found)}"
    return f"on the {on.value} logs {errors}"


def _candidates(found: AxisDiagnosis) -> Iterator[str]:
    """The best candidates, a line each."""
    shown = found.ranking[:SHOWN]
    if any(c.score for c in shown):
        yield f"  candidates with their evidence (difference of BIC) and the {tested_on(found)}"
    yield from (f"  {line_of(row_of(c, found))}" for c in shown)


@text_of.register
def plan_text(result: Plan) -> str:
    """The question, the chosen experiment and what it is expected to show, and the next best."""
    favoured, chosen = result.favoured, result.chosen
    lines = [
        in_short(chosen.experiment, chosen.units),
        gap_in_words(result.gap),
        *(f"{name} is excited by {motion}" for name, motion in result.excited_by.items()),
        favoured and f"the existing logs already favour {favoured}",
        supposed_in_words(result),
        *(experiment_in_words(t, result) for t in in_order(result)[:SHOWN]),
        *(f"not run: {why}" for why in all_not_run_in_words(result.not_run)),
    ]
    first = f"axis {result.axis}: {question_in_words(result)}"
    return "\n".join([first, *(f"  {line}" for line in lines if line)])


@text_of.register
def add_text(result: Addition) -> str:
    """The errors before and after adding the effect."""
    step, words = result.step, result.units.words
    lines = [f"added {step.effect} to axis {step.axis}"]
    if result.reshaped:
        lines = [f"gave {step.effect} of axis {step.axis} the shape that the logs show"]
    lines += _errors_of(step, words)
    if result.position_error is not None and result.replayed is not None:
        unit = result.units.position
        scale = DisplayUnit.of(unit, result.position_error)
        lines.append(
            f"  {words('free-running position error'):33s} {arrow(*result.position_error, unit)} "
            f"on {result.position_log} (MuJoCo: {scale.text(result.replayed)})"
        )
    lines += [f"  {note}" for note in result.notes]
    if not result.kept:
        lines.append(
            f"  The logs do not prove it: {result.candidate.refused}. The model has it "
            "nevertheless, as asked for; go on with the model before, or, if a diagnosis says that "
            "it needs another beside it, add that to the new model and judge then."
        )
    return "\n".join(lines)


@text_of.register
def all_added_text(result: AllAdded) -> str:
    """What was added to each axis, and the errors before and after all of it."""
    lines = []
    for axis in dict.fromkeys(step.axis for step in result.steps):
        steps = [step for step in result.steps if step.axis == axis]
        words = result.model.axes[axis].units.words
        laws = [step.effect for step in steps if step.action != "body"]
        bodies = [step.effect for step in steps if step.action == "body"]
        if laws:
            lines.append(f"added {listed(laws)} to axis {axis}")
        if bodies:
            lines.append(f"corrected body {listed(bodies)}, which moves with axis {axis}")
        lines += _errors_of(steps[0], words)
    if not result.kept:
        lines.append(
            "  These logs do not prove all of it: go on with the model before, or diagnose it with "
            "them."
        )
    return "\n".join(lines)


@text_of.register
def removal_text(result: Removal) -> str:
    """What was taken out, the errors with it and without, and whether the logs ask for it."""
    step = result.step
    asked = "ask for it: go on with the model before" if result.needed else "do not ask for it"
    lines = [f"took {step.effect} off axis {step.axis}"]
    lines += _errors_of(step, result.model.axes[step.axis].units.words)
    return "\n".join([*lines, f"  The logs {asked}."])


def _errors_of(step: HistoryStep, words: Callable[[str], str]) -> Iterator[str]:
    """The errors before and after a step on the logs of each role, a line each."""
    for role, (before, after) in errors_of_step(step).items():
        what = words(f"force error on the {role.value} logs")
        yield f"  {what:33s} {arrow(before, after, step.unit)}"


@text_of.register
def corrected_text(result: CorrectedBody) -> str:
    """What was written into the MuJoCo file, and the errors before and after."""
    file, given, lines = result.model.mjcf_name, result.given.mjcf_name, list[str]()
    for body in result.bodies:
        why = wrong_body_in_words(body, result.given)
        lines.append(f"Body {body.body} of {file} has {body.written}; {given} is as it was.")
        lines += [f"  {line}" for line in why]
    return "\n".join(lines)


@text_of.register
def feedforward_text(result: Feedforward) -> str:
    """By axis the tracking errors in simulation, and what each effect gains."""
    lines = [f"in simulation, on the motion of {', '.join(result.logs)}"]
    for axis, found in result.axes.items():
        unit = result.model.axes[axis].units.position
        lines.append(f"axis {axis}: tracking error, RMS and largest")
        lines += [
            f"  {name}: {quantity(e.rms, unit)}, {quantity(e.largest, unit)}"
            for name, e in found.by_feedforward.items()
        ]
        lines += [
            f"    with all but {e}: RMS {by_how_much(gain, unit)}"
            for e, gain in found.gains.items()
        ]
        lines += [f"  not in it: {e}, {why}" for e, why in result.axes[axis].lost.items()]
    return "\n".join(lines)


@text_of.register
def agree_text(result: Agreement) -> str:
    """By axis whether the fits agree, what differs, and what would make the difference."""
    lines = []
    for axis, found in result.axes.items():
        lines.append(agreement_in_words(axis, found))
        lines += [f"  {difference_in_words(n, found.parameters[n])}" for n in found.differing]
        lines += [f"  {cause}" for cause in causes_in_words(found)]
    lines += [f"axis {axis}: not compared, as it has no intervals" for axis in result.not_compared]
    return "\n".join(lines)


# --- in a notebook, whose templates and pictures are loaded when they are asked for ----------


@html_of.register(FitResult | Comparison | Diagnosis)
def _tables(result: FitResult | Comparison | Diagnosis) -> str:
    from identify.output.report import tables

    return tables(result)


@report_of.register(Comparison | Diagnosis)
def _page(result: Comparison | Diagnosis, path: Path) -> None:
    from identify.output.report import write_report
    from identify.output.report.subject import Subject

    write_report(path, Subject.of(result))


@save_of.register(Printed)
def _json(result: Printed, path: Path) -> None:
    from identify.output.as_json import save  # whose classes take a tenth of a second

    save(result, path)


@figure_of.register(Comparison | Diagnosis)
def _picture(result: Comparison | Diagnosis, coordinate: str | None, axis: str | None) -> Figure:
    from identify.output.report.explorer import residual

    return residual(result, coordinate, axis)
