"""An effect is the same on either axis, and two effects read the other axis: tested in number."""

from dataclasses import replace

import numpy as np
import pytest
from effect_runs import CATALOGUE

from twin.effect import Effect
from twin.experiments.trajectory import Setpoint
from twin.laws.trials import Array, moderate
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel
from twin.simulator import MujocoSimulator, ReducedSimulator, run

BOTH = pytest.mark.parametrize("stage", [MujocoSimulator, ReducedSimulator])
OF_AXES = [e for e in CATALOGUE.values() if not e.of_joints]
EVERY = pytest.mark.parametrize("effect", OF_AXES, ids=lambda e: e.name)
Stepper = type[MujocoSimulator] | type[ReducedSimulator]

RATE = 5000.0  # Hz
FRICTION = Fitted.at_start(CATALOGUE["lugre"], {"sigma2": 2.0})
PLAIN = AxisModel(4.0, Hardware(), (FRICTION,))


def setpoint(swapped: bool = False) -> Setpoint:
    """0.4 s of different swings of the two axes."""
    t = (np.arange(round(0.4 * RATE)) / RATE)[:, None]
    w, size = np.array([[9.0, 23.0]]), np.array([[0.05, 0.02]])
    x, v, a = size * (1.0 - np.cos(w * t)), size * w * np.sin(w * t), size * w**2 * np.cos(w * t)
    columns = [1, 0] if swapped else [0, 1]
    x, v, a = (np.ascontiguousarray(c[:, columns]) for c in (x, v, a))
    return Setpoint(x, v, a, np.zeros_like(x), RATE)


def signals(x: AxisModel, y: AxisModel, swapped: bool, stage: Stepper) -> Array:
    model = MachineModel("slides", {"x": x, "y": y}, sample_rate=RATE)
    return run(model, setpoint(swapped), np.random.default_rng(0), simulator=stage).signals


def drawn(effect: Effect, seed: int) -> Fitted:
    return Fitted.at_start(effect, moderate(effect, np.random.default_rng(seed)))


@EVERY
@BOTH
def test_on_the_other_axis_it_does_the_same(effect: Effect, stage: Stepper) -> None:
    """Both axes exchange their effects, masses and setpoints, and with them their motion."""
    plain = replace(PLAIN, mass=7.0)
    changed = PLAIN.with_effect(drawn(effect, 1))
    for first, second in ((changed, plain), (changed, plain.with_effect(drawn(effect, 2)))):
        one = signals(first, second, False, stage)
        other = signals(second, first, True, stage)[:, ::-1]
        size = np.abs(one).max(axis=(0, 1))
        assert np.all(np.abs(one - other).max(axis=(0, 1)) <= 1e-8 * size)
    without = signals(PLAIN, plain, False, stage)
    assert np.abs(one[:, 0] - without[:, 0]).max() > 1e-9, "it does nothing"


@EVERY
def test_a_planted_difference_between_the_axes_is_seen(effect: Effect) -> None:
    """The comparison above fails where one axis has a thousandth more of the effect."""
    fitted = drawn(effect, 1)
    more = {p.name: min(1.001 * fitted.values[p.name], p.upper) for p in effect.strengths}
    other = Fitted.at_start(effect, {**fitted.values, **more})
    plain = replace(PLAIN, mass=7.0)
    one = signals(PLAIN.with_effect(fitted), plain, False, ReducedSimulator)
    two = signals(plain, PLAIN.with_effect(other), True, ReducedSimulator)[:, ::-1]
    size = np.abs(one).max(axis=(0, 1))
    assert not np.all(np.abs(one - two).max(axis=(0, 1)) <= 1e-8 * size)


def with_values(name: str, **values: float) -> AxisModel:
    return PLAIN.with_effect(Fitted.at_start(CATALOGUE[name], values))


def logged(axis: AxisModel, stage: Stepper) -> tuple[Array, dict[str, Array]]:
    """Signals of both axes and the forces on x, by effect; y moves alone by the setpoint."""
    model = MachineModel("slides", {"x": axis, "y": PLAIN}, sample_rate=RATE)
    done = run(model, setpoint(), np.random.default_rng(0), simulator=stage)
    rows = {e: done.forces[:, i] for i, (a, e) in enumerate(done.table.labels) if a == "x"}
    return done.signals, rows


def acceleration_known(v: Array) -> Array:
    """What an axis is told of the other's acceleration: as it was a sample before the last one."""
    return np.concatenate([[0.0, 0.0], np.diff(v)[:-1]]) * RATE


@BOTH
def test_coupling_is_the_acceleration_and_speed_of_the_other_axis(stage: Stepper) -> None:
    mass, damping = 0.7, 3.0
    found, forces = logged(with_values("axis_coupling", mass=mass, damping=damping), stage)
    v = found[:, 1, 3]  # the velocity that the sample begins with
    wanted = -(mass * acceleration_known(v) + damping * v)
    np.testing.assert_allclose(forces["axis_coupling"], wanted, atol=1e-9 * np.abs(wanted).max())
    assert np.abs(wanted).max() > 1.0


@BOTH
def test_friction_follows_the_load_of_motor_and_other_axis(stage: Stepper) -> None:
    """Bristles settle on the level within a sample of fast sliding, so the level can be read."""
    values = {"motor": 0.02, "corner": 0.05, "offset": 4.0}
    stiff = Fitted.at_start(CATALOGUE["dahl"], {"Fc": 0.5, "sigma0": 1e7, "sigma2": 0.0})
    axis = with_values("load_dependent_friction", **values).with_effect(stiff)
    found, forces = logged(axis, stage)
    v_other = found[:, 1, 3]
    a_other = acceleration_known(v_other)
    x_other = found[:, 1, 2] + 0.5 * v_other / RATE
    load = (
        1.0 + values["motor"] * np.abs(found[:, 0, 1]) + values["corner"] * np.abs(a_other)
        + values["offset"] * x_other
    )  # fmt: skip
    v = found[:, 0, 3]
    sliding = np.abs(v) > 0.05
    assert sliding.sum() > 500
    wanted = -0.5 * load * np.sign(v)
    np.testing.assert_allclose(forces["dahl"][sliding], wanted[sliding], rtol=1e-9)
    assert np.ptp(load[sliding]) > 0.2
