"""Every kind of experiment gives what its fields say, on the axis and at the place they name.

Times, speeds, spans and forces are read off the setpoint by counting samples.
"""

from collections.abc import Callable
from dataclasses import fields, replace
from itertools import pairwise

import numpy as np
import pytest

import twin
from twin.errors import CannotRun, InputError
from twin.experiments.experiment import Experiment, gentle, machine_limits
from twin.experiments.kinds import (
    KINDS,
    Moves,
    Multisine,
    OpenLoopSine,
    Passes,
    Rests,
    Reversals,
    Staircase,
    Steps,
    Sweep,
    Tracking,
)
from twin.experiments.named import EXPERIMENTS, MAP_SPEEDS, find_experiment, lasting, missed
from twin.experiments.trajectory import Setpoint
from twin.model.machine import AxisModel, Hardware, MachineModel

RATE = 2000.0
X = Hardware(travel=(-0.11, 0.17), force_limit=30.0, velocity=0.3, acceleration=4.0, jerk=300.0)
Y = Hardware(travel=(-0.05, 0.09), force_limit=20.0, velocity=0.2, acceleration=3.0, jerk=150.0)
STAGE = MachineModel("s", {"x": AxisModel(3.0, X), "y": AxisModel(5.0, Y)}, sample_rate=RATE)
LIMITS = machine_limits(STAGE)
MIDDLE = (0.03, 0.02)
SPEEDS = (0.0001, 0.001, 0.015, 0.1)


def made(experiment: Experiment, seed: int = 0, model: MachineModel = STAGE) -> Setpoint:
    setpoint = experiment.setpoint(model, np.random.default_rng(seed))
    return setpoint.part(0, len(setpoint))


EVERY = (
    Tracking(5.0), Tracking(1.2345), Moves(5, dwell=0.02), Moves(3, dwell=0.0),
    Passes("x", 0.1, 0.1, 2), Staircase("y", SPEEDS, 0.03, longest_plateau=1.0, at=(0.1, 0.06)),
    Reversals("x", 5, at=(0.1, -0.03)), OpenLoopSine("y", 6.0), Steps("x", 0.1, 0.02, (1.0, 0.4)),
    Rests("y", 0.02, 0.04, (0.3, 0.8)), Passes("y", 0.08, 0.02, 1, other=0.06),
    Sweep("x", 0.1, 0.05, 1, amplitude=0.4, lowest=4.0, highest=80.0, effort=0.5),
)  # fmt: skip


def assert_lawful(setpoint: Setpoint) -> None:
    """Limits kept, position, velocity and acceleration of one motion, at rest at both ends."""
    h = 1.0 / setpoint.sample_rate
    position, velocity = setpoint.position, setpoint.velocity
    acceleration = setpoint.acceleration
    jerk = np.array([axis.jerk for axis in LIMITS])
    for i, axis in enumerate(LIMITS):
        assert axis.travel[0] <= position[:, i].min() <= position[:, i].max() <= axis.travel[1]
        assert np.abs(velocity[:, i]).max() <= axis.velocity * (1 + 1e-12)
        assert np.abs(acceleration[:, i]).max() <= axis.acceleration * (1 + 1e-12)
    assert (np.abs(np.diff(acceleration, axis=0)) <= jerk * h + 1e-10).all()
    # The trapezoidal rule on a signal whose slope changes at most by twice the jerk.
    dv = np.diff(velocity, axis=0) - h * (acceleration[1:] + acceleration[:-1]) / 2
    assert (np.abs(dv) <= jerk * h**2 / 4 + 1e-13).all()
    dp = np.diff(position, axis=0) - h * (velocity[1:] + velocity[:-1]) / 2
    assert (np.abs(dp) <= jerk * h**3 / 4 + 1e-15).all()
    for end in (0, -1):
        assert np.abs(velocity[end]).max() < 1e-12
        assert np.abs(acceleration[end]).max() < 1e-9


@pytest.mark.parametrize("experiment", EVERY, ids=lambda e: type(e).__name__)
def test_every_setpoint_keeps_the_laws(experiment: Experiment) -> None:
    assert_lawful(made(experiment, 3))


