"""A proposed map reads the file that it was proposed for, and says what it assumes."""

import json
import re
import tomllib
from pathlib import Path

import cli_runs
import numpy as np
import pytest
from import_cases import guess_map, mapping, write_csv
from scipy.io import savemat

from twin.checks import Fault, check_log
from twin.checks.content import assumptions
from twin.errors import InputError
from twin.importers import import_log
from twin.logs import read_log, write_log
from twin.model.file import save_model
from twin.model.machine import AxisModel, MachineModel

T = np.arange(4000) / 1000.0
Q = 0.05 * np.sin(5.0 * T) + 0.02 * np.sin(13.0 * T)
V = 0.25 * np.cos(5.0 * T) + 0.26 * np.cos(13.0 * T)
F = 3.0 * np.gradient(V, T) + 2.0 * np.sign(V) + 5.0 * V
NOISE = np.random.default_rng(3).standard_normal(len(T))


def columns_of(text: str) -> dict[str, dict[str, str]]:
    """Axis -> field -> column, also of a map that asks for a scale."""
    return {
        axis: {field: table["column"] for field, table in entry.items() if isinstance(table, dict)}
        for axis, entry in tomllib.loads(text)["axes"].items()
    }


def trailing(column, samples=25):
    """A loop that is so many samples behind its setpoint, a little smaller, read with noise."""
    late = np.r_[np.full(samples, column[0]), column[:-samples]]
    return 0.97 * late + 1e-5 * np.std(column) * NOISE


GOAL, RATE_OF_GOAL, REACHED, SPEED = Q, V, trailing(Q), trailing(V)
PUSH = 3.0 * np.gradient(SPEED, T) + 2.0 * np.sign(SPEED) + 5.0 * SPEED
MOVES_A_MASS = 20.0 * np.gradient(SPEED, T) + 2.0 * np.sign(SPEED)


@pytest.mark.parametrize(
    ("columns", "expected", "told"),
    [
        ({"time [ms]": 1e3 * T, "pos [mm]": 1e3 * Q, "force [N]": F, "ref_pos [mm]": 1e3 * Q},
         {"x": {"position": "pos [mm]", "force": "force [N]",
                "setpoint_position": "ref_pos [mm]"}}, ""),
        ({"t": T, "qm": Q, "qg": Q + 1e-6 * NOISE, "vir": F, "temp": NOISE},
         {"x": {"position": "qm", "setpoint_position": "qg", "force": "vir",
                "temperature": "temp"}}, 'temperature = {column = "temp", unit = "degC"}'),
        ({"t": T, "Weg [mm]": 1e3 * Q, "Kraft [N]": F, "p_A [bar]": 4.0 + 0.01 * F,
          "Druck B [bar]": 4.0 - 0.01 * F, "Versorgungsdruck max [bar]": 6.0 + 0.1 * NOISE},
         {"x": {"position": "Weg [mm]", "force": "Kraft [N]", "pressure": "p_A [bar]",
                "pressure_2": "Druck B [bar]"}}, ""),
        ({"Time": 1.7e9 + T, "xPos_mm": 1e3 * Q, "yPos_mm": 1e3 * V, "xCurrent_A": F,
          "yCurrent_A": NOISE},
         {"x": {"position": "xPos_mm", "current": "xCurrent_A"},
          "y": {"position": "yPos_mm", "current": "yCurrent_A"}}, ""),
        ({"one": T, "two": NOISE, "three": V, "four": Q, "five": F},
         {"x": {"position": "four", "velocity": "three", "force": "five"}}, ""),
        ({"one": T, "two": F, "three": NOISE, "four": Q},
         {"x": {"position": "four", "force": "two"}}, "likely: the motion explains 100 % of it"),
        # what follows the position is its setpoint and no force
        ({"a": T, "b": REACHED, "c": SPEED, "d": GOAL, "e": PUSH},
         {"x": {"position": "b", "velocity": "c", "setpoint_position": "d", "force": "e"}},
         "goes as the position, 25 ms ahead of it"),
        ({"a": T, "b": GOAL, "c": RATE_OF_GOAL, "d": REACHED, "e": SPEED, "f": PUSH},
         {"x": {"position": "d", "velocity": "e", "setpoint_position": "b",
                "setpoint_velocity": "c", "force": "f"}}, "setpoint_velocity"),
        ({"a": T, "b": GOAL, "c": REACHED, "d": MOVES_A_MASS},
         {"x": {"position": "c", "setpoint_position": "b", "force": "d"}}, "explains 100 % of d"),
        ({"t": T, "angle": REACHED, "u": 180.0 / np.pi * GOAL, "w": PUSH},
         {"x": {"position": "angle", "setpoint_position": "u", "force": "w"}}, 'unit = "deg"'),
        ({"t": T, "present_position": REACHED, "goal": GOAL, "load": PUSH},
         {"x": {"position": "present_position", "setpoint_position": "goal", "force": "load"}}, ""),
        ({"t": T, "pos": REACHED, "push": 40.0 * REACHED + 0.1 * PUSH},
         {"x": {"position": "pos", "force": "push"}}, ""),  # a spring's, of another size
    ],
)  # fmt: skip
def test_names_and_numbers_tell_the_signals(tmp_path, columns, expected, told):
    write_csv(tmp_path / "a.csv", columns)
    found = guess_map(tmp_path / "a.csv")
    assert columns_of(found.text) == expected
    assert told in found.text
    assert "resample" not in found.text  # the steps are even
    # the force of a column that says nothing of one is in a unit that nobody knows
    asked = [what for what in found.missing if "the scale of its force is not known" in what]
    assert list(found.missing) == asked
    text = found.text.replace('unit = "1"', 'unit = "1", scale = 1.0') if asked else found.text
    log = import_log(tmp_path / "a.csv", mapping(tmp_path, text))
    assert log.sample_rate == 1000.0
    moved = log.axes["x"].position
    assert min(np.abs(moved - column).max() for column in (Q, REACHED)) < 1e-9


