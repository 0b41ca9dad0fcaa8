"""The part of a force that the parameters of a fit can reproduce, and the part they cannot."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def orthonormal(columns: Array) -> Array:
    """Orthonormal basis (n, r) of the columns' span."""
    norms = np.linalg.norm(columns, axis=0)
    scaled = columns[:, norms > 0] / norms[norms > 0]
    power, directions = np.linalg.eigh(scaled.T @ scaled)
    kept = power > 1e-12 * power.max(initial=1.0)
    return scaled @ (directions[:, kept] / np.sqrt(power[kept]))


def unabsorbed(force: Array, basis: Array) -> Array:
    """The part of forces (n,) or (n, k), N, outside the span of an orthonormal basis (n, r)."""
    return np.asarray(force - basis @ (basis.T @ force))
