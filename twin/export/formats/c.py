"""The feedforward of a machine as C99: a function for each axis, from the laws of its effects.

What the C looks like is in ``templates``. ``twin.feedforward`` is the same in Python; the tests
compare the two.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import ceil

from twin.core.native import LONGEST_STEP
from twin.effect import IO_SIZE, Kind
from twin.errors import InputError
from twin.export import Exported, Exporter, Held, Remark, axis_identifiers, filled, identifier
from twin.export.c_law import SLOTS, CannotTranslate, CLaws
from twin.feedforward import followed
from twin.logs import Log
from twin.model.machine import AxisModel, Fitted, MachineModel

MOTION = ("position", "velocity", "acceleration")
IMPOSED = "1e300"  # kg: along an imposed motion friction slides wherever it moves


@dataclass(frozen=True)
class AxisCode:
    """The function of one axis, as the templates write it."""

    name: str
    """Of the axis in the model."""
    prefix: str
    """With which its C names begin: PREFIX_force, PREFIX_state."""
    axis: AxisModel
    """With the effects that are kept."""
    functions: dict[str, str]
    """The C functions of their laws by effect, in the order of a sample."""
    period: float
    """s, from one call to the next."""
    ahead: float
    """By how much the setpoint has to come early, s."""
    ends: dict[str, tuple[float, float]]
    """90 % intervals by the label of a parameter."""
    held: Held
    """What becomes of its effects."""

    @property
    def effects(self) -> list[Fitted]:
        """The effects in the order of a sample."""
        return [self.axis[name] for name in self.functions]

    @property
    def reads_other(self) -> bool:
        """Whether the motion of the other axis is an argument too."""
        return any(f.effect.reads_other_axis for f in self.effects)

    @property
    def arguments(self) -> tuple[str, ...]:
        """Of the function, after the state."""
        return (*MOTION, *(f"other_{m}" for m in MOTION if self.reads_other))

    @property
    def by_current(self) -> bool:
        """Whether there is a function for the current too."""
        return self.axis.hardware.force_constant != 1.0

    @property
    def rubs_by_itself(self) -> bool:
        """Whether friction depends on the force that moves the axis."""
        return any(f.effect.reads("U") for f in self.of("MODIFIER", "FRICTION"))

    @property
    def standing(self) -> list[Fitted]:
        """Attached masses that move against the net force, such as a base."""
        return [f for f in self.of("STRUCTURE") if f.effect.reads("NET")]

    @property
    def riding(self) -> list[Fitted]:
        """Attached masses that move with the axis."""
        return [f for f in self.of("STRUCTURE") if not f.effect.reads("NET")]

    @property
    def steps(self) -> int:
        """In which the attached masses take a period."""
        return 1 if self.standing else ceil(self.period / LONGEST_STEP - 1e-9)

    def of(self, *kinds: str) -> list[Fitted]:
        """The effects of some kinds, kind by kind."""
        return [f for kind in kinds for f in self.effects if f.effect.kind is Kind[kind]]

    def signature(self, what: str) -> str:
        """Of its function for force or current."""
        given = ", ".join(f"double {n}" for n in self.arguments)
        return f"double {self.prefix}_{what}({self.prefix}_state *state, {given})"


@dataclass(frozen=True)
class CSource:
    """The two files of a machine."""

    name: str
    header: str
    source: str
    axes: tuple[AxisCode, ...]


def c_source(model: MachineModel) -> CSource:
    """The feedforward of a machine; raises InputError where the motion of an axis is imposed."""
    if model.joints:
        raise InputError(
            f"{model.name}: its axes are joints of {model.mjcf_name}, whose forces depend on the "
            "motion of all of them; give a model of one axis with a mass"
        )
    model.require_mass()
    name, names, laws = identifier(model.name), axis_identifiers(model), CLaws()
    axes = []
    for axis_name, axis in model.axes.items():
        found = followed(axis)
        functions, left = {}, dict(found.lost)
        for f in sorted(found.axis.effects, key=lambda f: f.effect.turn):
            try:
                CLaws().law(f.effect.law)  # so that half a law is not left among the others
                functions[f.effect.name] = laws.law(f.effect.law)
            except CannotTranslate as error:
                left[f.effect.name] = f"its law cannot be written in C: {error}"
        nearly = {n: t for n, t in found.approximated.items() if n not in left}
        for effect in functions:
            if axis[effect].effect.kind is Kind.STRUCTURE and model.period > LONGEST_STEP:
                nearly[effect] = "the acceleration is held from one call to the next"
        kept = (n for n in found.axis.names if n not in nearly and n not in left)
        held = Held(
            (axis.units.mass_name, *kept),
            tuple(Remark(axis_name, *item) for item in nearly.items()),
            tuple(Remark(axis_name, *item) for item in left.items()),
        )
        intervals = model.intervals.get(axis_name)
        axes.append(
            AxisCode(
                axis_name, f"{name}_{names[axis_name]}", found.axis, functions, model.period,
                found.ahead(model.period), dict(intervals.ends) if intervals else {}, held,
            )
        )  # fmt: skip
    header, source = (
        filled(
            f"model.{kind}", model=model, name=name, axes=axes, laws=laws.text, slots=SLOTS,
            io_size=IO_SIZE, imposed=IMPOSED,
        )
        for kind in ("h", "c")
    )  # fmt: skip
    return CSource(name, header, source, tuple(axes))


def export(model: MachineModel, logs: Mapping[str, Log]) -> Exported:
    """A header and a source file."""
    made = c_source(model)
    files = {f"{made.name}.h": made.header, f"{made.name}.c": made.source}
    return Exported(files, {a.name: a.held for a in made.axes})


EXPORTER = Exporter(
    "C99 feedforward from the setpoint: force or current of each axis", export, ".c"
)
