"""What `project.toml` holds: recordings in roles, models in their order, answers, experiments.

Names of files are as seen from the project's folder.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Literal, TypeVar

import tomlkit
from pydantic import Field

from twin.entries import Entries

RoleName = Literal["training", "selection", "test"]
ROLES: tuple[RoleName, ...] = ("training", "selection", "test")
HEAD = "A project of twin: its commands without arguments take what they need from here."


class RecordingEntry(Entries):
    """A log, what it was imported from and by which map, and what it is for."""

    file: str = Field(description="the MCAP log")
    role: RoleName = Field(description="training, selection or test")
    sources: list[str] = Field(default=[], description="the files that it was imported from")
    map: str | None = Field(default=None, description="the import map")


class ErrorsEntry(Entries):
    """The RMS force error of an axis in a role, before a change and after it, in ``unit``."""

    axis: str = Field(description="the axis")
    role: RoleName = Field(description="training, selection or test")
    after: float = Field(description="the error with this model")
    before: float | None = Field(default=None, description="the error before the change")
    unit: str = Field(description='the unit, as "N"')


class ModelEntry(Entries):
    """A model, what it was made from, and what was changed. change: names of effects, or "fit"."""

    file: str = Field(description="the machine model (.toml)")
    base: str | None = Field(default=None, description="the model that was changed")
    change: list[str] = Field(default=[], description="effects that were added, or fit")
    removed: str | None = Field(default=None, description="the effect that was taken out")
    proved: bool = Field(default=True, description="whether the logs prove the change")
    errors: list[ErrorsEntry] = Field(default=[], description="errors by axis and role")


class AnswerEntry(Entries):
    """What a command answered. file: its JSON object; page: the same to be looked at."""

    command: str = Field(description="the command, as typed outside a project")
    file: str = Field(description="the answer as JSON")
    page: str | None = Field(default=None, description="the answer as a page")
    model: str | None = Field(default=None, description="the model that was asked about")


class ExperimentEntry(Entries):
    """An experiment that was planned."""

    file: str = Field(description="the experiment (.toml)")


class ExportEntry(Entries):
    """A model as files of another tool."""

    format: str = Field(description="what it was exported to")
    files: list[str] = Field(default=[], description="what was written")


class Project(Entries):
    """All of a project."""

    recordings: list[RecordingEntry] = Field(default=[], description="tables of recordings")
    models: list[ModelEntry] = Field(default=[], description="tables of models, in their order")
    answers: list[AnswerEntry] = Field(default=[], description="tables of answers")
    experiments: list[ExperimentEntry] = Field(default=[], description="tables of experiments")
    exports: list[ExportEntry] = Field(default=[], description="tables of exports")

    def logs(self, *roles: RoleName) -> list[str]:
        """The logs in these roles, in the order of the roles."""
        return [r.file for role in roles for r in self.recordings if r.role == role]

    @property
    def model(self) -> str | None:
        """The model that one goes on with: the last."""
        return self.models[-1].file if self.models else None

    def answer(self, kind: str) -> AnswerEntry | None:
        """The last answer of a command about the present model."""
        fitting = (
            a
            for a in reversed(self.answers)
            if a.command.split()[1] == kind and a.model == self.model
        )
        return next(fitting, None)

    def next_role(self) -> RoleName:
        """What one recording more is proposed for: fitted, then to choose, then to test."""
        have = {r.role for r in self.recordings}
        return next((role for role in ROLES if role not in have), ROLES[0])

    def text(self) -> str:
        """As it stands in the file."""
        document = tomlkit.document()
        document.add(tomlkit.comment(HEAD))
        for name, tables in self.model_dump(exclude_none=True).items():
            if tables:
                array = tomlkit.aot()
                for table in tables:
                    array.append(_table(table))
                document.add(name, array)
        return tomlkit.dumps(document)


Table = TypeVar("Table", bound=Entries)


def _table(values: Mapping[str, object]) -> tomlkit.items.Table:
    table = tomlkit.table()
    for key, value in values.items():
        if value == []:
            continue
        if isinstance(value, list) and isinstance(value[0], dict):
            rows = tomlkit.array()
            for row in value:
                rows.append(_inline(row))
            table.add(key, rows.multiline(True))
        else:
            table.add(key, value)
    return table


def _inline(values: Mapping[str, object]) -> tomlkit.items.InlineTable:
    table = tomlkit.inline_table()
    table.update({key: value for key, value in values.items() if value is not None})
    return table
