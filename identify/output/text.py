"""Results as text for a terminal."""

from __future__ import annotations

from identify.dataset.given_logs import Role
from identify.estimation.intervals import Estimate, NoInterval
from identify.experiment_design.plan import Plan
from identify.output.remarks import remarks_on
from identify.output.simulation_fit import simulation_fit_text
from identify.output.words.estimation import (
    common_reason,
    no_interval_in_words,
    outcome_in_words,
    prepared_in_words,
)
from identify.output.words.experiment_design import (
    experiment_in_words,
    gap_in_words,
    in_order,
    not_run_in_words,
    supposed_in_words,
)
from identify.output.words.findings import (
    advice,
    also_seen_in_words,
    finding_in_words,
    next_command,
    shape_in_words,
    shares_in_words,
    together_in_words,
)
from identify.output.words.selection import (
    dependence_in_words,
    named_errors_in_words,
    named_in_words,
    nonparametric_in_words,
    refit_in_words,
    remainder_in_words,
    step_in_words,
    tested_on,
    ties_in_words,
    verdict_in_words,
)
from identify.output.words.steps import step_lines, why_not
from identify.output.words.validation import (
    correlation_in_words,
    loop_in_words,
    region_in_words,
)
from identify.results.addition import Addition
from identify.results.printed import text_of
from identify.results.results import Comparison, Diagnosis, FitResult, SimulationFit
from identify.results.told import Told
from identify.selection.candidates import Candidate
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.nonparametric import nonparametric_labels
from identify.validation.misfit_maps import AxisComparison
from twin.experiments.file import in_short


@text_of.register
def fit_text(result: FitResult) -> str:
    """The fit of each axis, one parameter a line."""
    lines = []
    for axis, fit in result.fits.items():
        unit, words = fit.axis.units.force, fit.axis.units.words
        others = {"held out": result.holdout_error[axis], "test": result.test_error[axis]}
        tail = "".join(f", {on} {e:.4g} {unit}" for on, e in others.items() if e is not None)
        lines.append(
            f"axis {axis}: {words('force error')} {fit.error:.4g} {unit}{tail}, noise floor "
            f"{fit.floor:.4g} {unit} (ratio {fit.ratio:.2f})"
        )
        lines.append(f"  {words(outcome_in_words(fit.ended))}")
        lines += [f"  at its bound: {label}" for label in fit.at_bound]
        lines += [f"  {said}" for said in prepared_in_words(result.datasets[axis])]
        if result.left_out[axis]:
            still = ", ".join(result.left_out[axis])
            lines.append(f"  not fitted on {still}, where axis {axis} stands still")
        if changed := refit_in_words(result.refits[axis]):
            lines.append(f"  {changed}")
        hidden = nonparametric_labels(fit.axis)
        common = common_reason(result.estimates[axis])
        if common is not None:
            lines.append(f"  {no_interval_in_words(common)}")
        lines += [
            f"  {e.label:34s} {_with_interval(e, common)}"
            for e in result.estimates[axis]
            if e.label not in hidden
        ]
        lines += [
            f"  {nonparametric_in_words(f)}" for f in fit.axis.effects if f.effect.is_nonparametric
        ]
    lines += [f"axis {axis}: not fitted, as it moves in no log" for axis in result.not_fitted]
    return "\n".join(lines)


def _with_interval(e: Estimate, common: NoInterval | None) -> str:
    """A value with its interval, or why it has none, unless the reason is common to all."""
    text = f"{e.value:12.6g} {'' if e.unit == '1' else e.unit:10s}"
    if not e.free:
        return text + " fixed"
    if e.low is None:
        return text if e.reason in (None, common) else f"{text} {no_interval_in_words(e.reason)}"
    return text + f" 90 % in [{e.low:.6g}, {e.high:.6g}]"


def _position_error(c: AxisComparison, log: str) -> str:
    """The position error of a log, as the rest of a sentence; nothing of imposed motion."""
    if log not in c.position_error:
        return ""
    error = f"{c.position_error[log]:.3g} {c.units.position}"
    return f", {c.units.words('free-running position error')} {error}"


@text_of.register
def compare_text(result: Comparison) -> str:
    """Errors by log, and the three worst regions of each axis."""
    lines = []
    for axis, c in result.axes.items():
        words = c.units.words
        for name, error in c.force_error.items():
            lines.append(
                f"axis {axis}, {name}: {words('force error')} {error:.4g} {c.units.force} "
                f"({error / c.floor:.1f} x noise floor){_position_error(c, name)}"
            )
        lines += [f"  worst: {region_in_words(region)}" for region in c.worst]
        if not c.worst:
            lines.append("  in no region is the error above the noise")
        lines += [f"  {words(correlation_in_words(test))}" for test in c.tests.correlations]
    lines += dict.fromkeys(c.units.words(loop_in_words(c.tests.loop)) for c in result.axes.values())
    return "\n".join(lines)


