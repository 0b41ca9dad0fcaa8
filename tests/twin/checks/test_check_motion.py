"""Laws of the checks of motion: outliers, one-way or one-speed motion, a position too coarse.

The share of time, the spread of speeds, the noise and the size of a jump are put in on both sides
of what is allowed.
"""

from dataclasses import replace

import numpy as np
import pytest
from check_drive import axis_of, command, drive, findings, motion, stated

from twin.checks import Fault, Severity, check_log
from twin.logs import ROTARY_UNITS, AxisLog, Log

T = np.arange(6000) / 1000.0

# Outliers


def test_a_jump_is_possible_up_to_what_acceleration_and_noise_explain():
    """Four times the usual acceleration over a sample, and ten times the noise of a bend."""
    axis = axis_of(drive())
    fast = np.quantile(np.abs(motion(10.0 + np.arange(4000) / 1e3, 2)), 0.99)
    noise = 10.0 * 6**0.5 * axis.position_noise
    assert axis.possible_jump == pytest.approx(4.0 * fast / 1e6 + noise, rel=0.01)
    steps = np.abs(np.diff(axis.log.position))
    assert axis.position_step == steps[steps > 0.0].min()
    assert axis.position_noise >= axis.position_step / 12**0.5
    assert axis.duration == 4.0


def test_noise_makes_a_larger_jump_possible_by_ten_times_its_own_second_difference():
    """A second difference 1, -2, 1 of white noise is sqrt(6) times the noise."""
    white = 1e-3 * np.random.default_rng(4).standard_normal(4000)

    def shake(columns):
        columns["position"] += white

    quiet, axis = axis_of(drive()), axis_of(drive(change=shake))
    more = axis.possible_jump - 4.0 * np.quantile(np.abs(axis.acceleration), 0.99) / 1e6
    assert more == pytest.approx(10.0 * np.std(np.diff(white, 2)), rel=0.06)
    assert not axis.jumps.any()
    assert axis.possible_jump > 10.0 * quiet.possible_jump


@pytest.mark.parametrize(("speed", "moves"), [(3.3, False), (4.2, True)])
def test_an_axis_moves_often_at_five_times_the_noise_of_its_velocity(speed, moves):
    """Nine tenths of normal noise stay below 1.28 of its rms, which adds to the speed."""
    white = 1e-6 * np.random.default_rng(6).standard_normal(6000)
    noise = axis_of(drive()).smoother.velocity_noise(1e-6)
    position = speed * noise * T + white
    log = Log(1000.0, {"x": AxisLog({"position": position, "force": command(T)})})
    assert axis_of(log).moves_often is moves


@pytest.mark.parametrize("at", [700, 2500])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_position_that_jumps_farther_is_an_outlier_there(at, sign):
    allowed = axis_of(drive()).possible_jump
    bend = abs(np.diff(drive().axes["x"].position, 2)).max()

    def jump(size):
        def change(columns):
            columns["position"][at:] += sign * size

        wanted = (Fault.STEP, Fault.MISSING, Fault.JOINED)  # without a setpoint they look alike
        return [f for f in check_log(drive(change=change)).findings if f.fault in wanted]

    assert not jump(0.9 * (allowed - bend))
    (found,) = jump(8.0 * (allowed + bend))
    assert found.where == f"{(at - 1) / 1e3:g} to {at / 1e3:g} s"
    assert found.severity is Severity.ERROR


@pytest.mark.parametrize("apart", [45, 60])
def test_samples_more_than_fifty_milliseconds_apart_are_two(apart):
    def change(columns):
        for at in (1000, 1000 + apart):
            columns["position"][at] += 1e-3

    (found,) = findings(drive(change=change), Fault.OUTLIERS)
    one, two = ("0.999 to 1.046 s", "0.999 to 1.001 s and 1 more times")
    assert found.where == (one if apart == 45 else two)


@pytest.mark.parametrize(("size", "told"), [(0.4, False), (60.0, True)])
def test_a_command_that_contradicts_the_motion_is_placed_and_sized(size, told):
    def push(columns):
        columns["force"][2000:2030] += size

    found = findings(drive(change=push), Fault.OUTLIERS)
    assert len(found) == told
    if told:
        first, _, last, _ = found[0].where.split()[:4]
        assert float(first) == pytest.approx(2.0, abs=0.012)
        assert float(last) == pytest.approx(2.03, abs=0.012)
        assert stated(found[0], "up to ") == pytest.approx(size, rel=0.1)
        assert found[0].what.startswith("force and motion contradict each other")


