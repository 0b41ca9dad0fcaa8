"""The JSON of diagnoses and added effects."""

from __future__ import annotations

from dataclasses import replace
from typing import Annotated, Any

from pydantic import Field

from identify.dataset.dataset import Role
from identify.estimation.confounded import Refit
from identify.estimation.found_shape import FoundShape, FreeExponent
from identify.estimation.residual_dependence import Dependence, Repeat
from identify.output.answers import LOWER, Answer, Entry, File, answer_of, read
from identify.output.answers.bodies import BodyEntry, values_of_body
from identify.output.answers.fits import (
    EstimateEntry,
    FeedforwardAnswer,
    ReadOtherwiseEntry,
    estimate_entries,
)
from identify.output.answers.plans import PlanAnswer
from identify.output.candidates import CandidateRow, row_of
from identify.output.words.diagnosis import (
    advice,
    model_change_in_words,
    not_named_in_words,
    said_of,
)
from identify.output.words.findings import pairs_in_words
from identify.output.words.refusal import refusal_in_words
from identify.results.grown import Addition, AllAdded, Removal
from identify.results.results import Diagnosis
from identify.selection.candidates import Candidate
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.findings import Confirmation, FindingKind
from identify.selection.roles import RoleDependent
from identify.validation.misfit_maps import Region
from twin.knee import Imitated
from twin.model.file import format_model
from twin.record import Number, record


class ValuesEntry(Entry):
    """An effect with the values of its parameters."""

    effect: str
    parameters: dict[str, Number]
    parameter_units: dict[str, str]


class AdditionAnswer(Answer, ValuesEntry):
    """What `twin add` prints: the RMS errors before and after."""

    action: str
    axis: str
    unit: str
    fit_error_before: Number
    fit_error_after: Number
    holdout_error_before: Number
    holdout_error_after: Number
    test_error_before: Number
    test_error_after: Number
    is_nonparametric: bool = read("candidate.effect.is_nonparametric")
    kept: bool
    """Whether the logs prove the effect."""
    part: Number = read("candidate.part")
    """What it takes of the squared error above the noise floor."""
    why_not: str | None
    notes: list[str]
    noise_floor: Number = read("candidate.fit.floor")
    position_error_on: str | None
    position_error_before: Number
    position_error_after: Number
    position_error_in_mujoco: Number
    position_unit: str = read("units.position")
    left_out: list[str] = Field([])


@answer_of.register
def _(result: Addition, **more: Any) -> AdditionAnswer:
    before, after = result.position_error or (None, None)
    refused = result.candidate.refused
    return AdditionAnswer.of(
        result,
        result.step,
        **_values(result.candidate),
        why_not=refused and refusal_in_words(refused),
        position_error_before=before,
        position_error_after=after,
        **more,
    )


def _values(c: Candidate) -> dict[str, Any]:
    """The values of the effect of a candidate, and their units."""
    axis, name = c.fit.axis, c.effect.name
    return {"parameters": axis[name].values, "parameter_units": axis.parameter_units(name)}


class StepErrorsEntry(Entry):
    """A law that was added or changed, and the RMS errors without and with all that was."""

    action: str
    effect: str
    axis: str
    unit: str
    fit_error_before: Number
    fit_error_after: Number
    holdout_error_before: Number
    holdout_error_after: Number
    test_error_before: Number
    test_error_after: Number


class RemovalAnswer(Answer, StepErrorsEntry):
    """What `twin remove` prints: the RMS errors with the effect and without it."""

    needed: bool
    """Whether the logs ask for the effect beside the others."""
    left_out: list[str] = Field([])


@answer_of.register
def _(result: Removal, **more: Any) -> RemovalAnswer:
    return RemovalAnswer.of(result, result.step, **more)


class AllAddedAnswer(Answer):
    """What `twin add --found` prints: the laws that were added together."""

    steps: list[StepErrorsEntry]
    kept: bool
    """Whether the logs prefer the model with all of them on every axis that it changed."""
    left_out: list[str] = Field([])


@answer_of.register
def _(result: AllAdded, **more: Any) -> AllAddedAnswer:
    steps = [StepErrorsEntry.of(step) for step in result.steps]
    return AllAddedAnswer.of(result, steps=steps, **more)


@record
class StepRow(CandidateRow):
    """A change of the model that was accepted on the way to the answer."""

    change: str
    dropped: tuple[str, ...]
    with_others: bool
    not_named: str | None


def _step(d: AxisDiagnosis, index: int) -> StepRow:
    step = d.steps[index]
    row = replace(row_of(step.tried.candidate, d), effect=step.change.name)
    return StepRow(
        **vars(row), change=model_change_in_words(step.change), dropped=step.dropped,
        with_others=step.with_others, not_named=not_named_in_words(d, index),
    )  # fmt: skip


# --- findings --------------------------------------------------------------------------------


class FindingEntry(Entry):
    """An effect that is missing, or of another shape, and what shows it."""

    effect: str
    kind: FindingKind
    explains: Number
    """Part of the squared error above the noise floor."""
    confidence: Number
    """How often such answers were right in the self-test; null where test logs contradict."""
    unit: str
    parameters: dict[str, Number]
    parameter_units: dict[str, str]
    together: list[str]
    """Effects without which the logs do not prove it."""
    bend: FreeExponent | None
    imitated: Imitated | None
    """What its law is on this motion, where no more than that is proved."""
    indistinguishable_from: list[str] = read("tied")
    state: Confirmation
    test_error_before: Number = read("tested.before")
    test_error_after: Number = read("tested.after")
    test_error_on: Role = read("tested.on")
    part: Number = read("score.part")
    """What it removes, above the noise floor, of the logs that decided it."""
    t: Number = read("score.t")
    control: Number = read("score.control")
    """The part that the same force shifted in time stays below, 19 of 20 times."""
    shape: FoundShape | None


