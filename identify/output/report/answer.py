"""The answer for each axis: what is missing, and how much it would improve the model."""

from __future__ import annotations

from identify.dataset.given_logs import Role
from identify.estimation.decision import RULE
from identify.experiment_design.plan import Plan
from identify.output.report.blocks import Answer, Section, Tile, Tone
from identify.output.report.subject import Subject, what_was_found
from identify.output.report.units import SCALED, Scale, number, quantity, spaced
from identify.output.words.experiment_design import gap_in_words
from identify.output.words.findings import (
    advice,
    also_seen_in_words,
    finding_in_words,
    next_command,
    shares_in_words,
    together_in_words,
)
from identify.output.words.numbers import capitalised
from identify.output.words.selection import (
    also_chose_in_words,
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
from identify.results.addition import Addition
from identify.results.told import Told
from identify.selection.confounded import Refit
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
    told = subject.told(axis.axis)
    assert told is not None  # of whatever was diagnosed
    sentence = axis.units.words(verdict_in_words(found))
    if remains := remainder_in_words(found, SCALED):
        sentence = f"{sentence} {capitalised(remains)}"
    if found.unexplained is not None:
        sentence = f"{sentence} {dependence_in_words(found.unexplained, SCALED)}"
    if region := subject.left_over(axis.axis):
        sentence = f"{sentence} It is largest at {region_in_words(region, SCALED)}."
    return Answer(
        headline=f"Axis {axis.axis}: {_headline(found)}",
        sentence=sentence,
        tiles=_tiles(axis, found, told),
        remarks=_remarks(axis, found, following, subject.refit(axis.axis)),
        tone=Tone.PLAIN if found.verdict is Verdict.NOTHING_MISSING else Tone.STRONG,
    )


def _remarks(
    axis: AxisComparison, found: AxisDiagnosis, following: Plan | None, refit: Refit | None
) -> list[str]:
    """What each finding explains, what else was seen, and what to do next."""
    findings = (spaced(". ".join(finding_in_words(f, SCALED))) for f in found.findings)
    said = [
        *(axis.units.words(text) for text in findings), *shares_in_words(found),
        *together_in_words(found), *also_seen_in_words(found), *_runner_up(found),
    ]  # fmt: skip
    if following is not None:
        said.append(_next_step(following))
    if found.verdict is Verdict.NOTHING_MISSING and refit:
        said.append(refit_in_words(refit, SCALED) or "")
    out = [capitalised(text) for text in (*said, *next_command(found)) if text]
    return out if found.unexplained is None else [*out, f"{advice(found.findings)}."]


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
    others = [c for c in found.ranking if c.score and c.effect.name not in found.named]
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


def _tiles(axis: AxisComparison, found: AxisDiagnosis, told: Told) -> list[Tile]:
    base, final, floor = found.base, found.final, told.floor
    unit, words = axis.units.force, axis.units.words
    if final is base:
        errors = _error_tiles(base.error, floor, axis.units)
        return [*errors, *_test_tile(found, told), *_position_tile(axis, "")]
    named = what_was_found(found)
    return [
        Tile(
            words("Force error on the fit logs"),
            _change(unit, base.error, final.error),
            f"with {named}, RMS",
        ),
        *_chosen_tile(found, told, named),
        *_test_tile(found, told),
        Tile(
            "Error over noise floor",
            f"{number(base.error / floor)} → {number(final.error / floor)}",
            f"fit logs; floor {quantity(floor, unit)} RMS",
        ),
        *_position_tile(axis, f", without {named}"),
    ]


def _chosen_tile(found: AxisDiagnosis, told: Told, named: str) -> list[Tile]:
    """The error on held-out logs; without them one effect has the error of cross-validation."""
    units = found.dataset.units
    if found.dataset.holdout:
        chosen = told.chosen
        error = _change(units.force, chosen.before, chosen.after)
        return [Tile(units.words("Held-out force error"), error, f"with {named}, RMS")]
    if found.best is None or len(found.named) > 1:
        return []
    gain = found.best.gain
    error, t = _change(units.force, gain.before, gain.after), f"t = {number(gain.t)} over blocks"
    return [Tile(units.words("Cross-validated force error"), error, t)]


def _test_tile(found: AxisDiagnosis, told: Told) -> list[Tile]:
    """The error on test logs without and with what is named, where there are such logs."""
    tested, units = told.tested, found.dataset.units
    if tested.on is not Role.TEST:
        return []
    error, what = quantity(tested.before, units.force), "RMS"
    if found.final is not found.base:
        error = _change(units.force, tested.before, tested.after)
        what = f"with {what_was_found(found)}, RMS"
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
        remarks=[capitalised(also)] if (also := also_chose_in_words(addition.told_on)) else [],
        tone=Tone.STRONG if addition.kept else Tone.PLAIN,
    )