@pytest.mark.parametrize("offset", [0.0, 100.0])
@pytest.mark.parametrize(("part", "told"), [(0.85, False), (1.2, True)])
@pytest.mark.parametrize("kind", ["contradict", "to and fro"])
def test_a_tenth_of_the_command_is_the_least_that_counts_whatever_its_mean(
    offset, part, told, kind
):
    """A push counts by its height, alternating noise by its second difference, four times it.

    Without Coulomb friction, whose steps at every reversal are bends of the command too.
    """
    force = drive(coulomb=0.0).axes["x"].force
    tenth = 0.1 * np.quantile(np.abs(force - np.median(force)), 0.99)

    def disturb(columns):
        columns["force"] += offset
        if kind == "contradict":
            columns["force"][2000:2030] += part * tenth
        else:
            columns["force"][2000:2020] += part * tenth / 4.0 * (-1.0) ** np.arange(20)

    found = [
        f for f in findings(drive(change=disturb, coulomb=0.0), Fault.OUTLIERS) if kind in f.what
    ]
    assert len(found) == told


@pytest.mark.parametrize(("size", "told"), [(0.05, False), (20.0, True)])
def test_noise_on_the_command_is_told_where_it_is(size, told):
    noise = size * np.random.default_rng(2).standard_normal(30)

    def shake(columns):
        columns["force"][2000:2030] += noise
        columns["force"][500] += size  # one bend alone is no noise

    found = [f for f in findings(drive(change=shake), Fault.OUTLIERS) if "to and fro" in f.what]
    assert len(found) == told
    if told:
        first, _, last, _ = found[0].where.split()[:4]
        assert float(first) == pytest.approx(2.0, abs=0.006)
        assert float(last) == pytest.approx(2.03, abs=0.006)


def test_a_step_of_the_command_is_no_noise():
    def step(columns):
        columns["force"][2000:] += 40.0

    assert not [f for f in findings(drive(change=step), Fault.OUTLIERS) if "to and fro" in f.what]


@pytest.mark.parametrize("at", [1200, 2700])
def test_motion_near_a_jump_is_not_believed_and_all_other_is(at):
    """Two samples each side of the jump, reached by the low-pass of 21 blocks."""

    def change(columns):
        columns["position"][at:] += 0.01

    assert axis_of(drive()).kept.all()
    spoilt = np.flatnonzero(axis_of(drive(change=change)).kept == 0.0)
    places = axis_of(drive()).smoother.time(spoilt) * 1e3
    assert abs(places.mean() - at) < 1.5
    assert np.all(np.diff(spoilt) == 1)
    assert 21 <= len(spoilt) <= 28


# Excitation


def one_axis(velocity: np.ndarray, rate: float = 1000.0, units=None) -> Log:
    """A drive without noise that moves at this velocity."""
    position = np.concatenate([[0.0], np.cumsum(velocity)[:-1]]) / rate
    force = 2.0 * np.gradient(velocity) * rate + 3.0 * np.tanh(velocity / 1e-3)
    axis = AxisLog({"position": position, "force": force}, **({"units": units} if units else {}))
    return Log(rate, {"x": axis})