def test_a_table_may_have_neither_names_nor_a_velocity(tmp_path):
    table = np.column_stack([T, GOAL, REACHED, MOVES_A_MASS])
    np.savetxt(tmp_path / "a.csv", table, delimiter=",")
    found = columns_of(guess_map(tmp_path / "a.csv").text)
    assert found == {"x": {"position": "3", "setpoint_position": "2", "force": "4"}}


def test_a_setpoint_alone_is_no_force(tmp_path):
    write_csv(tmp_path / "a.csv", {"t": T, "pos": REACHED, "u": GOAL})
    assert guess_map(tmp_path / "a.csv").missing == (
        "axis x: no column of pos, u looks like a force",
    )


def test_what_is_assumed_and_what_is_missing_is_said(tmp_path):
    savemat(tmp_path / "a.mat", {"t": T, "angle": 100.0 * Q, "speed": 200.0 * V, "label": "abc"})
    found = guess_map(tmp_path / "a.mat")
    assert found.missing == ("axis x: no column of angle, speed looks like a force",)
    assert "one of it is 0.5 rad/s by the position: correct one of the units" in found.text
    assert found.text.count("ASSUMED") == 3  # the first line says it too


def test_uneven_times_are_resampled(tmp_path):
    t = T + 2e-4 * np.random.default_rng(1).uniform(-1.0, 1.0, len(T))
    write_csv(tmp_path / "a.csv", {"t": t, "pos": Q, "force": F})
    text = guess_map(tmp_path / "a.csv").text
    assert "resample = 1000 " in text
    assert import_log(tmp_path / "a.csv", mapping(tmp_path, text)).sample_rate == 1000.0


def test_public_recordings(shared_data, tmp_path):
    emps = columns_of(guess_map(shared_data / "emps" / "DATA_EMPS.mat").text)
    assert emps == {"x": {"position": "qm", "setpoint_position": "qg", "force": "vir"}}
    (arts,) = (shared_data / "arts").glob("1Hz*.json")
    found = guess_map(arts)
    assert columns_of(found.text) == {"x": {"position": "data[2]", "velocity": "data[4]"}}
    assert "alike; which of them is the force" in found.missing[0]
    laas = guess_map(shared_data / "laas" / "acc_current.txt").text
    assert columns_of(laas) == {
        "x": {"position": "Position", "velocity": "Velocity", "current": "Iq"}
    }
    assert "resample = 1000 " in laas


