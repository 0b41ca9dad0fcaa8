"""Laws of the free run: a free mass moves as the command says, and a wrong one as far off as that.

Positions are exact: each sample's force is held over it.
"""

from dataclasses import replace

import numpy as np
import pytest
from constructed import effect, held, log_of, waves, windowed

from identify.dataset.motion import motion_of
from identify.estimation.force_balance import residual
from identify.estimation.open_loop import START_FIT
from identify.validation.comparison import side_by_side
from identify.validation.free_run import HORIZON, FreeRun, free_run, rms_error
from twin.model.machine import AxisModel, Hardware, MachineModel
from twin.simulation.simulators import MujocoSimulator, ReducedSimulator

RATE, MASS = 1000.0, 1.7
N = 1730
T = np.arange(N) / RATE
FORCE = waves((3.0, 2.3, 0.4), (1.0, 5.1, 1.0))(T)
X = held(FORCE, MASS, 1.0 / RATE)
SIDE, COUNT = round(START_FIT * RATE), round(HORIZON * RATE)


def prepared(x=X, force=FORCE, name="log"):
    return windowed(motion_of(log_of(RATE, x, force), "x", name, ripples=()), 0.02)


def stage(mass: float = MASS, hardware: Hardware | None = None) -> MachineModel:
    axis = AxisModel(mass, hardware or Hardware())
    return MachineModel("free", {"x": axis}, RATE)


def test_the_true_mass_moves_as_measured_from_the_first_restart_on():
    run = free_run(stage(), {"x": prepared()})
    error = run.error["x"]
    assert len(error) == N - 1  # the last force has no motion behind it
    assert np.isnan(error[:SIDE]).all()
    assert np.isfinite(error[SIDE:]).all()
    assert np.abs(error[SIDE:]).max() < 1e-5 * np.ptp(X)


def test_a_wrong_mass_is_off_by_what_the_force_does_since_the_restart():
    factor = 1.01
    error = free_run(stage(factor * MASS), {"x": prepared()}).error["x"]
    v = np.concatenate([[0.0], np.cumsum(FORCE)[:-1]]) / RATE / MASS
    for start in range(SIDE, N - 1 - SIDE, COUNT):
        span = slice(start, min(start + COUNT, N - 1))
        exact = held(FORCE[span], factor * MASS, 1.0 / RATE, X[start], v[start])
        off = exact - X[span]
        np.testing.assert_allclose(error[span], off, atol=0.01 * np.abs(off).max())


def test_mujoco_runs_as_the_reduced_model_whenever_the_log_began():
    """The buffer of a delay begins anew at sample 0, not where the time passes 0."""
    log = prepared()
    log = replace(log, motion=replace(log.motion, time_origin=-0.0203))
    delayed = (
        effect("actuator_delay", {"tau": 1.25e-3}),
        effect("periodic_disturbance", {"f": 7.0, "a": 1.0}),
    )
    model = MachineModel("late", {"x": AxisModel(MASS, effects=delayed)}, RATE)
    reduced, mujoco = (
        free_run(model, {"x": log}, simulator).error["x"]
        for simulator in (ReducedSimulator, MujocoSimulator)
    )
    np.testing.assert_allclose(mujoco, reduced, rtol=0, atol=1e-12)


def test_the_error_is_the_root_of_its_mean_square_where_it_ran():
    run = FreeRun({"x": np.array([np.nan, 3.0, -4.0])})
    assert rms_error(run, "x") == pytest.approx(12.5**0.5)
    assert rms_error(FreeRun({"x": np.array([1e200, 1e300])}), "x") == np.inf


def test_measured_is_the_model_and_what_is_left_on_one_clock():
    axis = AxisModel(1.02 * MASS, effects=(effect("constant_force", {"F0": 0.3}),))
    model, log = MachineModel("m", {"x": axis}, RATE), prepared()
    found = side_by_side(model, {"x": log})
    measured, said, left = (found.topics[f"/{k}/x"] for k in ("measured", "model", "residual"))
    error = free_run(model, {"x": log}).error["x"]
    assert found.sample_rate == RATE
    np.testing.assert_allclose(measured["position"], log.motion.at_samples(0.0)[0][SIDE:])
    np.testing.assert_allclose(said["position"] - measured["position"], error[SIDE:], atol=1e-15)
    np.testing.assert_allclose(left["position"], -error[SIDE:])
    inner = slice(50, -50)
    np.testing.assert_allclose(
        (said["force"] + left["force"])[inner], FORCE[SIDE:-1][inner], atol=0.02 * np.ptp(FORCE)
    )
    times = np.arange(SIDE, N - 1) / RATE
    at = log.time - log.motion.time[0]
    np.testing.assert_allclose(left["force"], np.interp(times, at, residual(axis, [log])))
    np.testing.assert_allclose(measured["force"], log.motion.at_samples(0.0)[2][SIDE:])


def test_axes_in_blocks_of_another_length_are_told_as_long_as_the_shorter():
    """A noisy encoder asks for longer blocks, of which fewer samples fill a whole number."""
    noise = 1e-4 * np.random.default_rng(5).standard_normal(N)
    log = log_of(RATE, X, FORCE, X + noise)
    parts = {a: windowed(motion_of(log, a, "log", ripples=()), 0.1) for a in "xy"}
    lengths = {a: part.motion.raw.shape[1] for a, part in parts.items()}
    assert lengths["y"] < lengths["x"]
    model = MachineModel("m", {a: AxisModel(MASS) for a in "xy"}, RATE)
    topics = side_by_side(model, parts).topics
    shapes = {c.shape for columns in topics.values() for c in columns.values()}
    assert shapes == {(lengths["y"] - SIDE,)}
