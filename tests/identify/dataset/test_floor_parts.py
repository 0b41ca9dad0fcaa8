"""The parts of a noise floor add up by their squares."""

import pytest

from identify.dataset.noise_floor import NoiseFloor


def floor(**parts: float) -> NoiseFloor:
    return NoiseFloor(1.0, 0.8, 1.2, 1.2, {"rounding": 0.6, "aliasing": 0.3, "path": 0.2, **parts})


def test_a_floor_follows_the_motion_where_most_of_its_square_does():
    assert not floor().follows_motion
    assert floor(path=0.3).follows_motion


def test_a_force_that_no_sensor_makes_is_not_known_to_be_noise():
    assert floor().known == 1.0
    assert floor(force=0.6).known == pytest.approx(0.8)
    assert floor(force=1.1).known == 0.0


@pytest.mark.parametrize("error", [0.5, 3.0])
def test_a_floor_is_at_most_an_error_and_its_parts_fall_alike(error):
    parts = {"rounding": 1.2, "aliasing": 0.6, "path": 0.4}
    less = NoiseFloor(2.0, 1.6, 2.4, 2.4, parts).at_most(error)
    assert less.value == min(error, 2.0)
    assert (less.low, less.high) == (min(error, 1.6), 2.4)
    assert less.parts["rounding"] == pytest.approx(less.value * 0.6)
