"""The answer for each axis: what is missing, how much it would improve the model; and the notes."""

from __future__ import annotations

from identify.dataset.dataset import Role
from identify.mechanism.bodies import WrongBody
from identify.output.blocks import AnswerBlock, Block, Listing, Tile, Tone
from identify.output.machine import minor
from identify.output.numbers import DisplayUnit, arrow, capitalised, number, quantity, spaced
from identify.output.shown.subject import AxisView, Subject
from identify.output.words.diagnosis import Said, tested_on
from identify.output.words.fit import refit_in_words
from identify.output.words.next_step import (
    Source,
    body_in_words,
    disputed_in_words,
    next_step_in_words,
)
from identify.output.words.recording import read_otherwise_in_words
from identify.results.results import AxisSummary, Diagnosis
from identify.rules import RULE
from identify.selection.diagnosis import AxisDiagnosis, Verdict


def cards(view: AxisView) -> list[Block]:
    """The card of an axis; before the first that of a recording, and of a body, that is another."""
    diagnosis = view.subject.diagnosis
    if not (diagnosis and view.found and view.summary and view.said):
        return [_compared(view)]
    own = _diagnosed(view, diagnosis, view.found, view.summary, view.said)
    first: list[Block] = []
    if diagnosis.recording is not None:
        said, *others = read_otherwise_in_words(diagnosis.recording)
        headline = "The recording is not what the model needs"
        first.append(AnswerBlock(headline, said, [], others, Tone.STRONG))
    if diagnosis.disputed:
        said, *others = disputed_in_words(diagnosis.disputed)
        first.append(AnswerBlock("The logs disagree", said, [], others, Tone.STRONG))
    if diagnosis.body is not None:
        first.append(_body(diagnosis, diagnosis.body, view.subject.source))
    return [*(first if view is view.subject.views[0] else []), own]


def _body(diagnosis: Diagnosis, body: WrongBody, source: Source) -> AnswerBlock:
    """The card of a body whose inertia is not that of its file."""
    sentence, *others = body_in_words(diagnosis, source)
    axes = diagnosis.fitted.axes
    tiles = [
        Tile(
            axes[a].units.words(f"Force error, {a}"),
            arrow(e.before, e.after, axes[a].units.force),
            f"{e.on.value} logs, with the body as it was found",
        )
        for a, e in body.errors.items()
        if a in body.axes
    ]
    headline = f"Body {' or '.join((body.body, *body.tied))}: another inertia"
    return AnswerBlock(headline, sentence, tiles, others, Tone.STRONG)


def _diagnosed(
    view: AxisView, diagnosis: Diagnosis, found: AxisDiagnosis, summary: AxisSummary, said: Said
) -> AnswerBlock:
    quiet = found.verdict is Verdict.NOTHING_MISSING
    plan, refit = diagnosis.next_experiments.get(view.name), diagnosis.refits.get(view.name)
    remarks = (
        *(spaced(". ".join(sentences)) for sentences in said.findings),
        *said.beside,
        plan and next_step_in_words(plan),
        refit_in_words(refit) if quiet and refit else None,
        *said.advice,
    )
    return AnswerBlock(
        headline=f"Axis {view.name}: {said.headline}",
        sentence=" ".join((said.verdict, *said.left)),
        tiles=_tiles(view, found, summary),
        remarks=[capitalised(text) for text in remarks if text],
        tone=Tone.PLAIN if quiet else Tone.STRONG,
        commands=view.subject.still_to_do(said.commands),
    )


def _tiles(view: AxisView, found: AxisDiagnosis, summary: AxisSummary) -> list[Tile]:
    """The errors without and with what was found, on the logs of each role."""
    base, final, floor, unit = found.base, found.final, summary.floor, view.units.force
    errors = {f"{Role.TRAINING.value} logs": (base.error, final.error)}
    if found.dataset.selection:
        errors["selection logs"] = (summary.chosen.before, summary.chosen.after)
    elif found.best is not None and len(found.named) == 1:
        errors[tested_on(found).split()[0]] = (found.best.gain.before, found.best.gain.after)
    if summary.tested.on is Role.TEST:
        errors["test logs"] = (summary.tested.before, summary.tested.after)
    remark = f"with {view.label}, RMS" if view.label else "RMS"
    tiles = [
        Tile(view.words(f"Force error, {on}"), _fall(*pair, unit), remark)
        for on, pair in errors.items()
    ]
    ratio = _fall(base.error / floor, final.error / floor, "1")
    noise = DisplayUnit.of(unit, base.error)
    of = f"training logs; floor {noise.text(floor)} RMS"
    tiles.append(Tile("Error over noise floor", ratio, of))
    return [*tiles, *_position_tile(view)]


def _fall(before: float, after: float, unit: str) -> str:
    return quantity(before, unit) if after == before else arrow(before, after, unit)


def _position_tile(view: AxisView) -> list[Tile]:
    """The free run of the worst log, without what was found and with it."""
    before, after = view.axis.position_error, view.free_runs
    if not before:
        return []
    worst, unit = max(before, key=before.__getitem__), view.units.position
    which = "with" if worst in after else "without"
    remark = f"{which} {view.label}, " if view.label else ""
    error = _fall(before[worst], after.get(worst, before[worst]), unit)
    return [Tile(view.words("Position, free run"), error, f"{remark}RMS of the worst log")]


def _compared(view: AxisView) -> AnswerBlock:
    axis, unit = view.axis, view.units.force
    ratio, tone = number(axis.ratio), Tone.STRONG
    headline = view.words(f"force error {ratio} times the noise floor")
    sentence = "is larger than noise explains; twin diagnose finds which effect is missing."
    commands = [view.subject.command("twin diagnose MODEL LOG... -o diagnosis.html")]
    if axis.ratio < RULE.at_floor:
        headline, sentence = "the model explains the measurement", "is at its noise floor."
        commands, tone = [], Tone.PLAIN
    error, floor = quantity(axis.total_error, unit), quantity(axis.floor, unit)
    return AnswerBlock(
        headline=f"Axis {view.name}: {headline}",
        sentence=view.words(f"The force error {sentence}"),
        tiles=[
            Tile(view.words("Force error"), error, "RMS over the logs"),
            Tile("Error over noise floor", ratio, f"floor {floor} RMS"),
            *_position_tile(view),
        ],
        remarks=[],
        tone=tone,
        commands=commands,
    )


# The parts of what a model says of its machine.
OF_MACHINE = {"response": "the frequency response", "worth": "what the model gains as feedforward"}


def notes(subject: Subject) -> list[Block]:
    """Notes of all axes, of the history, of the check, and of what is left out, each once."""
    said = [
        f"Axis {view.name}: {note}"
        for view in subject.views
        for note in (view.said.notes if view.said else ())
    ]
    for step in subject.history:
        how = "given the shape found" if step.action == "shape" else "added"
        said += [f"Axis {step.axis}, {spaced(step.effect)} {how}: {note}" for note in step.notes]
    said += minor(subject.findings)
    for part, why in subject.machine.left_out.items():
        said.append(f"Left out is {OF_MACHINE[part]}: {why}")
    once = tuple(dict.fromkeys(f"{note.removesuffix('.')}." for note in said))
    return [Listing(once)] if once else []
