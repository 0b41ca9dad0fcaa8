"""Physics decides what names leave open: which column the force, which one was measured."""

import tomllib

import numpy as np
import pytest
from import_cases import write_csv
from servo_loop import RATE, loop

from twin.importers.guess import guess_map
from twin.importers.proposal.courses import columns_of, course, follows
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
