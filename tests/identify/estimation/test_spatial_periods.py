"""Pitches at which a residual repeats along the track, beside what the model can add itself."""

from __future__ import annotations

import numpy as np
import pytest

from identify.estimation.spatial_periods import MOST_LINES, MOST_PEAKS, spatial_periods

RNG = np.random.default_rng(11)
N = 2000
PLACE = 0.15 * np.sin(np.linspace(0.0, 40.0, N)) + 0.01 * RNG.standard_normal(N)
NOISE = 0.1 * RNG.standard_normal(N)
NOTHING = np.zeros((N, 0))
ALIKE = np.ones(N)


@pytest.mark.parametrize("pitch", [0.061, 0.0213, 0.0047])
def test_a_pitch_is_told_first_within_half_a_cycle(pitch: float) -> None:
    force = np.sin(2.0 * np.pi * PLACE / pitch) + NOISE
    span = np.ptp(PLACE)
    found = spatial_periods(PLACE, force, ALIKE, NOTHING)
    assert abs(span / found[0] - span / pitch) <= 0.5
    assert 1 <= len(found) <= MOST_PEAKS + MOST_LINES


def test_a_pitch_in_proportion_to_a_weight_is_told_by_that_weight() -> None:
    thrust = 3.0 * np.cos(np.linspace(0.0, 97.0, N))
    force = thrust * np.cos(2.0 * np.pi * PLACE / 0.0213) + NOISE
    assert spatial_periods(PLACE, force, thrust, NOTHING)[0] == pytest.approx(0.0213, rel=0.04)
    assert spatial_periods(PLACE, force, ALIKE, NOTHING)[0] != pytest.approx(0.0213, rel=0.04)


def test_what_the_model_can_add_itself_is_no_pitch() -> None:
    own = np.stack([f(2.0 * np.pi * PLACE / 0.05) for f in (np.sin, np.cos)], axis=1)
    force = own @ [5.0, 2.0] + np.sin(2.0 * np.pi * PLACE / 0.0213) + NOISE
    assert spatial_periods(PLACE, force, ALIKE, NOTHING)[0] == pytest.approx(0.05, rel=0.1)
    assert spatial_periods(PLACE, force, ALIKE, own)[0] == pytest.approx(0.0213, rel=0.04)


def test_a_pitch_far_below_the_first_look_is_found_as_a_line() -> None:
    place = np.linspace(-0.1, 0.1, 8000)
    force = np.sin(2.0 * np.pi * place / 3.3e-4) + 0.1 * RNG.standard_normal(8000)
    found = spatial_periods(place, force, np.ones(8000), np.zeros((8000, 0)))
    assert any(p == pytest.approx(3.3e-4, rel=1e-3) for p in found)


def test_without_a_residual_or_a_motion_there_is_none() -> None:
    assert spatial_periods(PLACE, np.zeros(N), ALIKE, NOTHING) == ()
    assert spatial_periods(np.zeros(N), NOISE, ALIKE, NOTHING) == ()
