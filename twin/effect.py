"""What an effect is: one physical law with its parameters, states and fingerprint.

A law is one function ``law(p, s, io)`` of three arrays of doubles:

* ``p``  the effect's parameters, in the order of ``Effect.parameters``;
* ``s``  its internal states, zero at the start, advanced by the law once per sample;
* ``io`` the axis at this sample, indexed by the constants below.

The law reads what it needs from ``io`` and writes one result: a force effect writes OUT (the force
on the axis, N); a friction writes OUT (the force opposing motion, N); an actuation changes U; a
modifier multiplies DRY, STATIC or VISCOUS; a sensing effect changes READING.
A structure effect writes OUT, the force (N) that bodies attached to the axis add to its motion. OUT
is linear in ACC for a body on the axis, and linear in NET for the body that the axis stands on;
where WHEN is 0 the law must not change its states.
It is plain Python and also compiles, once, to native code (see twin.core.native).
"""

from __future__ import annotations

import importlib
import importlib.util
import inspect
import sys
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cached_property
from pathlib import Path
from types import FunctionType
from typing import Any

from twin.curve import Curve, FreeShape, Part
from twin.errors import InputError
from twin.excitation import Excitation as Excitation  # effects' files take it from here
from twin.knee import REACH, Imitation, Knee

# Slots of ``io``. Compiled laws freeze these numbers.
INDEX = 0  # sample index, 0 at the first sample
TIME = 1  # s
DT = 2  # s, sample period
X = 3  # m, true position
V = 4  # m/s, true velocity
U = 5  # N, actuator force; commanded on entry, actual after the actuation effects
MASS = 6  # kg, what a force moves, with what is attached; infinite along a measured motion
X_OTHER = 7  # m, position of the other axis of two (zero on a machine with more: see MachineModel)
V_OTHER = 8  # m/s
A_OTHER = 9  # m/s^2
FRICTION = 10  # N, friction of the previous sample (opposing motion)
DRY = 11  # 1, factor on the dry friction level (Coulomb, Stribeck)
STATIC = 12  # 1, further factor on the static level only
VISCOUS = 13  # 1, factor on the viscous part
HOLD = 14  # N, friction that would bring the axis to rest within this sample
READING = 15  # m, encoder reading
OUT = 16  # N, result of a force or friction law
WHEN = 17  # 1, instant of the result in the sample: 1 its end (stepping), 1/2 its middle (walk)
MOVED = 18  # kg, moved mass of the axis
NET = 19  # m/s^2, all forces on the axis but those of structure, over its moved mass
ACC = 20  # m/s^2, absolute acceleration of the bodies on the axis
LOAD = 21  # N, what the bodies of a mechanism take of this joint; zero on a plain axis
SPEEDS = 22  # m/s, velocities of all joints of a mechanism in the order of its axes; else zero
MOST_JOINTS = 64
PRESSURE = SPEEDS + MOST_JOINTS  # Pa, as logged; zero where it was not, and so are the next two
PRESSURE_2 = PRESSURE + 1  # Pa, of the other chamber
TEMPERATURE = PRESSURE + 2  # K
IO_SIZE = PRESSURE + 3
COLUMNS = IO_SIZE  # how many strengths act at a sample; then the number and the weight of each

# What a log may hold beside the motion, in the order of the slots from PRESSURE on.
CHANNELS = {"PRESSURE": "pressure", "PRESSURE_2": "pressure_2", "TEMPERATURE": "temperature"}

Law = Callable[[Any, Any, Any], None]

# Bounds of what has a force or a length in its unit where physics gives none: beyond any machine.
LEAST, MOST = 1e-15, 1e15

ELEMENTS = "elements"  # the parameter that counts the elements of an effect with ``of_size``


def own_functions(function: Callable[..., Any]) -> tuple[FunctionType, ...]:
    """The plain functions that a function calls, of its own file or imported, directly or not."""
    found: list[FunctionType] = []
    waiting: list[Any] = [function]
    while waiting:
        caller = waiting.pop()
        for name in caller.__code__.co_names:
            called = caller.__globals__.get(name)
            if isinstance(called, FunctionType) and called not in found:
                found.append(called)
                waiting.append(called)
    return tuple(found)


class Kind(Enum):
    """What a law acts on; the values give the order of computation within a sample (`turn`)."""

    SENSING = 0
    ACTUATION = 1
    FORCE = 2
    MODIFIER = 3
    FRICTION = 4
    STRUCTURE = 5


RUBBING = (Kind.FRICTION, Kind.MODIFIER)  # what makes friction together


