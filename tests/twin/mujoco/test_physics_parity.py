"""MuJoCo and the reduced model give one answer, on either axis; a held force moves a mass."""

from collections.abc import Mapping
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from axis_runs import BOTH, Stepper, effect
from constructed import two_waves
from effect_runs import with_all
from machines import CATALOGUE, PROTON

from twin.effect import Effect
from twin.laws.trials import moderate
from twin.logs import Log
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel
from twin.mujoco.callback import passive_callback
from twin.signals import Array
from twin.simulation.simulate import simulate
from twin.simulation.simulators import MujocoSimulator, ReducedSimulator, run


def smooth(model: MachineModel) -> MachineModel:
    """The stage with encoders that do not round: a rounding step would magnify the last bit."""
    for name, axis in model.axes.items():
        hardware = replace(axis.hardware, encoder_resolution=0.0)
        model = model.with_axis(name, replace(axis, hardware=hardware))
    return model


STAGE = smooth(PROTON)


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


ON_AXES = [  # without a load, or what a log holds beside the motion, no effect
    e for e in CATALOGUE.values() if e.name != "joint_load_friction" and not e.channels
]


@pytest.mark.parametrize("effect", ON_AXES, ids=lambda e: e.name)
def test_both_simulations_agree_with_every_effect_and_it_acts(effect: Effect, plain: Log) -> None:
    fitted = Fitted.at_start(effect, moderate(effect, np.random.default_rng(21)))
    log = require_parity(STAGE.with_axis("x", STAGE.axes["x"].with_effect(fitted)))
    command = plain.axes["x"].force
    changed = np.abs(log.axes["x"].force - command).max()
    assert changed > 1e-6 * np.abs(command).max(), "the stage moves as without the effect"


@pytest.mark.short(1)
@pytest.mark.parametrize("experiment", ["tracking", pytest.param("moves", marks=pytest.mark.slow)])
def test_both_simulations_agree_with_all_effects_on_both_axes(experiment: str) -> None:
    require_parity(with_all(STAGE, np.random.default_rng(22)), experiment)


SLIDE = AxisModel(4.0, Hardware(), (Fitted.at_start(CATALOGUE["lugre"], {"sigma2": 2.0}),))
HEAVIER = replace(SLIDE, mass=7.0)
OF_AXES = [e for e in CATALOGUE.values() if not (e.of_joints or e.channels)]


MOTION = ("position", "velocity", "acceleration")


def turned(columns: Array) -> Array:
    """Those of both axes exchanged."""
    return np.ascontiguousarray(columns[:, ::-1])


def signals(x: AxisModel, y: AxisModel, stage: Stepper, swapped: bool = False) -> Array:
    """Of two axes that swing for 0.4 s, or of both exchanged."""
    asked = two_waves(2000, 5000.0)
    if swapped:
        x, y = y, x
        asked = replace(asked, **{n: turned(getattr(asked, n)) for n in MOTION})
    model = MachineModel("slides", {"x": x, "y": y}, sample_rate=5000.0)
    done = run(model, asked, np.random.default_rng(0), simulator=stage).signals
    return done[:, ::-1] if swapped else done


@pytest.mark.short(16)
@pytest.mark.parametrize("effect", OF_AXES, ids=lambda e: e.name)
@pytest.mark.parametrize("stage", BOTH)
def test_on_the_other_axis_an_effect_does_the_same(effect: Effect, stage: Stepper) -> None:
    """Both axes exchange their effects, masses and setpoints, and with them their motion."""
    drawn = [Fitted.at_start(effect, moderate(effect, np.random.default_rng(s))) for s in (1, 2)]
    changed = SLIDE.with_effect(drawn[0])
    for other in (HEAVIER, HEAVIER.with_effect(drawn[1])):
        one = signals(changed, other, stage)
        difference = np.abs(one - signals(changed, other, stage, swapped=True)).max(axis=(0, 1))
        assert np.all(difference <= 1e-8 * np.abs(one).max(axis=(0, 1)))
    without = signals(SLIDE, HEAVIER, stage)
    assert np.abs(one[:, 0] - without[:, 0]).max() > 1e-9, "it does nothing"


def test_a_free_crank_keeps_its_energy() -> None:
    """m (1 + J(x)) v^2/2, by the sums of its own series; it slows and speeds up in each turn."""
    crank = effect("varying_inertia", p=0.1, b1=0.1, a2=0.2, b2=-0.3, b3=-0.1)
    machine = MachineModel("free", {"x": AxisModel(2.0, effects=(crank,))}, 1.0 / 2e-5)
    with passive_callback():
        free = MujocoSimulator(machine, machine.table())
        free.data.qvel[:] = 0.5
        path = np.empty((2, 20000))
        for k in range(path.shape[1]):
            mujoco.mj_step(free.model, free.data)
            path[:, k] = free.data.qpos[0], free.data.qvel[0]
    x, v = path
    turns = 2.0 * np.pi * np.outer((1, 2, 3), x / 0.1)
    inertia = 1.0 + [0.1, -0.3, -0.1] @ np.cos(turns) + [0.0, 0.2, 0.0] @ np.sin(turns)
    energy = inertia * v**2
    assert v.max() > 1.3 * v.min()
    np.testing.assert_allclose(energy, energy[0], rtol=2e-3)
