"""The command line run by the tests: as a process of its own, or within this one and in small."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import chdir, contextmanager, redirect_stderr, redirect_stdout
from dataclasses import replace
from io import StringIO
from pathlib import Path
from unittest.mock import patch

import pytest

from identify.cli import main
from identify.experiment_design.candidate_experiments import proposals
from twin.effects import Catalogue, load_catalogue
from twin.experiments.experiment import Experiment
from twin.model.file import load_model
from twin.model.machine import MachineModel

Done = subprocess.CompletedProcess[str]
RATE = 2500.0  # Hz, of the stages in small


def process(*arguments: object, folder: Path) -> Done:
    """Run `twin` in a folder as its own process, as a user does; it takes a second to start."""
    return subprocess.run(
        [sys.executable, "-c", "from identify.cli import main; main()", *map(str, arguments)],
        cwd=folder, capture_output=True, text=True, check=False,
    )  # fmt: skip


def twin(*arguments: object, folder: Path) -> Done:
    """The same within this process."""
    out, err = StringIO(), StringIO()
    command = ["twin", *map(str, arguments)]
    with (
        chdir(folder), redirect_stdout(out), redirect_stderr(err),
        patch.object(sys, "argv", command), pytest.raises(SystemExit) as ended,
    ):  # fmt: skip
        main()
    assert isinstance(ended.value.code, int)
    return Done(command, ended.value.code, out.getvalue(), err.getvalue())


def refusal(*arguments: object, folder: Path) -> str:
    """The one line on standard error of a refused command; nothing else may have happened."""
    before = sorted(folder.iterdir())
    done = twin(*arguments, folder=folder)
    assert done.returncode == 2, done.stderr
    assert done.stdout == ""
    lines = [line for line in done.stderr.splitlines() if not line.endswith("so far)")]
    assert len(lines) == 1, done.stderr  # beside what a slow machine says of its progress
    assert lines[0].startswith("twin: ")
    assert sorted(folder.iterdir()) == before, "something was written"
    return lines[0]


@contextmanager
def in_small(*rivals: str, duration: float = 5.0, proposed: int = 4) -> Iterator[None]:
    """Everything smaller, so that whole commands run in a second or two.

    The catalogue holds the rivals and the stage's own effects; named experiments last that long (s)
    by default; stages have a quarter of their sample rate; a plan tries about so many experiments.
    """

    def few(user_files: Sequence[Path] = ()) -> Catalogue:
        known = load_catalogue(user_files)
        own = {f for axis in load_model("proton_xy", known).axes.values() for f in axis.names}
        yours = {Path(f).stem for f in user_files}
        return Catalogue([e for n, e in known.items() if n in {*rivals, *own, *yours}])

    def slower(name: str | Path, catalogue: Catalogue) -> MachineModel:
        return replace(load_model(name, catalogue), sample_rate=RATE)

    def fewer(model: MachineModel, axis: str, seconds: float) -> list[Experiment]:
        every = proposals(model, axis, seconds)
        return every[:: max(len(every) // proposed, 1)]

    with (
        patch("twin.effects.load_catalogue", few),
        patch("twin.model.file.load_model", slower),
        patch("identify.experiment_design.plan.proposals", fewer),
        patch("twin.experiments.named.DURATION", duration),
        patch("twin.simulation.simulate.DURATION", duration),
    ):
        yield
