"""Logs that say nothing, in every role of every command: one line each, and no number of none."""

from __future__ import annotations

import inspect
import re
import warnings
from collections.abc import Iterator
from itertools import cycle
from pathlib import Path

import numpy as np
import pytest
from cli_runs import Done, twin
from constructed import log_of
from planted_logs import RATE, SLIDE, Ride, having, logged

from identify.cli.shared import app
from twin.effects import Catalogue, load_catalogue
from twin.logs import Log, write_log
from twin.model.file import save_model
from twin.model.machine import MachineModel

ROLES = ("holdout", "test")
MOVED = logged(SLIDE, Ride(9, 3.0)).axes["x"]
T = np.arange(len(MOVED)) / RATE


def log(position: np.ndarray, force: np.ndarray, setpoint: np.ndarray | None = None) -> Log:
    return log_of(
        RATE, position, force, setpoint_position=position if setpoint is None else setpoint
    )


def once(seconds: float) -> np.ndarray:
    """One move, of 30 mm, in the middle of a rest."""
    done = np.clip((T - 1.0) / seconds, 0.0, 1.0)
    return 0.03 * done**3 * (10.0 - 15.0 * done + 6.0 * done**2)


def jogs() -> np.ndarray:
    """Moves of 80 ms, between which it rests."""
    speed = np.where(T % 0.3 < 0.08, np.sin(np.pi * T / 0.08) ** 2, 0.0)
    return 0.1 / RATE * np.cumsum(speed * (1.0 - 2.0 * (T // 0.3 % 2.0)))


def driven(position: np.ndarray) -> np.ndarray:
    """The force of the slide on a motion, without any noise."""
    speed = np.gradient(position, T)
    return SLIDE.mass * np.gradient(speed, T) + 0.31 * np.sign(speed) + 0.53 * speed


NOISE = np.random.default_rng(3).standard_normal((2, len(T)))
LOGS = {
    "rest": log(0.0 * T, 0.0 * T),
    "noise": log(0.02 + 1e-7 * NOISE[0], 1.3 + 5e-3 * NOISE[1], 0.02 + 0.0 * T),
    "blocked": log(0.02 + 0.0 * T, np.sin(7.0 * T), 0.02 + 0.01 * np.sin(7.0 * T)),
    "unforced": log(MOVED.position, 0.0 * T),
    "one": log(T[:1], 1.0 + T[:1]),
    "two": log(T[:2], 1.0 + T[:2]),
    "move": log(once(0.5), driven(once(0.5))),
    "jogs": log(jogs(), driven(jogs())),
    "cruise": log(0.01 * T, 0.3 + 0.0 * T),
    "creep": log(0.01 * T, 0.3 + 5e-3 * NOISE[1]),
}
LEFT_OUT = ("rest", "noise", "blocked", "unforced", "one", "two")  # say nothing to a fit
UNMOVED = ("rest", "noise", "one", "two")  # nor to who only follows the motion

# Of each command that takes logs what else it is given; L stands for the logs.
COMMANDS = {
    "add": "add quadratic_drag m.toml L -o added.toml",
    "agree": "agree m.toml controller L",
    "check": "check L",
    "compare": "compare m.toml L -o page.html --mcap both.mcap",
    "cut": "cut L -o part.mcap",
    "diagnose": "diagnose m.toml L -o page.html",
    "export": "export m.toml --to csv -o table L",
    "feedforward": "feedforward m.toml L",
    "fit": "fit m.toml L -o fitted.toml",
    "frf": "frf m.toml L -o response.csv",
    "info": "info L",
    "new": "new L -o new.toml",
    "plan": "plan m.toml L --duration 1 -o next.toml",
    "remove": "remove coulomb_viscous m.toml L -o less.toml",
    "recover": "recover L -o whole.mcap",
    "view": "view L m.toml --html view.html",
    "watch": "watch L m.toml",
}
ONE_LOG = ("recover", "view", "export", "cut", "watch")
FEW = ("coulomb_viscous", "quadratic_drag", "wear", "empirical_map")
FITTED = ("fit", "compare", "diagnose", "add", "remove", "plan", "new")


def takes_logs() -> dict[str, set[str]]:
    """The commands that take logs, with their parameters."""
    every = {}
    for info in app.registered_commands:
        known = set(inspect.signature(info.callback).parameters)
        if known & {"log", "logs", *ROLES}:
            every[info.name or info.callback.__name__] = known
    return every


def uses() -> Iterator[tuple[str, str]]:
    """Each role of each command, as what stands for L: N is the log that says nothing."""
    for command, parameters in takes_logs().items():
        yield command, "N"
        if command not in ONE_LOG:
            yield command, "a N"
        roles = [role for role in ROLES if role in parameters]
        yield from ((command, f"a --{role} N") for role in roles)
        if roles:
            given = (f"--{role} {'ab'[i]}" for i, role in enumerate(roles))
            yield command, " ".join(["N", *given])


USES = sorted(uses())
SOME = list(zip(USES, cycle(LOGS)))  # each role once, with one log after the other
ALL = [(use, name) for use in USES for name in LOGS if (use, name) not in SOME]


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Two logs of a slide with a drag that its model lacks, the silent logs, a controller of it."""
    path = tmp_path_factory.mktemp("silent")
    save_model(MachineModel("slide", {"x": SLIDE}, RATE), path / "m.toml")
    for seed, name in enumerate("ab", start=1):
        own = logged(having(SLIDE, "quadratic_drag", c=3.0), Ride(seed, 4.0)).axes["x"]
        write_log(log(own.position, own.force), path / f"{name}.mcap")
    for name, silent in LOGS.items():
        write_log(silent, path / f"{name}.mcap")
    assert twin("export", "m.toml", "--to", "c", "-o", "controller", folder=path).returncode == 0
    return path


def run(folder: Path, monkeypatch: pytest.MonkeyPatch, use: tuple[str, str], name: str) -> Done:
    def few(user_files: object = ()) -> Catalogue:
        return Catalogue([e for n, e in load_catalogue().items() if n in FEW])

    monkeypatch.delenv("TWIN_TRACEBACK", raising=False)
    monkeypatch.setattr("twin.effects.load_catalogue", few)
    command, given = use
    logs = re.sub(r"\b(N|[ab])\b", lambda m: f"{name if m[0] == 'N' else m[0]}.mcap", given)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        return twin(*COMMANDS[command].replace("L", logs, 1).split(), folder=folder)


def sound(done: Done, command: str, given: str, name: str) -> None:
    """One line that refuses it, or an answer, that says of a silent log that it is left out."""
    lines = [line for line in done.stderr.splitlines() if not line.endswith("so far)")]
    assert all(line.startswith("twin: ") for line in lines), done.stderr
    assert "fault of the program" not in done.stderr
    if done.returncode == 2:
        assert len(lines) == 1, done.stderr
        assert done.stdout == ""
        return
    assert not re.search(r"\b(nan|inf)\b", done.stdout), done.stdout
    intervals = re.findall(r"90 % in (\S+) to (\S+)", done.stdout)
    assert all(low != high for low, high in intervals), done.stdout
    if re.search(r"error( on the \w+ logs)? 0 m?N\b", done.stdout):
        assert not intervals, done.stdout
    silent = {"feedforward": UNMOVED, **dict.fromkeys(FITTED, LEFT_OUT)}.get(command, ())
    if name in silent:
        assert given != "N", done.stdout  # nothing is answered by it alone
        assert f"twin: {name}.mcap is left out: " in done.stderr


def test_every_command_that_takes_logs_is_here():
    assert set(COMMANDS) == set(takes_logs())


@pytest.mark.short(14)
@pytest.mark.parametrize(("use", "name"), SOME, ids=str)
def test_a_log_that_says_nothing_is_told_in_one_line(folder, monkeypatch, use, name):
    sound(run(folder, monkeypatch, use, name), *use, name)


@pytest.mark.slow
@pytest.mark.parametrize(("use", "name"), ALL, ids=str)
def test_every_such_log_in_every_role(folder, monkeypatch, use, name):
    sound(run(folder, monkeypatch, use, name), *use, name)
