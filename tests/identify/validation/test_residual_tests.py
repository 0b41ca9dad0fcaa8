"""Residual tests: white stays within the bounds, what is coloured or knows the input does not."""

import numpy as np
import pytest
from constructed import log_of, windowed
from machines import one_axis
from scipy.signal import lfilter

from identify.dataset.motion import motion_of
from identify.estimation.force_balance import residual
from identify.validation.whiteness import Loop, correlation, loop_of, residual_tests
from identify.workflow import fit
from twin.effects import load_catalogue
from twin.experiments.named import simulate
from twin.model.file import load_model
from twin.simulator import ReducedSimulator

CATALOGUE = load_catalogue()
STAGE = one_axis(load_model("proton_xy", CATALOGUE))
SPACING = 0.02  # s
N = 1500


def drawn(seed: int) -> tuple[np.ndarray, np.ndarray]:
    """White noise, and a smooth command that knows nothing of it."""
    rng = np.random.default_rng(seed)
    return rng.normal(size=N), lfilter([1.0], [1.0, -0.95], rng.normal(size=N))


def test_of_a_white_residual_a_tenth_leaves_the_bounds_and_nearly_all_pass():
    for name in ("residual", "command"):
        drawings = (
            (white, white if name == "residual" else c) for white, c in map(drawn, range(60))
        )
        tests = [correlation(name, [a], [b], SPACING, Loop.CLOSED) for a, b in drawings]
        assert np.mean([t.outside for t in tests]) == pytest.approx(0.1, abs=0.03)
        assert np.mean([t.passes for t in tests]) > 0.94
        assert tests[0].bound == pytest.approx(1.645 / np.sqrt(N), rel=1e-3)


def test_what_feedback_does_to_the_command_is_no_fault_of_the_model():
    """A command that answers the residual comes after it: not tested where the loop is closed."""
    white, _ = drawn(3)
    answer = -0.5 * np.roll(white, 4) + drawn(4)[0]
    assert correlation("command", [white], [answer], SPACING, Loop.CLOSED).passes
    opened = correlation("command", [white], [answer], SPACING, Loop.OPEN)
    assert not opened.passes
    assert opened.lag[np.argmax(np.abs(opened.value))] == pytest.approx(-4 * SPACING)


def test_gaps_and_the_seams_between_logs_do_not_count():
    white, command = drawn(5)
    holed = white.copy()
    holed[200:700] = np.nan
    test = correlation(
        "command", [holed, white[:300]], [command, command[:300]], SPACING, Loop.OPEN
    )
    assert np.isfinite(test.value).all()
    assert test.passes
    assert test.bound == pytest.approx(1.645 / np.sqrt(N - 500 + 300), rel=1e-3)


def test_the_twins_own_log_passes_and_a_model_that_lacks_an_effect_fails():
    logs = {"run": simulate(STAGE, "tracking", seed=3, duration=12.0, simulator=ReducedSimulator)}

    def tested(stage):
        result = fit(stage, logs)
        found, dataset = result.fits["x"], result.datasets["x"]
        force = residual(found.axis, dataset.fit)
        return residual_tests(dataset.fit, force, found.kept, found.floor, loop_of(dataset.fit))

    found = tested(STAGE)
    assert found.passes
    assert found.loop is Loop.CLOSED
    assert found.within == pytest.approx(0.9, abs=0.06)
    assert np.sum(found.density * np.diff(found.edges)) == pytest.approx(1.0, abs=0.02)
    poor = tested(STAGE.with_axis("x", STAGE.axes["x"].without("cable_slab")))
    assert not any(c.passes for c in poor.correlations)
    assert poor.within < 0.3


def test_correlations_are_the_plain_sums_at_their_lags():
    rng = np.random.default_rng(51)
    logs = [rng.normal(0.3, 1.0, n) for n in (200, 170)]
    signals = [rng.normal(-2.0, 3.0, n) for n in (200, 170)]
    for name, other in (("command", signals), ("residual", logs)):
        found = correlation(name, logs, other, 0.02, Loop.OPEN)
        a, b = (np.concatenate(rows).mean() for rows in (logs, other))
        a, b = [r - a for r in logs], [r - b for r in other]
        size = np.sqrt(sum(np.sum(r**2) for r in a) * sum(np.sum(r**2) for r in b))
        lags = np.rint(found.lag / 0.02).astype(int)
        assert lags.tolist() == list(range(1 if name == "residual" else -40, 41))
        sums = np.zeros(len(lags))
        for x, y in zip(a, b, strict=True):
            every = range(len(x))
            sums += [sum(x[k] * y[k - lag] for k in every if k - lag in every) for lag in lags]
        np.testing.assert_allclose(found.value, sums / size)
        assert found.tested.all()
    short = correlation(
        "command", [*logs, logs[0][:40]], [*signals, signals[0][:40]], 1.0, Loop.OPEN
    )
    assert np.abs(short.lag).max() == 10


def test_a_loop_is_closed_where_the_position_follows_its_setpoint():
    t = np.arange(4000) / 1000.0
    a, b = np.sin(6.0 * t), np.random.default_rng(51).normal(size=len(t))
    b -= a * (a @ b) / (a @ a)
    b *= np.std(a) / np.std(b)

    def log(setpoint=None):
        more = {} if setpoint is None else {"setpoint_position": setpoint}
        return windowed(motion_of(log_of(1000.0, a, t, **more), "x", "l"))

    for angle, wanted in ((0.24, Loop.CLOSED), (0.26, Loop.OPEN), (1.0, Loop.CLOSED)):
        mixed = np.cos(np.pi * angle) * a + np.sin(np.pi * angle) * b
        assert loop_of([log(mixed)]) is wanted
    assert loop_of([log(0.0 * a)]) is Loop.OPEN
    assert loop_of([log()]) is Loop.UNKNOWN
    assert loop_of([log(a), log()]) is Loop.UNKNOWN
    assert loop_of([log(0.0 * a), log(a)]) is Loop.CLOSED
