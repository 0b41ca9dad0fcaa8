"""Fit of simulated motion: planted values, beginnings, several starts, and the public EMPS task."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from cli_runs import twin
from machines import CATALOGUE

import identify
from identify.dataset.preparation import datasets
from identify.dataset.prepared_log import PreparedLog
from identify.estimation.fit import Outcome
from identify.estimation.open_loop import measured_beginning, simulated_error
from identify.estimation.simulated_motion import MotionFit, fit_simulated_motion, rough_minimum
from identify.output.words.fit import HELD_OUT_GREW, motion_fit_in_words
from twin.errors import InputError
from twin.experiments.kinds import OpenLoopSine
from twin.importers import import_log, load_mapping
from twin.logs import AxisLog, Log, write_log
from twin.model.file import load_model, save_model
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.model.parameters import free_parameters, read, write
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator

EXAMPLES = Path(__file__).parents[3] / "examples"
RATE = 1000.0
NOISE = 1e-7  # m


@pytest.fixture(scope="module")
def slide() -> MachineModel:
    """A mass under dry and viscous friction, driven by a force alone."""
    friction = Fitted.at_start(
        CATALOGUE["dahl"], {"Fc": 2.0, "sigma2": 20.0, "sigma0": 2e4, "n": 1.0}
    )
    axis = AxisModel(mass=5.0, effects=(friction,))
    hardware = replace(axis.hardware, encoder_noise=NOISE, travel=(-1.0, 1.0))
    axis = replace(axis, hardware=hardware)
    return MachineModel("slide", {"x": axis}, RATE)


@pytest.fixture(scope="module")
def log(slide) -> Log:
    motion = OpenLoopSine("x", 6.0, amplitude=6.0, period=1.5)
    return simulate(slide, motion, seed=3, simulator=ReducedSimulator)


def prepared(model: MachineModel, log: Log) -> tuple[PreparedLog, ...]:
    return datasets(model, {"log": log}, {}, 0.1)["x"].training


@pytest.mark.slow
def test_planted_values_are_found_from_a_start_a_tenth_off(slide, log) -> None:
    axis, where = slide.axes["x"], free_parameters(slide.axes["x"])
    found = fit_simulated_motion(write(axis, where, 1.1 * read(axis, where)), prepared(slide, log))
    np.testing.assert_allclose(read(found.axis, where), read(axis, where), rtol=2e-3)
    assert found.error == pytest.approx(NOISE, rel=0.1)  # what is left is the readings' noise
    assert found.error < 1e-3 * found.error_begun
    assert len(found.errors_of_starts) == 4


@pytest.mark.slow
def test_a_log_that_begins_in_motion_is_begun_as_it_was(slide, log) -> None:
    columns = {name: column[700:] for name, column in log.axes["x"].columns.items()}
    late = Log(RATE, {"x": AxisLog(columns)})
    part = prepared(slide, late)
    axis = slide.axes["x"]
    found = fit_simulated_motion(axis, part)
    (begun,) = found.beginnings
    speed = log.truth["x"]["velocity"][700 + begun.first]
    assert begun.velocity == pytest.approx(speed, rel=1e-3)
    assert found.error == pytest.approx(NOISE, rel=0.1)
    assert found.error < simulated_error(axis, part)


def test_unknown_bristles_are_as_sure_as_their_usual_deflection(slide, log) -> None:
    begun, surely = measured_beginning(slide.axes["x"], prepared(slide, log)[0])
    position, velocity, *states = surely
    assert 0.1 * NOISE < position < NOISE
    assert velocity < 1e-3
    assert max(states) == pytest.approx(2.0, rel=0.3)  # N: this friction's state is its force
    assert begun.first == 5


def test_an_effect_of_the_other_axis_is_refused(slide, log) -> None:
    axis = slide.axes["x"].with_effect(Fitted.at_start(CATALOGUE["axis_coupling"]))
    with pytest.raises(InputError, match="'axis_coupling' depends on the other axis"):
        fit_simulated_motion(axis, prepared(slide, log))


def test_a_held_out_error_that_grows_is_said(slide, log) -> None:
    axis, logs = slide.axes["x"], prepared(slide, log)
    begun = [measured_beginning(axis, one)[0] for one in logs]
    found = MotionFit(axis, axis, logs, begun, Outcome.CONVERGED, [1e-6])
    grew, fell = (
        " ".join(motion_fit_in_words("x", found, held)) for held in ((1e-6, 2e-6), (2e-6, 1e-6))
    )
    assert HELD_OUT_GREW in grew
    assert HELD_OUT_GREW not in fell


def test_the_command_says_the_objective_and_both_errors(slide, log, tmp_path: Path) -> None:
    write_log(log, tmp_path / "log.mcap")
    save_model(slide, tmp_path / "slide.toml")
    given = ("fit", "slide.toml", "log.mcap", "--objective", "simulation", "--json")
    done = twin(*given, folder=tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["objective"] == "simulation"
    axis = found["axes"]["x"]
    assert axis["position_error"] <= axis["position_error_of_force_fit"]
    assert axis["unit"] == "m"
    assert axis["parameters"]["mass"]["unit"] == "kg"
    assert list(axis["beginnings"]) == ["log.mcap"]


@pytest.mark.slow
def test_emps_as_diagnosed_simulates_the_pulses_better_than_published(shared_data) -> None:
    """Whole records without a restart; 6.63 mm: mujoco.sysid with four parameters."""
    mapping = load_mapping(EXAMPLES / "import_emps.toml")
    run, pulses = (
        import_log(shared_data / "emps" / f"{name}.mat", mapping)
        for name in ("DATA_EMPS", "DATA_EMPS_PULSES")
    )
    model = load_model(EXAMPLES / "emps.toml", CATALOGUE)
    axis = model.axes["x"].with_effect(Fitted.at_start(CATALOGUE["asymmetric_friction"]))
    model = model.with_axis("x", axis)
    force = identify.fit(model, {"run": run}, {"pulses": pulses}, test_function=0.2)
    found = identify.fit_simulation(force)
    before, after = found.holdout_error["x"]
    assert after < 6.63e-3 < before
    assert found.axes["x"].error < found.axes["x"].error_begun
    assert "x" not in found.model.intervals


RUBBING = (("viscous_friction", {"c": 20.0}),)


@pytest.fixture(scope="module")
def sprung(slide) -> Log:
    """Of a mass on a spring of 300 N/m, which the models below lack."""
    laws = (*RUBBING, ("spring", {"k1": 300.0}))
    springy = [Fitted.at_start(CATALOGUE[name], values) for name, values in laws]
    machine = slide.with_axis("x", replace(slide.axes["x"], effects=tuple(springy)))
    motion = OpenLoopSine("x", 2.0, amplitude=6.0, period=0.7)
    return simulate(machine, motion, seed=3, simulator=ReducedSimulator)


@pytest.mark.parametrize("off", [1.0, 0.2])
def test_where_much_is_left_the_least_error_is_found_from_wherever(slide, sprung, off) -> None:
    effects = tuple(Fitted.at_start(CATALOGUE[name], values) for name, values in RUBBING)
    axis = replace(slide.axes["x"], effects=effects)
    where, logs = free_parameters(axis), prepared(slide.with_axis("x", axis), sprung)
    begun = write(axis, where, off * read(axis, where))
    found = fit_simulated_motion(begun, logs)
    assert found.outcome is Outcome.CONVERGED
    assert len(found.errors_of_starts) == 4
    assert found.error < min(found.errors_of_starts)
    assert found.error == pytest.approx(0.014993, rel=1e-4)  # m
    assert found.axis.mass == pytest.approx(1.745, rel=1e-3)  # what a spring leaves of it
    assert found.error < 0.5 * found.error_begun == 0.5 * simulated_error(begun, logs)


OPEN = np.full(2, -np.inf), np.full(2, np.inf)


def dented(x: np.ndarray) -> float:
    """A bowl around (1, -2) with dents half a unit apart, in which slopes point anywhere."""
    away = x - np.array([1.0, -2.0])
    return float(np.sum(away**2) + 0.3 * np.sum(1.0 - np.cos(4.0 * np.pi * away)))


def test_the_least_of_many_dents_is_found() -> None:
    rng = np.random.default_rng(0)
    found = rough_minimum(dented, np.zeros(2), np.ones(2), OPEN, rng)
    np.testing.assert_allclose(found, [1.0, -2.0], atol=1e-3)


def test_bounds_are_kept_and_what_is_not_finite_is_not_taken() -> None:
    low, high = np.zeros(2), np.array([0.5, 3.0])
    found = rough_minimum(
        lambda x: np.nan if x[1] < 0.2 else dented(x), np.array([0.2, 1.0]), np.ones(2),
        (low, high), np.random.default_rng(1),
    )  # fmt: skip
    np.testing.assert_array_equal(found, np.clip(found, low, high))
    assert found[1] >= 0.2
