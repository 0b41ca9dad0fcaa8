"""The stage model: for each axis its mass, its hardware, its effects and their values."""

from __future__ import annotations

import math
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from enum import Enum
from typing import Any

from twin.core.native import Table, build_table
from twin.effect import ELEMENTS, LEAST, MOST, Effect, Kind, Parameter
from twin.errors import CannotRun, InputError
from twin.model.units import LINEAR, ROTARY, AxisUnits
from twin.numbers import is_number, require_number


@dataclass(frozen=True)
class HistoryStep:
    """One step of the model's growth; errors are RMS force errors, None where not measured."""

    action: str
    """What was done: "add", "shape", "body" or "remove"."""
    effect: str
    """Name of the effect."""
    axis: str
    """Name of the axis."""
    fit_error_before: float
    """On the training logs, before the step."""
    fit_error_after: float
    """On the training logs, after it."""
    holdout_error_before: float | None
    """On the selection logs, which may have taken part in the choice of the effect."""
    holdout_error_after: float | None
    """The same after the step."""
    unit: str = LINEAR.force
    """Of the errors."""
    notes: tuple[str, ...] = ()
    """What else is to be said of the step, in sentences."""
    test_error_before: float | None = None
    """On the test logs, on which nothing was decided."""
    test_error_after: float | None = None
    """The same after the step."""


Interval = tuple[float, float]


@dataclass(frozen=True)
class AxisIntervals:
    """The intervals (90 %) that the last fit of an axis found."""

    ends: Mapping[str, Interval]
    """Low and high end by parameter label, in its unit; none where the model is wrong."""
    above_floor: float
    """Force error of the fit over its noise floor; far above 1 the model is wrong."""


MASS = Parameter(LINEAR.mass_name, LINEAR.mass, 1.0, LEAST, MOST, "moved mass")
# Declared linear as all parameters are.
INERTIA = Parameter(ROTARY.mass_name, LINEAR.mass, 1.0, LEAST, MOST, "moment of inertia")
OF_IMPOSED_MOTION = (Kind.FORCE, Kind.MODIFIER, Kind.FRICTION)  # need neither mass nor motor
MOST_AXES_OF_A_PAIR = 2  # with more, which is the other axis?


@dataclass(frozen=True)
class HardwareEntry:
    """What a machine's file may hold of one field of the hardware, and how it is shown there."""

    unit: str
    """On a linear axis."""
    meaning: str
    note: str = ""
    """What stands behind the unit in a file."""
    zero: bool = False
    """Whether 0 is allowed."""
    most: float = 1e12
    """The largest value that is."""


def _of_hardware(default: Any, *args: Any, **kwargs: Any) -> Any:
    """A field of the hardware with its ``HardwareEntry``."""
    return field(default=default, metadata={"entry": HardwareEntry(*args, **kwargs)})


