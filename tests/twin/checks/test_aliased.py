"""Speeds at which an encoder moves by whole steps a sample are told, with another speed."""

from __future__ import annotations

import numpy as np
import pytest
from constructed import log_of

from twin.checks import check_log
from twin.checks.report import Fault, LogFinding

RATE, STEP = 1000.0, 1e-6  # Hz, m


def told(
    steps: float, step: float = STEP, noise: float = 0.0, often: float = 1.0
) -> list[LogFinding]:
    """What is told of a motion to and fro by so many steps of 1 um a sample, read in steps.

    often: in which part of the time; else by 0.37 of a step more.
    """
    k = np.arange(8000)
    size = np.where(k < often * len(k), steps, steps + 0.37) * STEP * RATE
    speed = size * np.sign(np.sin(k * 2.0 * np.pi / 2000.0 + 0.1))
    speed = np.convolve(speed, np.full(100, 0.01), "same")
    position = np.cumsum(speed) / RATE
    force = 2.0 * np.gradient(speed) * RATE + 3.0 * np.sign(speed)
    rng = np.random.default_rng(1)
    read = step * np.rint((position + noise * rng.standard_normal(len(position))) / step)
    findings = check_log(log_of(RATE, read, force)).findings
    return [f for f in findings if f.fault is Fault.ALIASED]


@pytest.mark.parametrize("steps", [1.0, 2.0, 7.0])
def test_whole_steps_a_sample_are_told_with_another_speed(steps: float) -> None:
    (found,) = told(steps)
    assert found.axis == "x"
    assert "multiples of 0.001 m/s" in found.what
    assert f"such as {(steps + 0.4) * 1e-3:.3g} m/s" in found.remedy


@pytest.mark.parametrize(
    ("steps", "step", "noise"), [(1.4, STEP, 0.0), (2.0, STEP, 3e-6), (2.0, 1e-9, 0.0)]
)
def test_other_speeds_noise_and_a_fine_encoder_are_not(steps, step, noise) -> None:
    assert told(steps, step, noise) == []


@pytest.mark.parametrize(("often", "number"), [(0.45, 1), (0.2, 0)])
def test_a_part_of_the_motion_is_told_where_it_is_far_more_than_by_chance(often, number) -> None:
    assert len(told(2.0, often=often)) == number
