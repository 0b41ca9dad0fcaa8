"""The JSON of commands that need no identification: machines, effects, logs, files."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, field_validator

from identify.output.answers import LOWER, Answer, Entry, File, Told, read
from twin.export import Outdated, Remark
from twin.record import Number

if TYPE_CHECKING:  # a command that only shows the catalogue loads no NumPy
    from twin.checks.long import AxisInfo, LogInfo
    from twin.checks.report import CheckReport
    from twin.laws.verdict import LawReport


class ErrorAnswer(Answer):
    """What any command prints that was given bad input, or that failed."""

    error: str


# --- effects ---------------------------------------------------------------------------------


class ParameterEntry(Entry):
    """A parameter of an effect, in the units of a linear axis."""

    name: str
    unit: str
    start: Number
    lower: Number
    upper: Number
    meaning: str


class EffectEntry(Entry):
    """What the catalogue knows of an effect."""

    name: str
    kind: Annotated[str, LOWER] = read("kind.name")
    is_nonparametric: bool
    summary: str
    equation: str
    source: str
    states: list[str]
    fingerprint: str
    excited_by: str
    parameters: list[ParameterEntry]


class EffectAnswer(Answer, EffectEntry):
    """What `twin effects NAME` prints."""


class EffectsAnswer(Answer):
    """What `twin effects` prints: the catalogue."""

    effects: list[EffectEntry]


class LawEntry(Entry):
    """A law of every effect; holds: null where it was not tried."""

    law: str
    holds: bool | None
    fault: Told


class LawsAnswer(Answer):
    """What `twin effects --check` prints."""

    ok: bool
    effects: dict[str, list[LawEntry]]


def laws_answer(reports: Sequence[LawReport]) -> LawsAnswer:
    """Whether all laws hold for all effects, and each law."""
    effects = {r.effect: r.outcomes for r in reports}
    return LawsAnswer.of(ok=all(r.ok for r in reports), effects=effects)


# --- logs ------------------------------------------------------------------------------------


class CheckFindingEntry(Entry):
    """A fault of a log."""

    severity: Literal["error", "warning"]
    fault: Annotated[str, LOWER] = read("fault.name")
    axis: str
    what: str
    where: Annotated[str, BeforeValidator(str)]
    start: Number = read("where.start")
    """s, from which on it is seen first; null in all of the log."""
    stop: Number = read("where.stop")
    """s, until which; null to the end."""
    remedy: str


class CheckAnswer(Answer):
    """What `twin check` prints; ok: whether all logs may be fitted."""

    ok: bool
    logs: dict[str, list[CheckFindingEntry]]


def check_answer(reports: Mapping[str, CheckReport]) -> CheckAnswer:
    """The findings of each log."""
    logs = {name: report.findings for name, report in reports.items()}
    return CheckAnswer.of(ok=all(report.ok for report in reports.values()), logs=logs)


class ChannelEntry(Entry):
    """The range of a signal, and its course."""

    unit: str
    least: Number
    most: Number
    course: list[Number]
    """Least and largest value of parts of the log of one length, in turn: what it looks like."""


class AxisInfoEntry(Entry):
    """The signals of an axis."""

    kind: str
    force_constant: Number
    force_constant_unit: str | None
    channels: dict[str, ChannelEntry]


class FaultEntry(Entry):
    """A fault of a log in a sentence."""

    severity: Literal["error", "warning"]
    fault: str
    axis: str
    text: str


class LogInfoEntry(Entry):
    """What is in a log."""

    duration: Number
    duration_unit: str = "s"
    samples: int
    sample_rate: Number
    sample_rate_unit: str = "Hz"
    metadata: dict[str, str]
    axes: dict[str, AxisInfoEntry]
    ok: bool = read("check.ok")
    findings: list[FaultEntry]


class InfoAnswer(Answer):
    """What `twin info` prints."""

    logs: dict[str, LogInfoEntry]


def info_answer(found: Mapping[str, LogInfo]) -> InfoAnswer:
    """By the name of the log."""
    logs = {}
    for name, info in found.items():
        axes = {axis: _axis_info(own) for axis, own in info.axes.items()}
        findings = [FaultEntry.of(f, text=str(f)) for f in info.check.findings]
        logs[name] = LogInfoEntry.of(info, axes=axes, findings=findings)
    return InfoAnswer(logs=logs)


def _axis_info(axis: AxisInfo) -> AxisInfoEntry:
    value, unit = axis.constant or (None, None)
    channels = {c.name: c for c in axis.channels}
    return AxisInfoEntry.of(axis, force_constant=value, force_constant_unit=unit, channels=channels)


class LogAnswer(Answer):
    """What `twin simulate` and `twin cut` print of the log that they wrote."""

    log: File
    samples: int
    sample_rate: Number
    unit: str = "Hz"
    setpoints: File | None = None


class ViewAnswer(Answer):
    """What `twin view` prints; gain: by how much differences are drawn larger than they are."""

    log: File
    html: File | None
    video: File | None
    rerun: File | None
    axes: list[str]
    duration: float
    duration_unit: Literal["s"] = "s"
    gain: float
    notes: list[str]
    left_out: list[str]


class RecoveryAnswer(Answer):
    """What `twin recover` prints."""

    log: File
    kept: str
    lost: list[str]
    not_proved: list[str]
    others: list[File]
    """The other intact parts, as files beside the log."""


# --- files -----------------------------------------------------------------------------------


class ProposedColumn(Entry):
    """A column, and the signal of an axis that it is taken for; null where it is none."""

    column: str
    unit: str | None
    assumed: bool
    """Whether the unit is, as nothing tells it."""
    low: Number
    high: Number
    axis: str | None
    field: str | None
    certainty: Literal["sure", "likely", "unsure"] | None
    why: str
    course: list[Number]
    """Means of at most 80 parts of it, in their order: what it looks like."""

    @field_validator("course", mode="before")
    @classmethod
    def _in_short(cls, value: Any) -> list[float]:
        import numpy as np

        parts = np.array_split(np.asarray(value, dtype=float), min(80, len(value)))
        return [float(part.mean()) for part in parts]


class MapAnswer(Answer):
    """What `twin import` prints of a map that it proposes: as TOML, and what is missing in it."""

    map: str
    missing: list[str]
    columns: list[ProposedColumn]


class MapProofEntry(Entry):
    """What the motion explains of the force of an axis, as it is and with its sign reversed."""

    explained: Number = read("motion.forward")
    explained_reversed: Number = read("motion.backward")
    both_ways: bool = read("motion.both_ways")
    """Whether the axis moves both ways, without which no sign is told."""
    mass: Number
    mass_unit: str = read("units.mass")


class ImportAnswer(LogAnswer):
    """What `twin import` prints of a log, with what its map makes of each axis."""

    map: File
    proofs: dict[str, MapProofEntry]


class NewModelAnswer(Answer):
    """What `twin new` prints; not_determined: by axis, the values that the logs do not tell."""

    model: File
    axes: list[str]
    not_determined: dict[str, list[str]]


class ExportAnswer(Answer):
    """What `twin export` prints: the files, and by axis what they hold as the model does."""

    format: str
    files: list[File]
    kept: dict[str, list[str]]
    approximated: list[Remark]
    lost: list[Remark]
    written: list[Remark]
    """What of a file that is written back is another now, and what stays beside the model."""


class ExportAgreementAnswer(Answer):
    """What `twin agree` prints of exported files."""

    agrees: bool
    formats: list[str]
    outdated: list[Outdated]
    a: File
    b: File


class ExamplesAnswer(Answer):
    """What `twin example` prints: what each example is."""

    examples: dict[str, str]


class ExampleAnswer(Answer):
    """What `twin example NAME` prints; data: where the data are to be had, if not in the folder."""

    folder: File
    files: list[File]
    commands: list[str]
    data: str | None


class LineEntry(Entry):
    """A thing that `twin doctor` looked at; remedy: how to get what is missing, if anything."""

    about: str
    found: str
    remedy: str | None
    needed: bool


class DoctorAnswer(Answer):
    """What `twin doctor` prints; ok: whether nothing is missing that `twin` needs."""

    ok: bool
    lines: list[LineEntry]
