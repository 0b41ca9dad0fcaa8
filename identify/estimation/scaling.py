"""Maps between the free parameters and the internal variables of the least squares.

A positive parameter is fitted as its logarithm, and one that may not fall below another (Fs >= Fc)
as its excess over it, so that every inequality holds by construction.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.model.machine import AxisModel
from twin.model.parameters import ParameterReference, read, write

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Scaling:
    """Maps parameters of an axis to internal variables and back."""

    where: tuple[ParameterReference, ...]

    def _floors(self, axis: AxisModel) -> list[tuple[int | None, float]]:
        """For each parameter: index of the free parameter that bounds it below, or its value."""
        floors: list[tuple[int | None, float]] = []
        for c in self.where:
            other = c.parameter.at_least
            if other is None:
                floors.append((None, 0.0))
                continue
            index = next(
                (
                    i
                    for i, d in enumerate(self.where)
                    if d.effect == c.effect and d.parameter.name == other
                ),
                None,
            )
            floors.append((index, 0.0 if index is not None else axis[c.effect].values[other]))
        return floors

    def least(self, axis: AxisModel) -> Array:
        """Values (k,) of the parameters below which these may not fall; zero without one."""
        pairs = ((c.effect, c.parameter.at_least) for c in self.where)
        return np.array([axis[e].values[other] if other else 0.0 for e, other in pairs])

    def inside(self, axis: AxisModel) -> Array:
        """The internal variables for the values of this axis."""
        values = read(axis, self.where)
        out = np.empty_like(values)
        for i, (c, (index, fixed)) in enumerate(zip(self.where, self._floors(axis), strict=True)):
            if c.parameter.at_least is not None:
                out[i] = values[i] - (values[index] if index is not None else fixed)
            else:
                out[i] = np.log(values[i]) if c.parameter.lower > 0 else values[i]
        return out

    def outside(self, axis: AxisModel, internal: Array) -> AxisModel:
        """The axis with the values of these internal variables."""
        values = np.empty_like(internal)
        floors = self._floors(axis)
        for i, c in enumerate(self.where):
            if c.parameter.at_least is None:
                values[i] = np.exp(internal[i]) if c.parameter.lower > 0 else internal[i]
        for i, (c, (index, fixed)) in enumerate(zip(self.where, floors, strict=True)):
            if c.parameter.at_least is not None:
                values[i] = internal[i] + (values[index] if index is not None else fixed)
            values[i] = min(max(values[i], c.parameter.lower), c.parameter.upper)
        return write(axis, self.where, values)

    def chain(self, axis: AxisModel, columns: Array) -> Array:
        """Derivatives by the parameters (n, k) -> by the internal variables (n, k)."""
        out = columns.copy()
        values = read(axis, self.where)
        for i, (c, (index, _)) in enumerate(zip(self.where, self._floors(axis), strict=True)):
            if c.parameter.at_least is not None:
                if index is not None:
                    out[:, index] += columns[:, i]
            elif c.parameter.lower > 0:
                out[:, i] *= values[i]
        return out

    def bounds(self) -> tuple[Array, Array]:
        """Bounds of the internal variables."""
        low, high = [], []
        for c in self.where:
            p = c.parameter
            if p.at_least is not None:
                low.append(0.0)
                high.append(p.upper - p.lower)
            elif p.lower > 0:
                low.append(np.log(p.lower))
                high.append(np.log(p.upper))
            else:
                low.append(p.lower)
                high.append(p.upper)
        return np.array(low), np.array(high)

    def is_logarithm(self) -> NDArray[np.bool_]:
        """Which variables are logarithms."""
        return np.array(
            [c.parameter.lower > 0 and c.parameter.at_least is None for c in self.where]
        )
