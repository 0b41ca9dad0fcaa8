"""How machines of a fleet stand, and that what is told of them comes back from its JSON."""

from __future__ import annotations

import json
from datetime import date
from math import inf, nan
from pathlib import Path

import pytest

import identify
from identify.output.answers.fleet import FloorAnswer
from identify.results.fleet import Alarm, Floor, MachineState, Off, Scope

NIGHT = date(2026, 3, 2)


def alarm(machine: str | None, strength: float, before: float = 0.31) -> Alarm:
    scope = Scope.HALL if machine is None else Scope.MACHINE
    return Alarm(
        machine, "x", "stage", "lugre.Fc", "N", NIGHT, NIGHT, NIGHT, NIGHT, before, 0.34, 0.03,
        0.004, strength, scope, None, ("lugre.Fs",),
    )  # fmt: skip


def state(name: str, faulty: int, alarms: tuple[Alarm, ...] = (), far: float = 0.0) -> MachineState:
    off = (Off(name, "x", "mass", "kg", 15.0, 14.0, far),) if far else ()
    return MachineState(name, "stage", 8, NIGHT, faulty, 1.07, alarms, off)


def test_alarms_come_before_what_is_off_and_that_before_bad_logs() -> None:
    quiet, torn = state("a", 0), state("b", 2)
    far, changed = state("c", 0, far=4.1), state("d", 0, (alarm("d", 3.0), alarm("d", 7.0)))
    assert quiet.attention == (0.0, 0.0, 0.0)
    assert torn.attention == (0.0, 0.0, pytest.approx(0.2))
    assert far.attention == (0.0, 4.1, 0.0)
    assert changed.attention == (7.0, 0.0, 0.0)
    ranked = sorted((quiet, torn, far, changed), key=lambda m: m.attention, reverse=True)
    assert [m.machine for m in ranked] == ["d", "c", "b", "a"]
    assert alarm("a", 1.0).relative == pytest.approx(0.03 / 0.31)
    assert alarm("a", 1.0, before=0.0).relative == inf


def test_what_is_told_of_a_fleet_comes_back_from_its_json(tmp_path: Path) -> None:
    machines = (state("d", 1, (alarm("d", 7.0, before=nan),), far=4.1), state("a", 0))
    floor = Floor(Path("store"), machines, (alarm(None, 2.0),), {}, {}, ("x.parquet: is cut off",))
    answer = FloorAnswer.of(floor, alarms=floor.alarms)
    (tmp_path / "answer.json").write_text(json.dumps(answer.entries()), encoding="utf-8")
    again = identify.load(tmp_path / "answer.json")
    assert again == answer
    told = again.entries()
    assert told["hall"][0]["machine"] is None
    assert told["machines"][0]["off"][0]["far"] == 4.1
    assert told["machines"][0]["alarms"][0]["before"] is None
    assert (told["alarms"][0]["night"], told["alarms"][0]["others"]) == ("2026-03-02", ["lugre.Fs"])
