"""Physics decides what names leave open: which column the force, which one was measured."""

import tomllib

import numpy as np
import pytest
from import_cases import guess_map, write_csv
from servo_loop import RATE, loop

from twin.importers.proposal.courses import (
    TableColumn,
    columns_of,
    course,
    distinct,
    follows,
    sums,
)
from twin.importers.proposal.doubts import doubts_as_metadata
from twin.importers.proposal.motion import explained
from twin.logs import AxisLog, Log

SERVO = loop()
OVER = loop(friction_fed_forward=6.0)
NOISE = np.random.default_rng(5).standard_normal(len(SERVO.time))


def proposed(folder, columns, seconds=SERVO.time):
    """The tables of the map that is proposed, its text, and what it asks for."""
    write_csv(folder / "a.csv", {"t": seconds, **columns})
    found = guess_map(folder / "a.csv")
    return tomllib.loads(found.text).get("axes", {}), found.text, found.missing


def test_the_motion_explains_the_force_that_moves_it_and_no_other():
    whole, turned, other = explained(SERVO.position, [SERVO.force, -SERVO.force, NOISE])
    assert whole.forward > 0.99
    assert whole.backward < 0.5
    assert not whole.is_turned
    assert turned.is_turned
    assert turned.accelerates == -1
    assert turned.backward == pytest.approx(whole.forward)
    assert other.best < 0.1


def test_one_way_tells_no_sign():
    t = SERVO.time
    position = t + 0.02 * np.sin(9.0 * t)
    force = -2.0 * np.gradient(np.gradient(position, t), t) - 3.0
    (found,) = explained(position, [force])
    assert not found.both_ways
    assert not found.is_turned


def test_a_sine_tells_its_sign_by_friction_alone_and_none_without():
    t = SERVO.time
    position = 0.01 * np.sin(20.0 * np.pi * t)
    speed = np.gradient(position, t)
    for sign in (1.0, -1.0):
        (found,) = explained(position, [sign * np.gradient(speed, t)])
        assert not found.is_turned  # a spring would make the same
    (found,) = explained(position, [3.0 * np.sign(speed) + 0.5 * np.gradient(speed, t)])
    assert not found.is_turned
    assert found.forward > found.backward


def test_the_measured_column_is_told_by_its_noise_and_the_force_that_answers_it():
    c = columns_of({"p": SERVO.position, "s": SERVO.setpoint, "f": SERVO.force, "b": -SERVO.force})
    assert follows(c["p"], c["s"], c["f"]) >= 2
    assert follows(c["s"], c["p"], c["f"]) <= -2
    assert follows(c["p"], c["s"], c["b"], -1) >= 2
    found = course(c["p"], c["s"])
    assert found is not None
    assert found.slope == pytest.approx(1.0, abs=0.01)


def test_a_start_at_speed_of_some_samples_is_no_noise_that_a_force_answers():
    """A log that begins while the axis moves: its setpoint was taken for the reading."""
    starts = 12  # samples
    swings = np.zeros(len(SERVO.time))
    swings[:starts] = np.sin(np.arange(starts) * 2.0) * np.linspace(1.0, 0.0, starts)
    for size in (1e-7, 1e-6, 1e-5):  # m
        position, force = SERVO.position + size * swings, SERVO.force * (1.0 + 9.0 * swings)
        c = columns_of({"p": position, "s": SERVO.setpoint, "f": force})
        assert follows(c["p"], c["s"], c["f"]) >= 2


@pytest.mark.parametrize("names", [("act_pos", "cmd_pos"), ("cmd_pos", "act_pos")])
def test_setpoint_and_position_exchanged_are_found(tmp_path, names):
    columns = dict(zip(names, (SERVO.position, SERVO.setpoint), strict=True))
    axes, text, _ = proposed(tmp_path, {**columns, "force": SERVO.force})
    assert axes["x"]["position"]["column"] == names[0]
    assert axes["x"]["setpoint_position"]["column"] == names[1]
    assert ("unsure: although act_pos is called so" in text) is (names[0] == "cmd_pos")


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_reversed_sign_is_in_the_map_with_the_reason(tmp_path, sign):
    columns = {"pos": SERVO.position, "ref": SERVO.setpoint, "force": sign * SERVO.force}
    axes, text, _ = proposed(tmp_path, columns)
    assert axes["x"]["force"].get("sign", 1) == sign
    assert ("reversed, as it moves the mass with its sign -1: 100 %" in text) is (sign < 0.0)


