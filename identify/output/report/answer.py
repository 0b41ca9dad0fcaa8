"""The answer for each axis: what is missing, how much it would improve the model; and the notes."""

from __future__ import annotations

import re

from identify.dataset.dataset import Role
from identify.output.numbers import arrow, capitalised, number, quantity, spaced
from identify.output.report.page import Answer, Block, Listing, Tile, Tone
from identify.output.report.subject import AxisView, Subject
from identify.output.words.addition import also_chose_in_words, errors_of_step, proved_in_words
from identify.output.words.diagnosis import Said, tested_on, why_not
from identify.output.words.fit import refit_in_words
from identify.output.words.plan import next_step_in_words
from identify.results.addition import Addition
from identify.results.told import Told
from identify.rules import RULE
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from twin.model.machine import HistoryStep

ADD = re.compile(r"twin add (--shape )?\w+")


def cards(view: AxisView) -> list[Block]:
    """The card of an axis; before it, where nothing was diagnosed, one for its latest addition."""
    if view.found and view.told and view.said:
        return [_diagnosed(view, view.found, view.told, view.said)]
    added = [a for a in view.subject.additions if a.step.axis == view.name]
    return [*(_added(a) for a in added[-1:]), _compared(view)]


def _diagnosed(view: AxisView, found: AxisDiagnosis, told: Told, said: Said) -> Answer:
    return Answer(
        headline=f"Axis {view.name}: {said.headline}",
        sentence=" ".join((said.verdict, *said.left)),
        tiles=_tiles(view, found, told),
        remarks=_remarks(view, found, said),
        tone=Tone.PLAIN if found.verdict is Verdict.NOTHING_MISSING else Tone.STRONG,
        commands=[view.subject.command(text) for text in _following(found, said)],
    )


def _following(found: AxisDiagnosis, said: Said) -> list[str]:
    """The next step as commands, of model and logs that are still to be named."""
    if found.verdict is Verdict.NOTHING_MISSING:
        return []
    for finding in found.missing:
        if finding.tied:
            between = f"{finding.effect} {finding.tied[0]}"
            return [f"twin plan MODEL LOG... --between {between} -o next.toml"]
        if finding.together:
            second = f"twin add {finding.together[0]} first.toml LOG... -o both.toml"
            return [f"twin add {finding.effect} MODEL LOG... -o first.toml", second]
    asked = (ADD.search(text) for text in (*said.following, *said.advice))
    return [f"{m[0]} MODEL LOG... -o better.toml" for m in asked if m][:1]


def _remarks(view: AxisView, found: AxisDiagnosis, said: Said) -> list[str]:
    """What each finding explains, what else was seen, and what to do next."""
    diagnosis = view.subject.diagnosis
    plan = diagnosis and diagnosis.next_experiments.get(view.name)
    refit = diagnosis and diagnosis.refits.get(view.name)
    quiet = found.verdict is Verdict.NOTHING_MISSING
    every = (
        *(spaced(". ".join(sentences)) for sentences in said.findings),
        *said.beside,
        _runner_up(found),
        plan and next_step_in_words(plan),
        refit_in_words(refit) if quiet and refit else None,
        *said.advice,
    )
    return [capitalised(text) for text in every if text]


def _runner_up(found: AxisDiagnosis) -> str | None:
    second = next((c for c in found.ranking if c.score and c.effect.name not in found.named), None)
    if second is None:
        return None
    errors = arrow(second.gain.before, second.gain.after, found.dataset.units.force)
    role = "Runner-up" if found.best else "Nearest candidate"
    return (
        f"{role}: {spaced(second.effect.name)}, evidence (difference of BIC) "
        f"{number(second.delta_bic)}, {tested_on(found)} error {errors}, "
        f"{why_not(found, second) or 'proved too'}"
    )