@dataclass(frozen=True)
class Parameter:
    """One number of a law, in the unit that it has on a linear axis (see twin.model.units)."""

    name: str
    """Name within the effect, as in a model file."""
    unit: str
    """SI unit, such as "N s/m"; "1" for a ratio."""
    start: float
    """Value before anything is known, in ``unit``."""
    lower: float
    """Least value allowed, in ``unit``."""
    upper: float
    """Largest value allowed, in ``unit``."""
    meaning: str
    """What it is, in a few words; the comment beside it in a model file."""
    strength: bool = False
    """Whether the force is linear in it; where all strengths are zero the effect is absent."""
    fixed: bool = False
    """Whether it is known by design: a fit holds it, unless the model file says otherwise."""
    at_least: str | None = None
    """Name of a parameter of the same effect that it may not fall below."""
    start_rule: Callable[[Excitation], float] | None = field(default=None, compare=False)
    """A better start value, in ``unit``, from the motion of the logs."""
    scan: Callable[[Excitation], Sequence[float]] | None = field(default=None, compare=False)
    """Values (k,), in ``unit``, that a diagnosis tries, from the motion of the logs."""
    period: bool = False
    """Whether it is a length (m) after which the force repeats along the track."""
    dry: bool = False
    """Whether it is a level (N) of dry friction."""

    def __getstate__(self) -> dict[str, Any]:
        """Without the rules, which are asked for of the effect, and are functions."""
        return {**self.__dict__, "start_rule": None, "scan": None}

    def start_from(self, excitation: Excitation) -> float:
        """Start value for this motion, inside the bounds."""
        value = self.start_rule(excitation) if self.start_rule else self.start
        return min(max(value, self.lower), self.upper)


