"""Friction and the force of the cable from logs, without a fit of the model."""

from __future__ import annotations

from dataclasses import astuple, replace
from pathlib import Path

import numpy as np
import pytest
from built_fits import axis_of, fitted
from machines import CATALOGUE, tracked
from machines import PROTON as STAGE
from scipy.special import stdtrit

from identify.dataset.motion import motion_of
from identify.dataset.preparation import datasets
from studies.curves.cable_force import (
    CableForce,
    Passes,
    Spike,
    cable_force,
    find_spikes,
    pitch_of,
)
from studies.curves.dynamic_friction import DYNAMIC, dynamic_friction, dynamic_part_free
from studies.curves.friction_curve import (
    LINE,
    NAMES,
    StribeckCurve,
    curve_through,
    fit_stribeck,
    stribeck_through,
)
from studies.curves.velocity_map import VelocityMap, along_track, friction_map, velocity_map
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.experiments import kinds
from twin.experiments.kinds import OpenLoopSine, Reversals, Staircase
from twin.importers import import_log, load_mapping
from twin.logs import Log
from twin.model.file import load_model
from twin.model.machine import Fitted, MachineModel
from twin.model.parameters import free_parameters
from twin.simulation.simulate import simulate
from twin.simulation.simulators import FineSimulator, ReducedSimulator

EXAMPLES = Path(__file__).parents[3] / "examples"
LOCAL = Fitted.at_start(CATALOGUE["position_dependent_friction"], {"c1": 0.06})
ONE = MachineModel("slide", {"x": STAGE.axes["x"].with_effect(LOCAL)}, 1000.0)
SLIDE = MachineModel("slide", {"x": STAGE.axes["x"]}, 2000.0)
CURVE = StribeckCurve(0.285, 0.335, 0.01, 0.018)


def moves(place: float) -> dict[str, Log]:
    return {
        f"{place} {speed}": simulate(
            ONE, Staircase("x", speeds=(speed,) * 2, span=0.01, longest_plateau=1e4, at=(place,)),
            seed=1 + (place > 0.0), simulator=ReducedSimulator,
        )
        for speed in (0.03, 0.06)
    }  # fmt: skip


@pytest.fixture(scope="module")
def logs() -> dict[str, Log]:
    return {**moves(0.102), **moves(-0.102)}


def test_friction_along_the_track_is_read_place_by_place(logs) -> None:
    found = along_track(ONE, logs)
    assert [m.position for m in found] == pytest.approx([-0.102, 0.102], abs=1e-3)
    low, high = (m.curves[1.0].values["Fc"] for m in found)
    assert low > 1.05 * high  # as planted: the level falls along the track
    assert [len(m.map) for m in found] == [8, 8]
    with pytest.raises(InputError, match=r"all logs are of one place.*friction_map"):
        along_track(ONE, dict(list(logs.items())[:2]))


def test_a_map_has_a_curve_each_way_and_the_mean_of_both(logs) -> None:
    found = friction_map(ONE, dict(list(logs.items())[:2]), axis="x")
    ahead, back = (found.curves[way].values for way in (1.0, -1.0))
    assert found.both["Fc"] == pytest.approx(0.5 * (ahead["Fc"] + back["Fc"]))
    assert found.differing == []  # the machine's friction does not know the direction
    assert "8 plateaus" in repr(found)
    assert found.units.velocity == "m/s"


def test_the_axis_must_be_one_that_moves_and_at_constant_speed(logs) -> None:
    with pytest.raises(InputError, match="axis z does not move in the logs; there moves x"):
        friction_map(ONE, logs, axis="z")
    both = tracked(STAGE, 1, 2.0)
    assert len(datasets(STAGE, {"run": both}, {})) == 2
    with pytest.raises(InputError, match="x, y move in the logs; give the axis"):
        velocity_map(STAGE, {"run": both})
    log = simulate(SLIDE, Reversals("x", repeats=8), simulator=ReducedSimulator)
    with pytest.raises(InputError, match="no constant speed"):
        VelocityMap.of(SLIDE.axes["x"], motion_of(log, "x", "log"))


def test_the_map_of_a_real_drive_shows_its_direction_dependent_viscosity(shared_data) -> None:
    """Published: Fv 166.7 and 240.4 N s/m, Fc 20.1 and 20.6 N (IDIM-LS by direction)."""
    mapping = load_mapping(EXAMPLES / "import_emps.toml")
    log = import_log(shared_data / "emps" / "DATA_EMPS.mat", mapping)
    model = load_model(EXAMPLES / "emps.toml", CATALOGUE)
    found = friction_map(model, {"run": log})
    assert found.curves[1.0].values == pytest.approx({"Fc": 20.1, "sigma2": 166.7}, rel=0.06)
    assert found.curves[-1.0].values == pytest.approx({"Fc": 20.6, "sigma2": 240.4}, rel=0.06)
    assert "sigma2" in found.differing


