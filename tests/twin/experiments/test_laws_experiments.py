"""Experiments give what their fields say, on the axis and at the place they name.

Times, speeds, spans and forces are read off the setpoint by counting samples.
"""

from dataclasses import fields, replace

import numpy as np
import pytest

from twin.errors import InputError
from twin.experiments.experiment import _require, gentle, machine_limits
from twin.experiments.kinds import (
    KINDS,
    Moves,
    Passes,
    Rests,
    Steps,
    Sweep,
)
from twin.experiments.named import EXPERIMENTS, MAP_SPEEDS, find_experiment
from twin.experiments.trajectory import Setpoint
from twin.experiments.trajectory.limits import axis_name
from twin.model.machine import AxisModel, Hardware, MachineModel

RATE = 2000.0
X = Hardware(travel=(-0.11, 0.17), force_limit=30.0, velocity=0.3, acceleration=4.0, jerk=300.0)
Y = Hardware(travel=(-0.05, 0.09), force_limit=20.0, velocity=0.2, acceleration=3.0, jerk=150.0)
STAGE = MachineModel("s", {"x": AxisModel(3.0, X), "y": AxisModel(5.0, Y)}, sample_rate=RATE)
LIMITS = machine_limits(STAGE)
MIDDLE = (0.03, 0.02)


def made(experiment, seed: int = 0) -> Setpoint:
    return experiment.setpoint(STAGE, np.random.default_rng(seed))


# --- experiments ----------------------------------------------------------------------------------


def test_an_experiment_without_a_place_is_in_the_middle_and_gentle_by_its_effort() -> None:
    whole = made(Passes("x", span=0.1, speed=0.1, repeats=1))
    half = made(Passes("x", span=0.1, speed=0.1, repeats=1, effort=0.5))
    for found, effort in ((whole, 1.0), (half, 0.5)):
        np.testing.assert_allclose(found.position[0], [MIDDLE[0] - 0.05, MIDDLE[1]])
        a = found.acceleration[:, 0]
        assert np.abs(a).max() == pytest.approx(effort * 4.0, rel=1e-6)
        assert np.abs(np.diff(a)).max() * RATE == pytest.approx(effort * 300.0, rel=1e-3)
    assert gentle(LIMITS[1], 0.3) == replace(LIMITS[1], acceleration=0.3 * 3.0, jerk=0.3 * 150.0)
    with pytest.raises(InputError, match="effort"):
        made(Passes("x", span=0.1, speed=0.1, repeats=1, effort=1.01))


@pytest.mark.parametrize(("axis", "moves"), [("x", 1), ("y", 0)])
def test_the_other_axis_goes_back_and_forth_meanwhile(axis: str, moves: int) -> None:
    found = made(Passes(axis, span=0.08, speed=0.02, repeats=1, other=0.06))
    alone = made(Passes(axis, span=0.08, speed=0.02, repeats=1))
    own = 1 - moves
    np.testing.assert_array_equal(found.position[:, own], alone.position[:, own])
    other = found.position[:, moves] - MIDDLE[moves]
    assert other.max() == pytest.approx(0.03)
    assert other.min() == pytest.approx(-0.03)
    assert np.abs(found.velocity[:, moves]).max() <= (0.3, 0.2)[moves] * (1 + 1e-9)
    for a, b in ((found.position, found.velocity), (found.velocity, found.acceleration)):
        mean = 0.5 * (b[1:, moves] + b[:-1, moves]) / RATE
        np.testing.assert_allclose(np.diff(a[:, moves]), mean, rtol=0, atol=300.0 / RATE**2)
    goes = np.flatnonzero(np.diff(np.sign(other[np.abs(other) > 0.029])))
    assert len(goes) >= 3, "more than once"
    with pytest.raises(InputError, match="longer"):
        made(Passes(axis, span=1e-4, speed=0.001, repeats=1, dwell=0.0, other=0.06))


