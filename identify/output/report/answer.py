"""The answer for each axis: what is missing, and how much it would improve the model."""

from __future__ import annotations

from identify.dataset.given_logs import Role
from identify.estimation.decision import RULE
from identify.experiment_design.plan import Plan
from identify.output.addition import Addition
from identify.output.report.blocks import Answer, Section, Tile, Tone
from identify.output.report.subject import Subject
from identify.output.report.units import SCALED, Scale, number, quantity, spaced
from identify.output.words.experiment_design import gap_in_words
from identify.output.words.findings import (
    advice,
    also_seen_in_words,
    finding_in_words,
    shares_in_words,
    together_in_words,
)
from identify.output.words.numbers import capitalised
from identify.output.words.selection import (
    dependence_in_words,
    named_in_words,
    not_confirmed_in_words,
    refit_in_words,
    remainder_in_words,
    tested_on,
    verdict_in_words,
)
from identify.output.words.steps import why_not
from identify.output.words.validation import region_in_words
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from identify.validation.misfit_maps import AxisComparison
from twin.experiments.file import in_short
from twin.model.units import AxisUnits


def section(subject: Subject) -> Section:
    """A card for each axis; a card for the latest addition first where nothing was diagnosed."""
    cards = []
    if subject.additions and subject.diagnosis is None:
        cards.append(_added(subject.additions[-1]))
    for axis in subject.axes:
        found = subject.diagnosed(axis.axis)
        following = subject.next_experiment(axis.axis)
        if found is None:
            cards.append(_compared(axis))
        else:
            cards.append(_diagnosed(axis, found, following, subject))
    return Section("answer", "Answer", cards)


def _diagnosed(
    axis: AxisComparison, found: AxisDiagnosis, following: Plan | None, subject: Subject
) -> Answer:
    remarks: list[str] = []
    refit = subject.refit(axis.axis)
    sentence = axis.units.words(verdict_in_words(found))
    if remains := remainder_in_words(found, SCALED):
        sentence = f"{sentence} {capitalised(remains)}"
    if found.unexplained is not None:
        sentence = f"{sentence} {dependence_in_words(found.unexplained, SCALED)}"
    if region := subject.left_over(axis.axis):
        sentence = f"{sentence} It is largest at {region_in_words(region, SCALED)}."
    remarks.extend(
        axis.units.words(f"{capitalised(spaced(finding_in_words(f, SCALED)))}")
        for f in found.findings
    )
    remarks.extend(capitalised(text) for text in shares_in_words(found))
    told = (*together_in_words(found), *also_seen_in_words(found))
    remarks.extend(capitalised(text) for text in told)
    remarks.extend(_runner_up(found))
    if found.unexplained is not None:
        remarks.append(f"{advice(found.findings)}.")
    if following is not None:
        remarks.append(_next_step(following))
    if (
        found.verdict is Verdict.NOTHING_MISSING
        and refit
        and (changed := refit_in_words(refit, SCALED))
    ):
        remarks.append(capitalised(changed))
    return Answer(
        headline=f"Axis {axis.axis}: {_headline(found)}",
        sentence=sentence,
        tiles=_tiles(axis, found),
        remarks=remarks,
        tone=Tone.PLAIN if found.verdict is Verdict.NOTHING_MISSING else Tone.STRONG,
    )


def _headline(found: AxisDiagnosis) -> str:
    against = not_confirmed_in_words(found)
    return _answer(found) + (f" ({spaced(against)})" if against else "")


def _answer(found: AxisDiagnosis) -> str:
    match found.verdict:
        case Verdict.MISSING_EFFECTS:
            return f"{spaced(named_in_words(found))} {'are' if found.named[1:] else 'is'} missing"
        case Verdict.WRONG_SHAPE:
            return f"{spaced(found.findings[0].effect)} has another shape"
        case Verdict.UNEXPLAINED:
            return "something outside the catalogue is missing"
        case Verdict.NOTHING_MISSING:
            return "nothing is missing"


def _runner_up(found: AxisDiagnosis) -> list[str]:
    others = found.ranking[1:] if found.best else found.ranking
    if not others:
        return []
    second = others[0]
    change = _change(found.dataset.units.force, second.gain.before, second.gain.after)
    role = "Runner-up" if found.best else "Nearest candidate"
    verdict = why_not(found, second) or "proved too"
    return [
        f"{role}: {spaced(second.effect.name)}, ΔBIC {number(second.delta_bic)}, "
        f"{tested_on(found)} error {change}, {verdict}."
    ]


def _next_step(following: Plan) -> str:
    chosen, unit = following.chosen, following.chosen.units.force
    what = "decides" if following.decides else "comes nearest to deciding, but is too short"
    return (
        f"The experiment that {what} ({quantity(chosen.duration, 's')}; twin plan writes it): "
        f"{in_short(chosen.experiment, chosen.units)}. "
        f"The rival leaves {quantity(chosen.difference, unit)} RMS unexplained, where noise is "
        f"{quantity(chosen.floor, unit)}; {gap_in_words(following.gap)}."
    )