@pytest.mark.parametrize(("position", "unit"), [("pos [mm]", "N/A"), ("angle [rad]", "N m/A")])
def test_a_current_alone_asks_for_the_force_constant_in_the_units_of_the_axis(
    tmp_path, position, unit
):
    write_csv(tmp_path / "a.csv", {"t": T, position: Q, "current [A]": F})
    found = guess_map(tmp_path / "a.csv")
    assert not found.missing
    assert f"# force_constant = 1.0 # {unit}: NOT KNOWN" in found.text


def test_a_force_asks_for_no_constant_and_what_is_used_is_not_listed(tmp_path):
    write_csv(tmp_path / "a.csv", {"t": T, "pos [mm]": Q, "force [N]": F})
    text = guess_map(tmp_path / "a.csv").text
    assert "NOT KNOWN" not in text
    assert "not used" not in text


COLUMNS = {"t [s]": T, "position": Q, "force [N]": F, "temperature": 20.0 + 0.0 * T}


def assumed(log) -> list[str]:
    return [f.what for f in check_log(log).findings if f.fault is Fault.ASSUMED]


@pytest.fixture
def guessed(tmp_path):
    write_csv(tmp_path / "a.csv", COLUMNS)
    (tmp_path / "map.toml").write_text(guess_map(tmp_path / "a.csv").text, encoding="utf-8")
    return tmp_path


def test_an_assumed_unit_is_said_of_the_log_and_of_its_file_until_confirmed(guessed):
    text = (guessed / "map.toml").read_text(encoding="utf-8")
    assert "ASSUMED" in text
    log = import_log(guessed / "a.csv", mapping(guessed, text))
    (what,) = assumed(log)
    assert what.startswith("the import map assumes position in ")
    write_log(log, guessed / "a.mcap")
    assert assumed(read_log(guessed / "a.mcap")) == [what]
    confirmed = text.replace("; unit ASSUMED", "")
    assert assumed(import_log(guessed / "a.csv", mapping(guessed, confirmed))) == []


def test_import_check_and_the_report_say_it(guessed):
    said = cli_runs.twin("import", "a.csv", "--map", "map.toml", "-o", "a.mcap", folder=guessed)
    assert said.returncode == 0
    assert "the import map assumes position in" in said.stderr
    said = cli_runs.twin("check", "a.mcap", folder=guessed)
    assert "the import map assumes position in" in said.stdout
    save_model(MachineModel("plain", {"x": AxisModel(3.0)}, 1000.0), guessed / "m.toml")
    said = cli_runs.twin("compare", "m.toml", "a.mcap", "-o", "r.html", folder=guessed)
    assert said.returncode == 0, said.stderr
    head = (guessed / "r.html").read_text(encoding="utf-8").partition("<h2")[0]
    assert "the import map assumes position in" in head


@pytest.mark.parametrize(
    ("current", "said"),
    [
        ('{column = "i [A]", unit = "mA"}\nforce_constant = 12.0', "in A by its name, in mA by"),
        ('{column = "i [A]", unit = "A"}', "has a current and no force_constant"),
        ('{column = "i [A]", unit = "A"}\nforce_constant = 12.0', ""),
    ],
)
def test_import_says_where_a_name_has_another_unit_and_where_no_force_can_be(
    tmp_path: Path, current: str, said: str
) -> None:
    write_csv(tmp_path / "a.csv", {"x_m": Q, "i [A]": F})
    position = 'position = {column = "x_m", unit = "mm"}'  # which may be a motor's, no length
    text = f"sample_rate = 1000.0\n[axes.x]\n{position}\ncurrent = {current}\n"
    (tmp_path / "map.toml").write_text(text)
    done = cli_runs.twin("import", "a.csv", "--map", "map.toml", "-o", "a.mcap", folder=tmp_path)
    assert done.returncode == 0
    assert said in done.stderr
    assert bool(done.stderr) is bool(said)


def test_a_map_by_hand_assumes_nothing_and_comments_are_no_entries():
    text = '# correct what is ASSUMED\n[axes.x]\nposition = {column = "q", unit = "m"} # known\n'
    assert assumptions(text, "x") == []
    text = 'sample_rate = 1000.0 # Hz, ASSUMED\n[axes.x]\nforce = {unit = "N"} # ASSUMED\n'
    assert assumptions(text, "x") == ["sample_rate = 1000.0", "force in N"]
    assert assumptions(text, "y") == ["sample_rate = 1000.0"]


