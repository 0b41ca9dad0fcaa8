"""The numbers of an axis that a fit may change, as a vector: which they are, read and written."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from twin.effect import Parameter
from twin.model.machine import AxisModel, Fitted


@dataclass(frozen=True)
class ParameterReference:
    """One number of an axis model that a fit may change."""

    effect: str
    """Name of the effect; "" for the axis' own mass."""
    parameter: Parameter
    """Which of its parameters, or the mass as one."""

    @property
    def label(self) -> str:
        """E.g. ``lugre.Fc``, ``mass`` or ``inertia``."""
        return f"{self.effect}.{self.parameter.name}" if self.effect else self.parameter.name


def all_parameters(axis: AxisModel) -> tuple[ParameterReference, ...]:
    """The numbers of an axis: its mass, then those of its effects."""
    of_effects = (
        ParameterReference(f.effect.name, p) for f in axis.effects for p in f.effect.parameters
    )
    return ParameterReference("", axis.mass_parameter), *of_effects


def free_parameters(axis: AxisModel) -> tuple[ParameterReference, ...]:
    """Those that a fit may change: not what is fixed, nor the mass where there is none."""
    fixed = {f.effect.name: f.fixed for f in axis.effects}
    mass, *others = all_parameters(axis)
    free = [
        c
        for c in others
        if c.parameter.name not in fixed[c.effect] and c.parameter.lower < c.parameter.upper
    ]
    return tuple(free) if axis.mass_fixed or axis.is_imposed else (mass, *free)


def read(axis: AxisModel, where: Iterable[ParameterReference]) -> NDArray[np.float64]:
    """Values of those coordinates, in SI units."""
    return np.array(
        [axis[c.effect].values[c.parameter.name] if c.effect else axis.mass for c in where]
    )


def write(
    axis: AxisModel, where: Iterable[ParameterReference], values: Iterable[float]
) -> AxisModel:
    """The axis with those coordinates set."""
    by_effect: dict[str, dict[str, float]] = {}
    for c, value in zip(where, values, strict=True):
        by_effect.setdefault(c.effect, {})[c.parameter.name] = float(value)
    mass = by_effect.pop("", {}).get(axis.mass_parameter.name, axis.mass)
    effects = tuple(
        replace(f, values=_ordered(f, {**f.values, **by_effect[f.effect.name]}))
        if f.effect.name in by_effect
        else f
        for f in axis.effects
    )
    return replace(axis, mass=mass, effects=effects)


def _ordered(before: Fitted, values: dict[str, float]) -> dict[str, float]:
    """The values with each held one raised to the one it may not fall below (Fs >= Fc).

    One that is held at that follows it: the logs did not tell the two apart.
    """
    floors = {p.name: p.at_least for p in before.effect.parameters if p.at_least}
    out = dict(values)
    for name, floor in floors.items():
        follows = name in before.fixed and before.values[name] == before.values[floor]
        out[name] = values[floor] if follows else max(values[name], values[floor])
    return out
