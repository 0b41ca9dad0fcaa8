"""Forces of laws along a prescribed motion are those of the law at that place and speed."""

from __future__ import annotations

import numpy as np
import pytest
from built_fits import HARDWARE, axis_of, fitted

from identify.estimation.force_balance import force_along, steady_friction
from twin.effect import Kind
from twin.model.machine import AxisModel

CABLE = {"offset": 0.05, "k1": 1.5, "k2": -2.0, "k3": 8.0}


def test_forces_are_those_of_the_law_at_that_place_and_speed() -> None:
    axis = AxisModel(2.0, HARDWARE, (fitted("cable_slab", **CABLE), *axis_of().effects))
    x, v = np.linspace(-0.1, 0.12, 40), np.linspace(0.3, 0.01, 40)
    force = force_along(axis, x, v, 1e-3, Kind.FORCE)
    np.testing.assert_allclose(force, -(0.05 + 1.5 * x - 2.0 * x**2 + 8.0 * x**3), rtol=1e-9)
    rubbing = -force_along(axis, x, v, 1e-3, Kind.FRICTION)
    np.testing.assert_allclose(rubbing, 0.31 + 0.53 * v, rtol=1e-9)
    back = force_along(axis, x, -v, 1e-3, Kind.FRICTION)
    np.testing.assert_allclose(back, rubbing, rtol=1e-9)


def test_a_state_goes_on_by_the_speed_and_the_length_of_a_sample() -> None:
    """Dahl's force after a way s is Fc (1 - exp(-sigma s / Fc)), whatever the samples."""
    period = 4e-3
    dahl = fitted("dahl", Fc=0.4, sigma0=250.0)
    way = 1e-2
    count = round(way / (0.005 * period))
    v = np.full(count, 0.005)
    x = np.cumsum(v) * period
    force = -force_along(AxisModel(1.0, HARDWARE, (dahl,)), x, v, period, Kind.FRICTION)
    middle = x - 0.5 * 0.005 * period
    np.testing.assert_allclose(force, 0.4 * (1.0 - np.exp(-250.0 * middle / 0.4)), atol=2e-3)


@pytest.mark.parametrize(("way", "place"), [(1.0, -0.1), (-1.0, 0.05)])
def test_steady_friction_is_what_the_laws_reach_at_one_place(way: float, place: float) -> None:
    """Stribeck's curve with the level of the place, more forwards than backwards."""
    lugre = fitted("lugre", Fc=0.285, Fs=0.335, v0=0.01, sigma2=0.018, sigma0=260.0, sigma1=0.6)
    local = fitted("position_dependent_friction", c1=0.06, c2=-0.015)
    axis = AxisModel(1.0, HARDWARE, (lugre, local, fitted("asymmetric_friction", coulomb=0.02)))
    along = np.pi * (place + 0.17) / 0.34
    level = (1.0 + 0.06 * np.cos(along) - 0.015 * np.cos(2 * along)) * (1.0 + 0.02 * way)
    for v in (0.002, 0.1):
        curve = level * (0.285 + 0.05 * np.exp(-((v / 0.01) ** 2))) + 0.018 * v
        assert steady_friction(axis, place, way * v) == pytest.approx(curve, rel=2e-3)