@pytest.mark.parametrize(
    "fault",
    [
        lambda s: replace(s, position=s.position + 0.2),
        lambda s: replace(s, velocity=np.roll(s.velocity, 1, axis=0)),
        lambda s: replace(s, acceleration=s.acceleration * 1.01),
        lambda s: replace(s, position=s.position + 1e-7 * (s.position > s.position.mean(axis=0))),
        lambda s: replace(s, sample_rate=s.sample_rate * 1.001),
        lambda s: s.part(0, 400),
    ],
)
def test_the_laws_notice_a_planted_fault(fault: Callable[[Setpoint], Setpoint]) -> None:
    whole = made(Moves(2, dwell=0.05), 1)
    assert_lawful(whole)
    with pytest.raises(AssertionError):
        assert_lawful(fault(whole))


def plateaus(velocity: np.ndarray, speed: float) -> list[int]:
    """Numbers of samples of the stretches at +-speed, signed by direction."""
    level = np.where(np.isclose(np.abs(velocity), speed, rtol=1e-12, atol=0), np.sign(velocity), 0)
    edges = np.flatnonzero(np.diff(level, prepend=0, append=0))
    return [int((b - a) * level[a]) for a, b in pairwise(edges) if level[a]]


def stays(signal: np.ndarray) -> np.ndarray:
    """Lengths in samples of the stretches of rest of a velocity."""
    edges = np.flatnonzero(np.diff(np.r_[0, (signal == 0.0).astype(int), 0]))
    return edges.reshape(-1, 2)


def test_an_experiment_without_a_place_is_in_the_middle_and_gentle_by_its_effort() -> None:
    for effort in (1.0, 0.5):
        found = made(Passes("x", span=0.1, speed=0.1, repeats=1, effort=effort))
        np.testing.assert_allclose(found.position[0], [MIDDLE[0] - 0.05, MIDDLE[1]])
        a = found.acceleration[:, 0]
        assert np.abs(a).max() == pytest.approx(effort * 4.0, rel=1e-6)
        assert np.abs(np.diff(a)).max() * RATE == pytest.approx(effort * 300.0, rel=1e-3)
    assert gentle(LIMITS[1], 0.3) == replace(LIMITS[1], acceleration=0.3 * 3.0, jerk=0.3 * 150.0)


def test_passes_hold_the_speed_both_ways_and_leave_the_other_axis_alone() -> None:
    found = made(Passes("x", span=0.2, speed=0.1, repeats=3, at=(0.0, 0.07)))
    runs = plateaus(found.velocity[:, 0], 0.1)
    assert [np.sign(run) for run in runs] == [1, -1] * 3
    ramps = 0.1 * LIMITS[0].ramp_time(0.1)
    assert np.abs(runs) / RATE == pytest.approx((0.2 - ramps) / 0.1, abs=1e-3)
    assert np.ptp(found.position[:, 0]) == pytest.approx(0.2, abs=1e-12)
    assert (found.position[:, 1] == 0.07).all()
    assert not found.velocity[:, 1].any()
    assert not found.force.any()


def test_rounding_does_not_carry_a_pass_out_of_the_travel() -> None:
    wide = STAGE.with_axis("x", replace(STAGE.axes["x"], hardware=replace(X, travel=(-0.15, 0.15))))
    assert 0.1 + 0.05 > 0.15  # in floating point
    found = made(Passes("x", span=0.1, speed=0.05, repeats=1, at=(0.1, 0.0)), model=wide)
    assert found.position[:, 0].max() == 0.15


def test_a_staircase_holds_every_speed_over_half_of_its_move() -> None:
    longest = 1.0
    found = made(Staircase("y", SPEEDS, 0.03, longest_plateau=longest, at=(-0.1, 0.06)))
    for speed in SPEEDS:
        forward, back = plateaus(found.velocity[:, 1], speed)
        assert forward == pytest.approx(-back, abs=1)
        held = speed * forward / RATE
        assert held >= 0.5 * min(0.03, held + speed * LIMITS[1].ramp_time(speed)) - speed / RATE
        assert forward / RATE <= longest + 2.0 / RATE
        # The plateau lies around the place of the experiment, whatever the speed.
        at_speed = found.position[np.isclose(found.velocity[:, 1], speed, rtol=1e-12), 1]
        assert (at_speed.min() + at_speed.max()) / 2 == pytest.approx(0.06, abs=speed / RATE)
    assert (found.position[:, 0] == -0.1).all()