@pytest.mark.parametrize(("share", "told"), [(0.015, True), (0.03, False)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_fiftieth_of_the_time_the_other_way_is_enough(share, told, sign):
    """Speeds from 0.1 to 0.2 m/s; the way back fills a share of the time."""
    velocity = 0.15 + 0.05 * np.sin(5.0 * T)
    velocity[2000 : 2000 + round(share * 6000)] *= -1.0
    found = findings(one_axis(sign * velocity), Fault.WEAK_EXCITATION)
    assert len(found) == told
    if told:
        side = "forwards" if sign > 0.0 else "backwards"
        assert found[0].what.startswith(f"the axis moves only {side} (")
        assert stated(found[0], "(") == pytest.approx(100.0 * (1.0 - share), abs=0.3)


@pytest.mark.parametrize("units", [None, ROTARY_UNITS])
@pytest.mark.parametrize(("spread", "told"), [(0.04, True), (0.06, False)])
def test_speeds_must_spread_by_a_twentieth(spread, told, units):
    """Triangles of speed around 0.2 m/s, both ways: nine tenths less one are 0.8 of the spread."""
    wave = 2.0 * np.abs((T * 0.7) % 1.0 - 0.5) - 0.5  # even from -1/2 to 1/2
    speed = 0.2 * (1.0 + spread / 0.8 * wave)
    velocity = np.where((T // 1.5) % 2 == 0, speed, -speed)
    found = findings(one_axis(velocity, units=units), Fault.WEAK_EXCITATION)
    assert len(found) == told
    if told:
        unit = "rad/s" if units else "m/s"
        assert f"there is one speed only, 0.2 {unit}, " in found[0].what


@pytest.mark.parametrize(("factor", "told"), [(0.8, False), (1.25, True)])
def test_a_position_is_too_coarse_where_its_noise_is_three_tenths_of_the_acceleration(factor, told):
    """The step of the encoder that reaches the bound is computed from the window's own noise."""
    log = drive()
    axis = axis_of(log)
    rms = np.sqrt(np.mean(axis.acceleration**2))
    noise = factor * 0.3 * rms / axis.smoother.acceleration_noise(1.0)
    rng = np.random.default_rng(12)

    def shake(columns):
        columns["position"] += noise * rng.standard_normal(len(columns["position"]))

    found = findings(drive(change=shake), Fault.COARSE_POSITION)
    assert len(found) == told
    if told:
        assert found[0].severity is Severity.WARNING
        assert stated(found[0], "good to ") == pytest.approx(noise, rel=0.1)
        assert stated(found[0], " of the ") == pytest.approx(rms, rel=0.1)
        assert "over 21 ms makes" in found[0].what


@pytest.mark.parametrize(("moving", "told"), [(0.06, True), (0.16, False)])
def test_an_axis_that_moves_a_tenth_of_the_time_moves(moving, told):
    """Noise of a micrometre all the time, motion of centimetres for a share of it."""
    t = 10.0 + T
    begin, end = 2000, 2000 + round(moving * 6000)
    position = np.full(6000, motion(t[begin]))
    position[begin:end] = motion(t[begin:end])
    position[end:] = motion(t[end])
    position += 1e-6 * np.random.default_rng(1).standard_normal(6000)
    log = Log(1000.0, {"x": AxisLog({"position": position, "force": command(t)})})
    found = findings(log, Fault.WEAK_EXCITATION)
    assert bool([f for f in found if "hardly moves" in f.what]) == told
    assert axis_of(log).moves_often == (not told)
    if told:
        assert stated(found[0], "noise of its position (") == pytest.approx(1e-6, rel=0.1)


def test_an_axis_lacking_something_is_told_that_alone_and_the_other_axis_is_checked():
    good = drive().axes["x"]
    late = drive(late={"force": 0.02}).axes["x"]
    bad = replace(good, columns={"position": good.position})
    found = check_log(Log(1000.0, {"a": bad, "b": late, "c": good})).findings
    assert [(f.axis, f.fault) for f in found] == [("a", Fault.INCOMPLETE), ("b", Fault.LAG)]
    assert str(found[0]).startswith("axis a, whole log: there is no force")


@pytest.mark.parametrize(
    ("signals", "complete"),
    [
        (("position", "force"), True),
        (("position", "current"), True),
        (("force",), False),
        (("position",), False),
        (("position", "velocity"), False),
    ],
)
def test_a_log_needs_a_position_and_a_command(signals, complete):
    assert len(findings(drive(signals=signals), Fault.INCOMPLETE)) == (not complete)
    if complete:

        def cut(columns):
            columns[signals[1]] = columns[signals[1]][:-1]

        (found,) = findings(drive(signals=signals, change=cut), Fault.INCOMPLETE)
        assert f"differ in length (position 4000, {signals[1]} 3999)" in found.what
    one = check_log(drive(seconds=0.001, signals=signals)).findings
    assert "lasts 0.001 s" in next(f.what for f in one if f.fault is Fault.TOO_SHORT)
