"""Levels of noise by its spectrum: what of a power is of each of some shapes.

P. Whittle, "Estimation and information in stationary time series", Ark. Mat. 2 (1953): the errors
of an estimated power are in proportion to it, so that relative errors are fitted.
Without SciPy, which takes longer to load than a short fit takes.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

ROUNDS = 12
TOLERATED = 0.5  # log of power over fit at which a frequency has half its weight
SMOOTHED = 9  # frequencies
DEEPEST = 1e-6  # of the least power, that a fit may be


def fitted_levels(shapes: Array, power: Array) -> Array:
    """Non-negative levels (2,) of shapes (m, 2) in a power (m,), by repeated least squares.

    A frequency above the fit, such as a resonance, has the less weight the higher it is.
    """
    model = _underneath(power)
    levels = np.zeros(2)
    for _ in range(ROUNDS):
        above = np.maximum(np.log(power / model), 0.0) / TOLERATED
        weight = 1.0 / (1.0 + above**2)
        levels = _not_negative(shapes * (weight / model)[:, None], power / model * weight)
        model = np.maximum(shapes @ levels, 1e-12 * power.max())
    return levels


def levels_with_dip(white: Array, bend: Array, power: Array) -> tuple[float, float]:
    """Level of ``white`` in a power (m,), and its coherence, 0..1, with ``bend`` of opposite sign.

    Two noises of one origin: to the shapes (m,) of each alone comes that of their product, which
    may take from the power; 0 where it does not, or where one of the levels is not positive.
    """
    shapes = np.stack([white, bend, -np.sqrt(white * bend)], axis=1)
    least = _underneath(power)
    model, levels = least, np.zeros(3)
    for _ in range(ROUNDS):
        above = np.maximum(np.log(power / model), 0.0) / TOLERATED
        weight = 1.0 / (1.0 + above**2)
        weighed = shapes * (weight / model)[:, None]
        size = np.maximum(np.linalg.norm(weighed, axis=0), np.finfo(float).tiny)
        levels = np.linalg.lstsq(weighed / size, power / model * weight, rcond=1e-12)[0] / size
        model = np.maximum(shapes @ levels, DEEPEST * least)
    if levels.min() <= 0.0:
        return 0.0, 0.0
    return float(levels[0]), float(min(0.5 * levels[2] / np.sqrt(levels[0] * levels[1]), 1.0))


def _underneath(power: Array) -> Array:
    """The smallest power at this or any higher frequency: noise of such shapes never falls."""
    smooth = np.convolve(np.pad(power, SMOOTHED // 2, mode="edge"), np.ones(SMOOTHED), "valid")
    smooth /= SMOOTHED
    return np.maximum(np.minimum.accumulate(smooth[::-1])[::-1], 1e-300)


def _not_negative(columns: Array, wanted: Array) -> Array:
    """Gains (2,) of least squares that are not negative: of both, or of the one that takes more."""
    size = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    columns = columns / size
    pull = columns.T @ wanted
    gains = np.linalg.lstsq(columns.T @ columns, pull, rcond=1e-14)[0]
    if gains.min() < 0.0:
        gains = np.where(np.arange(2) == np.argmax(pull), np.maximum(pull, 0.0), 0.0)
    return np.asarray(gains / size)