def test_reversals_turn_at_the_amplitude() -> None:
    found = made(Reversals("x", 50, amplitude=4e-6, dwell=0.02, at=(0.1, 0.0)))
    x = found.position[:, 0] - 0.1
    assert (x.max(), x.min()) == (pytest.approx(4e-6, abs=1e-15), pytest.approx(-4e-6, abs=1e-15))
    direction = np.sign(found.velocity[np.abs(found.velocity[:, 0]) > 1e-6, 0])
    assert np.count_nonzero(np.diff(direction)) == 99


def test_an_open_loop_sine_is_force_alone() -> None:
    found = made(OpenLoopSine("y", 30.0, amplitude=0.21, period=3.0, at=(0.1, -0.04)))
    assert found.position.shape == (60_000, 2)
    assert (found.position == [0.1, -0.04]).all()
    assert not found.velocity.any()
    assert not found.force[:, 0].any()
    expected = 0.21 * np.sin(2.0 * np.pi / 3.0 * np.arange(60_000) / RATE)
    np.testing.assert_allclose(found.force[:, 1], expected, atol=1e-12)


@pytest.mark.parametrize(("axis", "moves"), [("x", 1), ("y", 0)])
def test_the_other_axis_goes_back_and_forth_meanwhile(axis: str, moves: int) -> None:
    experiment = Passes(axis, span=0.08, speed=0.02, repeats=1, other=0.06)
    found, alone = made(experiment), made(replace(experiment, other=0.0))
    np.testing.assert_array_equal(found.position[:, 1 - moves], alone.position[:, 1 - moves])
    other = found.position[:, moves] - MIDDLE[moves]
    assert (other.max(), other.min()) == (pytest.approx(0.03), pytest.approx(-0.03))
    goes = np.flatnonzero(np.diff(np.sign(other[np.abs(other) > 0.029])))
    assert len(goes) >= 3, "more than once"
    with pytest.raises(CannotRun, match="longer"):
        made(Passes(axis, span=1e-4, speed=0.001, repeats=1, dwell=0.0, other=0.06))
    alone_there = MachineModel("one", {"x": STAGE.axes["x"]}, RATE)
    with pytest.raises(CannotRun, match="has no second axis; leave it out"):
        made(Passes("x", span=0.08, speed=0.02, repeats=1, other=0.06), model=alone_there)


