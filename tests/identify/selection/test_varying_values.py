"""A value of the model that varies is no noise: what it varies with is told.

A conveyor is loaded while it runs, a winder grows, a motor loses force with speed: the error is
the acceleration, or the motor's force, times a curve, and no curve over one coordinate predicts it.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from planted_logs import RATE, SLIDE, Ride, asked, few

from identify.estimation.residual_dependence import Varying
from identify.output.words.fit import dependence_in_words
from identify.selection.diagnosis import Verdict

Array = NDArray[np.float64]
RIDE = Ride(3, seconds=8.0)


def rate(speed: Array) -> Array:
    return np.gradient(speed) * RATE


def loaded(x: Array, speed: Array) -> Array:
    """Half of the mass more from the middle on."""
    return -0.5 * SLIDE.mass * rate(speed) * (np.arange(len(x)) > 0.5 * len(x))


def along(x: Array, speed: Array) -> Array:
    """A third of the mass less at one end, and more at the other."""
    return -5.0 * x * SLIDE.mass * rate(speed)


def weaker_when_fast(x: Array, speed: Array) -> Array:
    """A motor that makes a fifth less of its command at the highest speed."""
    rubs = 0.31 * np.sign(speed) * (speed != 0.0) + 0.53 * speed
    return -0.2 * (speed / RIDE.fast) ** 2 * (SLIDE.mass * rate(speed) + rubs)


@pytest.mark.short(3)
@pytest.mark.parametrize(
    ("beside", "varies", "on"),
    [(loaded, Varying.INERTIA, "time"), (along, Varying.INERTIA, "position"),
     (weaker_when_fast, Varying.GAIN, "velocity")],
)  # fmt: skip
def test_a_value_that_varies_is_told_with_what_it_varies(
    beside: Callable[[Array, Array], Array], varies: Varying, on: str
) -> None:
    found = asked(SLIDE, SLIDE, few("spring"), beside, RIDE)
    assert found.verdict is Verdict.UNEXPLAINED
    assert found.unexplained is not None
    assert (found.unexplained.varies, found.unexplained.depends_on) == (varies, on)
    assert found.unexplained.share_of_error > 0.8
    words = dependence_in_words(found.unexplained)
    assert f"most on {on}, which" in words
    assert f"{varies.value} that changes with it" in words
