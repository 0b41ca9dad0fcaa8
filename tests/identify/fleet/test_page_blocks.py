"""What the page of a fleet shows of made-up machines: its tables, sentences and charts."""

from __future__ import annotations

import html
import json
import re
from dataclasses import replace
from datetime import date, timedelta
from pathlib import Path

import numpy as np
import pytest

from identify.output.shown.fleet import write_fleet
from identify.results.fleet import Alarm, Course, Floor, MachineState, Off, Scope

FIRST = date(2026, 3, 1)
DAYS = (FIRST - date(1970, 1, 1)).days + np.arange(12.0)
NIGHTS = [FIRST + timedelta(days=i) for i in range(12)]
RISING = np.where(np.arange(12) < 7, 0.31, 0.37)
COURSE = Course(
    "x", "lugre.Fc", "N", DAYS, 3.0 * np.arange(1.0, 13.0), RISING + 0.02, RISING,
    np.full(12, 0.004), np.full(12, 0.305),
)  # fmt: skip
ERROR = Course(
    "x", "force_error", "N", DAYS, 3.0 * np.arange(1.0, 13.0), np.full(12, 0.0031),
    np.full(12, 0.0031), np.full(12, np.nan), np.full(12, 0.0029),
)  # fmt: skip
ALARM = Alarm(
    "m1", "x", "stage", "lugre.Fc", "N", NIGHTS[9], NIGHTS[7], NIGHTS[6], NIGHTS[8], 0.31, 0.37,
    0.06, 0.003, 7.1, Scope.MACHINE, None, ("mass",),
)  # fmt: skip
HALL = replace(ALARM, machine=None, parameter="mass", unit="kg", scope=Scope.HALL, others=())
OFF = Off("m2", "x", "mass", "kg", 17.0, 15.0, 4.7)
CHANGED = MachineState("m1", "stage", 12, NIGHTS[11], 2, 1.23, (ALARM,), ())
APART = MachineState("m2", "stage", 11, NIGHTS[10], 0, 1.07, (), (OFF,))
WELL = MachineState("m3", "", 0, None, 0, 1.0, (), ())
FLOOR = Floor(
    Path("store"), (CHANGED, APART, WELL), (HALL,),
    {"m1": (ERROR, COURSE), "m2": (COURSE, ERROR)}, {ALARM: ("wear", "gms")}, ("x: cut off",),
)  # fmt: skip


def written(floor: Floor, folder: Path) -> dict[str, str]:
    """The sections of the page by their anchors, and all of it by "page"."""
    write_fleet(folder / "fleet.html", floor)
    text = (folder / "fleet.html").read_text(encoding="utf-8")
    body = text[text.index("<body>") :]
    parts = re.split(r'<section id="([\w-]+)"', body)
    return {"page": body, **dict(zip(parts[1::2], parts[2::2], strict=True))}


