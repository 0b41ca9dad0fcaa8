"""The experiments among which a plan chooses: each fills its time, within the stage's limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import HARDWARE, PLAIN

from identify.experiment_design.candidate_experiments import (
    _passes,
    proposals,
)
from twin.experiments.experiment import machine_limits
from twin.experiments.kinds import Moves, Passes, Rests, Staircase, Steps, Sweep, Tracking
from twin.model.machine import AxisModel, Hardware, MachineModel
from twin.numbers import neat

STAGE = MachineModel("s", {"x": PLAIN, "y": replace(PLAIN, mass=3.1)}, 2000.0)


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


def test_a_weak_motor_makes_all_moves_gentler():
    weak = replace(STAGE, axes={"x": replace(PLAIN, hardware=replace(HARDWARE, force_limit=5.3))})
    efforts = {getattr(e, "effort", 0.2) for e in proposals(weak, "x", 8.0)[0]}
    assert efforts == {0.2, 0.1}  # a fifth of what the limits allow, and half of it under a sweep