@pytest.mark.parametrize("ending", ["csv", "mat", "json"])
def test_every_column_and_value_is_in_the_map(tmp_path, ending):
    path = tmp_path / f"a.{ending}"
    values = {"gain": 35.15, "note": "run 7"}
    extra = {"short": [1.0, 2.0, 4.0]}
    if ending == "csv":
        values = extra = {}
        write_csv(path, COLUMNS)
    elif ending == "mat":
        named = {n.split()[0]: c for n, c in COLUMNS.items()}
        savemat(path, {**named, **values, **extra})
    else:
        columns = {n: c.tolist() for n, c in COLUMNS.items()}
        path.write_text(json.dumps({**columns, **values, **extra}))
    text = guess_map(path).text
    assert "# not used: temperature = 20 throughout" in text
    if values:
        assert "# not used: gain = 35.15\n" in text
        assert "# not used: note (no numbers)" in text
        assert "# not used: short (3 rows, 1 to 4)" in text
    assert import_log(path, mapping(tmp_path, text)).axes


def lines_of(folder: Path, columns: dict[str, np.ndarray]) -> dict[str, str]:
    """Entry -> the rest of its line, of the map proposed for these columns, which it imports."""
    write_csv(folder / "a.csv", columns)
    text = guess_map(folder / "a.csv").text
    assert import_log(folder / "a.csv", mapping(folder, text)).axes
    return dict(line.split(" = ", 1) for line in text.splitlines() if line[:1].isalpha())


INDEX = np.arange(len(T), dtype=float)


SLIDE = {"pos_mm": 1e3 * Q, "force_N": F}
PLAIN = {"position": "", "force": ""}


def turning(column, values):
    return {"time_s": T, "q_rad": REACHED, column: values, "tau_Nm": PUSH}


@pytest.mark.parametrize(
    ("columns", "entries"),
    [
        ({"t_ms": INDEX, **SLIDE},
         {"time": '{column = "t_ms", unit = "ms"} # rises by 1 ms: its name states the', **PLAIN}),
        # the unit and the data decide against a name
        *((turning(name, GOAL),
           {"time": "", "setpoint_position": 'unit = "rad"} #', **PLAIN})
          for name in ("qd_ref_rad", "qd_ref", "velocity [rad]")),
        (turning("qd_ref", RATE_OF_GOAL),
         {"time": "", "setpoint_velocity": 'unit = "rad/s"} # sure: so called', **PLAIN}),
        # a unit a second may be of two words, and a letter behind a name need not be its unit
        ({"time_s": T, **SLIDE, "vel_mm_s": 1e3 * V},
         {"time": "", "velocity": '"vel_mm_s", unit = "mm/s"} # sure: so called', **PLAIN}),
        ({"t": T, "theta [rad]": Q, "tau_m": F, "qd_m": V},
         {"time": "", "position": "", "force": '{column = "tau_m"',
          "velocity": '{column = "qd_m"'}),
        # amperes are a current
        *(({"t": T, "pos [mm]": 1e3 * Q, name: F},
           {"time": "", "position": "", "current": 'unit = "A"'})
          for name in ("Strom [A]", "torque [A]")),
    ],
)  # fmt: skip
def test_an_entry_has_its_column_and_unit_with_the_reason(tmp_path, columns, entries):
    found = lines_of(tmp_path, columns)
    assert found.keys() == entries.keys()
    for entry, line in entries.items():
        assert line in found[entry]


@pytest.mark.parametrize("name", ["Sample", "t"])
def test_the_number_of_a_row_is_no_time_and_no_rate_is_made_up(tmp_path, name):
    write_csv(tmp_path / "a.csv", {name: INDEX, **SLIDE})
    found = guess_map(tmp_path / "a.csv")
    (what,) = found.missing
    assert what == f"'{name}' counts the rows; give sample_rate (Hz)"
    assert f"# sample_rate = ? # Hz: NOT KNOWN, '{name}' counts the rows" in found.text
    with pytest.raises(InputError, match="does not state its sample rate"):
        import_log(tmp_path / "a.csv", mapping(tmp_path, found.text))


