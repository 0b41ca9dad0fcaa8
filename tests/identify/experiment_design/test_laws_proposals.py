"""The experiments among which a plan chooses: each fills its time, within the stage's limits."""

from __future__ import annotations

import importlib
import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import HARDWARE, PLAIN, axis_of, built_motion, fitted

from identify.dataset.prepared_log import PreparedLog
from identify.experiment_design.candidate_experiments import (
    _accelerating,
    _affordable,
    _move_time,
    _pass,
    _passes,
    _require_fit,
    _reversing,
    _swept,
    proposals,
)
from identify.experiment_design.discrimination import (
    Arena,
    Explanation,
)
from twin.errors import CannotRun
from twin.experiments.experiment import gentle, machine_limits
from twin.experiments.kinds import Moves, Passes, Rests, Staircase, Steps, Sweep, Tracking
from twin.model.machine import AxisModel, Hardware, MachineModel
from twin.numbers import neat

plans = importlib.import_module("identify.experiment_design.plan")
STAGE = MachineModel("s", {"x": PLAIN, "y": replace(PLAIN, mass=3.1)}, 2000.0)
ONE = axis_of(fitted("quadratic_drag", c=0.9)).with_effect(fitted("lugre", Fc=0.3, Fs=0.3))
TWO = axis_of(fitted("constant_force", F0=0.2)).with_effect(fitted("lugre", Fc=0.3, Fs=0.3))
FIRST, SECOND = Explanation("one", ONE), Explanation("two", TWO)
MOTION, OLD = (
    built_motion("new", 2.0, seed=4),
    PreparedLog.of(built_motion("old", 1.5, seed=5), 0.04),
)


def arena(*explanations: Explanation, logs=(OLD,), test_function=0.04) -> Arena:
    return Arena(STAGE, "x", explanations, logs, test_function)


def absorbed(force, columns):
    """What least squares leaves of a force."""
    scaled = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    return force - scaled @ np.linalg.lstsq(scaled, force, rcond=1e-12)[0]


# --- proposals ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "value", [0.1234567, 0.999999, 1.0, 4.0, 1234.9, 5e-7, 0.29999999999999999]
)
def test_a_neat_value_has_three_digits_and_is_no_larger(value):
    found = neat(value)
    assert found <= value * (1.0 + 1e-12)
    assert found > value * (1.0 - 1e-2)
    assert float(f"{found:.3g}") == found
    assert neat(found) == found


def test_a_weak_motor_is_asked_for_a_part_of_its_force():
    for limit, effort in ((math.inf, 1.0), (0.4 * 5.3 * 2.0 / 0.16, 1.0), (5.3, 0.2)):
        axis = replace(PLAIN, hardware=replace(HARDWARE, force_limit=limit))
        assert _affordable(MachineModel("s", {"x": axis}), "x") == pytest.approx(effort)


def test_proposals_cover_the_sorts_and_last_as_long_as_asked():
    found, _ = proposals(STAGE, "x", 8.0)
    kinds = {type(e) for e in found}
    assert {Tracking, Moves, Passes, Staircase, Steps, Sweep} <= kinds
    assert Tracking(8.0) in found
    for e in found:
        assert getattr(e, "axis", "x") == "x"
        assert getattr(e, "span", 0.0) <= 0.9 * 0.24 + 1e-12
    assert any(getattr(e, "other", 0.0) > 0.0 for e in found)
    alone, _ = proposals(MachineModel("s", {"x": PLAIN}, 2000.0), "x", 8.0)
    assert not any(getattr(e, "other", 0.0) for e in alone)
    rounds = [Moves(80, duration=8.0), Moves(8, dwell=1.0, duration=8.0)]
    assert all(m in found for m in rounds)
    for e in found:
        lasts = e.setpoint(STAGE, np.random.default_rng(7)).duration
        assert lasts == pytest.approx(8.0, rel=0.05)


def test_a_proposal_may_take_a_twentieth_more_than_asked():
    lasting = SimpleNamespace(setpoint=lambda model, rng: SimpleNamespace(duration=10.49))
    _require_fit(lasting, STAGE, 10.0)
    with pytest.raises(CannotRun, match="longer"):
        _require_fit(lasting, STAGE, 9.99)

    def refused(model, rng):
        raise CannotRun("no")

    with pytest.raises(CannotRun):
        _require_fit(SimpleNamespace(setpoint=refused), STAGE, 1e9)


def test_passes_fill_the_time_at_the_speed_that_the_span_allows():
    (limit, _) = machine_limits(STAGE)
    for span, speed, seconds in ((0.2, 0.05, 30.0), (0.02, 1.0, 8.0), (0.2, 0.01, 2.0)):
        found = _pass("x", limit, span, speed, seconds)
        fastest = limit.fastest_plateau(span)
        assert found.speed == neat(min(speed, fastest))
        once = span / found.speed + limit.ramp_time(found.speed) + 0.1  # and the dwell
        assert found.repeats == max(int(seconds / once / 2), 1)
        assert (found.axis, found.span) == ("x", span)
    assert _pass("x", limit, 2e-5, 5e-2, 1e5).repeats == 1000


