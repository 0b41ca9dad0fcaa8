"""A rough model of the axis, to find faults of its signals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.signals import Array

_TRIMMED = 0.05  # share of the samples that a fit leaves out
_ROUNDS = 4
_LEVERAGE = 3.0  # times the acceleration that 99 % of the samples stay below
_EXPLAINED = 0.3  # residual as a part of the command
_NOTICED = 0.3  # share of mass x acceleration in the command


@dataclass(frozen=True)
class Dynamics:
    """residual: (m,) command less the model, N, its first sample being number ``first``.

    explains: whether the model holds well. mass: kg, negative where the command is reversed.
    inertial_share: what acceleration makes of the command, RMS about its mean, as a part of it.
    """

    mass: float
    explains: bool
    inertial_share: float
    residual: Array
    first: int

    @property
    def mass_matters(self) -> bool:
        """Whether acceleration makes a part of the command worth the name."""
        return self.inertial_share > _NOTICED


def fit_dynamics(force: Array, regressors: Array, kept: Array, first: int) -> Dynamics:
    """Least trimmed squares of a force (m,) on regressors (m, k), the first the acceleration."""
    acceleration = np.abs(regressors[:, 0])
    use = (kept > 0.0) & (acceleration <= _LEVERAGE * np.quantile(acceleration, 0.99))
    size = np.sqrt(np.mean(regressors**2, axis=0))
    scaled = regressors / np.where(size > 0.0, size, 1.0)
    for _ in range(_ROUNDS):
        rows = scaled * use[:, None]
        gains = np.linalg.lstsq(rows.T @ scaled, rows.T @ force, rcond=1e-12)[0]
        residual = force - scaled @ gains
        error = np.abs(residual)
        use = (kept > 0.0) & (error <= np.quantile(error[kept > 0.0], 1.0 - _TRIMMED))
    spread = float(np.std(force[use]))
    inertial = float(np.std(gains[0] * scaled[use, 0]))
    return Dynamics(
        mass=float(gains[0] / size[0]) if size[0] > 0.0 else 0.0,
        explains=float(np.std(residual[use])) < _EXPLAINED * spread,
        inertial_share=inertial / spread if spread > 0.0 else 0.0,
        residual=residual,
        first=first,
    )
