"""Which shapes are sought again: where the first fit leaves more than noise, or saw too little."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import (
    CATALOGUE,
    PERIOD,
    PLAIN,
    axis_of,
    built_dataset,
    built_machine,
    built_motion,
    fitted,
    pushed,
)

from identify.dataset.prepared_log import PreparedLog
from identify.estimation.fit import Outcome, finished, fit_axis
from identify.estimation.force_balance import residual
from identify.estimation.variable_projection import (
    Start,
    _Ground,
    _is_nearest,
    _promises,
    _try,
    _unlike,
    fit_thoroughly,
    fit_without,
    starts,
)
from twin.effect import Excitation

# The rules as they were decided.
BETTER = 0.99
SEEN = Excitation(-0.05, 0.07, 0.4, 0.3, 3.0, 1e-3)


# --- fitted thoroughly ----------------------------------------------------------------------


def test_a_start_promises_what_it_leaves_less_of(dataset, base):
    shape = fitted("cogging")
    for part, promising in ((BETTER - 0.001, True), (BETTER + 0.001, False)):
        left = part * base.residual
        assert _promises(Start({}, shape, left, left), base, dataset) is promising
    few = replace(dataset, fit=dataset.fit)
    few.__dict__["in_heads"] = np.arange(len(base.kept)) < 0.2 * len(base.kept)
    rows = few.in_heads[base.kept]
    assert 0 < rows.sum() < len(rows)
    columns = base.jacobian[rows]
    there = base.residual[rows]
    there = there - columns @ np.linalg.lstsq(columns, there, rcond=None)[0]
    for part, promising in ((BETTER - 0.001, True), (BETTER + 0.001, False)):
        left = np.full(len(there), part * np.sqrt(np.mean(there**2)))
        assert _promises(Start({}, shape, left, left), base, few) is promising


def test_present_values_are_nearest_to_one_of_the_shapes():
    lugre = fitted("lugre", v0=0.03, sigma0=299.0)
    slow, fast = lugre.effect.parameter("v0").scan(SEEN)  # 8 and 40 mm/s
    soft, stiff, _ = lugre.effect.parameter("sigma0").scan(SEEN)  # 300, 3000, 30 000 N/m
    assert _is_nearest({"v0": fast, "sigma0": soft}, lugre, SEEN)
    assert not _is_nearest({"v0": slow, "sigma0": soft}, lugre, SEEN)
    assert not _is_nearest({"v0": fast, "sigma0": stiff}, lugre, SEEN)


def test_without_an_effect_the_rest_stays_where_it_was(dataset, base):
    found = fit_without(base, dataset, "constant_force")
    assert found.axis == base.axis.without("constant_force")
    assert (found.begun, found.outcome) == (base.begun, base.outcome)
    np.testing.assert_allclose(
        found.residual, residual(base.axis, dataset.fit)[found.kept] - 0.2, atol=1e-9
    )


# --- shapes that the heads do not tell ------------------------------------------------------


def of_shape(squared: float, shape: dict[str, float], *, silent: bool = False) -> Start:
    left = np.array([np.sqrt(squared)])
    return Start(shape, None, left, left, is_silent=silent)


def test_a_start_beside_the_best_shares_no_value_with_it():
    shapes = [(0.1, 5.0), (0.2, 5.0), (0.1, 6.0), (0.2, 6.0), (0.3, 7.0)]
    found = [of_shape(1.0, {"v0": v, "sigma0": s}) for v, s in shapes]
    assert _unlike(found) == [found[0], found[3]]
    assert _unlike(found[:3]) == [found[0]]


def test_a_law_is_silent_where_the_motion_does_not_reach_it():
    dataset = built_dataset("one", "two")
    base = finished(PLAIN, PLAIN, dataset.fit, Outcome.CONVERGED)
    reached = max(float(log.motion.position.max()) for log in dataset.fit)
    stop = CATALOGUE["end_stop"]
    ground = _Ground.of(base, dataset, stop, SEEN, on_heads=False)
    for high, silent in ((0.99 * reached, False), (1.01 * reached, True)):
        start = _try(ground, {"low": -10.0, "high": high}, stop.strengths)
        assert start.is_silent is silent


def test_a_stop_that_only_a_late_move_reaches_is_the_first_start():
    """The heads, on which no strength of it makes a force, tell nothing of it."""
    plain = built_motion("late", 10.0)
    time = PERIOD * np.arange(len(plain.position))
    turn = 2.0 * np.pi * np.clip(time - 8.5, 0.0, 1.5) / 1.5
    x = plain.position + 0.04 * np.sin(turn) * (1.0 - np.cos(turn))
    v = np.gradient(x, PERIOD)
    u = plain.command + 5.3 * np.gradient(v - plain.velocity, PERIOD)
    motion = replace(plain, signals=np.stack([x, v, u]), raw=np.stack([v, u]))
    low, high = (x.min() + 0.05 * np.ptp(x), x.max() - 0.05 * np.ptp(x))
    stopped = pushed(motion, fitted("end_stop", low=low, high=high, stiffness=2000.0))
    covered = replace(SEEN, position_low=float(x.min()), position_high=float(x.max()))
    dataset = replace(
        built_dataset(), fit=(PreparedLog.of(stopped, 0.04),), covered=lambda: covered
    )
    (head,) = dataset.heads
    found = starts(fit_axis(PLAIN, dataset.fit), dataset, CATALOGUE["end_stop"])
    first = found[0].shape
    assert first["low"] < head.motion.position.min()
    assert first["high"] > head.motion.position.max()
    assert not found[0].is_silent
    assert (first["low"], first["high"]) == pytest.approx((low, high), abs=0.03 * np.ptp(x))


def test_a_shape_is_sought_anew_where_error_is_left_and_nowhere_else():
    """From a wrong pitch a fit ends beside the right one; what is held stays held."""
    right = fitted("cogging", p=0.02, a1=0.4, b1=0.1)
    right = replace(right, fixed=right.fixed | {"b1"})
    dataset = built_machine(built_dataset("one", "two"), axis_of(right))
    begun = axis_of(replace(right, values={**right.values, "p": 0.031, "a1": 0.01}))
    stuck, found = fit_axis(begun, dataset.fit), fit_thoroughly(begun, dataset)
    assert found.error < 0.1 * stuck.error
    values = found.axis["cogging"].values
    assert (values["p"], values["a1"]) == pytest.approx((0.02, 0.4), rel=0.01)
    assert (values["b1"], found.axis["cogging"].fixed) == (0.1, right.fixed)
    assert found.begun is begun
    quiet = fit_thoroughly(found.axis, dataset, begun=begun)
    assert quiet.error == pytest.approx(found.error, rel=1e-3)
    assert quiet.begun is begun
