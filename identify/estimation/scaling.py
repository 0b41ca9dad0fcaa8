"""Maps between the free parameters and the internal variables of the least squares.

A positive parameter is fitted as its logarithm, and one that may not fall below another (Fs >= Fc)
as its excess over it, so that every inequality holds by construction. Bounds are those that are
declared; a positive scale is besides sought where the motion can show it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.dataset.prepared_log import PreparedLog, scale_of
from twin.effect import Parameter
from twin.model.machine import AxisModel
from twin.model.parameters import ParameterReference, free_parameters, read, write
from twin.model.units import Scale, dimension, has_size

Array = NDArray[np.float64]
Limits = tuple[float, float]

BEYOND = 4.0  # times the travel or the top speed: what is longer or faster shows as a constant
DECADES = 1e9  # a scale is sought within this factor of what is usual, as good as everywhere
AT_EDGE = 1e-6  # of a bound, within which a value is at it


def limits_of(p: Parameter, value: float, scale: Scale) -> Limits:
    """Where a fit seeks a parameter that begins at a value: bounds, or less for a scale.

    The value itself is always allowed.
    """
    if p.lower <= 0.0 or p.at_least is not None or not has_size(p.unit):
        return p.lower, p.upper
    force, length, _ = dimension(p.unit)
    usual = scale.size(p.unit)
    most = BEYOND if (force, length) == (0, 1) else DECADES
    low, high = max(p.lower, usual / DECADES), min(p.upper, usual * most)
    return min(low, value), max(high, value)


@dataclass(frozen=True)
class Scaling:
    """Maps parameters of an axis to internal variables and back.

    limits: of each parameter where it is sought, in its unit; without them its bounds.
    """

    where: tuple[ParameterReference, ...]
    limits: tuple[Limits, ...] = ()

    def __post_init__(self) -> None:
        if not self.limits:
            declared = tuple((c.parameter.lower, c.parameter.upper) for c in self.where)
            object.__setattr__(self, "limits", declared)

    @classmethod
    def of(cls, axis: AxisModel, logs: Sequence[PreparedLog]) -> Scaling:
        """For all free parameters of an axis, sought where the motion of some logs shows them."""
        where, scale = free_parameters(axis), scale_of(logs)
        limits = (
            limits_of(c.parameter, value, scale)
            for c, value in zip(where, read(axis, where).tolist(), strict=True)
        )
        return cls(where, tuple(limits))

    def at_limit(self, values: Array) -> list[bool]:
        """For each parameter, whether its value is at a limit that is no mere absence.

        An upper limit is one whatever the lower is; of the lower ones only those that are not zero.
        """
        return [
            any(edge != 0.0 and abs(value - edge) <= AT_EDGE * abs(edge) for edge in limits)
            for value, limits in zip(values.tolist(), self.limits, strict=True)
        ]

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
            low, high = self.limits[i]
            values[i] = min(max(values[i], low), high)
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
        for c, (lower, upper) in zip(self.where, self.limits, strict=True):
            if c.parameter.at_least is not None:
                low.append(0.0)
                high.append(upper - lower)
            elif c.parameter.lower > 0:
                low.append(np.log(lower))
                high.append(np.log(upper))
            else:
                low.append(lower)
                high.append(upper)
        return np.array(low), np.array(high)

    def is_logarithm(self) -> NDArray[np.bool_]:
        """Which variables are logarithms."""
        return np.array(
            [c.parameter.lower > 0 and c.parameter.at_least is None for c in self.where]
        )