def test_of_a_command_and_its_parts_the_sum_is_the_force(tmp_path):
    columns = {"pos": OVER.position, "pos_cmd": OVER.setpoint, "tau_pid": OVER.feedback,
               "tau_ff": OVER.feedforward, "tau_total": OVER.force}  # fmt: skip
    axes, text, _ = proposed(tmp_path, columns)
    assert axes["x"]["force"]["column"] == "tau_total"
    assert "tau_pid, tau_ff: tau_total is the sum of tau_pid and tau_ff" in text
    plain = {"pos": OVER.position, "force_a": OVER.feedback, "force_b": OVER.feedforward,
             "force_c": OVER.force}  # fmt: skip
    axes, text, _ = proposed(tmp_path, plain)
    assert axes["x"]["force"]["column"] == "force_c"


def test_a_force_that_helps_the_motion_says_so(tmp_path):
    _, text, _ = proposed(tmp_path, {"pos": OVER.position, "force": OVER.feedback})
    assert "unsure" in text
    assert "it helps the motion where friction resists it: a part of the force is missing" in text


def test_forces_that_go_alike_are_asked_for(tmp_path):
    size = 0.1 * np.std(SERVO.force)
    one, two = (SERVO.force + size * np.sin(w * SERVO.time) for w in (31.0, 37.0))
    columns = {"pos": SERVO.position, "force_1": one, "force_2": two}
    axes, text, missing = proposed(tmp_path, columns)
    assert "force" not in axes["x"]
    assert 'force = {column = "?"' in text
    assert "which of them is the force that the drive makes?" in missing[0]


def test_each_axis_has_its_own_columns_in_whatever_order(tmp_path):
    second = loop(seconds=4.0, friction_fed_forward=1.0)
    t = SERVO.time
    turned = slice(None, None, -1)  # another motion: the first backwards in time
    columns = {
        "Fy": second.force[turned], "x_set": SERVO.setpoint, "y_act": second.position[turned],
        "Fx": SERVO.force, "x_act": SERVO.position, "y_set": second.setpoint[turned],
    }  # fmt: skip
    axes, _, _ = proposed(tmp_path, columns, t)
    for axis in "xy":
        assert axes[axis]["position"]["column"] == f"{axis}_act"
        assert axes[axis]["setpoint_position"]["column"] == f"{axis}_set"
        assert axes[axis]["force"]["column"] == f"F{axis}"


def test_axes_whose_names_do_not_go_together_are_told_by_the_motion(tmp_path):
    t = SERVO.time
    position = 0.03 * np.sin(7.0 * t) + 0.01 * np.sin(17.0 * t)
    speed = np.gradient(position, t)
    force = 4.0 * np.gradient(speed, t) + 2.0 * np.tanh(speed / 1e-3)
    columns = {"left pos": SERVO.position, "right pos": position, "torque A": force,
               "torque B": SERVO.force}  # fmt: skip
    axes, _, _ = proposed(tmp_path, columns)
    found = {a["position"]["column"]: a["force"]["column"] for a in axes.values()}
    assert found == {"left pos": "torque B", "right pos": "torque A"}


def test_an_acceleration_is_no_position(tmp_path):
    axes, text, missing = proposed(tmp_path, {"accel_x": NOISE, "accel_y": NOISE[::-1]})
    assert axes == {"x": {}}
    assert "no column of accel_x, accel_y looks like a position" in missing[0]
    assert "# not used: accel_x, accel_y: an acceleration" in text


def test_a_torque_beside_a_length_asks_for_the_screw(tmp_path):
    columns = {"pos [mm]": 1e3 * SERVO.position, "torque [Nm]": SERVO.force}
    axes, text, missing = proposed(tmp_path, columns)
    assert "scale" not in axes["x"]["force"]
    assert "for one Nm: 2 pi / lead of the screw" in text
    assert len(missing) == 1


def test_an_angle_that_comes_round_is_seen_as_one_motion(tmp_path):
    turns = 40.0 * SERVO.position
    columns = {"angle": np.mod(np.degrees(turns), 360.0), "torque_Nm": SERVO.force}
    axes, text, _ = proposed(tmp_path, columns)
    assert axes["x"]["position"]["unit"] == "deg"
    assert "jumps back by 360: it wraps" in text
    assert "sure: so called, the motion explains" in text


def test_a_counter_that_comes_round_is_asked_for_its_counts_per_turn(tmp_path):
    counts = np.mod(np.rint(2e3 * 40.0 * SERVO.position), 4096)
    axes, text, _ = proposed(tmp_path, {"present_position": counts, "torque_Nm": SERVO.force})
    assert axes["x"]["position"]["wraps"] == 4096
    assert "counts_per_turn NOT KNOWN" in text
    assert "counts_per_metre" not in text


