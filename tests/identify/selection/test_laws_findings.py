"""Shares of what was found."""

from __future__ import annotations

import pytest
from built_fits import built_dataset, built_fit

from identify.selection.findings import _share


def test_a_share_is_of_the_squared_error_above_the_noise_floor():
    base = built_fit(0.7)
    base.__dict__["floor"] = 0.3
    without = built_dataset("one", held=())
    assert _share(0.6, 0.2, base, without) == pytest.approx(0.2 / (0.7**2 - 0.3**2))
    # Without one of several effects a fit may leave more than the base did.
    assert _share(0.9, 0.2, base, without) == pytest.approx(0.2 / (0.9**2 - 0.3**2))
    assert _share(0.9, 0.8, base, without) == 1.0
    base.__dict__["floor"] = 0.8  # the base is at the floor: nothing is left to share
    assert _share(0.6, 0.2, base, without) == 0.0
