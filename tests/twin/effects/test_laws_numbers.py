"""Laws against other ways to compute the same numbers."""

from __future__ import annotations

import numpy as np
import pytest

from twin.effect import DRY, DT, IO_SIZE, MOVED, OUT, STATIC, TIME, VISCOUS, WHEN, V, X
from twin.effects import load_catalogue
from twin.effects.empirical_map import PHASES, curve, ring
from twin.law_parts import along_track

CATALOGUE = load_catalogue()
RNG = np.random.default_rng(41)


def sample(**given: float) -> np.ndarray:
    """io of a sample of 0.1 ms at its end, of an axis of 10 kg."""
    io = np.zeros(IO_SIZE)
    io[[DT, WHEN, MOVED, DRY, STATIC, VISCOUS]] = 1e-4, 1.0, 10.0, 1.0, 1.0, 1.0
    for name, value in given.items():
        io[{"x": X, "v": V, "t": TIME}[name]] = value
    return io


@pytest.mark.parametrize("place", [-0.3, -0.2, -0.137, 0.0, 0.061, 0.1, 0.4])
def test_a_profile_along_a_track_is_a_sum_of_cosines_that_stays_beyond_it(place: float) -> None:
    terms = RNG.normal(size=5)
    along = np.clip((place + 0.2) / 0.3, 0.0, 1.0)
    expected = terms @ np.cos(np.pi * along * np.arange(1, 6))
    assert along_track([-0.2, 0.3, *terms], place) == pytest.approx(expected, abs=1e-12)


def test_free_curves_are_straight_between_their_knots() -> None:
    knots = RNG.normal(size=9)
    for place in (-0.1, 0.0, 0.131, 0.5, 0.77, 1.0, 1.2):
        expected = np.interp(place, np.linspace(0.0, 1.0, 9), knots)
        assert curve([9.9, *knots], 1, 8, place) == pytest.approx(expected)
    knots = RNG.normal(size=PHASES)
    for turns in (-0.31, 0.0, 0.13, 0.5, 0.98, 1.37, 7.7):
        grid = np.linspace(0.0, 1.0, PHASES + 1)
        expected = np.interp(turns % 1.0, grid, [*knots, knots[0]])
        assert ring([9.9, *knots], 1, turns) == pytest.approx(expected)


def test_elements_of_any_parts_are_together_as_stiff_and_as_strong_as_stated() -> None:
    """Of Maxwell-slip elements, whatever their relative limits and springs are."""
    gms = CATALOGUE["gms"]
    values = {p.name: p.start for p in gms.parameters}
    unlike = [n for n in values if n not in {p.name for p in gms.parameters[:9]}]
    values |= {name: 1.0 + 0.7 * k for k, name in enumerate(unlike)}
    p, states = list(values.values()), [0.0] * len(gms.states)
    stiffness, speed = p[5], 1e-9
    io = sample(v=speed)
    gms.law(p, states, io)
    viscous = p[4] * speed
    assert io[OUT] - viscous == pytest.approx(stiffness * speed * 1e-4, rel=1e-6)
    for _ in range(40_000):
        io = sample(v=0.01)
        gms.law(p, states, io)
    level = p[1] + (p[2] - p[1]) * np.exp(-((0.01 / p[3]) ** p[8]))
    assert io[OUT] - p[4] * 0.01 == pytest.approx(level, rel=1e-3)
