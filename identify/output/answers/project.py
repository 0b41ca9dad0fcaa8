"""The JSON of a project."""

from __future__ import annotations

from identify.output.answers import Answer, Entry, Number


class RecordingEntry(Entry):
    """A log, what it was imported from and by which map, and what it is for."""

    file: str
    role: str
    sources: list[str]
    map: str | None


class RoleErrorEntry(Entry):
    """The RMS force error of an axis in a role, before a change and after it."""

    axis: str
    role: str
    after: Number
    before: Number
    unit: str


class ModelEntry(Entry):
    """A model, what it was made from, and what was changed."""

    file: str
    base: str | None
    change: list[str]
    proved: bool
    errors: list[RoleErrorEntry]


class AnswerEntry(Entry):
    """What a command answered: as JSON, and as a page."""

    command: str
    file: str
    page: str | None
    model: str | None


class PlannedEntry(Entry):
    """An experiment that was planned."""

    file: str


class ExportedEntry(Entry):
    """A model as files of another tool."""

    format: str
    files: list[str]


class ProjectAnswer(Answer):
    """What `twin log`, `twin undo` and `twin project` print."""

    recordings: list[RecordingEntry]
    models: list[ModelEntry]
    answers: list[AnswerEntry]
    experiments: list[PlannedEntry]
    exports: list[ExportedEntry]
    history: list[str]
    """The commands that made it, in their order."""