@dataclass(frozen=True)
class Hardware:
    """What surrounds an axis' mechanics, in the units of a linear axis (see twin.model.units).

    A field is declared here alone: files, their schema and their comments follow. Raises InputError
    for a value that its entry does not allow.
    """

    travel: tuple[float, float] | None = _of_hardware(None, "m", "low and high end")
    force_constant: float = _of_hardware(1.0, "N/A", "force of the drive per current")
    force_limit: float = _of_hardware(math.inf, "N", "most force of the drive", most=math.inf)
    encoder_resolution: float = _of_hardware(0.0, "m", "step of the readings", zero=True, most=1.0)
    encoder_noise: float = _of_hardware(
        0.0, "m", "rms of the readings' noise", " rms", zero=True, most=1.0
    )
    current_noise: float = _of_hardware(
        0.0, "A", "rms of the current's noise", " rms", zero=True, most=1e3
    )
    velocity: float = _of_hardware(0.25, "m/s", "fastest move", ", fastest move", most=1e6)
    acceleration: float = _of_hardware(2.0, "m/s^2", "fastest move", ", fastest move")
    jerk: float = _of_hardware(200.0, "m/s^3", "fastest move", ", fastest move")
    bandwidth: float = _of_hardware(30.0, "Hz", "of the position loop", ", position loop", most=1e6)

    def __post_init__(self) -> None:
        for name in self.entries():
            self._require(name, getattr(self, name))

    @classmethod
    def of_allowed(cls, **values: Any) -> Hardware:
        """Hardware with those of the values that it may have, and else with its defaults."""
        allowed = {}
        for name, value in values.items():
            with suppress(InputError):
                cls._require(name, value)
                allowed[name] = value
        return cls(**allowed)

    @classmethod
    def _require(cls, name: str, value: Any) -> None:
        """Raise InputError for a value that its entry does not allow."""
        entry = cls.entries()[name]
        if name != "travel":
            require_number(name, value, entry.unit, zero=entry.zero, most=entry.most)
        elif value is not None:
            low, high = value
            farthest = 1e6  # m, beyond which a position is one in counts
            if not (is_number(low) and is_number(high) and -farthest <= low < high <= farthest):
                raise InputError(
                    f"travel = [{low}, {high}] m: give its low and its high end, the low one "
                    f"first, at most {farthest:g}"
                )

    @classmethod
    def entries(cls) -> dict[str, HardwareEntry]:
        """Of each field, by its name."""
        return {f.name: f.metadata["entry"] for f in fields(cls)}


@dataclass(frozen=True)
class Fitted:
    """An effect with its parameter values."""

    effect: Effect
    """The physical law."""
    values: Mapping[str, float] = field(hash=False)
    """Value by parameter name, in the parameter's unit."""
    fixed: frozenset[str]
    """Names of the parameters that a fit holds."""

    @classmethod
    def at_start(
        cls, effect: Effect, values: Mapping[str, float] | None = None, units: AxisUnits = LINEAR
    ) -> Fitted:
        """The effect at its start values, or those given; checks names and bounds (InputError).

        units: of the axis, for messages.
        """
        effect = _sized(effect, values or {})
        merged = {**effect.starts(), **(values or {})}
        for name, value in merged.items():
            _check_value(effect, name, value, units)
        fixed = frozenset(p.name for p in effect.parameters if p.fixed)
        return cls(effect, merged, fixed)

    def require_sound(self, units: AxisUnits = LINEAR) -> None:
        """Raise InputError for values that are none of the effect's, and for others that are held.

        units: of the axis, for messages.
        """
        known = {p.name for p in self.effect.parameters}
        for name in (*self.fixed - known, *known - self.values.keys()):
            raise InputError(
                f"{self.effect.name}.{name}: is no value of the effect; give "
                f"{', '.join(p.name for p in self.effect.parameters)}"
            )
        for name, value in self.values.items():
            _check_value(self.effect, name, value, units)

    def vector(self) -> list[float]:
        """Values in the order of the effect's parameters."""
        return [self.values[p.name] for p in self.effect.parameters]


def _sized(effect: Effect, values: Mapping[str, float]) -> Effect:
    """The effect with as many elements as its values ask for."""
    count = values.get(ELEMENTS)
    if effect.of_size is None or count is None:
        return effect
    most_elements = 1000
    if not (is_number(count) and float(count).is_integer() and 1 <= count <= most_elements):
        raise InputError(
            f"{effect.name}.{ELEMENTS} = {count!s:.60}: give a whole number of elements from 1 to "
            f"{most_elements}"
        )
    return effect.of_size(int(count)).numbered(effect.number)


def _check_value(effect: Effect, name: str, value: float, units: AxisUnits) -> None:
    known = [p.name for p in effect.parameters]
    if name not in known:
        raise InputError(
            f"effect '{effect.name}' has no parameter '{name}'; it has {', '.join(known)}"
        )
    p = effect.parameter(name)
    unit = units(p.unit)
    if not is_number(value):
        shown = repr(value) if isinstance(value, str) else str(value)
        raise InputError(
            f"{effect.name}.{name} = {shown:.60}: is not a finite number; give it in {unit}"
        )
    if not p.lower <= value <= p.upper:
        raise InputError(
            f"{effect.name}.{name} = {value:g} {unit}: outside [{p.lower:g}, {p.upper:g}] "
            f"{unit} ({p.meaning})"
        )


