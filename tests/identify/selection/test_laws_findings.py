"""Shares of what was found."""

from __future__ import annotations

from dataclasses import replace

import pytest
from built_fits import built_dataset, built_fit

from identify.dataset.dataset import Role
from identify.estimation.fit import Errors
from identify.selection.findings import share_explained


def test_a_share_is_of_the_squared_error_above_the_noise_floor():
    base, without = built_fit(0.7, 0.3), built_dataset("one", held=())
    fall = Errors(0.6, 0.4, Role.TRAINING)
    assert share_explained(fall, base, without) == pytest.approx(
        (0.6**2 - 0.4**2) / (0.7**2 - 0.3**2)
    )
    # Without one of several effects a fit may leave more than the base did.
    more = Errors(0.9, 0.5, Role.TRAINING)
    assert share_explained(more, base, without) == pytest.approx(
        (0.9**2 - 0.5**2) / (0.9**2 - 0.3**2)
    )
    assert share_explained(replace(more, after=0.1), base, without) == 1.0
    quiet = built_fit(0.7, 0.8)  # at the floor nothing is left to share
    assert share_explained(fall, quiet, without) == 0.0
