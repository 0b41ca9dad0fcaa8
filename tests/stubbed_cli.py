"""The command line with its input stubbed: what a command was called with, and what it said."""

from __future__ import annotations

import sys
from contextlib import nullcontext
from pathlib import Path

import pytest

from identify.cli import loop, machine, main
from identify.cli import plan as plan_command
from twin.model.machine import MachineModel


class Stub:
    """Records how it was called, and answers what it was given."""

    def __init__(self, answer: object = None) -> None:
        self.answer, self.calls = answer, []

    def __call__(self, *given: object, **named: object) -> object:
        named.pop("progress", None)
        self.calls.append((given, named))
        return self.answer

    @property
    def only(self) -> tuple:
        (call,) = self.calls
        return call


def logs_of(paths: list[Path] | None) -> dict[str, str]:
    return {str(p): f"log {p}" for p in paths or ()}


def checked_logs_of(paths: list[Path] | None) -> tuple[dict[str, str], list[str]]:
    return logs_of(paths), [f"warned of {name}" for name in logs_of(paths)]


def stubbed(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture, folder: Path):
    """A function that runs `twin`: exit code, standard output and standard error."""
    monkeypatch.chdir(folder)
    for module in (loop, machine, plan_command):
        for name, answer in (
            (
                "machine_model",
                lambda name, catalogue: MachineModel(f"{name} {catalogue['all']}", {}),
            ),
            ("catalogue_with", lambda files: {"all": [str(f) for f in files or ()], "wear": "W"}),
            ("read_measured", lambda paths, beside=None: logs_of(paths)),
            (
                "read_checked",
                lambda paths, beside=None, refused=(): (
                    logs_of(paths),
                    [f"warned of {p}" for p in paths or ()],
                ),
            ),
            ("progress_on_stderr", lambda: nullcontext(Stub())),
        ):
            if hasattr(module, name):
                monkeypatch.setattr(module, name, answer)
    monkeypatch.setattr("identify.cli.shared.read_checked", loop.read_checked)
    monkeypatch.setattr(
        "identify.cli.shared.read_measured", lambda paths, beside=None: logs_of(paths)
    )
    monkeypatch.setattr("identify.cli.shared.progress_on_stderr", lambda: nullcontext(Stub()))

    def run(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["twin", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        return ended.value.code, out, err

    return run


def stub(monkeypatch, where: object, name: str, answer: object = None) -> Stub:
    made = Stub(answer)
    monkeypatch.setattr(where, name, made)
    return made
