"""Maps between the free parameters and the internal variables of the least squares.

A positive parameter is fitted as its logarithm, and one that may not fall below another (Fs >= Fc)
as its excess over it, so that every inequality holds by construction. Bounds are those that are
declared; a positive scale is besides sought where the motion can show it, and a knee of the
actuation where the law is itself there: beyond, it would take the command away and no force is left
to explain.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.dataset.coordinates import covered
from identify.dataset.prepared_log import PreparedLog, scale_of
from twin.effect import Kind, Parameter
from twin.model.machine import AxisModel
from twin.model.parameters import ParameterReference, free_parameters, read, write
from twin.model.units import Scale, dimension, has_size
from twin.signals import Array

Limits = tuple[float, float]

STEP = float(np.cbrt(np.finfo(float).eps))  # of a value, of a difference quotient
AT_EDGE = float(np.sqrt(np.finfo(float).eps))  # of a bound, within which a value is at it


def limits_of(p: Parameter, value: float, scale: Scale) -> Limits:
    """Where a fit seeks a parameter that begins at a value: bounds, or less for a scale.

    The value itself is always allowed.
    """
    decades = 1e9  # a scale is sought within this factor of what is usual, as good as everywhere
    if p.lower <= 0.0 or p.at_least is not None or not has_size(p.unit):
        return p.lower, p.upper
    force, length, _ = dimension(p.unit)
    usual = scale.size(p.unit)
    # 4 times the travel or the top speed: what is longer or faster shows as a constant
    most = 4.0 if (force, length) == (0, 1) else decades
    low, high = max(p.lower, usual / decades), min(p.upper, usual * most)
    return min(low, value), max(high, value)


def difference_step(c: ParameterReference, value: float, scale: Scale) -> float:
    """A step within the bounds, small relative to the value or to what is usual on this machine.

    A positive scale counts by itself; a strength or a place may be zero.
    """
    p = c.parameter
    usual = scale.size(p.unit) if has_size(p.unit) else min(p.upper - p.lower, 1.0)
    # 1e-3 of what is usual, by which a smaller value is stepped as if it were that large
    size = STEP * (abs(value) if p.lower > 0.0 else max(abs(value), 1e-3 * usual))
    return size if value + size <= p.upper else -size


def _fenced(
    axis: AxisModel,
    c: ParameterReference,
    value: float,
    limits: Limits,
    logs: Sequence[PreparedLog],
) -> Limits:
    """Limits of a parameter that keep a law of the actuation itself on the motion of some logs."""
    law = axis[c.effect] if c.effect else None
    if law is None or law.effect.kind is not Kind.ACTUATION:
        return limits
    for knee in (k for k in law.effect.knees if k.name == c.parameter.name):
        low, high = knee.bounds(law.values, covered(tuple(log.motion for log in logs)))
        limits = min(max(limits[0], low), value), max(min(limits[1], high), value)
    return limits


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
            _fenced(axis, c, value, limits_of(c.parameter, value, scale), logs)
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

    @cached_property
    def _index(self) -> dict[tuple[str, str | None], int]:
        return {(c.effect, c.parameter.name): i for i, c in enumerate(self.where)}

    def _below(self, c: ParameterReference) -> int | None:
        """Index of the free parameter that bounds a parameter below; None where it is held."""
        return self._index.get((c.effect, c.parameter.at_least))

    def _floor(self, axis: AxisModel, c: ParameterReference, values: Array) -> float:
        """What a parameter may not fall below, with these values (k,) of the free ones."""
        index, other = self._below(c), c.parameter.at_least
        if index is not None:
            return float(values[index])
        return axis[c.effect].values[other] if other else 0.0

    def least(self, axis: AxisModel) -> Array:
        """Values (k,) of the parameters below which these may not fall; zero without one."""
        values = read(axis, self.where)
        return np.array([self._floor(axis, c, values) for c in self.where])

    def inside(self, axis: AxisModel) -> Array:
        """The internal variables for the values of this axis."""
        values = read(axis, self.where)
        out = values - self.least(axis)
        log = self.is_logarithm()
        out[log] = np.log(values[log])
        return out

    def outside(self, axis: AxisModel, internal: Array) -> AxisModel:
        """The axis with the values of these internal variables."""
        values, log = internal.copy(), self.is_logarithm()
        values[log] = np.exp(internal[log])
        for i, (c, (low, high)) in enumerate(zip(self.where, self.limits, strict=True)):
            values[i] = min(max(values[i] + self._floor(axis, c, values), low), high)
        return write(axis, self.where, values)

    def chain(self, axis: AxisModel, columns: Array) -> Array:
        """Derivatives by the parameters (n, k) -> by the internal variables (n, k)."""
        log = self.is_logarithm()
        out = columns * np.where(log, read(axis, self.where), 1.0)
        for i, c in enumerate(self.where):
            if (index := self._below(c)) is not None:
                out[:, index] += columns[:, i]
        return out

    def bounds(self) -> tuple[Array, Array]:
        """Bounds of the internal variables."""
        low, high = np.array(self.limits).reshape(-1, 2).T.copy()
        log = self.is_logarithm()
        excess = np.array([bool(c.parameter.at_least) for c in self.where], dtype=bool)
        low[log], high[log] = np.log(low[log]), np.log(high[log])
        low[excess], high[excess] = 0.0, (high - low)[excess]
        return low, high

    def part(self, mask: NDArray[np.bool_]) -> Scaling:
        """The same of some of the parameters."""
        each = zip(self.where, self.limits, mask, strict=True)
        kept = [(c, own) for c, own, wanted in each if wanted]
        return Scaling(tuple(c for c, _ in kept), tuple(own for _, own in kept))

    def is_itself(self) -> NDArray[np.bool_]:
        """Which variables are parameters, by which no other parameter is bounded."""
        bounding = {self._below(c) for c in self.where}
        own = ((i, c.parameter) for i, c in enumerate(self.where))
        alone = [p.at_least is None and i not in bounding for i, p in own]
        return np.array(alone, dtype=bool) & ~self.is_logarithm()

    def is_logarithm(self) -> NDArray[np.bool_]:
        """Which variables are logarithms."""
        own = (c.parameter for c in self.where)
        return np.array([p.lower > 0 and p.at_least is None for p in own], dtype=bool)