def _change(unit: str, before: float, after: float) -> str:
    """E.g. "73.6 → 7.25 mN"."""
    scale = Scale.of(unit, [before, after])
    return f"{number(before / scale.size)} → {scale.text(after)}"


def _tiles(axis: AxisComparison, found: AxisDiagnosis) -> list[Tile]:
    base, best = found.base, found.best
    unit, words = axis.units.force, axis.units.words
    if best is None:
        errors = _error_tiles(base.error, base.floor, axis.units)
        return [*errors, *_test_tile(found), *_position_tile(axis, "")]
    final = found.with_named
    named = spaced(best.effect.name) if len(found.named) == 1 else "all that is named"
    return [
        Tile(
            words("Force error on the fit logs"),
            _change(unit, base.error, final.error),
            f"with {named}, RMS",
        ),
        *_chosen_tile(found, named),
        *_test_tile(found),
        Tile(
            "Error over noise floor",
            f"{number(base.error / final.floor)} → {number(final.ratio)}",
            f"fit logs; floor {quantity(final.floor, unit)} RMS",
        ),
        *_position_tile(axis, f", without {named}"),
    ]


def _chosen_tile(found: AxisDiagnosis, named: str) -> list[Tile]:
    """The error on held-out logs; without them one effect has the error of cross-validation."""
    units = found.dataset.units
    if found.dataset.holdout:
        chosen = found.chosen
        error = _change(units.force, chosen.before, chosen.after)
        return [Tile(units.words("Held-out force error"), error, f"with {named}, RMS")]
    if found.best is None or len(found.named) > 1:
        return []
    gain = found.best.gain
    error, t = _change(units.force, gain.before, gain.after), f"t = {number(gain.t)} over blocks"
    return [Tile(units.words("Cross-validated force error"), error, t)]


def _test_tile(found: AxisDiagnosis) -> list[Tile]:
    """The error on test logs without and with what is named, where there are such logs."""
    tested, units = found.tested, found.dataset.units
    if tested.on is not Role.TEST:
        return []
    error, what = quantity(tested.before, units.force), "RMS"
    if found.with_named is not found.base:
        error = _change(units.force, tested.before, tested.after)
        what = "with what is named, RMS"
    return [Tile(units.words("Test force error"), error, what)]


def _error_tiles(error: float, floor: float, units: AxisUnits) -> list[Tile]:
    of_noise = f"floor {quantity(floor, units.force)} RMS"
    return [
        Tile(units.words("Force error"), quantity(error, units.force), "RMS over the logs"),
        Tile("Error over noise floor", number(error / floor), of_noise),
    ]


def _position_tile(axis: AxisComparison, model: str) -> list[Tile]:
    if not axis.position_error:
        return []
    worst = max(axis.position_error.values())
    told = quantity(worst, axis.units.position)
    return [Tile(axis.units.words("Position, free run"), told, f"RMS of the worst log{model}")]


def _compared(axis: AxisComparison) -> Answer:
    at_floor, words = axis.ratio < RULE.at_floor, axis.units.words
    headline = (
        "the model explains the measurement"
        if at_floor
        else f"{words('force error')} {number(axis.ratio)} times the noise floor"
    )
    sentence = (
        "The force error is at its noise floor."
        if at_floor
        else "The force error is larger than noise explains; twin diagnose finds which effect is "
        "missing."
    )
    return Answer(
        headline=f"Axis {axis.axis}: {headline}",
        sentence=words(sentence),
        tiles=[
            *_error_tiles(axis.total_error, axis.floor, axis.units),
            *_position_tile(axis, ""),
        ],
        remarks=[],
        tone=Tone.PLAIN if at_floor else Tone.STRONG,
    )


def _added(addition: Addition) -> Answer:
    step, unit, words = addition.step, addition.units.position, addition.units.words
    errors = _change(step.unit, step.fit_error_before, step.fit_error_after)
    tiles = [Tile(words("Force error on the fit logs"), errors, "RMS")]
    others = {
        "Held-out force error": (step.holdout_error_before, step.holdout_error_after),
        "Test force error": (step.test_error_before, step.test_error_after),
    }
    tiles += [
        Tile(words(name), _change(step.unit, before, after), "RMS")
        for name, (before, after) in others.items()
        if before is not None and after is not None
    ]
    if addition.position_error and addition.replayed is not None:
        moved = _change(unit, *addition.position_error)
        replayed = f"RMS; {quantity(addition.replayed, unit)} replayed by MuJoCo"
        tiles.append(Tile(words("Position, free run"), moved, replayed))
    outcome = "given the shape found" if step.action == "shape" else "added"
    sentence = "The logs prove the effect."
    if not addition.kept:
        sentence = (
            f"The logs do not prove this effect: {addition.candidate.refused}; leave it out, "
            "unless a diagnosis says that it needs another beside it."
        )
    return Answer(
        headline=f"Axis {step.axis}: {spaced(step.effect)} {outcome}",
        sentence=sentence,
        tiles=tiles,
        remarks=[] if addition.also_chose is None else [capitalised(addition.also_chose)],
        tone=Tone.STRONG if addition.kept else Tone.PLAIN,
    )