def test_passes_over_the_travel_are_slow_fast_and_between():
    limits = dict(zip(STAGE.axes, machine_limits(STAGE), strict=True))
    *passes, stairs = _passes(limits, "x", 20.0)
    span = neat(0.9 * 0.24)
    slow, fast = 2.0 * span / 20.0, limits["x"].fastest_plateau(span)
    speeds = [neat(v) for v in (1.1 * slow, math.sqrt(slow * fast), fast)]
    assert [(p.speed, p.other) for p in passes] == [
        (v, other) for v in speeds for other in (0.0, span)
    ]
    assert {p.span for p in passes} == {span}
    assert stairs.span == neat(0.3 * span)
    assert (stairs.speeds[0], len(stairs.speeds)) == (5e-4, 10)
    assert stairs.speeds[-1] == neat(limits["x"].fastest_plateau(stairs.span))
    assert stairs.longest_plateau == 0.5
    steps = np.diff(np.log(stairs.speeds))
    np.testing.assert_allclose(steps, steps.mean(), rtol=0.03)  # three digits each


def test_short_passes_and_rests_fit_the_time():
    limits = dict(zip(STAGE.axes, machine_limits(STAGE), strict=True))
    *passes, rests = _reversing(limits, "x", 20.0)
    asked = [(2e-5, 5e-5), (2e-4, 1e-3), (2e-3, 4e-3), (0.02, 1.0), (0.01, 2e-3)]
    assert [p.span for p in passes] == [span for span, _ in asked]
    for p, (span, speed) in zip(passes, asked, strict=True):
        assert p.speed == _pass("x", limits["x"], span, speed, 20.0).speed
    assert [p.other > 0.0 for p in passes] == [False] * 4 + [True]
    assert sum(rests.rests) == pytest.approx(0.55 * 20.0, rel=0.01)
    assert rests.rests[-1] / rests.rests[0] == pytest.approx(20.0 / 3.0 / 0.1, rel=0.02)
    assert (rests.span, rests.speed) == (2e-3, 4e-3)


@pytest.mark.parametrize(("noise", "scale"), [(1e-6, 6.8 / 0.34), (1e-4, 50.0 * 1e-4 / 2e-5)])
def test_angles_are_part_of_the_travel_and_seen_by_the_encoder(noise, scale):
    """The lengths of a linear stage, taken for rad, were lost in the noise of a rotary axis."""
    hardware = Hardware((-3.4, 3.4), velocity=90.0, acceleration=2e3, jerk=1e5, encoder_noise=noise)
    turned = AxisModel(5e-6, hardware, rotary=True)
    found, not_run = proposals(MachineModel("r", {"a": turned}, 2000.0), "a", 20.0)
    assert not not_run
    short = [e.span for e in found if isinstance(e, Passes)][-4:]
    np.testing.assert_allclose(short, scale * np.array([2e-5, 2e-4, 2e-3, 0.02]), rtol=0.01)
    assert min(short) > 49.0 * noise
    (rests,) = (e for e in found if isinstance(e, Rests))
    assert (rests.span, rests.speed) == pytest.approx((2e-3 * scale, 4e-3 * scale), rel=0.01)
    (stairs,) = (e for e in found if isinstance(e, Staircase))
    assert stairs.speeds[0] == pytest.approx(5e-4 * scale, rel=0.01)
    slow = MachineModel("r", {"a": replace(turned, hardware=replace(hardware, velocity=1e-3))}, 2e3)
    *_, stairs = _passes({"a": machine_limits(slow)[0]}, "a", 20.0, scale)
    assert (stairs.speeds[0], stairs.speeds[-1]) == (1e-4, 1e-3)


def test_steps_take_turns_in_effort_until_the_time_is_used():
    limits = dict(zip(STAGE.axes, machine_limits(STAGE), strict=True))
    found = list(_accelerating(limits, "x", 60.0))
    assert len(found) == 6
    for s in found:
        count = round(s.span / s.step)
        assert count in (60, 15, 3)

        def taken(effort, count=count, s=s):
            move = _move_time(gentle(limits["x"], effort), s.span / count)
            return 2 * count * (move + 0.05)

        turns = [(1.0, 0.3)[i % 2] for i in range(len(s.efforts) + 1)]
        assert s.efforts == tuple(turns[:-1])
        assert sum(map(taken, turns[:-1])) <= 60.0 < sum(map(taken, turns))
    assert {s.span for s in found} == {neat(0.9 * 0.24), neat(0.3 * 0.9 * 0.24)}


def test_a_weak_motor_makes_all_moves_gentler():
    weak = replace(STAGE, axes={"x": replace(PLAIN, hardware=replace(HARDWARE, force_limit=5.3))})
    efforts = {getattr(e, "effort", 0.2) for e in proposals(weak, "x", 8.0)[0]}
    assert efforts == {0.2, 0.1}  # a fifth of what the limits allow, and half of it under a sweep


def test_a_sweep_is_half_as_strong_as_the_limits_allow():
    limits = dict(zip(STAGE.axes, machine_limits(STAGE), strict=True))
    found = list(_swept(STAGE, limits, "x", 8.0))
    assert [(round(s.span, 4), s.highest) for s in found] == [
        (0.216, 60.0), (0.216, 120.0), (0.0216, 60.0), (0.0216, 120.0),
    ]  # fmt: skip
    for s in found:
        assert s.amplitude == neat(0.5 * s.most_force(PLAIN))
        assert (s.effort, s.lowest, s.repeats) == (0.5, 2.0, 1)
        assert s.speed <= 2.4 * s.span / 8.0


def test_the_time_of_a_move_follows_from_its_limits():
    (limit, _) = machine_limits(STAGE)  # 0.2 m/s, 2 m/s^2, 100 m/s^3
    assert _move_time(limit, 0.1) == pytest.approx(0.1 / 0.2 + 0.2 / 2.0 + 2.0 / 100.0)
    short = math.sqrt(1e-4 * 2.0)
    assert _move_time(limit, 1e-4) == pytest.approx(1e-4 / short + short / 2.0 + 2.0 / 100.0)