@pytest.fixture(scope="module")
def shown(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    return written(FLOOR, tmp_path_factory.mktemp("page"))


def rows(section: str) -> list[list[str]]:
    """The cells of the tables of a section."""
    found = re.findall(r"<tr.*?>(.*?)</tr>", section, re.DOTALL)
    cells = (re.findall(r"<t[dh].*?>(.*?)</t[dh]>", row, re.DOTALL) for row in found)
    plain = ([html.unescape(re.sub("<.*?>", "", c)).strip() for c in row] for row in cells)
    return [row for row in plain if row]


def charts(section: str) -> list[dict]:
    return [json.loads(html.unescape(c)) for c in re.findall(r'data-chart="(.*?)"', section)]


def test_the_answer_counts_machines_and_names_those_to_look_at(shown, tmp_path) -> None:
    answer = re.sub(r"\s+", " ", re.sub("<.*?>", " ", shown["answer"]))
    assert "1 of 3 machines changed" in answer
    assert "Look first at m1. What all machines did at once" in answer
    for tile in (
        "Machines that changed 1 of 3", "Off from their kind 1 by more", "hall 1 in all",
        "Bad logs 2 were not fitted",
    ):  # fmt: skip
        assert tile in answer
    several = [replace(CHANGED, machine=f"n{i}") for i in range(7)]
    many = written(replace(FLOOR, machines=tuple(several), hall=()), tmp_path)["answer"]
    assert "Look first at n0, n1, n2, n3 and n4 and 2 more." in many
    assert "What all machines did" not in many
    quiet = written(replace(FLOOR, machines=(WELL,), hall=()), tmp_path)
    assert "No machine has changed." in quiet["answer"]
    assert "None." in quiet["alarms"]


def test_alarms_are_a_table_those_of_the_hall_first(shown) -> None:
    head, hall, own = rows(shown["alarms"])
    assert head[:3] == ["Machine", "What", "Axis"]
    assert hall[:3] == ["hall (all of kind stage)", "mass", "x"]
    assert hall[-2:] == ["–", "–"]
    assert own == [
        "m1", "lugre.Fc", "x", "2026-03-08 (2026-03-07 to 2026-03-09)", "60.0 ± 3.0 mN (+19 %)",
        "2026-03-10", "mass", "wear and gms",
    ]  # fmt: skip


def test_machines_are_a_table_with_what_they_need_attention_for(shown) -> None:
    _, changed, apart, well = rows(shown["machines"])
    assert changed == ["m1", "stage", "lugre.Fc, 2 bad logs", "12", "2026-03-12", "1.2", "2"]
    assert apart == ["m2", "stage", "mass off from its kind", "11", "2026-03-11", "1.1", "0"]
    assert well == ["m3", "–", "–", "0", "–", "1.0", "0"]
    assert "more machines are not shown" not in shown["machines"]


def test_of_very_many_machines_some_are_shown_and_the_others_counted(tmp_path) -> None:
    many = tuple(replace(WELL, machine=f"w{i}") for i in range(207))
    found = written(replace(FLOOR, machines=(CHANGED, *many)), tmp_path)["machines"]
    assert len(rows(found)) == 1 + 1 + 200
    assert "7 more machines are not shown" in found


def test_a_machine_is_told_in_sentences_and_its_parameters_in_a_table(shown) -> None:
    first, second = shown["machine-0"], shown["machine-1"]
    assert "<li>m1: lugre.Fc of axis x rose on 2026-03-08 (" in first
    assert "a diagnosis of the nights after it names wear and gms" in html.unescape(first)
    assert "Mass of axis x is 17.0 kg, of its kind 15.0 kg is usual: 4.7 standard" in second
    _, error, friction = rows(first)
    assert error[0] == "force error of the fit, axis x"
    assert friction == [
        "lugre.Fc, axis x", "310 mN", "370 mN", "305 mN", "36.0 m",
    ]  # fmt: skip


def test_what_changed_is_drawn_first_over_time_and_over_distance(shown) -> None:
    time, distance, error = charts(shown["machine-0"])
    assert time["x"]["label"] == "Night (month-day)"
    assert time["x"]["values"] == pytest.approx(86_400.0 * DAYS)
    assert distance["x"]["label"] == "Travelled in its logs (m)"
    assert distance["x"]["values"] == pytest.approx(COURSE.distance)
    assert error["x"]["label"] == "Night (month-day)"
    drawn = {s["label"]: s["values"] for s in time["series"]}
    assert drawn["as fitted"] == pytest.approx(1e3 * COURSE.values)
    assert drawn["less what all machines do"] == pytest.approx(1e3 * RISING)
    assert drawn["median of its kind"] == pytest.approx([305.0] * 12)
    assert drawn["level before and after 2026-03-08"] == pytest.approx([310.0] * 7 + [370.0] * 5)
    assert drawn["90 % band within the log, high end"] == pytest.approx(1e3 * (RISING + 0.024))
    assert drawn["90 % band within the log, low end"] == pytest.approx(1e3 * (RISING + 0.016))
    labels = [s["label"] for s in error["series"]]
    assert labels == ["as fitted", "median of its kind"]


def test_of_a_machine_that_is_well_its_error_is_drawn(shown) -> None:
    (only,) = charts(shown["machine-1"])
    assert only["series"][0]["values"] == pytest.approx([3.1] * 12)


def test_a_page_tells_its_store_its_last_night_and_its_faults(shown) -> None:
    page = re.sub(r"\s+", " ", re.sub("<.*?>", " ", shown["page"]))
    assert "2026-03-12" in page
    assert "x: cut off" in page