def test_steps_go_through_the_span_and_back_once_with_each_effort() -> None:
    found = made(Steps("y", span=0.06, step=0.02, efforts=(1.0, 0.4), dwell=0.05))
    y = found.position[:, 1]
    rests = [y[a] for a, b in stays(found.velocity[:, 1]) if b - a > 0.04 * RATE]
    stairs = MIDDLE[1] + np.array([-0.03, -0.01, 0.01, 0.03, 0.01, -0.01, -0.03])
    np.testing.assert_allclose(rests, [*stairs, *stairs[1:]], atol=1e-9)
    a = np.abs(found.acceleration[:, 1])
    half = len(a) // 2
    assert a[: half // 2].max() > 2.0 * a[half + half // 2 :].max()


def test_rests_are_as_long_as_asked_before_each_pair_of_moves() -> None:
    found = made(Rests("x", span=0.02, speed=0.04, rests=(0.3, 0.8)))
    lengths = np.diff(stays(found.velocity[:, 0]))[:, 0] / RATE
    np.testing.assert_allclose(lengths, [0.15, 0.15, 0.55, 0.4, 0.4], atol=4 / RATE)


def test_a_sweep_rises_from_its_lowest_to_its_highest_frequency() -> None:
    sweep = Sweep("x", 0.1, 0.05, 2, amplitude=0.4, lowest=4.0, highest=80.0, effort=0.5)
    found = made(sweep)
    force = found.force[:, 0]
    assert not found.force[:, 1].any()
    assert np.abs(force).max() == pytest.approx(0.4, rel=1e-3)
    up = np.flatnonzero((force[:-1] < 0.0) & (force[1:] >= 0.0)) / RATE
    middles, rates = (up[1:] + up[:-1]) / 2.0, 1.0 / np.diff(up)
    wanted = 4.0 * 20.0 ** (middles / found.duration)  # the same factor in the same time
    slow = rates < 30.0
    np.testing.assert_allclose(rates[slow], wanted[slow], rtol=0.03)
    assert rates[0] < 5.0
    most = sweep.most_force(STAGE.axes["x"])
    made(replace(sweep, amplitude=most))
    with pytest.raises(CannotRun, match="amplitude"):
        made(replace(sweep, amplitude=1.001 * most))


def test_a_multisine_is_a_slow_motion_and_sines_of_equal_accelerations() -> None:
    asked = Multisine("y", period=2.0, repeats=3, span=0.02, lowest=5.0, highest=40.0, phases=1)
    found = made(asked)
    samples = round(2.0 * RATE)
    assert len(found) == 5 * samples
    y = found.position[:, 1] - MIDDLE[1]
    np.testing.assert_allclose(found.position[:, 0], MIDDLE[0], rtol=1e-12)
    periods = y[samples:-samples].reshape(3, samples)
    np.testing.assert_allclose(periods[1:], periods[:-1], atol=1e-12)
    lines = np.abs(np.fft.rfft(periods[0])) / (samples / 2)
    assert lines[1] == pytest.approx(0.5 * 0.02)  # a swing of the span a period
    sines = lines[10:81] * np.arange(10, 81) ** 2
    np.testing.assert_allclose(sines, sines[0], rtol=1e-9)
    assert lines[[0, *range(2, 10), *range(81, 200)]].max() < 1e-9 * lines[10]
    used = [
        np.abs(found.velocity[:, 1]).max() / Y.velocity,
        np.abs(found.acceleration[:, 1]).max() / Y.acceleration,
        np.abs(np.diff(found.acceleration[:, 1])).max() * RATE / Y.jerk,
    ]
    assert 0.85 < max(used) <= 1.0 + 1e-9  # what the slow motion leaves of one limit
    for end in (0, -1):
        assert abs(y[end]) < 1e-6
        assert abs(found.velocity[end, 1]) < 1e-4
    other = made(replace(asked, phases=2)).position[:, 1]
    assert np.abs(other - found.position[:, 1]).max() > 1e-5


def test_tracking_excites_speeds_reversals_and_travel() -> None:
    found = made(Tracking(60.0), 1)
    for i, axis in enumerate(LIMITS):
        velocity = found.velocity[:, i]
        moving = velocity[np.abs(velocity) > 1e-12]
        speed = np.abs(moving)
        assert np.ptp(found.position[:, i]) > 0.75 * (axis.travel[1] - axis.travel[0])
        assert speed.max() > 0.8 * axis.velocity
        for low, high in pairwise([5e-4, 2e-3, 1e-2, 5e-2, axis.velocity]):
            assert ((speed > low) & (speed <= high)).mean() > 0.03
        assert np.count_nonzero(np.diff(np.sign(moving))) >= 15
    assert (np.abs(found.velocity) < 1e-12).all(axis=1).mean() < 0.2


@pytest.mark.parametrize("duration", [0.0005, 0.2, 7.0])
def test_tracking_lasts_exactly_as_long_as_asked_and_is_drawn_by_its_seed(duration: float) -> None:
    a, b, c = (made(Tracking(duration), seed) for seed in (1, 1, 2))
    assert len(a) == round(duration * RATE)
    np.testing.assert_allclose(a.position[0], MIDDLE, atol=1e-12)
    np.testing.assert_array_equal(a.position, b.position)
    assert duration < 0.1 or not np.array_equal(a.position, c.position)


REFUSED = {
    "outside": (Passes("x", 0.3, 0.1, 1), CannotRun, r"-0\.12 m of axis x is outside its travel"),
    "place": (Reversals("y", 1, at=(0.0, 5.0)), CannotRun, "5 m of axis y.*not in mm"),
    "few places": (Passes("x", 0.1, 0.1, 1, at=(0.0,)), InputError, "2 positions in m, one per"),
    "speed": (Passes("x", 0.1, 0.4, 1), CannotRun, "above its limit of 0.3 m/s"),
    "span": (Passes("y", 0.01, 0.1, 1), CannotRun, r"axis y is not held over half of 0\.01 m"),
    "endless": (Passes("x", 0.1, 0.1, 10**12), CannotRun, "change the duration, the repeats"),
    "no motion": (Moves(1, dwell=0.0), InputError, "duration 0 s"),
    **{
        f"long {type(e).__name__}": (e, CannotRun, "^duration 100000 s at 2000 Hz is 2e.08 samples")
        for e in (OpenLoopSine("x", 1e5), Tracking(1e5), Moves(3, duration=1e5))
    },
    "effort": (Passes("x", 0.1, 0.1, 1, effort=1.01), InputError, "effort = 1.01"),
    "axis": (Passes("z", 0.1, 0.1, 1), InputError, "x, y"),
    "period": (OpenLoopSine("x", 1.0, period=5e-4), InputError, "at least 0.001 s"),
    "slowest": (Tracking(1.0, slowest=0.22), CannotRun, "axis y, 0.2 m/s"),
    "falling": (Sweep("x", 0.1, 0.05, 1, 1e-6, 80.0, 80.0, effort=0.5), InputError, "rising"),
    "too high": (
        Sweep("x", 0.1, 0.05, 1, 1e-9, 4.0, 1e3, effort=0.5),
        CannotRun,
        "lowest = 4 Hz, highest = 1000 Hz: .* below half the sample rate of 2000 Hz",
    ),
    "efforts": (
        Steps("x", 0.1, 0.02, (0.4, 1.2, 1.1)),
        InputError,
        "^efforts = 1.2: give parts of the lim",
    ),
    "sines": (
        Multisine("x", 2.0, 1, 0.01, 40.0, 5.0, 1),
        InputError,
        "lowest = 40 Hz, highest = 5 Hz: .* at least 0.5 Hz, below half the sample rate of 2000",
    ),
    "fast sines": (Multisine("x", 2.0, 1, 0.01, 1.0, 1e3, 1), InputError, "highest = 1000 Hz"),
    "slow motion": (
        Multisine("x", 0.2, 1, 0.1, 10.0, 40.0, 1),
        CannotRun,
        "the slow motion alone goes beyond the limits of axis x; give a longer period",
    ),
    "other": (
        Passes("x", 1e-4, 0.001, 1, dwell=0.0, other=0.06),
        CannotRun,
        r"other = 0.06 m: one round takes 1\.\d\d s, the experiment lasts 0\.2\d* s; give a small",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_run_is_one_line_that_says_what_to_do(name: str) -> None:
    experiment, kind, said = REFUSED[name]
    with pytest.raises(InputError, match=said) as refused:
        made(experiment)
    assert type(refused.value) is kind
    assert "\n" not in str(refused.value)
    assert "np.float64" not in str(refused.value)


def test_a_machine_without_a_travel_cannot_be_moved() -> None:
    free = MachineModel("free", {"q": AxisModel(1.0, Hardware(), rotary=True)})
    with pytest.raises(CannotRun, match=r"give travel = \[low, high\] in rad"):
        made(Tracking(1.0), model=free)


@pytest.mark.parametrize(
    ("fields", "said"),
    [
        ({"span": 0.0}, "span = 0.0 m: is not allowed; give a number above 0 m"),
        ({"speed": np.inf}, "speed = inf m/s"),
        ({"dwell": -1.0}, "dwell = -1.0 s: is not allowed; give 0 or more s"),
        ({"repeats": 0}, "repeats 0 is not allowed: give a whole number of at least 1"),
        ({"repeats": 1.5}, "repeats 1.5 is not allowed"),
    ],
)
def test_a_number_that_is_refused_says_what_is_allowed(fields, said: str) -> None:
    with pytest.raises(InputError, match=said):
        Passes(**{"axis": "x", "span": 0.1, "speed": 0.1, "repeats": 1, **fields})
    with pytest.raises(InputError, match="speeds: is empty; give at least one number in m/s"):
        Staircase("x", (), 0.1)


def test_every_number_of_an_experiment_has_its_unit() -> None:
    for kind in KINDS.values():
        for f in fields(kind):
            assert f.name == "axis" or f.metadata["unit"] in {"m", "s", "m/s", "N", "Hz", "1", ""}
            assert f.name == "axis" or len(f.metadata["meaning"]) > 3


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize("name", EXPERIMENTS)
def test_a_named_experiment_moves_its_axis_alone(name: str, axis: str) -> None:
    found = made(find_experiment(name, STAGE, axis, 6.0))
    if name not in ("tracking", "moves"):
        busy = np.ptp(found.position, axis=0) + np.ptp(found.force, axis=0)
        assert busy["xy".index(axis)] > 0.0 == busy[1 - "xy".index(axis)]


def test_a_map_runs_the_speeds_that_the_axis_reaches() -> None:
    staircase = find_experiment("velocity_map", STAGE, "x", 10.0)
    fastest = LIMITS[0].fastest_plateau(staircase.span)
    assert staircase.speeds == tuple(s for s in MAP_SPEEDS if s <= fastest)
    assert find_experiment("velocity_map", STAGE).axis == "x"
    passes = find_experiment("cable_pass", STAGE, "y", 60.0)
    assert passes.span == pytest.approx(0.88 * 0.14)
    assert passes.speed == 0.1
    assert 2 * passes.repeats * passes.span / 0.1 <= 60.0 < 2 * (passes.repeats + 1) * 0.14 / 0.1


MODEL = twin.load_model("proton_xy")


def seconds(experiment: Experiment, seed: int = 0) -> float:
    return experiment.setpoint(MODEL, np.random.default_rng(seed)).duration


@pytest.mark.parametrize("asked", [3.0, 20.0])
@pytest.mark.parametrize("name", sorted(EXPERIMENTS))
def test_a_named_experiment_lasts_what_was_asked(name, asked):
    lasts = seconds(find_experiment(name, MODEL, duration=asked), seed=4)
    if name == "cable_pass" and asked < 6.0:  # a pass each way over the travel at 0.1 m/s
        assert lasts == pytest.approx(6.2, abs=0.1)
        assert missed(asked, lasts) is not None
    else:
        assert lasts == pytest.approx(asked, rel=0.05)


@pytest.mark.parametrize("draft", [
    Passes("x", 0.05, 0.1, 1), Passes("x", 0.05, 0.1, 500), Passes("x", 0.05, 0.1, 3, other=0.1),
    Staircase("x", (0.01, 0.1), 0.05), Steps("x", 0.1, 0.05, (1.0, 0.5)),
    Rests("x", 0.01, 0.05, (0.1, 1.0)), Sweep("x", 0.05, 0.1, 1, 0.1, 2.0, 60.0, effort=0.5),
])  # fmt: skip
def test_a_draft_of_any_kind_fills_the_time_with_repeats_and_rests(draft):
    found = lasting(draft, MODEL, 9.0)
    assert seconds(found) == pytest.approx(9.0, rel=0.02)
    assert type(found) is type(draft)
    assert found.span == draft.span


def test_moves_of_a_given_length_visit_as_many_places_as_fit_whatever_the_seed():
    for seed in range(5):
        assert seconds(Moves(100, duration=7.0), seed) == pytest.approx(7.0, abs=1e-3)
    few = seconds(Moves(3, duration=20.0))  # three places, with rests between
    assert few == pytest.approx(20.0, abs=1e-3)
    assert seconds(Moves(100, dwell=0.0, duration=0.01)) < 1.5  # one move at least


def test_what_takes_longer_or_ends_earlier_is_said_with_both_lengths():
    assert missed(10.0, 10.4) is None
    assert "lasts 6.2 s, not 5 s as asked: its moves take" in missed(5.0, 6.2)
    assert "lasts 3 s, not 5 s as asked: it has no rests" in missed(5.0, 3.0)


@pytest.mark.parametrize("name", ["tracking", "moves"])
def test_an_experiment_that_moves_all_axes_takes_none(name: str) -> None:
    with pytest.raises(InputError, match=f"axis y: {name} moves all axes .*take one of cable_pass"):
        twin.simulate(STAGE, name, duration=1.0, axis="y")