def test_friction_of_a_machine_with_a_cable_lies_on_its_curve() -> None:
    """Between two rollers; the cable's force is taken off, so both directions are alike."""
    speeds = (0.004, 0.02)
    log = simulate(
        SLIDE, Staircase("x", speeds=speeds, span=0.024, at=(0.023,)), simulator=ReducedSimulator
    )
    found = VelocityMap.of(SLIDE.axes["x"], motion_of(log, "x", "log"))
    assert np.sign(found.velocity).tolist() == [1.0, -1.0, 1.0, -1.0]
    assert np.abs(found.velocity) == pytest.approx(np.repeat(speeds, 2), rel=1e-3)
    assert found.friction == pytest.approx(CURVE(np.abs(found.velocity)), abs=1.5e-3)
    whole = velocity_map(SLIDE, {"log": log})
    assert whole.friction.tolist() == found.friction.tolist()
    assert np.all(np.diff(np.abs(found.towards(-1.0).velocity)) > 0.0)


SPEEDS = np.array([0.001, 0.002, 0.004, 0.007, 0.01, 0.015, 0.03, 0.1, 0.2, 0.3])


def one_way(speeds, noise: float, seed: int, repeats: int = 3):
    rng = np.random.default_rng(seed)
    speed = np.repeat(speeds, repeats) * (1.0 + 1e-4 * rng.standard_normal(repeats * len(speeds)))
    friction = CURVE(speed) + noise * rng.standard_normal(len(speed))
    return speed, friction, np.full(len(speed), 100.0)


def test_the_intervals_of_a_curve_hold_the_truth_as_often_as_they_say() -> None:
    """90 % of them; 25 maps leave 79 to 99 % to chance at two standard errors."""
    true = {name: getattr(CURVE, name) for name in NAMES}
    held = []
    for seed in range(25):
        found = curve_through(*one_way(SPEEDS, 1e-3, seed))
        held += [abs(found.values[n] - true[n]) <= found.half[n] for n in NAMES]
    assert 0.79 <= np.mean(held) <= 0.99


def test_few_fast_speeds_are_a_line_and_plateaus_at_one_speed_count_once() -> None:
    fast = one_way(np.array([0.1, 0.2, 0.3]), 1e-4, 1)
    found = curve_through(*fast)
    assert tuple(found.half) == LINE
    assert found.values == pytest.approx({"Fc": 0.285, "sigma2": 0.018}, rel=0.05)
    with pytest.raises(InputError, match="3 plateaus at 1 speed in"):
        curve_through(*one_way(np.array([0.1]), 1e-4, 1))


def test_a_curve_has_the_intervals_of_least_squares() -> None:
    """By the scatter about the curve over its slopes; a plateau weighs by its samples."""
    scatter = 1e-5 * np.random.default_rng(4).standard_normal(len(SPEEDS))
    samples = np.linspace(50.0, 150.0, len(SPEEDS))
    found = stribeck_through(SPEEDS, CURVE(SPEEDS) + scatter, samples)
    assert list(found.values.values()) == pytest.approx(astuple(CURVE)[:4], rel=1e-2)
    columns, weight = found.curve.slopes(SPEEDS), np.diag(samples)
    left, freedom = found(SPEEDS) - CURVE(SPEEDS) - scatter, len(SPEEDS) - 4
    covariance = np.linalg.inv(columns.T @ weight @ columns) * (left @ weight @ left) / freedom
    expected = stdtrit(freedom, 0.95) * np.sqrt(np.diag(covariance))
    assert [found.half[n] for n in NAMES] == pytest.approx(expected, rel=1e-5)


def test_a_curve_without_noise_is_found_exactly() -> None:
    found = fit_stribeck(SPEEDS, CURVE(SPEEDS), None)
    assert astuple(found) == pytest.approx(astuple(CURVE), rel=1e-6)
    with pytest.raises(InputError, match="four parameters, the map 3 speeds"):
        fit_stribeck(SPEEDS[:3], CURVE(SPEEDS[:3]))


def test_the_slopes_are_those_of_the_curve() -> None:
    for i, name in enumerate(("Fc", "Fs", "v0", "sigma2")):
        step = 1e-6 * getattr(CURVE, name)
        moved = replace(CURVE, **{name: getattr(CURVE, name) + step})
        change = (moved(SPEEDS) - CURVE(SPEEDS)) / step
        assert CURVE.slopes(SPEEDS)[:, i] == pytest.approx(change, rel=1e-4, abs=1e-9)


LUGRE = fitted("lugre", Fc=0.285, Fs=0.335, v0=0.01, sigma2=0.018, sigma0=260.0, sigma1=0.6)


def test_only_the_dynamic_part_of_a_friction_is_free() -> None:
    axis = dynamic_part_free(axis_of(fitted("constant_force")).with_effect(LUGRE))
    assert [c.label for c in free_parameters(axis)] == [f"lugre.{name}" for name in DYNAMIC]
    with pytest.raises(InputError, match="coulomb_viscous: no friction with a stiffness"):
        dynamic_part_free(axis_of())


