"""The JSON of a project."""

from __future__ import annotations

from identify.output.answers import Answer
from identify.project.entries import (
    AnswerEntry,
    ExperimentEntry,
    ExportEntry,
    ModelEntry,
    RecordingEntry,
)


class ProjectAnswer(Answer):
    """What `twin log`, `twin undo` and `twin project` print."""

    recordings: list[RecordingEntry]
    models: list[ModelEntry]
    answers: list[AnswerEntry]
    experiments: list[ExperimentEntry]
    exports: list[ExportEntry]
    history: list[str]
    """The commands that made it, in their order."""