def test_what_hardly_goes_with_the_motion_is_no_force(tmp_path):
    noise = np.random.default_rng(3).standard_normal(len(SERVO.force))
    sag = 48.0 - 0.01 * np.abs(SERVO.force) / np.std(SERVO.force) + 0.02 * noise
    axes, _, lacks = proposed(tmp_path, {"pos_mm": SERVO.position, "V": sag})
    assert "force" not in axes["x"]
    assert "looks like a force" in " ".join(lacks)


SIGNALS = {"position": SERVO.position, "setpoint_position": SERVO.setpoint, "force": SERVO.force}


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({}, ""),
        ({"force": -SERVO.force}, "and with the sign reversed 100 %"),
        ({"position": SERVO.setpoint, "setpoint_position": SERVO.position}, "look exchanged"),
        ({"setpoint_position": 57.3 * SERVO.setpoint}, " times as large as the position"),
        ({"force": SERVO.force - 2.0 * OVER.force[0] - 6.0 * np.sign(
            np.gradient(SERVO.position, SERVO.time))}, "negative friction"),
    ],
)  # fmt: skip
def test_an_imported_log_says_what_its_signals_contradict(changed, said):
    log = Log(RATE, {"x": AxisLog({**SIGNALS, **changed})})
    found = "; ".join(doubts_as_metadata(log).values())
    assert said in found
    assert bool(found) is bool(said)


@pytest.mark.parametrize(("begins", "said"), [("x.current", False), ("y.x", True)])
def test_of_an_axis_whose_counter_begins_again_nothing_else_is_said(begins, said):
    turned = AxisLog({**SIGNALS, "force": -SERVO.force})
    log = Log(RATE, {"x": turned}, metadata={f"counter.{begins}": "column 'i' jumps by 65536"})
    assert bool(doubts_as_metadata(log)) is said


# What columns say of each other, of signals that are known exactly

ROWS = np.arange(6000.0)
WANDERING = np.cumsum(np.cumsum(np.random.default_rng(8).standard_normal(6000)) * 1e-3)


def smooth(rows: np.ndarray) -> np.ndarray:
    """A motion (n,) from rest to rest that is known between its rows too."""
    waves = np.sin(0.011 * rows) + 0.6 * np.sin(0.0271 * rows + 1.0) + 0.3 * np.cos(0.0437 * rows)
    return waves * np.exp(-(((rows - 3000.0) / 1000.0) ** 4))


def column(values: np.ndarray, name: str = "c") -> TableColumn:
    return TableColumn(name, values)


@pytest.mark.parametrize(
    ("values", "period"),
    [
        (np.mod(7.0 * ROWS, 4096.0), 4096.0),
        (np.mod(7.0 * ROWS, 128.0), None),
        (np.mod(0.9 * ROWS, 360.0), 360.0),
        (np.mod(0.01 * ROWS, 2.0 * np.pi), 2.0 * np.pi),
        (180.0 + 179.0 * np.sin(0.01 * ROWS), None),
        (np.mod(0.9 * ROWS, 300.0), None),
    ],
)
def test_what_comes_round_is_known_by_its_jumps(values: np.ndarray, period: float | None) -> None:
    found = column(values)
    assert found.wraps == period
    steps = np.diff(found.smooth)
    assert bool(np.ptp(steps) < 1e-9) is (period is not None)


def test_a_column_is_known_by_its_steps() -> None:
    rng = np.random.default_rng(3)
    held = column(np.repeat(rng.standard_normal(2000), 3))
    assert (held.held, column(rng.standard_normal(6000)).held) == (3, 1)
    assert column(np.repeat(np.arange(25.0), 3)).held == 1  # too few to be told
    counter, few = column(np.floor(ROWS / 9.0)), column(np.mod(ROWS, 4.0))
    assert (counter.counts, counter.whole, counter.rises) == (True, True, True)
    assert (few.counts, few.whole, few.rises) == (False, True, False)
    assert not column(0.5 * ROWS).whole
    assert not column(np.mod(ROWS, 3.0)).whole  # of two steps: a state


def test_noise_is_told_from_motion_by_its_size_and_its_kind() -> None:
    noise = 0.01 * np.random.default_rng(4).standard_normal(6000)
    size, is_noise = column(smooth(ROWS) + noise).rough(1)
    # fourth differences of white noise are as large as the root of 1 + 16 + 36 + 16 + 1
    assert size == pytest.approx(0.01 * np.sqrt(70.0) / np.std(smooth(ROWS)), rel=0.05)
    assert is_noise
    size, is_noise = column(smooth(ROWS)).rough(1)
    assert size < 1e-4
    assert not is_noise


