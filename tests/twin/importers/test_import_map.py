"""The import map: what it accepts, and the one line that it answers to everything else."""

import re
from pathlib import Path

import pytest

from twin.errors import InputError
from twin.importers import ImportMap, load_mapping
from twin.importers.mapping import find_unit

GOOD = """
sample_rate = 1000.0
[axes.x]
position = {column = "q", unit = "mm"}
force = {column = "u", unit = "V", scale = 35.0}
"""


def load(folder: Path, text: str) -> ImportMap:
    path = folder / "map.toml"
    path.write_text(text, encoding="utf-8")
    return load_mapping(path)


def test_the_map_keeps_its_text_and_names_its_columns_once(tmp_path: Path) -> None:
    text = GOOD + '[axes.y]\nposition = {column = "q", unit = "m"}\n'
    text += 'current = {column = 3, unit = "mA"}\nforce_constant = 53.4\n'
    mapping = load(tmp_path, text)
    assert mapping.text == text
    assert mapping.column_names() == ("q", "u", "3")
    assert mapping.sample_rate == 1000.0
    assert mapping.axes["y"].force_constant == 53.4
    assert mapping.axes["x"].units["force"] == "N"


@pytest.mark.parametrize(
    ("unit", "si", "answer"),
    [
        ("MM", "m", "did you mean 'mm'?"),
        ("mm/sek", "m/s", "did you mean 'mm/s'?"),
        ("Nm/", "N m", "did you mean 'Nm'?"),
        ("flurg", "m", "give a unit of m (m, cm, mm, um, nm, in, ...)"),
    ],
)
def test_an_unknown_unit_is_answered_with_the_nearest(unit: str, si: str, answer: str) -> None:
    with pytest.raises(InputError, match=re.escape(answer)):
        find_unit(unit, si)


def replaced(old: str, new: str) -> str:
    assert old in GOOD
    return GOOD.replace(old, new)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("sample_rate = ", "not a TOML file"),
        ("sample_rate = 1000.0", r"no \[axes"),
        ("axes = 3", "axes = 3: give a table"),
        (replaced("sample_rate", "samplerate"), "did you mean 'sample_rate'"),
        (replaced("1000.0", "0"), "sample_rate = 0: give .* above 0, in Hz"),
        (replaced("1000.0", "inf"), "sample_rate = inf: give a finite number"),
        (replaced("\n[axes.x]", '\ntime = {column = "t", unit = "s"}\n[axes.x]'), "both given"),
        (replaced("\n[axes.x]", '\ndelimiter = ";;"\n[axes.x]'), "one character"),
        (replaced("\n[axes.x]", '\ndecimal = ";"\n[axes.x]'), "'.' or ','"),
        (replaced("\n[axes.x]", "\nheader_line = 0\n[axes.x]"), "count from 1"),
        (replaced("axes.x", 'axes."a b"'), "axes.a b: give .* an axis name"),
        (replaced("position", "positon"), "axes.x: .*did you mean 'position'"),
        (replaced("force =", "velocity ="), "needs position and one of current and force"),
        (replaced(', unit = "mm"', ""), "axes.x: position: has no unit"),
        (replaced('"q"', "1.5"), "column = 1.5: give a name, or a number"),
        (replaced('"mm"', '"mn"'), "unit 'mn' is not known here; did you mean 'm"),
        (replaced(", scale = 35.0", ""), "unit 'V' needs a scale"),
        (replaced("35.0", "35.0, sign = 2"), "sign = 2: give 1 or -1"),
        (replaced("35.0", "35.0, delay_samples = 0.5"), "delay_samples = 0.5: give a whole"),
        (replaced('"V", scale = 35.0', '"N m"'), "position has a linear unit, force a rotary"),
        (replaced("[axes.x]", "[axes.x]\nforce_constant = -1"), "force_constant = -1: .*N/A"),
    ],
)
def test_a_wrong_map_is_refused_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as raised:
        load(tmp_path, text)
    assert "map.toml" in str(raised.value)
    assert "\n" not in str(raised.value)


def test_a_missing_map_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.toml: cannot be read"):
        load_mapping(tmp_path / "none.toml")