class RemainderEntry(Entry):
    """What stands above the noise floor beside the findings."""

    depends_on: str
    share_of_error: Number
    period: Number
    period_unit: str
    error: Number
    over_noise_floor: Number = read("ratio")
    unit: str
    where: Region | None
    advice: str


def _remainder(d: AxisDiagnosis, region: Region | None) -> RemainderEntry | None:
    if d.unexplained is None:
        return None
    units = {"period_unit": d.unexplained.unit, "unit": d.final.axis.units.force}
    said = advice(d.findings)
    return RemainderEntry.of(d.unexplained, d.final, **units, where=region, advice=said)


# --- diagnoses -------------------------------------------------------------------------------


class DiagnosisEntry(Entry):
    """The diagnosis of an axis."""

    axis: str = read("dataset.axis")
    verdict: Annotated[str, LOWER] = read("verdict.name")
    explanation: str
    effect: str | None
    """The effect that is named first."""
    missing: list[str] = read("named")
    ambiguous_with: list[str]
    findings: list[FindingEntry]
    explained: Number
    """Part of the squared error above the noise floor that all findings together remove."""
    needed_together: list[str]
    also_seen: list[str]
    depends_on_roles: list[RoleDependent]
    unexplained: Dependence | None
    remainder: RemainderEntry | None
    repeats_not_general: Repeat | None = read("repeat")
    ranking: list[CandidateRow]
    steps: list[StepRow]
    force_error: Number = read("base.error")
    force_error_with_found: Number = read("final.error")
    noise_floor: Number = read("floor")
    noise_floors: dict[Role, Number] = read("floors")
    test_error_before: Number = read("tested.before")
    test_error_after: Number = read("tested.after")
    test_error_on: Role = read("tested.on")
    unit: str = read("base.axis.units.force")
    parameters: dict[str, EstimateEntry]
    force_shift: Number = read("dataset.channel_delay")
    force_shift_unit: str = "s"
    refit: Refit | None
    not_tried: list[str]
    notes: list[str]
    next_experiment: PlanAnswer | None
    next_experiment_refused: str | None


class DiagnosisAnswer(Answer, DiagnosisEntry):
    """What `twin diagnose` prints: the axis that the answer is about, and the same by axis."""

    axes: dict[str, DiagnosisEntry]
    body: BodyEntry | None
    """Of a mechanism, the body of which most is told; the axes are told with it as it was found."""
    recording: ReadOtherwiseEntry | None
    """Of a mechanism, in what its recording is another than its file needs."""
    bodies: list[BodyEntry]
    """All bodies of which something is told."""
    disputed: dict[str, list[str]] = Field({})
    """By body, the logs that tell another change of it than the training logs do."""
    model: str
    """The model with everything that was found, as the text of its TOML file."""
    mujoco: str | None
    """Of a mechanism with another body, the text of the MJCF file of that model."""
    data_faults: list[str] = Field([])
    """What the check of the logs found."""
    left_out: list[str] = Field([])


@answer_of.register
def _(result: Diagnosis, **more: Any) -> DiagnosisAnswer:
    axes = {axis: _diagnosis(result, axis) for axis in result.axes}
    bodies = [BodyEntry.of(body, **values_of_body(body, result.fitted)) for body in result.bodies]
    body = next(iter(bodies), None)
    recording = result.recording and ReadOtherwiseEntry.of(result.recording)
    leading, model = axes[result.leading.dataset.axis], result.model
    mujoco = model.mjcf if body else None
    written = {"model": format_model(model), "mujoco": mujoco}
    return DiagnosisAnswer.of(
        leading,
        axes=axes,
        body=body,
        recording=recording,
        bodies=bodies,
        disputed=result.disputed,
        **written,
        **more,
    )


def _diagnosis(result: Diagnosis, axis: str) -> DiagnosisEntry:
    d, summary, said = result.axes[axis], result.summaries[axis], said_of(result, axis)
    planned = result.next_experiments.get(axis)
    return DiagnosisEntry.of(
        d,
        summary,
        explanation=said.verdict,
        effect=d.best.effect.name if d.best else None,
        needed_together=pairs_in_words(d),
        remainder=_remainder(d, result.left_over.get(axis)),
        ranking=[row_of(c, d) for c in d.ranking],
        steps=[_step(d, i) for i in range(len(d.steps))],
        parameters=estimate_entries(summary.after),
        refit=result.refits.get(axis),
        not_tried=list(result.not_tried.get(axis, {})),
        notes=said.notes,
        next_experiment=planned and answer_of(planned),
        next_experiment_refused=result.not_planned.get(axis),
    )


class DemoAnswer(Answer):
    """What `twin demo` prints; named: whether the diagnosis named the hidden effect."""

    hidden: str
    named: bool
    report: File
    diagnosis: DiagnosisAnswer
    feedforward: FeedforwardAnswer | None
