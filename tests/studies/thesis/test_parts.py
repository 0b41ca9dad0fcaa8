"""Parts of the chapters against closed forms, and their words."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import HARDWARE, axis_of, fitted
from machines import CATALOGUE

from identify.estimation.force_along import force_along
from studies.curves.friction_curve import StribeckCurve
from studies.curves.velocity_map import VelocityMap
from studies.thesis import (
    behaviours,
    cable,
    dynamic,
    future,
    models,
    residuals,
    shared,
    simulation,
    track,
)
from studies.thesis.mixed_friction import PARTS, mixed
from twin.effect import Kind
from twin.logs import AxisLog, Log
from twin.model.machine import AxisModel, Fitted

TRACK, _, STAGE = shared.machine("track")
OLD, _, AGING = shared.machine("aging")
CURVE = StribeckCurve(0.285, 0.335, 0.01, 0.018)
SPEEDS = np.array([0.001, 0.003, 0.006, 0.01, 0.015, 0.03, 0.06, 0.1, 0.2])


def of_cable(x):
    return -(0.05 + 1.5 * x - 2.0 * x**2 + 8.0 * x**3)


# --- the cable ------------------------------------------------------------------------------


def test_what_was_planted_is_read_from_the_log_at_the_positions_of_what_was_found() -> None:
    axis = AxisModel(2.0, HARDWARE, (fitted("cable_slab"), fitted("constant_force"),
                                     fitted("cogging", p=0.031), *axis_of().effects))  # fmt: skip
    x = 0.1 * np.cos(np.linspace(0.0, 9.0, 4001))  # neither rising nor falling
    truth = {"position": x, "cable_slab": 2.0 * x, "constant_force": np.full_like(x, 0.3),
             "cogging": np.sin(900.0 * x), "coulomb_viscous": 7.0 * x}  # fmt: skip
    log = Log(1e3, {"x": AxisLog({"position": x, "force": x})}, truth={"x": truth})
    at = np.array([-0.05, 0.0, 0.08])
    np.testing.assert_allclose(cable.planted(axis, log, "x", at), 2.0 * at + 0.3, atol=1e-4)


def test_the_sine_carries_the_cable_at_its_place_without_feedback() -> None:
    quiet = TRACK.with_axis("x", shared.with_hardware(STAGE, current_noise=0.0))
    log = dynamic.sine(quiet, "x", 0.07, 6.0, np.random.default_rng(0))
    t = np.arange(len(log)) / 1e3
    assert len(log) == round((6.0 + 0.75) * 1e3)
    expected = -of_cable(0.07) + 0.21 * np.sin(2.0 * np.pi * t / 3.0)
    np.testing.assert_allclose(log.axes["x"].force, expected, atol=1e-9)
    assert log.axes["x"].position[0] == pytest.approx(0.07, abs=1e-6)
    late = dynamic.late(log, "x").axes["x"]
    np.testing.assert_array_equal(late.force, log.axes["x"].force[750:])
    np.testing.assert_array_equal(late.position, log.axes["x"].position[750:])


# --- motions --------------------------------------------------------------------------------


def test_the_behaviours_are_what_they_say_and_lugre_has_its_traits() -> None:
    """Loops turn where they should; the small oscillation never reaches the break-away force.

    Under it LuGre creeps; it lags, and pushed fast it breaks away earlier (Al-Bender, Lampaert,
    Swevers 2005).
    """
    model, name, axis = shared.machine("simulation")
    stage, rng = models.noisy(model, name, axis), np.random.default_rng(0)
    logs = behaviours.behaviours(stage, rng)
    static = shared.friction_of(axis).values["Fs"]
    assert np.abs(logs["drift"].axes["x"].force).max() < static
    assert np.abs(logs["break-away"].axes["x"].force).max() > static
    reached = logs["pre-sliding loops"].axes["x"].position
    assert reached.max() == pytest.approx(behaviours.LOOP.max(), rel=0.1)
    assert np.diff(logs["frictional lag"].truth["x"]["position"][600:]).min() > 0.0
    found = behaviours.characteristics(stage, logs, rng)
    assert found["drift"] > 5e-5
    assert found["lag"] > 3e-3
    assert found["fall"] == pytest.approx(0.018, rel=0.05)
    assert found["fast_push"] < 0.7 * found["slow_push"]


# --- laws, loops, starts --------------------------------------------------------------------


def friction(fitted: Fitted) -> np.ndarray:
    position = behaviours.turning(behaviours.LOOP)
    velocity = np.diff(position, append=position[-1]) * behaviours.RATE
    axis = AxisModel(mass=1.0, effects=(fitted,))
    return force_along(axis, position, velocity, 1.0 / behaviours.RATE, Kind.FRICTION)


@pytest.mark.slow
@pytest.mark.parametrize("weight", [0.0, 0.3, 1.0])
def test_a_mixture_is_the_weighted_sum_of_both(weight: float) -> None:
    forgets = {"Fc": 0.3, "Fs": 0.4, "v0": 0.02, "sigma2": 0.5, "sigma0": 900.0, "sigma1": 0.3}
    remembers = {**forgets, "sigma0": 400.0, "sigma1": 0.7, "spread": 5.0}
    first, second = (
        friction(Fitted.at_start(effect, values))
        for effect, values in zip(PARTS, (forgets, remembers), strict=True)
    )
    found = friction(mixed(remembers, forgets, weight))
    np.testing.assert_allclose(found, weight * first + (1.0 - weight) * second, atol=1e-12)
    assert np.abs(first - second).max() > 0.01


def test_a_law_that_remembers_closes_its_inner_loop_and_dahls_does_not() -> None:
    """The gap is between two passes of one turn: of 0.4 in the loop, of 0.6 in the nested ones."""
    known, leg = shared.friction_of(AGING).values, round(behaviours.LEG * behaviours.RATE)
    gaps = {}
    for name in ("gms", "dahl"):
        axis = AxisModel(1.0, HARDWARE, (models.like(CATALOGUE[name], known),))
        found = models.loop(axis, behaviours.LOOP)
        gaps[name] = found.gap
        assert found.gap == abs(found.friction[3 * leg - 1] - found.friction[5 * leg - 1])
    assert gaps["gms"] < 1e-4 < 1e-3 < gaps["dahl"]
    nested = models.loop(axis, models.NESTED)
    assert nested.gap == abs(nested.friction[3 * leg - 1] - nested.friction[8 * leg - 1])


# --- simulation, track, future --------------------------------------------------------------


def test_noise_is_a_part_of_each_signals_own_size() -> None:
    rng, n = np.random.default_rng(6), np.arange(40_000)
    x, force, felt = (size * np.sin(n * w) + 3.0 for size, w in ((2.0, 0.1), (50.0, 0.13),
                                                                 (7.0, 0.17)))  # fmt: skip
    log = Log(1e3, {"x": AxisLog({"position": x, "force": force})})
    found = simulation.noisy(log, felt, 0.01, rng).axes["x"]
    off = found.position - x, found.force - force
    assert np.std(off[0]) == pytest.approx(0.01 * 2.0 / 2**0.5, rel=0.02)
    assert np.std(off[1]) == pytest.approx(0.01 * 7.0 / 2**0.5, rel=0.02)
    assert abs(np.corrcoef(*off)[0, 1]) < 0.03
    still = simulation.noisy(log, felt, 0.0, rng).axes["x"]
    np.testing.assert_array_equal([still.position, still.force], [x, force])


def test_a_trial_averages_both_directions_under_the_noise_of_a_plateau() -> None:
    """White noise of a part of the friction, averaged over 100 samples, is a tenth of it."""
    double = replace(CURVE, Fc=0.485, Fs=0.535)
    both = np.r_[SPEEDS, -SPEEDS]
    friction = np.r_[CURVE(SPEEDS), double(SPEEDS)]
    found = VelocityMap(both, friction, 0.0 * both, np.full(len(both), 100.0))
    assert simulation.static_of(found) == pytest.approx([0.385, 0.435, 0.01, 0.018], rel=1e-5)
    many = [simulation.noisy_map(found, 0.2, np.random.default_rng(i)).friction for i in range(400)]
    np.testing.assert_allclose(np.std(many, axis=0), 0.02 * friction, rtol=0.15)
    np.testing.assert_allclose(np.mean(many, axis=0), friction, rtol=4e-3)


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_curve_planted_at_a_place_is_that_of_its_level(way: float) -> None:
    along = np.pi * (0.05 + 0.17) / 0.34
    level = 1.0 + 0.06 * np.cos(along) - 0.015 * np.cos(2 * along) + 0.008 * np.cos(3 * along)
    level *= 1.0 + 0.02 * way
    expected = [0.285 * level, 0.335 * level, 0.01, 0.018]
    values = track.curve_at(STAGE, 0.05, way * SPEEDS)
    assert np.all(np.abs(values / expected - 1.0) < [5e-3, 5e-3, 2e-2, 0.05])


def test_the_level_that_a_machine_had_is_that_of_its_states() -> None:
    """Wear multiplies by 1 + 0.002 s, heat by exp(-0.05 E); a state is read every 100 samples."""
    assert [f.effect.name for f in AGING.effects if future.ages(f)] == ["wear", "thermal_drift"]
    assert not future.ages(fitted("asymmetric_friction"))
    states = {"position": np.zeros(400), "wear_distance": np.linspace(0.0, 40.0, 400),
              "thermal_drift_heat": np.linspace(0.0, 3.0, 400)}  # fmt: skip
    at = np.repeat(np.arange(0, 400, future.THINNED), future.THINNED)
    s, heat = states["wear_distance"][at], states["thermal_drift_heat"][at]
    expected = 0.335 * np.mean((1.0 + 0.002 * s) * np.exp(-0.05 * heat))
    assert future.true_level(AGING, states, "Fs") == pytest.approx(expected)


# The chapters in words: each number in its own place, and what stands out by its name


def test_words_tell_the_number_of_their_entry() -> None:
    """Whatever is large in the numbers is said in the sentence of that matter."""
    shown = {"repeats": 7, "rms_error": 1.1e-4, "largest_error": 2.2e-4, "within_band": 0.93,
             "rms_error_with_spikes": 3.3e-3, "spikes": [1, 2, 3, 4],
             "pitch": {"mean": 0.03407, "standard_error": 1.3e-5, "true": 0.034}}  # fmt: skip
    assert cable.words(shown) == [
        "cable force from 7 passes each way: 0.00011 N RMS from the planted one, at most 0.00022 "
        "N; 93 % of it inside its 90 % band",
        "with the spikes left in, as in the thesis: 0.0033 N RMS",
        "4 spikes, pitch 34.0700 +- 0.013 mm (planted 34 mm)",
    ]
    assert "there is no pitch" in cable.words({**shown, "pitch": None})[-1]
    said = residuals.words({
        "fitted": "lugre", "planted": "gms", "named": (), "verdict": "nothing_missing",
        "test_error_before": 0.06, "test_error_after": 0.021, "noise_floor": 0.02,
        "white": {"before": False, "after": True},
    })  # fmt: skip
    assert "0.06 N, 3.0 times the noise floor, and its residual is not white" in said[0]
    assert said[1] == "the diagnosis names nothing (nothing missing)"
    assert "0.021 N, 1.05 times the noise floor, and the residual is white" in said[2]


def test_words_tell_the_largest_error_of_the_places() -> None:
    record = {"friction_change": 0.01, "force_noise": 0.05, "relative_half_width_90": {"s": 0.5}}
    errors = {"from_rest": [1e-4, 5e-4], "beginning_estimated": [3e-9, 1e-9]}
    said = dynamic.words({
        "records": {"closed_loop": record, "open_loop": {**record, "friction_change": 0.2}},
        "position_error": {"first_period": errors, "after": {k: v[:1] for k, v in errors.items()}},
        "seconds_at_a_place": {"simplex": 2.0, "fit": 0.5}, "position": [0.1, 0.2],
        "simplex": {"s": {"mean": 9.0}},
        "parameters": {"s": {"true": 2.0, "unit": "N/m", "mean": 2.1, "sd": 0.0, "error": 0.05}},
    })  # fmt: skip
    assert "90 % intervals of s +- 50 %; the open-loop sine changes it by 0.2 N" in said[0]
    assert "planted 2 N/m; simplex search from rest 9, fit of simulated motion 2.1" in said[1]
    assert "is 0.0005 m RMS off, from the estimated beginning 3e-09 m; afterwards" in said[2]
    assert "afterwards 0.0001 m and 3e-09 m (largest of 2 places)" in said[2]
    assert "takes 2 s, the fit of simulated motion with its four starts 0.5 s" in said[3]
