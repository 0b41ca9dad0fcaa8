"""Every command that is printed on the way from a recording to a better model is run as it stands.

A walk begins with recordings of a machine of one axis, or of two that turn, whose names hurt; what
a command prints is run next, and what that prints, until nothing new is printed.
"""

import re
import shlex
from collections.abc import Iterator, Mapping
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from cli_runs import Done, twin

from twin.effects import load_catalogue
from twin.model.file import load_model
from twin.simulation.simulate import simulate

DRIVE = Path(__file__).parents[2] / "examples" / "drive.toml"
RATE = 500.0  # Hz, of the recordings
ONE = ("MODEL_A", "Lauf 1 für Übung", "it's $HOME")
TWO = ("LOG...", "MODEL", "ü,1 [a]")
MOST = 12  # commands of a walk


def recorded(experiment: str, seed: int, seconds: float) -> dict[str, np.ndarray]:
    """Signals of a drive with cogging that its first model lacks."""
    machine = load_model(DRIVE, load_catalogue())
    log = simulate(machine, experiment, seed=seed, duration=seconds)
    every, x = round(machine.sample_rate / RATE), log.axes["x"]
    named = {"Position": x.position, "Setpoint": x.columns["setpoint_position"], "Force": x.force}
    return {name: column[::every] for name, column in named.items()}


def write(path: Path, columns: Mapping[str, np.ndarray]) -> None:
    count = min(len(c) for c in columns.values())
    table = [np.arange(count) / RATE, *(c[:count] for c in columns.values())]
    lines = [";".join(("t [s]", *columns))]
    lines += [";".join(f"{v:.7f}" for v in row) for row in zip(*table, strict=True)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def one_axis(folder: Path, seconds: float) -> tuple[str, ...]:
    runs = (("moves", 1), ("tracking", 2), ("tracking", 3))
    for name, (experiment, seed) in zip(ONE, runs, strict=True):
        x = recorded(experiment, seed, seconds)
        units = {"Position": (1e3, "mm"), "Setpoint": (1e3, "mm"), "Force": (1.0, "N")}
        write(folder / f"{name}.csv", {f"{n} [{units[n][1]}]": units[n][0] * c
                                       for n, c in x.items()})  # fmt: skip
    return ONE


def two_axes(folder: Path, seconds: float) -> tuple[str, ...]:
    both = {"A": (("moves", 1), ("tracking", 2), ("tracking", 3)),
            "B": (("tracking", 12), ("moves", 11), ("tracking", 13))}  # fmt: skip
    units = {"Position": ("Winkel", "rad"), "Setpoint": ("Sollwinkel", "rad"),
             "Force": ("Moment", "Nm")}  # fmt: skip
    for number, name in enumerate(TWO):
        columns = {
            f"{units[n][0]} {axis} [{units[n][1]}]": c
            for axis, runs in both.items()
            for n, c in recorded(*runs[number], seconds).items()
        }
        write(folder / f"{name}.csv", columns)
    return TWO


def printed_in(done: Done) -> Iterator[str]:
    """The commands in what a command says."""
    text = f"{done.stdout}\n{done.stderr}"
    for pattern in (
        r"`(twin [^`\n]* [^`\n]*)`",
        r"(?m)^\s*next: (twin .*)$",
        r"(?m)^  (twin import .*)$",
    ):
        yield from re.findall(pattern, text)


def walked(start: list[str], folder: Path) -> list[list[str]]:
    """The commands that were run; fails where one does not work, or writes nothing that it says."""
    waiting, done = list(start), dict[str, list[str]]()
    while waiting and len(done) < MOST:
        command = waiting.pop(0)
        if command in done:
            continue
        words = done[command] = shlex.split(command)
        ran = twin(*words[1:], folder=folder)
        assert ran.returncode == 0, f"{command}\n{ran.stdout}\n{ran.stderr}"
        outputs = [w for option, w in pairwise(words) if option == "-o"]
        assert all((folder / name).exists() for name in outputs), command
        waiting += printed_in(ran)
    return list(done.values())


def beginning(folder: Path, names: tuple[str, ...]) -> list[str]:
    """Import by a proposed map, check, and a first model, of files with these names."""
    first, *others = names
    logs = [f"{name}.mcap" for name in names]
    imports = [("import", "--yes", f"{first}.csv", "-o", logs[0])]
    imports += [
        ("import", f"{name}.csv", "--map", f"{first}.map.toml", "-o", f"{name}.mcap")
        for name in others
    ]
    return [shlex.join(("twin", *c)) for c in (
        *imports, ("check", *logs), ("new", *logs, "-o", "MODEL é.toml"))]  # fmt: skip


@pytest.mark.short(1)
@pytest.mark.parametrize("machine", [two_axes, one_axis])
def test_what_is_printed_before_a_diagnosis_works(tmp_path, machine):
    names = machine(tmp_path, 3.0)
    done = walked(beginning(tmp_path, names)[:-1], tmp_path)
    assert [words[1] for words in done] == ["import"] * 3 + ["check"]
    new = twin("new", *(f"{n}.mcap" for n in names), "-o", "m ü.toml", folder=tmp_path)
    (command,) = (c for c in printed_in(new) if c.startswith("twin diagnose"))
    logs = [f"{n}.mcap" for n in names]
    roles = [logs[0], "--holdout", logs[1], "--test", logs[2]]
    assert shlex.split(command) == ["twin", "diagnose", "m ü.toml", *roles]


@pytest.mark.slow
@pytest.mark.parametrize("machine", [one_axis, two_axes])
def test_every_command_that_is_printed_works(tmp_path, machine):
    done = walked(beginning(tmp_path, machine(tmp_path, 6.0)), tmp_path)
    assert [words[1] for words in done].count("diagnose") >= 2, "the last writes the model"
