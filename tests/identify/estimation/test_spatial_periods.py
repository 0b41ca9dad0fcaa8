"""The periods at which what is left of a known force repeats along the track."""

from __future__ import annotations

import numpy as np
import pytest

from identify.estimation.spatial_periods import spatial_periods

COUNT, SPAN = 3000, 0.2  # m
RNG = np.random.default_rng(5)
PLACE = 0.5 * SPAN * np.sin(2.0 * np.pi * np.linspace(0.0, 3.3, COUNT) + 0.4)
SPEED = np.gradient(PLACE)
ONES = np.ones(COUNT)
NONE = np.zeros((COUNT, 0))
NOISE = 0.05 * RNG.standard_normal(COUNT)


def wave(period: float, size: float = 1.0, phase: float = 0.3) -> np.ndarray:
    return size * np.sin(2.0 * np.pi * PLACE / period + phase)


def near(found: tuple[float, ...], period: float, cycles: float = 0.35) -> bool:
    """Whether one is the period, but for a part of a cycle over the travel."""
    return any(abs(SPAN / p - SPAN / period) <= cycles for p in found)


@pytest.mark.parametrize(("period", "phase"), [(SPAN / 4.5, 0.3), (0.0237, 2.1), (0.0061, 0.3)])
def test_the_likeliest_is_that_of_the_sine(period: float, phase: float) -> None:
    first, *_ = spatial_periods(PLACE, wave(period, phase=phase) + NOISE, ONES, NONE)
    assert near((first,), period)


def test_of_two_the_larger_comes_first() -> None:
    force = wave(0.0237, 0.6) + wave(0.011, 1.0) + NOISE
    first, second, *_ = spatial_periods(PLACE, force, ONES, NONE)
    assert near((first,), 0.011)
    assert near((second,), 0.0237)


def test_what_the_model_can_add_is_no_period() -> None:
    taken = np.column_stack([wave(0.0237, phase=0.0), wave(0.0237, phase=0.5 * np.pi), ONES])
    force = wave(0.0237, 3.0) + wave(0.011, 1.0) + NOISE
    first, *_ = spatial_periods(PLACE, force, ONES, taken)
    assert near((first,), 0.011)


def test_a_force_that_turns_with_the_motion_repeats_by_its_weight() -> None:
    direction = np.sign(SPEED)
    force = wave(0.0237) * direction + NOISE
    first, *_ = spatial_periods(PLACE, force, direction, NONE)
    assert near((first,), 0.0237)


def test_a_pitch_far_below_is_a_spectral_line() -> None:
    fine = SPAN / 300.0  # more cycles over the travel than the first look has
    place = np.linspace(0.0, SPAN, COUNT)
    force = np.sin(2.0 * np.pi * place / fine) + NOISE
    found = spatial_periods(place, force, ONES, NONE)
    assert any(p == pytest.approx(fine, rel=2e-3) for p in found)


def test_where_nothing_moves_or_nothing_is_left_there_is_none() -> None:
    assert spatial_periods(0.0 * PLACE, NOISE, ONES, NONE) == ()
    assert spatial_periods(PLACE, 0.0 * NOISE, ONES, NONE) == ()


def test_each_is_told_once_and_within_three_cycles_and_half_a_sample() -> None:
    found = spatial_periods(PLACE, wave(0.0237) + wave(0.011) + NOISE, ONES, NONE)
    cycles = np.sort(SPAN / np.array(found))
    assert cycles.min() >= 3.0 - 1e-9
    assert np.diff(cycles).min() >= 0.5 - 1e-9
    assert len(found) <= 6 + 3