@dataclass(frozen=True)
class Effect:
    """One physical effect, or a nonparametric effect: a curve with no physical law.

    Its name is that of the file that defines its law. Raises ValueError, in one line, for a
    declaration that makes no sense.
    """

    kind: Kind
    """What the law acts on, and when in a sample it is computed."""
    summary: str
    """What it is, in a few words."""
    equation: str
    """The law as `twin effects NAME` prints it; where it is a formula, the law is checked by it."""
    source: str
    """Where the equation is from."""
    parameters: tuple[Parameter, ...]
    """Its numbers, in the order in which the law reads them from ``p``."""
    law: Law
    """The function law(p, s, io); see the top of this module."""
    fingerprint: str
    """The trace that the effect leaves in the force residual of a model that lacks it."""
    excited_by: str
    """The motion that shows the effect."""
    states: tuple[str, ...] = ()
    """Names of the internal states, in the order of ``s``."""
    of_size: Callable[[int], Effect] | None = None
    """Of a law of any number of elements: the effect with that many. Its parameter ``elements``,
    whose bounds are both that number, tells the law."""
    attach: Callable[[Any, Mapping[str, float]], None] | None = None
    """Of a structure effect: builds its bodies in MuJoCo, given a Mount (twin.simulation.spec) and
    the values by name. Its first two states are position (m) and speed (m/s) of the joint built."""
    added_mass: Callable[[Mapping[str, float], float], float] | None = None
    """(values by name, moved mass in kg) -> what the effect adds to the moved mass, kg."""
    sticks: bool = False
    """Whether it is a friction that holds the axis at rest with any force up to a level."""
    simplest: Callable[[Mapping[str, float]], dict[str, float]] | None = None
    """Values by name -> simpler ones of the same force, such as a shorter pitch where only a
    higher harmonic was used."""
    parts: tuple[Part, ...] = ()
    """The curves of a nonparametric effect, whose force is linear in its strengths. A diagnosis
    never answers with such an effect."""
    columns: Law | None = None
    """For many strengths of which few act at a time, or which share what takes long: a function
    like the law that writes each strength's own force (or change of a reading) to ``io`` from
    COLUMNS on, so that all columns take one walk. The law is their sum."""
    free_shape: FreeShape | None = None
    """Of a nonparametric effect that stands in the place of a law, and stays where others go."""
    curves: tuple[Curve, ...] = ()
    """Curves that the law assumes; a diagnosis asks whether a free one does better."""
    several: bool = False
    """Whether an axis may have the effect more than once, as cogging of poles and of slots."""
    number: int = 1
    """Which of several it is."""
    knees: tuple[Knee, ...] = ()
    """What makes the law itself; where the motion does not pass each of them, it is another law. A
    law that is linear in all that is free has none: it is always itself."""
    dead_time: bool = False
    """Whether it only delays the force against the reading. Which of the two is late, no log of
    both can tell."""
    suits: Callable[[Collection[Effect], bool], bool] | None = None
    """(effects that an axis has, whether it turns) -> whether a diagnosis offers this one there,
    and not the same law by another name; None: always."""

    joint_attributes: Callable[[Mapping[str, float]], Mapping[str, float]] | None = None
    """Values by name -> attributes of a joint of MuJoCo that hold the effect, or come nearest to
    it: frictionloss, damping, stiffness, springref, armature, in SI units; None: none does."""
    of_joint: Callable[[Mapping[str, float]], Mapping[str, float]] | None = None
    """Attributes of a joint of MuJoCo, SI units -> values by name of the effect that they are; None
    where it is another effect to which they are taken over, or none."""
    motor_attributes: Callable[[Mapping[str, float], float], Mapping[str, Sequence[float]]] = (
        lambda values, gear: {}
    )
    """(values by name, gear) -> attributes of a DC motor of MuJoCo that hold the effect as it is,
    but for what is viscous, in SI units."""
    of_joints: bool | None = None
    """Whether a diagnosis offers it on joints of a mechanism alone (True) or on plain axes alone
    (False), as what it is there is known from the bodies; None: on both."""

    def __post_init__(self) -> None:
        if not callable(self.law):
            raise ValueError(f"the law of an effect is {self.law!r}; give a function")
        if not self.name.isidentifier():
            raise ValueError(
                f"the law of an effect is defined in {self.name}, whose name is no name of an "
                "effect; write it to a Python file of its own, such as my_effect.py"
            )
        for fault in self._faults():
            raise ValueError(f"effect {self.name}: {fault}")

    def _faults(self) -> Iterator[str]:
        """What of the declaration makes no sense."""
        if not isinstance(self.kind, Kind):
            kinds = ", ".join(f"Kind.{kind.name}" for kind in Kind)
            yield f"its kind is {self.kind!r}; give one of {kinds}"
        names = [p.name for p in self.parameters]
        if len(set(names)) != len(names):
            yield "a parameter name is used twice"
        for p in self.parameters:
            bounds = f"its bounds [{p.lower}, {p.upper}]"
            if not isinstance(p.unit, str):
                yield f"the unit of {p.name} is {p.unit}; give a text such as 'N'"
            if not p.unit:
                yield f"parameter {p.name} has no unit; use '1' for a ratio"
            if not p.lower <= p.start <= p.upper:
                yield f"start {p.start} {p.unit} of {p.name} is outside {bounds}"
            if p.strength and not p.lower <= 0.0 <= p.upper:
                yield f"strength {p.name} cannot be zero within {bounds} {p.unit}"
            if p.at_least is not None and p.at_least not in names:
                yield f"{p.name} refers to unknown {p.at_least}"
        held = {p.name for p in self.parameters if p.fixed}
        for bend in (c.bent_by for c in self.curves if c.bent_by):
            if bend not in held:
                yield f"its curve is bent by {bend}, which is no fixed parameter"

    def __reduce__(self) -> tuple[Any, ...]:
        """An effect is its file, a number and a size; what is written are functions."""
        count = next((int(p.start) for p in self.parameters if p.name == ELEMENTS), None)
        return _again, (self.law.__module__, inspect.getfile(self.law), self.number, count)

    @cached_property
    def name(self) -> str:
        """The name of the file that holds the law, and from the second of several on its number."""
        stem = Path(inspect.getfile(self.law)).stem
        return stem if self.number == 1 else f"{stem}_{self.number}"

    def numbered(self, number: int) -> Effect:
        """The same effect as that one of several."""
        return self if number == self.number else replace(self, number=number)

    @property
    def is_nonparametric(self) -> bool:
        """Whether it is a fitted curve with no physical law."""
        return bool(self.parts)

    @property
    def strengths(self) -> tuple[Parameter, ...]:
        """Parameters that are all zero when the effect is absent."""
        return tuple(p for p in self.parameters if p.strength)

    def is_present(self, values: Mapping[str, float]) -> bool:
        """Whether any strength of the effect is not zero."""
        return any(values[p.name] != 0.0 for p in self.strengths)

    def imitation(self, values: Mapping[str, float], covered: Excitation) -> Imitation | None:
        """What other law it is with these values on that motion; None where it is itself."""
        told = (knee.imitation(values, covered) for knee in self.knees)
        return next((found for found in told if found), None)

    def presliding(self, values: Mapping[str, float], covered: Excitation) -> float:
        """Distance over which its contacts bend before they slide, m; 0 where it has none."""
        return max((k.size(values, covered) for k in self.knees if k.name == REACH), default=0.0)

    @cached_property
    def _names(self) -> frozenset[str]:
        """What the law, or a function that it calls, names: a walk asks for it each time."""
        written: list[Any] = [self.law, *own_functions(self.law)]
        return frozenset(name for function in written for name in function.__code__.co_names)

    def reads(self, slot: str) -> bool:
        """Whether the law, or a function that it calls, names that slot of ``io``, such as "U"."""
        return slot in self._names

    @property
    def remembers(self) -> bool:
        """Whether its force depends on the path that the axis came.

        A friction that sticks remembers no more than that it does.
        """
        along = self.kind in (Kind.FORCE, *RUBBING)
        return along and bool(self.states) and not self.sticks

    @property
    def repeats(self) -> bool:
        """Whether its force repeats along the track."""
        return any(p.period for p in self.parameters)

    @property
    def delays(self) -> bool:
        """Whether a force acts, or a motion is read, the later for it."""
        return self.dead_time or (self.kind is Kind.ACTUATION and bool(self.states))

    @property
    def is_of_place(self) -> bool:
        """Whether its force is told by where the axis is, and by nothing else."""
        moves = self.reads("V") or self.reads("TIME") or self.is_nonparametric or self.states
        return self.kind is Kind.FORCE and self.reads("X") and not moves

    @property
    def turn(self) -> tuple[int, int]:
        """When a law's turn is within a sample; effects of an equal one keep the model's order.

        By kind. Of those that make a reading, first what remembers: a delay is of the smooth
        position, of which samples tell what was between them. Rounding is last.
        """
        if self.kind is Kind.STRUCTURE:
            return self.kind.value, 0 if self.is_of_bodies else 1
        if self.kind is not Kind.SENSING:
            return self.kind.value, 0
        return self.kind.value, 0 if self.states else 2 if self.is_noise else 1

    @property
    def is_of_bodies(self) -> bool:
        """Whether bodies of MuJoCo have it: what it hangs on the axis, or a mass that it adds."""
        return self.attach is not None or self.added_mass is not None

    @property
    def is_noise(self) -> bool:
        """Whether it adds only noise to the readings, so that none of it can be fitted."""
        return self.kind is Kind.SENSING and all(p.fixed for p in self.parameters)

    @property
    def reads_other_axis(self) -> bool:
        """Whether the law depends on the motion of the machine's other axis."""
        return any(self.reads(slot) for slot in ("X_OTHER", "V_OTHER", "A_OTHER"))

    @property
    def is_between_axes(self) -> bool:
        """Whether it is a force of two axes on each other; a friction may do without the other."""
        return self.kind is Kind.FORCE and self.reads_other_axis

    @property
    def channels(self) -> tuple[str, ...]:
        """The fields of a log, such as "pressure", that the law reads beside the motion."""
        return tuple(field for slot, field in CHANNELS.items() if self.reads(slot))

    def parameter(self, name: str) -> Parameter:
        """The parameter of that name; KeyError where there is none."""
        return {p.name: p for p in self.parameters}[name]

    def starts(self, excitation: Excitation | None = None) -> dict[str, float]:
        """Start values by parameter name; from the motion where one is given."""
        return {
            p.name: p.start if excitation is None else p.start_from(excitation)
            for p in self.parameters
        }


