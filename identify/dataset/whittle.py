"""Levels of noise by its spectrum: what of a power is of each of some shapes.

P. Whittle, "Estimation and information in stationary time series", Ark. Mat. 2 (1953): the errors
of an estimated power are in proportion to it, so that relative errors are fitted.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d
from scipy.optimize import nnls

Array = NDArray[np.float64]

ROUNDS = 12
TOLERATED = 0.5  # log of power over fit at which a frequency has half its weight
SMOOTHED = 9  # frequencies


def fitted_levels(shapes: Array, power: Array) -> Array:
    """Non-negative levels (k,) of shapes (m, k) in a power (m,), by repeated least squares.

    A frequency above the fit, such as a resonance, has the less weight the higher it is.
    """
    model = _underneath(power)
    levels = np.zeros(shapes.shape[1])
    for _ in range(ROUNDS):
        above = np.maximum(np.log(power / model), 0.0) / TOLERATED
        weight = 1.0 / (1.0 + above**2)
        levels, _ = nnls(shapes * (weight / model)[:, None], power / model * weight)
        model = np.maximum(shapes @ levels, 1e-12 * power.max())
    return levels


def _underneath(power: Array) -> Array:
    """The smallest power at this or any higher frequency: noise of such shapes never falls."""
    smooth = uniform_filter1d(power, SMOOTHED, mode="nearest")
    return np.maximum(np.minimum.accumulate(smooth[::-1])[::-1], 1e-300)