def test_what_is_called_a_velocity_and_is_none_says_so(tmp_path):
    columns = {"time_s": T, "q_rad": Q, "qd": NOISE, "force_N": F}
    write_csv(tmp_path / "a.csv", columns)
    text = guess_map(tmp_path / "a.csv").text
    assert "# not used: qd: correlates with the rate of q_rad by 0." in text


def test_counts_ask_for_their_scale_and_the_map_says_so_until_it_is_given(tmp_path):
    columns = {"t": T, "enc_counts": np.rint(1e6 * Q), "speed [counts/s]": 1e6 * V, "u [V]": F}
    write_csv(tmp_path / "a.csv", columns)
    found = guess_map(tmp_path / "a.csv")
    assert found.missing == (
        "axis x: the scale of its position is not known: counts_per_turn of the encoder of "
        "enc_counts, or counts_per_metre where the axis travels",
        "axis x: the scale of its force is not known: N for one of u [V]",
    )
    assert "# not used: speed [counts/s]: counted: the position tells it too" in found.text
    with pytest.raises(InputError, match="unit 'counts' needs counts_per_turn or"):
        mapping(tmp_path, found.text)
    text = found.text.replace('unit = "counts"', 'unit = "counts", counts_per_metre = 1e6')
    text = text.replace('unit = "V"', 'unit = "V", scale = 2.0')
    log = import_log(tmp_path / "a.csv", mapping(tmp_path, text))
    np.testing.assert_allclose(log.axes["x"].position, Q, atol=1e-6)


def test_a_hole_in_a_column_that_is_used_is_named_and_hides_nothing(tmp_path):
    columns = {"t": T, "pos_mm": 1e3 * Q, "force_N": F, "spare": 20.0 + NOISE}
    columns = {n: c.copy() for n, c in columns.items()}
    columns["pos_mm"][[40, 50]] = columns["spare"][3] = np.nan
    write_csv(tmp_path / "a.csv", columns)
    found = guess_map(tmp_path / "a.csv")
    (what,) = found.missing
    assert what.startswith(
        "column 'pos_mm' is nan in row 41 of 4000 (line 42), 2 in all, also in line 52; "
    )
    assert columns_of(found.text) == {"x": {"position": "pos_mm", "force": "force_N"}}


def test_units_below_the_names_are_read(tmp_path):
    write_csv(tmp_path / "a.csv", {"Time": 1e3 * T, "Position": 1e3 * Q, "Load": F})
    names, _, rows = (tmp_path / "a.csv").read_text().partition("\n")
    (tmp_path / "a.csv").write_text(f"{names}\nms,[mm],N\n{rows}")
    text = guess_map(tmp_path / "a.csv").text
    assert text.count("ASSUMED") == 1  # in the first line, of what is to be corrected
    log = import_log(tmp_path / "a.csv", mapping(tmp_path, text))
    np.testing.assert_allclose(log.axes["x"].position, Q, atol=1e-9)


@pytest.mark.parametrize(
    ("position", "rate", "force", "said"),
    [
        ("deg", "U/min", "Nm", 'velocity = {column = "v [U/min]", unit = "rpm"}'),
        ("deg", "min-1", "% Mn", 'force = {column = "torque [% Mn]", unit = "%"}'),
        ("Inkr", "1/min", "‰", 'velocity = {column = "v [1/min]", unit = "rpm"}'),
    ],
)
def test_units_below_the_names_may_be_those_of_a_drive(tmp_path, position, rate, force, said):
    turn = {"deg": 360.0, "Inkr": 65536.0}[position]
    angle = np.rint(turn * Q / np.ptp(Q)) if position == "Inkr" else turn * Q / np.ptp(Q)
    speed = np.gradient(angle, T) / turn * 60.0
    write_csv(tmp_path / "a.csv", {"t": T, "position": angle, "v": speed, "torque": F})
    names, _, rows = (tmp_path / "a.csv").read_text().partition("\n")
    text = f"{names}\ns,{position},{rate},{force}\n{rows}"
    (tmp_path / "a.csv").write_text(text, encoding="utf-8")
    found = guess_map(tmp_path / "a.csv").text
    assert said in found
    assert ("N m for one" in found) is (force != "Nm")
    told = re.search(r"counts_per_turn NOT KNOWN.*, about (\d+) by v \[1/min\]", found)
    if position == "Inkr":
        assert told
        assert int(told[1]) == pytest.approx(65536, rel=1e-3)
    else:
        assert told is None


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("ref_pos [mm]", 'unit = "mm"} # .*; but one of it is 0.2599 of the position: correct'),
        ("ref_pos", 'unit = "counts"} # .*; counts_per_metre NOT KNOWN, one of it is 0.2599 of'),
        ("ref_pos [counts]", "counts_per_metre NOT KNOWN, one of it is 0.2599 of"),
    ],
)
def test_a_setpoint_of_another_size_says_how_much_one_of_it_is(tmp_path, name, said):
    columns = {"t": T, "pos [mm]": 1e3 * REACHED, name: 3.7e3 * GOAL, "F [N]": PUSH}
    write_csv(tmp_path / "a.csv", columns)
    assert re.search(rf"setpoint_position = .*{said}", guess_map(tmp_path / "a.csv").text)