class Hindrance(Enum):
    """Why a diagnosis does not offer an effect on an axis that could have it."""

    OTHER_AXIS = "it depends on the other axis, and there are several"
    IMPOSED = "it acts through the motor or the moved mass, and the motion is imposed"
    NO_ROTOR = "it is of the drive of a joint, whose rotor's inertia is not in the model"


@dataclass(frozen=True)
class AxisModel:
    """One axis of a machine: what is moved, what surrounds it, and its effects.

    Raises InputError for a mass below zero, a time that is no number above zero, two frictions, and
    an effect that the axis cannot have.
    """

    mass: float
    """Moved mass, kg; of a rotary axis its moment of inertia, kg m^2. Zero: the motion is imposed,
    and the force of a log is the one that it takes; such an axis cannot be simulated. Of a joint
    that of the bodies that it moves, on average over their poses; what they take beyond this mass
    times acceleration is known from the motion of all joints (twin.mujoco.mechanism)."""
    hardware: Hardware = Hardware()
    """Travel, drive, encoder and limits."""
    effects: tuple[Fitted, ...] = ()
    """The effects with their values, in the order in which they were added."""
    mass_fixed: bool = False
    """Whether a fit holds the mass."""
    rotary: bool = False
    """Whether the axis turns: all lengths are then angles (rad), forces torques (N m)."""
    joint: str | None = None
    """Name of its joint or fixed tendon in the machine's MuJoCo file; None: a plain axis."""
    test_function: float | None = None
    """Length of the test functions, s, at which a diagnosis found this model, and at which its
    errors were told. None: chosen from the logs."""
    channel_delay: float = 0.0
    """By how much the force acts before its time stamp in the logs that a diagnosis found this
    model on, s. A fit begins with it; where others explain its logs better, it takes these."""

    def __post_init__(self) -> None:
        name, unit = self.units.mass_name, self.units.mass
        if not (is_number(self.mass) and self.mass >= 0):
            raise InputError(
                f"{name} = {self.mass} {unit}: must be a positive number of {unit}, or 0 where the "
                "motion is imposed"
            )
        if self.test_function is not None:
            require_number("test_function", self.test_function, "s", most=1e3)
        require_number("channel_delay", self.channel_delay, "s", zero=True, most=1.0)
        frictions = [f.effect.name for f in self.effects if f.effect.kind is Kind.FRICTION]
        if len(frictions) > 1:
            raise InputError(
                f"an axis has one friction model, given {' and '.join(frictions)}; remove one"
            )
        for f in self.effects:
            if not self._moves_with(f.effect):
                raise InputError(
                    f"{f.effect.name} acts through the motor or the moved mass, and {name} = 0 "
                    f"{unit} says that the motion is imposed; remove it, or give the {name}"
                )

    def __repr__(self) -> str:
        effects = ", ".join(self.names) or "no effects"
        return f"<AxisModel of {self.mass:.6g} {self.units.mass}: {effects}>"

    @property
    def is_imposed(self) -> bool:
        """Whether the motion is imposed, so that there is no mass to move."""
        return self.mass == 0.0

    def can_have(self, effect: Effect) -> bool:
        """Whether a diagnosis offers the effect: it acts, and no other has its law on this axis."""
        return self._suits(effect) and self.hindrance(effect) is None

    def hindrance(self, effect: Effect) -> Hindrance | None:
        """Why a diagnosis does not offer an effect that an axis like this can have; else None.

        What the drive of a joint does to the command, but for its torque constant, is asked beside
        its rotor's inertia, whose torque a lag or a limit would imitate where the bodies are light.
        """
        if not self._suits(effect):
            return None
        if not self._moves_with(effect):
            return Hindrance.IMPOSED
        drives = effect.kind is Kind.ACTUATION and effect.of_joints is None
        bare = drives and self.joint is not None and self.weighed is self
        return Hindrance.NO_ROTOR if bare else None

    def _suits(self, effect: Effect) -> bool:
        """Whether an axis of this kind can have the effect, and no other has its law there."""
        present = [f.effect for f in self.effects]
        suits = effect.suits is None or effect.suits(present, self.rotary)
        return suits and effect.of_joints in (None, self.joint is not None)

    def _moves_with(self, effect: Effect) -> bool:
        """Whether the effect acts on this axis at all: imposed motion has no motor and no mass.

        A law that reads the motor's force would read there what it is to explain.
        """
        return not self.is_imposed or (effect.kind in OF_IMPOSED_MOTION and not effect.reads("U"))

    @property
    def units(self) -> AxisUnits:
        """What the axis' quantities are given in."""
        return ROTARY if self.rotary else LINEAR

    @property
    def mass_parameter(self) -> Parameter:
        """The moved mass, or moment of inertia, as a parameter."""
        return INERTIA if self.rotary else MASS

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the axis' effects."""
        return tuple(f.effect.name for f in self.effects)

    @property
    def friction(self) -> Fitted | None:
        """The friction of the axis, of which there is one at most."""
        return next((f for f in self.effects if f.effect.kind is Kind.FRICTION), None)

    def __getitem__(self, effect: str) -> Fitted:
        return next(f for f in self.effects if f.effect.name == effect)

    def begun_as(self, other: AxisModel) -> AxisModel:
        """The same effects, with the mass and the values of another axis, for those of both."""

        def begun(law: Fitted) -> Fitted:
            name = law.effect.name
            values = other[name].values if name in other.names else law.values
            # Another number of elements is another law.
            return replace(law, values=values) if values.keys() == law.values.keys() else law

        return replace(self, mass=other.mass, effects=tuple(map(begun, self.effects)))

    @property
    def weighed(self) -> AxisModel:
        """The same with what effects add to the moved mass in the mass, and without these."""
        adding = [(f, f.effect.added_mass) for f in self.effects if f.effect.added_mass]
        added = sum(add(f.values, self.mass) for f, add in adding)
        kept = tuple(f for f in self.effects if not f.effect.added_mass)
        return replace(self, mass=self.mass + added, effects=kept) if adding else self

    def parameter_units(self, effect: str) -> dict[str, str]:
        """Units of the parameters of an effect of this axis, by name."""
        return {p.name: self.units(p.unit) for p in self[effect].effect.parameters}

    def with_effect(self, new: Fitted) -> AxisModel:
        """This axis with the effect added, or exchanged where it is there already.

        A friction takes the place of the friction that was there.
        """
        replaced = {new.effect.name}
        if new.effect.kind is Kind.FRICTION and self.friction:
            replaced.add(self.friction.effect.name)
        kept = (f for f in self.effects if f.effect.name not in replaced)
        return replace(self, effects=(*kept, new))

    def without(self, effect: str) -> AxisModel:
        """This axis less one effect; InputError where it has no such effect."""
        if effect not in self.names:
            raise InputError(
                f"the axis has no effect '{effect}' to remove; it has {', '.join(self.names)}"
            )
        return replace(self, effects=tuple(f for f in self.effects if f.effect.name != effect))


