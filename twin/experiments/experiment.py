"""What an experiment is: a setpoint made from a few parameters in SI units.

Kinds of experiment are in twin.experiments.kinds, named ones in twin.experiments.named.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from copy import deepcopy
from dataclasses import KW_ONLY, MISSING, dataclass, field, fields, replace
from typing import Any, ClassVar

import numpy as np

from twin.errors import CannotRun, InputError
from twin.experiments.trajectory import (
    AnySetpoint,
    FloatArray,
    Limits,
    Setpoint,
    point_to_point,
    travel_box,
)
from twin.model.machine import MachineModel
from twin.model.units import rotary_unit


def given(unit: str, meaning: str, default: Any = MISSING, *, zero: bool = False) -> Any:
    """A parameter with its unit; positive, or where ``zero`` also zero."""
    return field(default=default, metadata={"unit": unit, "meaning": meaning, "zero": zero})


def counted(meaning: str) -> Any:
    """A whole number of at least 1."""
    return field(metadata={"unit": "", "meaning": meaning})


@dataclass(frozen=True)
class Experiment(ABC):
    """One experiment. Its fields are its parameters; their units are in the fields' metadata.

    closed_loop: whether the position loop is closed while it runs. Raises InputError for a
    parameter that is not a number of the allowed sign.
    """

    summary: ClassVar[str]
    closed_loop: ClassVar[bool] = True

    def __post_init__(self) -> None:
        for f in fields(self):
            value, whole = getattr(self, f.name), f.metadata.get("unit") == ""
            if "zero" in f.metadata:
                _require(f.name, value, f.metadata["unit"], f.metadata["zero"])
            elif whole and not (isinstance(value, int | np.integer) and value >= 1):
                raise InputError(
                    f"{f.name} {value!r} is not allowed: give a whole number of at least 1"
                )

    @abstractmethod
    def setpoint(self, model: MachineModel, rng: np.random.Generator) -> AnySetpoint:
        """The setpoint for this machine; CannotRun where it exceeds the machine's limits."""


def _require(name: str, value: Any, unit: str, zero: bool) -> None:
    values = value if isinstance(value, tuple) else (value,)
    for v in values:
        number = isinstance(v, int | float) and not isinstance(v, bool) and math.isfinite(v)
        if not (number and (v > 0 or (zero and v == 0))):
            allowed = "0 or more" if zero else "a number above 0"
            turned = rotary_unit(unit)
            also = "" if turned == unit else f" ({turned} on a rotary axis)"
            raise InputError(f"{name} = {v} {unit}: is not allowed; give {allowed} {unit}{also}")
    if not values:
        raise InputError(f"{name}: is empty; give at least one number in {unit}")


def machine_limits(model: MachineModel) -> list[Limits]:
    """Motion limits of every axis of the model; CannotRun where its travel is not known."""
    limits = []
    for name, axis in model.axes.items():
        h = axis.hardware
        if h.travel is None:
            unit = axis.units.position
            raise CannotRun(f"axis {name} has no travel; give travel = [low, high] in {unit}")
        limits.append(Limits(h.travel, h.velocity, h.acceleration, h.jerk, axis.units, name))
    return limits


@dataclass(frozen=True)
class Driven:
    """The axis that an experiment moves while all others rest.

    limits: of every axis; index: of the one that moves; place: m, one for each axis.
    """

    model: MachineModel
    limits: Sequence[Limits]
    index: int
    place: FloatArray


@dataclass(frozen=True)
class OneAxis(Experiment):
    """An experiment on one axis.

    at: place of the experiment on every axis, m, in the model's order; the middle of the travel
    where None. effort: part of the acceleration and jerk limits that its moves use. other: span (m)
    over which the other axis goes back and forth at its limits meanwhile; it rests where 0.
    """

    axis: str
    _: KW_ONLY
    at: tuple[float, ...] | None = field(
        default=None, metadata={"unit": "m", "meaning": "place, one for each axis"}
    )
    effort: float = given("1", "part of the acceleration limit", 1.0)
    other: float = given("m", "span of the other axis meanwhile", 0.0, zero=True)

    def setpoint(self, model: MachineModel, rng: np.random.Generator) -> AnySetpoint:
        model.axis(self.axis)
        if self.effort > 1.0:
            raise InputError(f"effort = {self.effort:g}: give a part of the limit, above 0 up to 1")
        limits = machine_limits(model)
        place = np.mean(travel_box(limits), axis=0) if self.at is None else np.array(self.at)
        if place.shape != (len(limits),) or not np.isfinite(place).all():
            unit = " or ".join(dict.fromkeys(limit.units.position for limit in limits))
            raise InputError(
                f"at = {self.at}: give {len(limits)} positions in {unit}, one per axis"
            )
        allowed = [gentle(limit, self.effort) for limit in limits]
        driven = Driven(model, allowed, list(model.axes).index(self.axis), place)
        alone = self.on(driven)
        return _with_other(alone, driven, self.other) if self.other else alone

    @abstractmethod
    def on(self, driven: Driven) -> AnySetpoint:
        """The setpoint with the other axis at rest."""


def gentle(limit: Limits, effort: float) -> Limits:
    """The limits with a part of the acceleration and jerk."""
    return replace(limit, acceleration=effort * limit.acceleration, jerk=effort * limit.jerk)


def _with_other(alone: AnySetpoint, driven: Driven, span: float) -> Setpoint:
    """The setpoint with the other axis going back and forth over the span (m) about its place."""
    model, names = driven.model, list(driven.model.axes)
    if len(names) != 2:
        which = "has no second axis" if len(names) < 2 else f"has {len(names)} axes, not two"
        raise CannotRun(f"other = {span:g}: the machine {which}; leave it out")
    index = 1 - driven.index
    ends = np.tile(driven.place, (4, 1))
    ends[1:3, index] += 0.5 * span, -0.5 * span
    turn_rest = 0.1  # s of rest of the other axis at each end, as of moves by default
    cycle = point_to_point(machine_limits(model), ends, turn_rest, model.sample_rate)
    count = len(alone) // len(cycle)
    if count == 0:
        raise CannotRun(
            f"other = {span:g} {model.axes[names[index]].units.position}: one round takes "
            f"{cycle.duration:.3g} s, the experiment lasts {alone.duration:.3g} s; give a smaller "
            "span or a longer experiment"
        )
    both = deepcopy(alone.part(0, len(alone)))
    for column, added in zip(both.columns[:3], cycle.part(0, len(cycle)).columns[:3], strict=True):
        column[: count * len(cycle), index] = np.tile(added[:, index], count)
    return both