def _tiles(view: AxisView, found: AxisDiagnosis, told: Told) -> list[Tile]:
    base, final, floor, unit = found.base, found.final, told.floor, view.units.force
    if final is base:
        tested = told.tested
        test = Tile(view.words("Force error, test logs"), quantity(tested.before, unit), "RMS")
        on_test = [test] if tested.on is Role.TEST else []
        return [*_error_tiles(view, base.error, floor), *on_test, *_position_tile(view, "")]
    named = f"with {view.label}"
    tiles = [_fall(view, "training logs", base.error, final.error, f"{named}, RMS")]
    if found.dataset.holdout:
        chosen = told.chosen
        tiles.append(_fall(view, "selection logs", chosen.before, chosen.after, f"{named}, RMS"))
    elif found.best is not None and len(found.named) == 1:
        gain = found.best.gain
        t = f"t = {number(gain.t)} over blocks"
        tiles.append(_fall(view, "cross-validated", gain.before, gain.after, t))
    if told.tested.on is Role.TEST:
        before, after = told.tested.before, told.tested.after
        tiles.append(_fall(view, "test logs", before, after, f"{named}, RMS"))
    of_noise = f"training logs; floor {quantity(floor, unit)} RMS"
    ratio = arrow(base.error / floor, final.error / floor, "1")
    return [
        *tiles,
        Tile("Error over noise floor", ratio, of_noise),
        *_position_tile(view, f", without {view.label}"),
    ]


def _fall(view: AxisView, on: str, before: float, after: float, remark: str) -> Tile:
    return Tile(view.words(f"Force error, {on}"), arrow(before, after, view.units.force), remark)


def _error_tiles(view: AxisView, error: float, floor: float) -> list[Tile]:
    unit = view.units.force
    return [
        Tile(view.words("Force error"), quantity(error, unit), "RMS over the logs"),
        Tile("Error over noise floor", number(error / floor), f"floor {quantity(floor, unit)} RMS"),
    ]


def _position_tile(view: AxisView, model: str) -> list[Tile]:
    if not view.axis.position_error:
        return []
    worst = quantity(max(view.axis.position_error.values()), view.units.position)
    return [Tile(view.words("Position, free run"), worst, f"RMS of the worst log{model}")]


def _compared(view: AxisView) -> Answer:
    axis, at_floor = view.axis, view.axis.ratio < RULE.at_floor
    headline = f"force error {number(axis.ratio)} times the noise floor"
    sentence = "The force error is at its noise floor."
    if not at_floor:
        sentence = (
            "The force error is larger than noise explains; twin diagnose finds which effect is "
            "missing."
        )
    following = [] if at_floor else ["twin diagnose MODEL LOG... -o diagnosis.html"]
    return Answer(
        headline=f"Axis {view.name}: "
        + ("the model explains the measurement" if at_floor else view.words(headline)),
        sentence=view.words(sentence),
        tiles=[*_error_tiles(view, axis.total_error, axis.floor), *_position_tile(view, "")],
        remarks=[],
        tone=Tone.PLAIN if at_floor else Tone.STRONG,
        commands=[view.subject.command(text) for text in following],
    )


def _added(addition: Addition) -> Answer:
    step, unit, words = addition.step, addition.units.position, addition.units.words
    tiles = [
        Tile(words(f"Force error, {role.value} logs"), arrow(before, after, step.unit), "RMS")
        for role, (before, after) in errors_of_step(step).items()
    ]
    if addition.position_error and addition.replayed is not None:
        replayed = f"RMS; {quantity(addition.replayed, unit)} replayed by MuJoCo"
        moved = arrow(*addition.position_error, unit)
        tiles.append(Tile(words("Position, free run"), moved, replayed))
    also = also_chose_in_words(addition.told_on)
    return Answer(
        headline=f"Axis {step.axis}: {done(step)}",
        sentence=proved_in_words(addition),
        tiles=tiles,
        remarks=[capitalised(also)] if also else [],
        tone=Tone.STRONG if addition.kept else Tone.PLAIN,
    )


def done(step: HistoryStep) -> str:
    """E.g. "cogging added"."""
    how = "given the shape found" if step.action == "shape" else "added"
    return f"{spaced(step.effect)} {how}"


def notes(subject: Subject) -> list[Block]:
    """Notes of all axes and of the model's history, each once."""
    said = [
        f"Axis {view.name}: {note}"
        for view in subject.views
        for note in (view.said.notes if view.said else ())
    ]
    for step in (*subject.steps, *(a.step for a in subject.additions)):
        said += [f"Axis {step.axis}, {done(step)}: {note}" for note in step.notes]
    once = tuple(dict.fromkeys(f"{note.removesuffix('.')}." for note in said))
    return [Listing(once)] if once else []
