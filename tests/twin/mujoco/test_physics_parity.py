"""MuJoCo and the reduced model give one answer; a held force moves a mass as Newton says."""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
from axis_runs import BOTH, Stepper
from effect_runs import CATALOGUE, with_all

from twin.core.loop import COMMAND_COLUMN, POSITION_COLUMN, VELOCITY_COLUMN, Controller
from twin.effect import Effect
from twin.experiments.named import simulate
from twin.experiments.trajectory import Setpoint
from twin.laws.trials import moderate
from twin.logs import Log
from twin.model.file import load_model
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.simulator import MujocoSimulator, ReducedSimulator, run


def smooth(model: MachineModel) -> MachineModel:
    """The stage with encoders that do not round: a rounding step would magnify the last bit."""
    for name, axis in model.axes.items():
        hardware = replace(axis.hardware, encoder_resolution=0.0)
        model = model.with_axis(name, replace(axis, hardware=hardware))
    return model


STAGE = smooth(load_model("proton_xy", CATALOGUE))


def simulated(model: MachineModel, stage: Stepper, experiment: str) -> Log:
    return simulate(model, experiment, seed=5, duration=0.4, simulator=stage)


def columns(log: Log) -> Mapping[str, np.ndarray]:
    """Everything logged, and the truth."""
    named = {f"{a} {n}": c for a, log_a in log.axes.items() for n, c in log_a.columns.items()}
    return named | {f"{a} true {n}": c for a, true in log.truth.items() for n, c in true.items()}


def require_parity(model: MachineModel, experiment: str = "tracking") -> Log:
    """Both simulations agree to rounding in every column; returns MuJoCo's log."""
    log = simulated(model, MujocoSimulator, experiment)
    reduced = columns(simulated(model, ReducedSimulator, experiment))
    for name, column in columns(log).items():
        # The position loop turns the last bit of a position into some 1e-10 N.
        share = 1e-11 if name.endswith(("position", "velocity")) else 1e-8
        tolerance = share * np.abs(column).max()
        np.testing.assert_allclose(reduced[name], column, rtol=0, atol=tolerance, err_msg=name)
    return log


@pytest.fixture(scope="module")
def plain() -> Log:
    return require_parity(STAGE)


ON_AXES = [e for e in CATALOGUE.values() if e.name != "joint_load_friction"]  # no load, no effect


@pytest.mark.parametrize("effect", ON_AXES, ids=lambda e: e.name)
def test_both_simulations_agree_with_every_effect_and_it_acts(effect: Effect, plain: Log) -> None:
    fitted = Fitted.at_start(effect, moderate(effect, np.random.default_rng(21)))
    log = require_parity(STAGE.with_axis("x", STAGE.axes["x"].with_effect(fitted)))
    command = plain.axes["x"].force
    changed = np.abs(log.axes["x"].force - command).max()
    assert changed > 1e-6 * np.abs(command).max(), "the stage moves as without the effect"


@pytest.mark.parametrize("experiment", ["tracking", pytest.param("moves", marks=pytest.mark.slow)])
def test_both_simulations_agree_with_all_effects_on_both_axes(experiment: str) -> None:
    require_parity(with_all(STAGE, np.random.default_rng(22)), experiment)


def test_both_simulations_agree_without_a_mujoco_file() -> None:
    model = replace(STAGE, mjcf=None, mjcf_name=None)
    require_parity(with_all(model, np.random.default_rng(23)))


@pytest.mark.parametrize("stage", BOTH)
def test_true_position_is_the_closed_form_of_a_force_held_over_samples(stage: Stepper) -> None:
    mass, rate, n, held = 3.7, 1000.0, 7000, 7
    levels = np.random.default_rng(24).normal(0.0, 5.0, n // held)
    force = np.repeat(levels, held)[:, None]
    still = np.zeros_like(force)
    done = run(
        MachineModel("slide", {"x": AxisModel(mass)}, sample_rate=rate),
        Setpoint(still, still, still, force, rate),
        np.random.default_rng(0),
        simulator=stage,
        controllers={"x": Controller()},
    ).signals[:, 0]

    # Piecewise parabolas from one level to the next: exact, at samples between them too.
    into = (np.arange(n) % held) / rate
    a = np.repeat(levels, held) / mass
    v0 = np.cumsum(np.r_[0.0, levels[:-1] * held / rate / mass])
    x0 = np.cumsum(np.r_[0.0, (v0 * held / rate + levels / mass * (held / rate) ** 2 / 2)[:-1]])
    v = np.repeat(v0, held) + a * into
    x = np.repeat(x0, held) + np.repeat(v0, held) * into + a * into**2 / 2
    np.testing.assert_array_equal(done[:, COMMAND_COLUMN], force[:, 0])
    np.testing.assert_allclose(done[:, VELOCITY_COLUMN], v, rtol=0, atol=1e-12 * np.ptp(v))
    np.testing.assert_allclose(done[:, POSITION_COLUMN], x, rtol=0, atol=1e-12 * np.ptp(x))