def test_a_rate_is_told_with_its_unit_and_an_offset_makes_it_none() -> None:
    position = column(smooth(ROWS))
    middle = 0.5 * (ROWS[1:] + ROWS[:-1])
    speed = np.append((smooth(middle + 0.5) - smooth(middle - 0.5)), 0.0)
    how, unit = position.rate(column(-4.0 * speed), 1)
    assert how == pytest.approx(1.0, abs=1e-6)
    assert unit == pytest.approx(-0.25, rel=1e-6)
    assert position.rate(column(speed + 0.1), 1)[0] < 0.5
    assert position.rate(column(0.0 * ROWS), 1) == (0.0, 0.0)
    assert position.rate(column(smooth(ROWS)), 1)[0] < 0.1


@pytest.mark.parametrize("late", [-7.0, 0.0, 2.5, 31.3])
@pytest.mark.parametrize("slope", [1.0, -57.3])
def test_the_course_of_a_column_is_told_with_slope_and_rows_behind(late, slope) -> None:
    found = course(column(smooth(ROWS - late)), column(slope * smooth(ROWS) + 3.0))
    assert found is not None
    assert found.behind == pytest.approx(late, abs=0.02)
    assert found.slope == pytest.approx(slope, rel=0.01)
    assert found.likeness > 0.98
    assert course(column(smooth(ROWS)), column(WANDERING)) is None
    assert course(column(smooth(ROWS)), column(0.0 * ROWS)) is None


def test_sums_and_readings_of_one_thing_are_found_row_by_row() -> None:
    rng = np.random.default_rng(6)
    one, two, other = rng.standard_normal((3, 6000))
    known = columns_of({"one": one, "two": two, "sum": one + two, "again": 2.0 * one})
    assert [[c.name for c in each] for each in sums(list(known.values())[:3])] == [
        ["sum", "one", "two"]
    ]
    near = columns_of({"one": one, "two": two, "sum": one + two + 1e-2 * other})
    assert not list(sums(list(near.values())))
    groups = distinct(list(known.values()))
    assert [[c.name for c in group] for group in groups] == [["one", "again"], ["two"], ["sum"]]


def test_the_parts_of_a_force_are_told_of_a_motion_that_is_known() -> None:
    rows = ROWS
    x = smooth(rows)
    v, a = (np.gradient(x), np.gradient(np.gradient(x)))
    pull, rub = a / np.std(a), 0.7 * np.sign(v)
    (found,) = explained(x, [pull + rub])
    size = np.std(pull + rub)
    assert found.forward > 0.99
    assert found.friction == pytest.approx(
        np.std(rub) / size, rel=0.3
    )  # less what the place may be
    assert found.t_inertia > 10.0
    assert found.accelerates == 1
    assert found.both_ways
    (lacking,) = explained(x, [pull - 0.5 * rub])
    assert lacking.friction < -0.1
    (turned,) = explained(x, [-3.0 * (pull + rub)])
    assert turned.inertia == pytest.approx(-found.inertia)
    assert turned.friction == pytest.approx(-found.friction)
    assert (turned.forward, turned.backward) == pytest.approx((found.backward, found.forward))
    assert lacking.pushes
    assert lacking.is_partial
    assert not found.pushes
    (still,) = explained(0.0 * rows, [pull])
    assert still.best == 0.0


@pytest.mark.parametrize(("late", "side"), [(7, "ahead of"), (-7, "behind")])
@pytest.mark.parametrize("stamped", [True, False])
def test_a_column_without_a_name_is_told_by_how_far_it_leads(tmp_path, late, side, stamped):
    x = smooth(ROWS - late)
    force = 1e4 * np.gradient(np.gradient(x)) + 0.3 * np.sign(np.gradient(x))
    columns = {"pos_mm": 10.0 * x, "ch7": 10.0 * smooth(ROWS), "force_N": force}
    clock = {"t": 2e-3 * ROWS} if stamped else {}
    write_csv(tmp_path / "a.csv", {**clock, **columns})
    text = guess_map(tmp_path / "a.csv").text
    lag = "14 ms" if stamped else "7 rows"
    assert f"goes as the position, {lag} {side} it" in text
    assert ('setpoint_position = {column = "ch7"' in text) is (late > 0)
    assert ("a second reading of it" in text) is (late < 0)
