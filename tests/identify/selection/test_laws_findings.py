"""Shares of what was found."""

from __future__ import annotations

from dataclasses import replace

import pytest

from identify.dataset.dataset import Role
from identify.estimation.fit import Errors


def test_a_share_is_of_the_squared_error_above_the_noise_floor():
    fall = Errors(0.6, 0.4, Role.TRAINING)
    assert fall.share_of(0.7, 0.3) == pytest.approx((0.6**2 - 0.4**2) / (0.7**2 - 0.3**2))
    # Without one of several effects a fit may leave more than the base did.
    more = Errors(0.9, 0.5, Role.TRAINING)
    assert more.share_of(0.7, 0.3) == pytest.approx((0.9**2 - 0.5**2) / (0.9**2 - 0.3**2))
    assert replace(more, after=0.1).share_of(0.7, 0.3) == 1.0
    assert fall.share_of(0.7, 0.8) == 0.0  # at the floor nothing is left to share
