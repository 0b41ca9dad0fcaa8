"""End stops that end no travel, or stop nothing, are some other force of position."""

from __future__ import annotations

import pytest
from constructed import CATALOGUE, COVERED

EFFECT = CATALOGUE["end_stop"]
TRAVEL, DRY = COVERED.travel, COVERED.dry_level
DEPTH = 0.04 * TRAVEL


def stops(low: float, high: float, stiffness: float) -> bool:
    """Stops so far (m) from the ends of the travel covered."""
    values = {"low": COVERED.position_low + low, "high": COVERED.position_high - high}
    assert EFFECT.is_itself is not None
    return EFFECT.is_itself({**values, "stiffness": stiffness, "relaxation": 0.0}, COVERED)


@pytest.mark.parametrize("sides", [(1, 0), (0, 1), (1, 1)])
def test_a_stop_pushes(sides: tuple[int, int]) -> None:
    low, high = (DEPTH * side for side in sides)
    for times, itself in ((0.5, True), (0.2, False)):
        assert stops(low, high, times * DRY / DEPTH) is itself


def test_stops_leave_the_travel_free() -> None:
    assert stops(0.04 * TRAVEL, 0.04 * TRAVEL, 1e3)
    assert not stops(0.06 * TRAVEL, 0.06 * TRAVEL, 1e3)
    assert not stops(0.0, 0.11 * TRAVEL, 1e3)
