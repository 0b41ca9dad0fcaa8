"""The import map: what it accepts, and the one line that it answers to everything else."""

import re
from pathlib import Path

import numpy as np
import pytest
from import_cases import mapping, write_csv

from twin.errors import InputError
from twin.importers import import_log, load_mapping
from twin.importers.mapping import PER_ENCODER
from twin.importers.units import find_unit

GOOD = """
sample_rate = 1000.0
[axes.x]
position = {column = "q", unit = "mm"}
force = {column = "u", unit = "V", scale = 35.0}
"""


def test_the_map_keeps_its_text_and_names_its_columns_once(tmp_path: Path) -> None:
    text = GOOD + '[axes.y]\nposition = {column = "q", unit = "m"}\n'
    text += 'current = {column = 3, unit = "mA"}\nforce_constant = 53.4\n'
    found = mapping(tmp_path, text)
    assert found.text == text
    assert found.column_names() == ("q", "u", "3")
    assert found.sample_rate == 1000.0
    assert found.axes["y"].force_constant == 53.4
    assert found.axes["x"].units["force"] == "N"


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
        mapping(tmp_path, text)
    assert "map.toml" in str(raised.value)
    assert "\n" not in str(raised.value)


RATE, AXIS, MM, VOLTS = "sample_rate = 1000.0", "[axes.x]", '"mm"', '"V", scale = 35.0'
BOUNDS = {
    "sample_rate": (RATE, "sample_rate = ?", 1e-3, 0.0),
    "resample": (RATE, 'resample = ?\ntime = {column = "t", unit = "s"}', 1e-3, 0.0),
    "step": (RATE, 'time = {column = "n", step = ?}', 1e-6, 0.0),
    "header_line": (AXIS, f"header_line = ?\n{AXIS}", 1, 0),
    "rows": (AXIS, f"rows = [?, 50]\n{AXIS}", 1, 0),
    "force_constant": (AXIS, f"{AXIS}\nforce_constant = ?", 1e-3, 0.0),
    **{name: (MM, f'"counts", {name} = ?', 0.5, 0.0) for name in PER_ENCODER},
    **{f"{name} of an axis": (f'{AXIS}\nposition = {{column = "q", unit = {MM}',
                              f'{AXIS}\n{name} = ?\nposition = {{column = "q", unit = "counts"',
                              0.5, 0.0) for name in PER_ENCODER},
    "wraps": (MM, f"{MM}, wraps = ?", 0.5, 0.0),
    "earliest": (MM, f"{MM}, delay_samples = ?", -1_000_000, -1_000_001),
    "latest": (MM, f"{MM}, delay_samples = ?", 1_000_000, 1_000_001),
    "file": (MM, f"{MM}, file = ?", 1, 0),
    "files": (MM, f"{MM}, file = ?", None, 1001),
}  # fmt: skip


@pytest.mark.parametrize("entry", BOUNDS)
def test_a_number_is_taken_to_its_bound_and_not_beyond(tmp_path: Path, entry: str) -> None:
    old, new, allowed, refused = BOUNDS[entry]
    text = replaced(old, new).replace(VOLTS, '"N m"' if "turn" in entry else '"N"')
    if allowed is not None:
        mapping(tmp_path, text.replace("?", str(allowed)))
    with pytest.raises(InputError, match=rf"{refused}\b.*: give "):
        mapping(tmp_path, text.replace("?", str(refused)))


def test_a_missing_map_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.toml: cannot be read"):
        load_mapping(tmp_path / "none.toml")


RATIOS = np.array([[45.0, 0.0], [32.0, -32.0]])  # motor turns a joint turn; the wrist is coupled
GEARS = ("{elbow = 45.0}", "{elbow = 32.0, wrist = -32.0}")


def imported(folder, gears=GEARS, wrist_velocity=True):
    """What the importer makes of the motors' columns of two joints; and these, (2, 3, n)."""
    rng = np.random.default_rng(3)
    position, velocity, torque = rng.normal(size=(3, 2, 100))
    motors = np.stack([RATIOS @ position, RATIOS @ velocity, np.linalg.solve(RATIOS.T, torque)])
    names = [f"{signal}{i}" for signal in "pvt" for i in range(2)]
    write_csv(folder / "log.csv", dict(zip(names, motors.reshape(6, -1), strict=True)))
    text = "sample_rate = 1000.0\n"
    for i, (axis, gear) in enumerate(zip(("elbow", "wrist"), gears, strict=True)):
        text += f'[axes.{axis}]\ngear = {gear}\nposition = {{column = "p{i}", unit = "rad"}}\n'
        if wrist_velocity or i == 0:
            text += f'velocity = {{column = "v{i}", unit = "rad/s"}}\n'
        text += f'current = {{column = "t{i}", unit = "A"}}\nforce_constant = 0.5\n'
    log = import_log(folder / "log.csv", mapping(folder, text))
    return log, np.stack([position, velocity, 0.5 * torque])


def test_joints_have_their_own_motion_and_torque(tmp_path):
    log, wanted = imported(tmp_path)
    for i, axis in enumerate(log.axes.values()):
        found = axis.position, axis.columns["velocity"], axis.force
        np.testing.assert_allclose(found, wanted[:, i], rtol=1e-9, atol=1e-12)
        assert axis.kind.rotary


@pytest.mark.parametrize(
    ("gears", "velocity", "said"),
    [
        (("{elbow = 1.0}", "{elbow = 2.0}"), True, "do not tell all joints"),
        (("{elbow = 1.0}", "{hand = 2.0}"), True, "has no axis 'hand'; it has elbow, wrist"),
        (GEARS, False, "axes.wrist: has no velocity, but is coupled"),
    ],
)
def test_what_cannot_be_brought_to_joints_is_one_line(tmp_path, gears, velocity, said):
    if not velocity:  # the elbow's motor turns with the wrist
        gears = ("{elbow = 45.0, wrist = 1.0}", gears[1])
    with pytest.raises(InputError, match=said):
        imported(tmp_path, gears, wrist_velocity=velocity)