def test_which_of_two_is_measured_is_assumed_where_the_numbers_deny_the_names(tmp_path):
    """A setpoint that comes later than its position is none by the numbers."""
    later = np.concatenate([np.zeros(2), REACHED[:-2]])
    columns = {"t": T, "Position measured": REACHED, "Setpoint": later, "force [N]": PUSH}
    write_csv(tmp_path / "a.csv", columns)
    text = guess_map(tmp_path / "a.csv").text
    assert "which of both is measured ASSUMED" in text
    assert "which of both is asked for ASSUMED" in text


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_command_in_newtons_beside_a_current_is_the_force_that_it_makes(tmp_path, sign) -> None:
    """Else a force constant is asked for, of which the two columns together tell all."""
    asked = F + 0.01 * NOISE
    columns = {"t": T, "pos [mm]": 1e3 * Q, "Force cmd [N]": asked, "Iq [A]": sign * F / 15.0}
    write_csv(tmp_path / "a.csv", columns)
    found = guess_map(tmp_path / "a.csv")
    assert columns_of(found.text)["x"]["force"] == "Force cmd [N]"
    assert columns_of(found.text)["x"]["current"] == "Iq [A]"
    assert not found.missing


def test_a_file_that_is_written_sideways_is_refused_at_once(tmp_path: Path) -> None:
    rows = [",".join(f"{v:.6g}" for v in column[:500]) for column in (T, Q, F)]
    (tmp_path / "a.csv").write_text("\n".join(rows))
    with pytest.raises(InputError, match="at most 400 are looked at; is it written sideways"):
        guess_map(tmp_path / "a.csv")


@pytest.mark.parametrize(("word", "sign"), [("less", 1.0), ("plus", -1.0)])
def test_a_set_point_and_its_following_error_make_the_position(tmp_path, word, sign) -> None:
    """An axis is behind its set point, which tells how the error is counted."""
    goal = np.r_[Q[25:], np.full(25, Q[-1])]
    columns = {
        "t": T,
        "Lagesollwert [mm]": 1e3 * goal,
        "Schleppabstand [mm]": sign * 1e3 * (goal - Q),
    }
    write_csv(tmp_path / "a.csv", {**columns, "Kraft [N]": F})
    found = guess_map(tmp_path / "a.csv")
    assert not found.missing
    made = f'column = "Lagesollwert [mm]", {word} = "Schleppabstand [mm]", unit = "mm"'
    assert f"position = {{{made}}}" in found.text
    assert columns_of(found.text)["x"]["setpoint_position"] == "Lagesollwert [mm]"
    (tmp_path / "m.toml").write_text(found.text)
    log = import_log(tmp_path / "a.csv", tmp_path / "m.toml")
    np.testing.assert_allclose(log.axes["x"].position, Q, atol=1e-9)


def test_an_error_beside_a_measured_position_makes_no_other(tmp_path: Path) -> None:
    columns = {"t": T, "pos [mm]": REACHED, "ref_pos [mm]": GOAL, "pos error [mm]": GOAL - REACHED}
    write_csv(tmp_path / "a.csv", {**columns, "force [N]": PUSH})
    found = columns_of(guess_map(tmp_path / "a.csv").text)["x"]
    assert (found["position"], found["setpoint_position"]) == ("pos [mm]", "ref_pos [mm]")
