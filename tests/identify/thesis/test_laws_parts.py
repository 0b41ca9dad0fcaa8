"""Parts of the chapters against closed forms: motions, forces of laws, planted values, errors."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import CATALOGUE, HARDWARE, axis_of, fitted
from constructed import log_of

from identify.estimation.prescribed_motion import force_along
from identify.thesis import behaviours, cable, dynamic, models, residuals, simulation, twin
from identify.thesis.chapter import Recovered
from twin.core.control import Controller
from twin.effect import Kind
from twin.log import AxisLog, Log
from twin.model.file import load_model
from twin.model.machine import AxisModel, Fitted
from twin.model.parameters import free_parameters

TRACK = load_model("thesis_track", CATALOGUE)
AGING = load_model("thesis_aging", CATALOGUE)
CABLE = {"offset": 0.05, "k1": 1.5, "k2": -2.0, "k3": 8.0}


def of_cable(x):
    return -(0.05 + 1.5 * x - 2.0 * x**2 + 8.0 * x**3)


# --- a chapter's numbers --------------------------------------------------------------------


def test_what_was_found_is_measured_in_parts_of_what_was_planted():
    r = Recovered(-4.0, np.array([-4.4, -4.0, -3.2]), "N")
    assert r.mean == pytest.approx(-3.8666667)
    assert r.error == pytest.approx(-1.0 / 30.0)
    assert r.rms_error == pytest.approx(np.sqrt((0.1**2 + 0.2**2) / 3.0))
    assert r.sd == pytest.approx(np.sqrt((0.5333333**2 + 0.1333333**2 + 0.6666667**2) / 2.0))
    assert Recovered(1.0, np.array([3.0]), "N").sd == 0.0


# --- laws along a prescribed motion ---------------------------------------------------------


def test_forces_along_a_prescribed_motion_are_those_of_the_law_at_that_place_and_speed():
    axis = AxisModel(2.0, HARDWARE, (fitted("cable_slab", **CABLE), *axis_of().effects))
    x, v = np.linspace(-0.1, 0.12, 40), np.linspace(0.3, 0.01, 40)
    force = force_along(axis, x, v, 1e-3, Kind.FORCE)
    np.testing.assert_allclose(force, of_cable(x), rtol=1e-9)
    rubbing = -force_along(axis, x, v, 1e-3, Kind.FRICTION)
    np.testing.assert_allclose(rubbing, 0.31 + 0.53 * v, rtol=1e-9)
    back = force_along(axis, x, -v, 1e-3, Kind.FRICTION)
    np.testing.assert_allclose(back, rubbing, rtol=1e-9)


@pytest.mark.parametrize("period", [1e-3, 4e-3])
def test_a_state_goes_on_by_the_speed_and_the_length_of_a_sample(period):
    """Dahl's force after a way s is Fc (1 - exp(-sigma s / Fc)), whatever the samples."""
    dahl = fitted("dahl", Fc=0.4, sigma0=250.0)
    way = 1e-2
    count = round(way / (0.005 * period))
    v = np.full(count, 0.005)
    x = np.cumsum(v) * period
    force = -force_along(AxisModel(1.0, HARDWARE, (dahl,)), x, v, period, Kind.FRICTION)
    middle = x - 0.5 * 0.005 * period
    np.testing.assert_allclose(force, 0.4 * (1.0 - np.exp(-250.0 * middle / 0.4)), atol=2e-3)


def test_the_cables_force_at_a_place_is_that_of_its_smooth_forces_of_position():
    assert dynamic._cable(TRACK.axes["x"], 0.07) == pytest.approx(of_cable(0.07))
    names = {f.effect.name: cable.of_position(f.effect) for f in TRACK.axes["x"].effects}
    assert [name for name, smooth in names.items() if smooth] == ["cable_slab"]
    assert not cable.of_position(CATALOGUE["cogging"])  # it repeats
    assert not cable.of_position(CATALOGUE["cable_hysteresis"])  # it remembers


def test_what_was_planted_is_read_from_the_log_at_the_positions_of_what_was_found():
    axis = AxisModel(2.0, HARDWARE, (fitted("cable_slab"), fitted("constant_force"),
                                     fitted("cogging", p=0.031), *axis_of().effects))  # fmt: skip
    x = 0.1 * np.cos(np.linspace(0.0, 9.0, 4001))  # neither rising nor falling
    truth = {"position": x, "cable_slab": 2.0 * x, "constant_force": np.full_like(x, 0.3),
             "cogging": np.sin(900.0 * x), "coulomb_viscous": 7.0 * x}  # fmt: skip
    log = Log(1e3, {"x": AxisLog({"position": x, "force": x})}, truth={"x": truth})
    at = np.array([-0.05, 0.0, 0.08])
    np.testing.assert_allclose(cable._planted(axis, log, "x", at), 2.0 * at + 0.3, atol=1e-4)
    found = SimpleNamespace(pitch=SimpleNamespace(value=0.032))
    pitch = cable._pitch(axis, found)
    assert (pitch.true, pitch.mean, pitch.printed, pitch.unit) == (0.031, 0.032, 0.034, "m")
    assert cable._pitch(axis, SimpleNamespace(pitch=None)) is None
    assert cable._pitch(axis_of(), found) is None