def test_both_are_found_from_a_sine_below_the_break_away() -> None:
    axis = axis_of(mass=15.0).with_effect(LUGRE)
    quiet = replace(axis, hardware=replace(axis.hardware, current_noise=0.0))
    machine = MachineModel("slide", {"x": quiet}, 1000.0)
    sine = OpenLoopSine("x", 6.0, amplitude=0.21, period=3.0)
    log = simulate(machine, sine, seed=2, simulator=FineSimulator)
    wrong = machine.with_axis("x", quiet.with_effect(replace(LUGRE, values={
        **LUGRE.values, "sigma0": 90.0, "sigma1": 3.0})))  # fmt: skip
    found = dynamic_friction(wrong, {"sine": log})
    values = found.axis["lugre"].values
    assert values["sigma0"] == pytest.approx(260.0, rel=2e-3)
    assert values["sigma1"] == pytest.approx(0.6, rel=2e-2)
    assert values["Fc"] == 0.285
    assert found.error < 1e-7


# The force of the cable from passes, and the spikes that are kept out of it


STAGE = load_model("proton_xy", load_catalogue())
ALONE = MachineModel("slide", {"x": STAGE.axes["x"]}, STAGE.sample_rate)
PLACE = np.linspace(-0.14, 0.14, 600)
CABLE = -(0.05 + 1.5 * PLACE - 2.0 * PLACE**2)


def made(ahead: float, behind: float, rng: np.random.Generator, pitch: float = 0.03) -> Passes:
    """Five passes each way with friction, a cable and bumps that brake by that much (N)."""
    apart = (PLACE - 0.004 + 0.5 * pitch) % pitch - 0.5 * pitch
    bump = np.maximum(1.0 - (apart / 0.002) ** 2, 0.0) ** 2
    noise = 1e-3 * rng.standard_normal((2, 5, len(PLACE)))
    return Passes(
        PLACE, 0.3 - CABLE + ahead * bump + noise[0], -0.3 - CABLE - behind * bump + noise[1]
    )


@pytest.mark.parametrize(("ahead", "behind"), [(0.06, -0.06), (-0.05, 0.02)])
def test_spikes_are_found_whichever_way_they_push(ahead: float, behind: float) -> None:
    spikes = find_spikes(made(ahead, behind, np.random.default_rng(1)))
    found = pitch_of(spikes)
    assert len(spikes) == 9
    assert found is not None
    assert found.value == pytest.approx(0.03, abs=2e-5)
    assert abs(found.value - 0.03) < 4.0 * found.standard_error
    assert np.mean([s.ahead for s in spikes]) == pytest.approx(ahead, abs=5e-3)


def test_a_track_without_spikes_has_none_and_one_not_found_leaves_the_pitch_as_it_is() -> None:
    assert find_spikes(made(0.0, 0.0, np.random.default_rng(2))) == ()
    assert pitch_of(()) is None
    places = np.array([0.0, 1.0, 2.0, 4.0, 5.0]) * 0.03
    found = pitch_of(tuple(Spike(p, 0.004, 0.05, 0.05) for p in places))
    assert found is not None
    assert found.value == pytest.approx(0.03)


def test_no_force_is_told_beyond_a_spike_at_the_end_and_its_band_holds_the_truth() -> None:
    """Where the grid begins 2.2 mm before a bump of 4 mm, nothing is known before the bump."""
    whole = made(0.05, 0.05, np.random.default_rng(3))
    first = int(np.searchsorted(PLACE, 0.004 - 0.12 - 0.0022))
    begun = whole.part(slice(first, None))
    found = CableForce.of(begun)
    assert found.spikes[0].centre == pytest.approx(0.004 - 0.12, abs=2e-4)
    assert found.position[0] > found.spikes[0].centre + 0.002
    assert found.position[-1] == PLACE[-1]
    assert found.kept[0]
    true = np.interp(found.position, PLACE, CABLE)
    assert found.force == pytest.approx(true, abs=2e-3)
    assert 0.75 < np.mean(np.abs(found.force - true) < found.band) < 0.99


@pytest.mark.slow
def test_passes_of_a_machine_give_its_cable_and_its_pitch() -> None:
    passes = kinds.Passes("x", span=0.3, speed=0.1, repeats=2)
    log = simulate(STAGE, passes, seed=1, simulator=ReducedSimulator)
    found = cable_force(STAGE, {"passes": log}, axis="x")
    assert found.pitch is not None
    assert found.pitch.value == pytest.approx(0.034, abs=1e-4)
    log = tracked(ALONE, 1, 3.0)
    with pytest.raises(InputError, match="two each way"):
        cable_force(ALONE, {"log": log})
    apart = {f"{at}": simulate(ALONE, kinds.Staircase("x", speeds=(0.06,) * 2, span=0.01, at=(at,)),
                               seed=k, simulator=ReducedSimulator)
             for k, at in enumerate((0.102, -0.102))}  # fmt: skip
    with pytest.raises(InputError, match="no stretch of the track in common"):
        cable_force(ALONE, apart)