@dataclass(frozen=True)
class MachineModel:
    """A machine: its axes, how it is sampled, and how the model grew.

    Raises InputError where it has more than two axes and an effect that depends on the other one,
    and for a rate that is no number above 0.
    """

    name: str
    """What the machine is called."""
    axes: Mapping[str, AxisModel]
    """Its axes by name."""
    sample_rate: float = 10_000.0
    """Rate of control and simulation, Hz."""
    mjcf: str | None = None
    """MJCF (or URDF) text of its bodies; None: each axis is a plain slide or hinge."""
    mjcf_name: str | None = None
    """Name of the MJCF file beside the model file."""
    history: tuple[HistoryStep, ...] = field(default=())
    """How the model grew, the first step first."""
    intervals: Mapping[str, AxisIntervals] = field(default_factory=dict)
    """By axis, what its last fit found; none where the axis was exchanged since."""

    def __post_init__(self) -> None:
        require_number("sample_rate", self.sample_rate, "Hz", most=1e7)
        for name, axis in self.axes.items():
            for f in axis.effects if len(self.axes) > 1 else ():  # one may be a part of two
                self.require_usable(f.effect, name)

    def __repr__(self) -> str:
        axes = "; ".join(f"{name}: {', '.join(a.names)}" for name, a in self.axes.items())
        return f"<MachineModel {self.name} at {self.sample_rate:g} Hz, {axes or 'no axes'}>"

    def can_use(self, effect: Effect) -> bool:
        """Whether "the other axis" is one axis of this machine; a friction may do without."""
        least = 2 if effect.is_between_axes else 1
        return least <= len(self.axes) <= MOST_AXES_OF_A_PAIR or not effect.reads_other_axis

    def hindrance(self, effect: Effect, axis: str) -> Hindrance | None:
        """Why a diagnosis of an axis does not offer an effect that it could have; else None."""
        return self.axes[axis].hindrance(effect) if self.can_use(effect) else Hindrance.OTHER_AXIS

    def require_usable(self, effect: Effect, axis: str) -> None:
        """Raise InputError for an effect that this machine cannot have."""
        if not self.can_use(effect):
            raise InputError(
                f"axis {axis}: {effect.name} depends on the other axis of two, and this machine "
                f"has {len(self.axes)}; remove it, or give a model of the two axes alone"
            )

    @property
    def joints(self) -> dict[str, str]:
        """Name of the joint or tendon of each axis that is one of a mechanism."""
        return {name: axis.joint for name, axis in self.axes.items() if axis.joint is not None}

    @property
    def is_imposed(self) -> bool:
        """Whether the motion of an axis is imposed, so that no motion can be simulated."""
        return any(axis.is_imposed for axis in self.axes.values())

    def require_mass(self) -> None:
        """Raise CannotRun where none can be simulated: one is imposed, or a law reads a log."""
        for name, axis in self.axes.items():
            for law in (f.effect for f in axis.effects if f.effect.channels):
                raise CannotRun(
                    f"axis {name}: {law.name} reads the {law.channels[0]} of a log, which no "
                    f"simulation has; remove {law.name}"
                )
            if axis.is_imposed:
                mass, unit = axis.units.mass_name, axis.units.mass
                raise CannotRun(
                    f"axis {name}: {mass} = 0 {unit} says that its motion is imposed, so that "
                    f"none can be simulated; give the {mass} that is moved"
                )

    @property
    def period(self) -> float:
        """Sample period in s."""
        return 1.0 / self.sample_rate

    def axis(self, name: str) -> AxisModel:
        """The axis of that name; InputError where there is none."""
        if name not in self.axes:
            raise InputError(f"the model has no axis '{name}'; it has {', '.join(self.axes)}")
        return self.axes[name]

    def with_axis(self, name: str, axis: AxisModel) -> MachineModel:
        """This stage with one axis exchanged, and without that axis' intervals."""
        kept = {a: i for a, i in self.intervals.items() if a != name}
        return replace(self, axes={**self.axes, name: axis}, intervals=kept)

    def with_intervals(self, name: str, found: AxisIntervals) -> MachineModel:
        """This stage with the intervals of one axis."""
        return replace(self, intervals={**self.intervals, name: found})

    def with_history(self, *steps: HistoryStep) -> MachineModel:
        """This machine with more steps of history."""
        return replace(self, history=(*self.history, *steps))

    def table(self) -> Table:
        """The native table of all axes."""
        return axis_table(self.axes)


def axis_table(axes: Mapping[str, AxisModel]) -> Table:
    """Native table of some axes."""
    return build_table(
        {name: [(f.effect, f.vector()) for f in axis.effects] for name, axis in axes.items()},
        [axis.mass for axis in axes.values()],
    )