# --- motions --------------------------------------------------------------------------------


def test_a_motion_from_turn_to_turn_rests_in_each():
    turns = np.array([0.0, 2.0, -1.0, 0.5])
    x = behaviours.turning(turns)
    leg = round(behaviours.LEG * behaviours.RATE)
    assert len(x) == 3 * leg
    np.testing.assert_allclose(x[::leg], turns[:-1])
    np.testing.assert_allclose(x[leg // 2 :: leg], (turns[1:] + turns[:-1]) / 2.0)
    np.testing.assert_allclose(x[leg - 1 :: leg], turns[1:], atol=1e-4)
    assert np.all(np.sign(np.diff(x[:leg])) == 1.0)


def test_the_speed_swings_about_its_mean_without_a_reversal():
    mean, amplitude, hertz = behaviours.SWING
    v = np.diff(behaviours._swing()) * behaviours.RATE
    assert v.min() > 0.0
    half, second = round(0.5 * behaviours.RATE), round(2.0 * behaviours.RATE)
    np.testing.assert_allclose(v[: half - 1], np.linspace(0.0, mean, half, endpoint=False)[1:])
    for i, f in enumerate(hertz):
        part = v[half - 1 + i * second :][:second]
        t = np.arange(second) / behaviours.RATE
        np.testing.assert_allclose(part, mean + amplitude * np.sin(2 * np.pi * f * t), atol=1e-9)


def test_each_triangle_of_force_begins_at_nothing_and_reaches_both_heights():
    force, begin = behaviours._pushes(), 0
    for period in behaviours.PUSHES:
        part = force[begin : begin + round(period * behaviours.RATE)]
        quarter = len(part) // 4
        np.testing.assert_allclose(
            part[[0, quarter, 2 * quarter, 3 * quarter]],
            behaviours.PUSH * np.array([0.0, 1.0, 0.0, -1.0]), atol=1e-12,
        )  # fmt: skip
        np.testing.assert_allclose(np.abs(np.diff(part)), behaviours.PUSH / quarter)
        begin += len(part)
    assert begin == len(force)


def test_the_steady_force_and_its_oscillation_rise_within_a_second():
    steady, amplitude, hertz = behaviours.DRIFT
    t = np.arange(round(behaviours.DRIFT_TIME * behaviours.RATE)) / behaviours.RATE
    whole = steady + amplitude * np.sin(2.0 * np.pi * hertz * t)
    force = behaviours._oscillation()
    np.testing.assert_allclose(force[1000:], whole[1000:])
    np.testing.assert_allclose(force[:1000], (t * whole)[:1000])


def test_a_setpoint_along_positions_has_their_rates_and_one_of_force_none():
    t = np.arange(400) / behaviours.RATE
    along = behaviours._along(0.01 * np.sin(9.0 * t))
    inner = slice(5, -5)
    np.testing.assert_allclose(along.velocity[inner, 0], 0.09 * np.cos(9 * t)[inner], atol=1e-4)
    np.testing.assert_allclose(
        along.acceleration[inner, 0], -0.81 * np.sin(9 * t)[inner], atol=1e-3
    )
    assert not along.force.any()
    pushed = behaviours._pushed(t)
    np.testing.assert_allclose(pushed.force[:, 0], t)
    assert not any(x.any() for x in (pushed.position, pushed.velocity, pushed.acceleration))


def test_each_behaviour_is_run_by_its_own_motion_in_its_own_loop(monkeypatch):
    seen = []

    def follow(model, setpoint, rngs, *, controllers, **more):
        seen.append((setpoint, controllers))
        assert rngs[0] is not rngs[1]
        return len(seen)

    monkeypatch.setattr(behaviours, "follow", follow)
    monkeypatch.setattr(behaviours, "simulate", lambda model, stairs, **more: stairs)
    found = behaviours.behaviours(AGING, np.random.default_rng(0))
    assert found["velocity map"].speeds == behaviours.SPEEDS
    ran = {name: seen[i - 1] for name, i in found.items() if name != "velocity map"}
    for name, motion in (("pre-sliding loops", behaviours.turning(behaviours.LOOP)),
                         ("frictional lag", behaviours._swing())):  # fmt: skip
        np.testing.assert_allclose(ran[name][0].position[:, 0], motion)
        assert ran[name][1] is None  # under the machine's own controller
    for name, force in (("break-away", behaviours._pushes()), ("drift", behaviours._oscillation())):
        np.testing.assert_allclose(ran[name][0].force[:, 0], force)
        assert ran[name][1] == {"x": Controller()}  # in open loop


# --- loops ----------------------------------------------------------------------------------


def test_the_gap_of_a_loop_is_between_two_passes_of_one_turn(monkeypatch):
    """A force that grows by 1 N a sample: the turn 0.4 is passed twice, two legs apart."""
    seen = {}

    def force(axis, position, velocity, period, *kinds):
        seen.update(position=position, velocity=velocity, period=period, kinds=kinds)
        return -np.arange(len(position), dtype=float)

    monkeypatch.setattr(models, "force_along", force)
    leg = round(behaviours.LEG * behaviours.RATE)
    turns = np.array([0.0, 1.0, -1.0, 0.4, -0.2, 0.4, 1.0])
    found = models._drawn(axis_of(), turns)
    assert found.gap == pytest.approx(2 * leg)
    np.testing.assert_allclose(found.friction, np.arange(6 * leg))
    np.testing.assert_allclose(np.diff(found.position), seen["velocity"][:-1] * seen["period"])
    assert seen["kinds"] == (Kind.FRICTION,)
    nested = np.array([0.0, 1.0, -1.0, 0.6, -0.4, 0.2, 0.0, 0.2, 0.6, 1.0])
    assert models._drawn(axis_of(), nested).gap == pytest.approx(5 * leg)  # of 0.6, not of 0.2


def test_a_law_that_remembers_closes_its_inner_loop_and_dahls_does_not():
    known = residuals.friction_of(AGING.axes["x"]).values
    gaps = {
        name: models._drawn(
            AxisModel(1.0, HARDWARE, (models._like(CATALOGUE[name], known),)), models.LOOP
        ).gap
        for name in ("gms", "dahl")
    }
    assert gaps["gms"] < 1e-4 < 1e-3 < gaps["dahl"]


# --- machines -------------------------------------------------------------------------------


def test_a_friction_like_another_has_its_free_values_by_name():
    known = {"Fc": 0.2, "Fs": 0.7, "n": 9.0, "other": 1.0}
    values = models._like(CATALOGUE["stribeck"], known).values
    start = Fitted.at_start(CATALOGUE["stribeck"]).values
    assert {k: v for k, v in values.items() if v != start[k]} == {"Fc": 0.2, "Fs": 0.7}


def test_only_the_dynamic_part_of_a_friction_is_free():
    axis = dynamic._dynamic_part_free(TRACK.axes["x"])
    assert [c.label for c in free_parameters(axis)] == ["lugre.sigma0", "lugre.sigma1"]


def test_the_dry_part_of_the_drawn_friction_is_scaled_by_one_factor():
    stage = load_model("proton_xy", CATALOGUE)
    drawn = twin._drawn(stage, "x", np.random.default_rng(5)).axes["x"]
    before, after = (residuals.friction_of(a) for a in (stage.axes["x"], drawn))
    dry = {p.name for p in before.effect.parameters if p.dry}
    ratios = {k: after.values[k] / v for k, v in before.values.items() if v}
    factor = np.random.default_rng(5).uniform(0.8, 1.25)
    assert ratios == pytest.approx({k: factor if k in dry else 1.0 for k in ratios})
    assert drawn.mass == stage.axes["x"].mass
    others = [f for f in drawn.effects if f.effect.kind is not Kind.FRICTION]
    assert others == [f for f in stage.axes["x"].effects if f.effect.kind is not Kind.FRICTION]


def test_errors_of_the_closed_loop_are_parts_of_what_the_machine_did():
    t = np.arange(3000) / 1e3
    x, force = 0.02 * np.sin(7.0 * t), np.cos(5.0 * t)
    found = twin.closed_loop_errors(log_of(1e3, x, force), log_of(1e3, 1.03 * x, 0.8 * force), "x")
    expected = {"position": 0.03, "velocity": 0.03, "acceleration": 0.03, "force": 0.2}
    assert found == pytest.approx(expected)


# --- noise of the simulation study ----------------------------------------------------------


def test_noise_is_a_part_of_each_signals_own_size():
    rng = np.random.default_rng(6)
    n = 40_000
    clean = simulation.Clean(*(size * np.sin(np.arange(n) * w) + 3.0 for size, w in
                               ((2.0, 0.1), (50.0, 0.13), (7.0, 0.17))))  # fmt: skip
    position, force = clean.noisy(0.01, rng)
    assert np.std(position - clean.position) == pytest.approx(0.01 * 2.0 / 2**0.5, rel=0.02)
    assert np.std(force - clean.force) == pytest.approx(0.01 * 7.0 / 2**0.5, rel=0.02)
    both = np.corrcoef(position - clean.position, force - clean.force)[0, 1]
    assert abs(both) < 0.03
    still = clean.noisy(0.0, rng)
    np.testing.assert_array_equal(still, (clean.position, clean.force))