def load_effect(path: Path) -> Effect:
    """The effect of a user's file, which is run. Raises InputError where it defines none."""
    spec = importlib.util.spec_from_file_location(f"user_effect_{path.stem}", path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path}: is not a Python file; an effect is one .py file")
    module = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = module
    try:
        with redirect_stdout(sys.stderr):  # what it prints is no answer
            spec.loader.exec_module(module)
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        if isinstance(error, TypeError) and "Parameter" in reason:
            reason += (
                "; a Parameter has a name, unit, start, lower, upper and meaning, in this order"
            )
        raise InputError(f"{path}: cannot be loaded as an effect: {reason}") from error
    effect = getattr(module, "EFFECT", None)
    if not isinstance(effect, Effect):
        raise InputError(
            f"{path}: defines no EFFECT of type twin.effect.Effect; "
            "see the worked example in examples/my_effect.py"
        )
    return effect


def _again(module: str, file: str, number: int, count: int | None) -> Effect:
    """The effect of a file, as that one of several, of so many elements."""
    known = module in sys.modules or module.startswith("twin.")
    # a user's file, which another process has not read
    effect: Effect = importlib.import_module(module).EFFECT if known else load_effect(Path(file))
    sized = effect if count is None or effect.of_size is None else effect.of_size(count)
    return sized.numbered(number)
