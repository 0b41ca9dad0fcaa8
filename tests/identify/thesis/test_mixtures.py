"""Mixtures of two frictions: the law is the weighted sum of both, and its weight is found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identify.estimation.prescribed_motion import force_along
from identify.thesis.behaviours import LOOP, RATE, turning
from identify.thesis.future import FULL, _of_a_mixture
from identify.thesis.mixed_friction import PARTS, mixed
from twin.effect import Kind
from twin.effects import load_catalogue
from twin.model.file import load_model
from twin.model.machine import AxisModel, Fitted

FORGETS = {"Fc": 0.3, "Fs": 0.4, "v0": 0.02, "sigma2": 0.5, "sigma0": 900.0, "sigma1": 0.3}
REMEMBERS = {**FORGETS, "sigma0": 400.0, "sigma1": 0.7, "spread": 5.0}


def friction(fitted: Fitted) -> np.ndarray:
    position = turning(LOOP)
    velocity = np.diff(position, append=position[-1]) * RATE
    axis = AxisModel(mass=1.0, effects=(fitted,))
    return force_along(axis, position, velocity, 1.0 / RATE, Kind.FRICTION)


@pytest.mark.parametrize("weight", [0.0, 0.3, 1.0])
def test_a_mixture_is_the_weighted_sum_of_both(weight: float) -> None:
    first, second = (
        friction(Fitted.at_start(effect, values))
        for effect, values in zip(PARTS, (FORGETS, REMEMBERS), strict=True)
    )
    found = friction(mixed(REMEMBERS, FORGETS, weight))
    np.testing.assert_allclose(found, weight * first + (1.0 - weight) * second, atol=1e-12)
    assert np.abs(first - second).max() > 0.01


@pytest.mark.slow
def test_a_mixture_is_found_where_there_is_one_and_elements_do_not_stand_in() -> None:
    catalogue = load_catalogue()
    machine = replace(load_model("thesis_memory", catalogue), sample_rate=1000.0)
    other = Fitted.at_start(PARTS[0], {"sigma0": 260.0, "sigma1": 0.6})
    size = replace(FULL, elements=(1, 4))
    rng = np.random.default_rng(11)
    found = _of_a_mixture(machine, "x", other, size, rng, lambda *_: None)
    assert found.planted == 0.5
    assert abs(found.weight - found.planted) < 2.0 * found.half
    assert found.both.over_floor < 1.2
    assert all(t.over_floor > 1.8 for t in (*found.alone, *found.elements))