def test_steps_go_through_the_span_and_back_once_with_each_effort() -> None:
    found = made(Steps("y", span=0.06, step=0.02, efforts=(1.0, 0.4), dwell=0.05))
    y, still = found.position[:, 1], found.velocity[:, 1] == 0.0
    edges = np.flatnonzero(np.diff(np.r_[0, still.astype(int), 0]))
    rests = [y[a] for a, b in zip(edges[::2], edges[1::2], strict=True) if b - a > 0.04 * RATE]
    stairs = MIDDLE[1] + np.array([-0.03, -0.01, 0.01, 0.03, 0.01, -0.01, -0.03])
    np.testing.assert_allclose(rests, [*stairs, *stairs[1:]], atol=1e-9)
    a = np.abs(found.acceleration[:, 1])
    half = len(a) // 2
    assert a[: half // 2].max() > 2.0 * a[half + half // 2 :].max()
    made(Steps("y", span=0.06, step=0.02, efforts=(1.0,)))
    with pytest.raises(InputError, match="efforts"):
        made(Steps("y", span=0.06, step=0.02, efforts=(0.4, 1.01)))


def test_rests_are_as_long_as_asked_before_each_pair_of_moves() -> None:
    found = made(Rests("x", span=0.02, speed=0.04, rests=(0.3, 0.8)))
    still = found.velocity[:, 0] == 0.0
    edges = np.flatnonzero(np.diff(np.r_[0, still.astype(int), 0]))
    lengths = (edges[1::2] - edges[::2]) / RATE
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
    with pytest.raises(InputError, match="amplitude"):
        made(replace(sweep, amplitude=1.001 * most))
    for low, high in ((80.0, 80.0), (4.0, 0.5 * RATE)):
        with pytest.raises(InputError, match="highest"):
            made(replace(sweep, amplitude=1e-6, lowest=low, highest=high))


UNITS = {"m", "s", "m/s", "N", "Hz", "1", ""}


def test_every_number_of_an_experiment_has_its_unit_and_one_is_the_least_count() -> None:
    for kind in KINDS.values():
        for f in fields(kind):
            assert f.name == "axis" or f.metadata["unit"] in UNITS
            assert f.name == "axis" or f.metadata["meaning"] not in UNITS
    assert Moves(count=1).count == 1
    assert [axis_name(i) for i in range(5)] == ["x", "y", "z", "3", "4"]


def test_a_number_that_is_refused_says_what_is_allowed() -> None:
    """Zero where a number may be zero, and nowhere else."""
    for value, zero, allowed in (
        (0.0, False, "give a number above 0 m"),
        (-1.0, True, "0 or more"),
    ):
        with pytest.raises(InputError, match=allowed):
            _require("span", value, "m", zero)
    _require("span", 0.0, "m", zero=True)
    with pytest.raises(InputError, match=r"span: is empty; give at least one number in m"):
        _require("span", (), "m", zero=True)


# --- named experiments ----------------------------------------------------------------------------


@pytest.mark.parametrize("axis", ["x", "y"])
@pytest.mark.parametrize("name", EXPERIMENTS)
def test_a_named_experiment_lasts_about_as_long_as_asked_on_its_axis(name: str, axis: str) -> None:
    for duration in (6.0, 18.0):
        found = made(find_experiment(name, STAGE, axis, duration))
        assert 0.3 * duration < found.duration < 2.0 * duration
        if name not in ("tracking", "moves"):
            busy = np.ptp(found.position, axis=0) + np.ptp(found.force, axis=0)
            assert busy["xy".index(axis)] > 0.0 == busy[1 - "xy".index(axis)]
    exact = {"tracking", "open_loop_sine"}
    assert (found.duration == pytest.approx(18.0, abs=1e-9)) == (name in exact)


def test_a_map_runs_the_speeds_that_the_axis_reaches() -> None:
    staircase = find_experiment("velocity_map", STAGE, "x", 10.0)
    fastest = LIMITS[0].fastest_plateau(staircase.span)
    assert staircase.speeds == tuple(s for s in MAP_SPEEDS if s <= fastest)
    assert len(staircase.speeds) * staircase.longest_plateau * 4.0 == pytest.approx(10.0)
    assert find_experiment("velocity_map", STAGE).axis == "x"
    counts = {
        name: [find_experiment(name, STAGE, "x", s) for s in (0.1, 4.5)]
        for name in ("moves", "reversals", "cable_pass")
    }  # at least two places, one reversal, one pass; then by the time that each takes
    assert [e.count for e in counts["moves"]] == [2, 45]
    assert [e.repeats for e in counts["reversals"]] == [1, 20]
    assert counts["cable_pass"][0].repeats == 1
    passes = find_experiment("cable_pass", STAGE, "y", 60.0)
    assert passes.span == pytest.approx(0.88 * 0.14)
    assert passes.speed == 0.1
    assert 2 * passes.repeats * passes.span / 0.1 <= 60.0 < 2 * (passes.repeats + 1) * 0.14 / 0.1