@text_of.register
def diagnose_text(result: Diagnosis) -> str:
    """The answer for each axis, and its best candidates."""
    lines = []
    for axis, d in result.axes.items():
        words = d.base.axis.units.words
        named = f" Missing: {named_in_words(d)}." if d.named else ""
        lines.append(f"axis {axis}: {words(verdict_in_words(d))}{named}")
        lines.append(f"  {words('force error')} {_errors(d, result.told[axis])}")
        if d.tested.on is not Role.TRAINING:
            lines.append(f"  {named_errors_in_words(d)}")
        lines += [f"  {tie}" for tie in ties_in_words(d)]
        if axis in result.next_experiments:
            lines += [f"  {line}" for line in plan_text(result.next_experiments[axis]).splitlines()]
        for f in d.findings:
            first, *others = finding_in_words(f)
            lines += [f"  {words(first)}", *(f"    {words(other)}" for other in others)]
        lines += [f"  {shares}" for shares in shares_in_words(d)]
        lines += [f"  {told}" for told in (*together_in_words(d), *also_seen_in_words(d))]
        shapes = [shape_in_words(f.effect, f.shape) for f in d.findings if f.shape]
        lines += [f"  {words(text)}" for text in shapes]
        if remains := remainder_in_words(d):
            lines.append(f"  {remains}")
        if d.unexplained:
            lines.append(f"  {words(dependence_in_words(d.unexplained))}")
            if axis in result.left_over:
                lines.append(f"  it is largest at {words(region_in_words(result.left_over[axis]))}")
        if d.unexplained or any(f.shape for f in d.findings):
            lines.append(f"  {advice(d.findings)}")
        lines += [f"  {command}" for command in next_command(d)]
        lines += [_ranking_line(c, d) for c in d.ranking[:4]]
        lines += [f"  {line}" for line in step_lines(d)]
        lines += [f"  note: {remark}" for remark in remarks_on(result, axis)]
    return "\n".join(lines)


def _errors(found: AxisDiagnosis, told: Told) -> str:
    """Errors on the training logs without and with what was found, and the noise floor."""
    unit, floor = found.base.axis.units.force, told.floor
    base, final = found.base.error, found.final.error
    error, ratio = f"{base:.4g} {unit}", f"{base / floor:.2f}"
    if found.final is not found.base:
        error, ratio = f"{base:.4g} -> {final:.4g} {unit}", f"{ratio} -> {final / floor:.2f}"
    return f"on the training logs {error}, noise floor {floor:.4g} {unit} (ratio {ratio})"


def _ranking_line(c: Candidate, found: AxisDiagnosis) -> str:
    unit = c.fit.axis.units.force
    tail = f"   {why}" if (why := why_not(found, c)) else ""
    if c.score is None:
        return f"  {c.effect.name:28s} not refitted: {why}"
    return (
        f"  {c.effect.name:28s} evidence {c.delta_bic:10.1f}   {tested_on(found)} error "
        f"{c.gain.before:.4g} -> {c.gain.after:.4g} {unit}{tail}"
    )


SHOWN = 4  # experiments of a plan that are printed


def plan_text(result: Plan) -> str:
    """The question, the chosen experiment and what it is expected to show, and the next best."""
    several = len(result.between) > 1
    what, verdict = " or ".join(result.between), "decided by"
    if not several:
        what, verdict = f"the parameters of {what}", "best constrained by"
    elif not result.decides:
        verdict = "not decided by any experiment of this length; the nearest is"
    lines = [
        f"axis {result.axis}: {what}, {verdict}",
        f"  {in_short(result.chosen.experiment, result.chosen.units)}",
    ]
    lines += [f"  {gap_in_words(result.gap)}"]
    lines += [f"  {name} is excited by {motion}" for name, motion in result.excited_by.items()]
    if result.favoured:
        lines.append(f"  the existing logs already favour {result.favoured}")
    if supposed := supposed_in_words(result):
        lines.append(f"  {supposed}")
    lines += [f"  {experiment_in_words(t, result)}" for t in in_order(result)[:SHOWN]]
    return "\n".join([*lines, *(f"  not run: {not_run_in_words(n)}" for n in result.not_run)])


@text_of.register
def add_text(result: Addition) -> str:
    """The errors before and after adding the effect."""
    s, words = result.step, result.units.words
    lines = [
        step_in_words(s),
        f"  {words('force error on the fit logs'):33s} {s.fit_error_before:.4g} -> "
        f"{s.fit_error_after:.4g} {s.unit}",
    ]
    others = {
        "held-out logs": (s.holdout_error_before, s.holdout_error_after),
        "test logs": (s.test_error_before, s.test_error_after),
    }
    for name, (before, after) in others.items():
        if before is not None and after is not None:
            what = words(f"force error on the {name}")
            lines.append(f"  {what:33s} {before:.4g} -> {after:.4g} {s.unit}")
    if result.position_error is not None:
        (before, after), unit = result.position_error, result.units.position
        lines.append(
            f"  {words('free-running position error'):33s} {before:.3g} -> {after:.3g} {unit} "
            f"on {result.position_log} (MuJoCo: {result.replayed:.3g} {unit})"
        )
    lines += [f"  {note}" for note in result.notes]
    if not result.kept:
        lines.append(
            f"  the logs do not prove it: {result.candidate.refused}. The model has it "
            "nevertheless, as asked for; go on with the model before, or, if a diagnosis says that "
            "it needs another beside it, add that to the new model and judge then"
        )
    return "\n".join(lines)


text_of.register(SimulationFit, simulation_fit_text)
