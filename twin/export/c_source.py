"""The feedforward of a machine as C99: a function for each axis, from the laws of its effects.

``twin.feedforward`` is the same in Python; the tests compare the two.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from math import ceil

from twin.core.native import LONGEST_STEP
from twin.effect import IO_SIZE, Kind
from twin.errors import InputError
from twin.export import Remark, axis_identifiers, identifier
from twin.export.c_law import SLOTS, CannotTranslate, CLaws
from twin.feedforward import followed
from twin.model.machine import AxisModel, Fitted, MachineModel

OTHER = ("X_OTHER", "V_OTHER", "A_OTHER")
MOTION = ("position", "velocity", "acceleration")
Laws = list[tuple[Fitted, str]]
IMPOSED = "1e300"  # kg: along an imposed motion friction slides wherever it moves


@dataclass(frozen=True)
class AxisCode:
    """The function of one axis."""

    name: str
    """Of the axis in the model."""
    prefix: str
    """With which its C names begin: PREFIX_force, PREFIX_state."""
    axis: AxisModel
    """With the effects that are kept."""
    laws: tuple[tuple[Fitted, str], ...]
    """The effects in the order of a sample, and the C function of each."""
    arguments: tuple[str, ...]
    """Of the function, after the state."""
    ahead: float
    """By how much the setpoint has to come early, s."""


@dataclass(frozen=True)
class CSource:
    """The two files of a machine, and what they lack of it."""

    name: str
    header: str
    source: str
    axes: tuple[AxisCode, ...]
    approximated: tuple[Remark, ...]
    lost: tuple[Remark, ...]

    @property
    def kept(self) -> dict[str, tuple[str, ...]]:
        """By axis, what is kept as it is."""
        less, kept = {(r.axis, r.part) for r in (*self.approximated, *self.lost)}, {}
        for a in self.axes:
            effects = (n for n in a.axis.names if (a.name, n) not in less)
            kept[a.name] = (a.axis.units.mass_name, *effects)
        return kept


def c_source(model: MachineModel) -> CSource:
    """The feedforward of a machine; raises InputError where the motion of an axis is imposed."""
    if model.joints:
        raise InputError(
            f"{model.name}: its axes are joints of {model.mjcf_name}, whose forces depend on the "
            "motion of all of them; give a model of one axis with a mass"
        )
    model.require_mass()
    name, names, laws = identifier(model.name), axis_identifiers(model), CLaws()
    axes, approximated, lost = list[AxisCode](), list[Remark](), list[Remark]()
    for axis_name, axis in model.axes.items():
        found = followed(axis)
        made, left = [], dict(found.lost)
        for f in sorted(found.axis.effects, key=lambda f: f.effect.kind.value):
            try:
                CLaws().law(f.effect.law)  # so that half a law is not left among the others
                made.append((f, laws.law(f.effect.law)))
            except CannotTranslate as error:
                left[f.effect.name] = f"its law cannot be written in C: {error}"
        nearly = {n: t for n, t in found.approximated.items() if n not in left}
        for f, _ in made:
            if f.effect.kind is Kind.STRUCTURE and model.period > LONGEST_STEP:
                nearly[f.effect.name] = "the acceleration is held from one call to the next"
        approximated += [Remark(axis_name, *item) for item in nearly.items()]
        lost += [Remark(axis_name, *item) for item in left.items()]
        prefix = f"{name}_{names[axis_name]}"
        other = any(f.effect.reads_other_axis for f, _ in made)
        more = tuple(f"other_{m}" for m in MOTION) if other else ()
        arguments, ahead = (*MOTION, *more), found.ahead(model.period)
        axes.append(AxisCode(axis_name, prefix, found.axis, tuple(made), arguments, ahead))
    header = _header(model, name, axes, approximated, lost)
    source = _source(model, name, axes, laws)
    return CSource(name, header, source, tuple(axes), tuple(approximated), tuple(lost))


def _header(
    model: MachineModel, name: str, axes: list[AxisCode], nearly: list[Remark], lost: list[Remark]
) -> str:
    guard = f"{name.upper()}_H"
    parts = [
        f"/* Feedforward of {_plain(model.name)}: what the drive has to give along a setpoint.\n"
        "   Written by twin export; needs the C99 library's math.h and no memory of its own. */",
        f"#ifndef {guard}\n#define {guard}",
        "#ifdef __cplusplus\nextern \"C\" {\n#endif",
        f"#define {name.upper()}_PERIOD {model.period!r} /* s, from one call to the next */",
        *(_declared(a, nearly, lost) for a in axes),
        "#ifdef __cplusplus\n}\n#endif\n#endif",
    ]  # fmt: skip
    return "\n\n".join(parts) + "\n"


def _declared(a: AxisCode, nearly: list[Remark], lost: list[Remark]) -> str:
    units = a.axis.units
    said = [
        f"{units.words('Force').capitalize()} in {units.force} that moves axis {_plain(a.name)} "
        f"along its setpoint: position {units.position}, velocity {units.velocity}, acceleration "
        f"{units.acceleration}.",
        "Call it once a period with the setpoint, never with the measurement.",
        *(f"{what}: {r.part}, {_plain(r.text)}." for what, remarks in
          (("Approximated", nearly), ("Lost", lost)) for r in remarks if r.axis == a.name),
    ]  # fmt: skip
    memories = {f.effect.name: len(f.effect.states) for f, _ in a.laws if f.effect.states}
    lines = [
        "/* s: give the setpoint of so much later: a command is held, a drive may be late. */\n"
        f"#define {a.prefix.upper()}_AHEAD {a.ahead!r}\n",
        f"/* Memory of axis {_plain(a.name)}: begin with {a.prefix}_state state = {{0}}; */",
        f"typedef struct {{\n    double calls;\n    double friction; /* {units.force} */",
        *(f"    double {member}[{count}];" for member, count in memories.items()),
        f"}} {a.prefix}_state;\n",
        "/* " + "\n   ".join(said) + " */",
        f"{_signature(a, 'force')};",
    ]
    if a.axis.hardware.force_constant != 1.0:
        lines += [f"\n/* The same as a current in A. */\n{_signature(a, 'current')};"]
    return "\n".join(lines)


def _signature(a: AxisCode, what: str) -> str:
    given = ", ".join(f"double {n}" for n in a.arguments)
    return f"double {a.prefix}_{what}({a.prefix}_state *state, {given})"


def _plain(text: str) -> str:
    """Text that cannot end a comment."""
    return text.replace("*/", "* /").replace("\\", "/")


def _source(model: MachineModel, name: str, axes: list[AxisCode], laws: CLaws) -> str:
    slots = ", ".join(f"IO_{slot} = {value}" for slot, value in SLOTS.items())
    parts = [
        f'#include "{name}.h"\n\n#include <math.h>',
        "/* What a law reads of a sample, and what it writes; see the names in the functions. */\n"
        f"enum {{ {slots}, IO_SIZE = {IO_SIZE} }};",
        laws.text,
        *(part for a in axes for part in _axis(model, name, a)),
    ]
    return "\n\n".join(part for part in parts if part) + "\n"


def _axis(model: MachineModel, name: str, a: AxisCode) -> Iterator[str]:
    intervals = model.intervals.get(a.name)
    ends = intervals.ends if intervals else {}
    units = a.axis.units

    def value(number: float, unit: str, meaning: str, label: str) -> str:
        band = "; 90 % {:.4g} to {:.4g}".format(*ends[label]) if label in ends else ""
        return f"{number!r} /* {label}: {_plain(units(unit))}, {_plain(meaning)}{band} */"

    mass = a.axis.mass_parameter
    stated = value(a.axis.mass, mass.unit, mass.meaning, mass.name).replace(" /*", "; /*")
    yield f"static const double {a.prefix}_mass = {stated}"
    for f, _ in a.laws:
        listed = ",\n    ".join(
            value(f.values[p.name], p.unit, p.meaning, f"{f.effect.name}.{p.name}")
            for p in f.effect.parameters
        )
        yield f"static const double {a.prefix}_{f.effect.name}[] = {{\n    {listed},\n}};"
    body = [f"    {line}" if line else "" for line in _body(model, name, a)]
    yield "\n".join([_signature(a, "force"), "{", *body, "}"])
    if a.axis.hardware.force_constant != 1.0:
        constant = f"{a.axis.hardware.force_constant!r} /* {units('N/A')} */"
        given = ", ".join(("state", *a.arguments))
        result = f"    return {a.prefix}_force({given}) / {constant};"
        yield f"{_signature(a, 'current')}\n{{\n{result}\n}}"


def _body(model: MachineModel, name: str, a: AxisCode) -> Iterator[str]:
    """Statements of the function of an axis."""
    of = {kind: [law for law in a.laws if law[0].effect.kind is kind] for kind in Kind}
    rubbing = of[Kind.MODIFIER] + of[Kind.FRICTION]
    yield "double io[IO_SIZE] = {0.0};"
    yield f"const double inertia = {a.prefix}_mass * acceleration;"
    yield "double force = 0.0, friction = 0.0, command;"
    yield ""
    yield f"io[IO_DT] = {name.upper()}_PERIOD;"
    yield "io[IO_INDEX] = state->calls;"
    yield "io[IO_TIME] = state->calls * io[IO_DT];"
    yield "io[IO_WHEN] = 0.5; /* the setpoint is in the middle of what a law steps over */"
    yield f"io[IO_MASS] = {IMPOSED};"
    yield f"io[IO_MOVED] = {a.prefix}_mass;"
    for slot, argument in zip(("X", "V", *OTHER), (*MOTION[:2], *a.arguments[3:]), strict=False):
        yield f"io[IO_{slot}] = {argument};"
    yield "io[IO_DRY] = io[IO_STATIC] = io[IO_VISCOUS] = 1.0;"
    yield "io[IO_FRICTION] = state->friction;"
    yield "io[IO_U] = inertia;"
    for law in of[Kind.FORCE]:
        yield "io[IO_OUT] = 0.0;"
        yield _called(a, law)
        yield "force += io[IO_OUT];"
    if rubbing:
        itself = any(f.effect.reads("U") for f, _ in rubbing)
        yield f"io[IO_U] = inertia - force{' + state->friction' if itself else ''};"
        yield f"io[IO_HOLD] = {IMPOSED} / io[IO_DT] * velocity + io[IO_U] + force;"
        yield from (_called(a, law) for law in rubbing)
    if of[Kind.FRICTION]:
        yield "friction = io[IO_OUT];"
    yield from _structure(model, a, of[Kind.STRUCTURE])
    yield "command = inertia - force + friction;"
    if of[Kind.ACTUATION]:
        yield "/* the command that makes this force: a straight line */"
        yield "io[IO_U] = 0.0;"
        yield from (_called(a, law) for law in of[Kind.ACTUATION])
        yield "force = io[IO_U];"
        yield "io[IO_U] = 1.0;"
        yield from (_called(a, law) for law in of[Kind.ACTUATION])
        yield "command = (command - force) / (io[IO_U] - force);"
    yield "state->friction = friction;"
    yield "state->calls += 1.0;"
    yield "return command;"


def _structure(model: MachineModel, a: AxisCode, laws: Laws) -> Iterator[str]:
    """Statements that add the force of attached masses: twin.core.native.along for one sample."""
    if not laws:
        return
    standing = [law for law in laws if law[0].effect.reads("NET")]
    riding = [law for law in laws if law not in standing]
    steps = 1 if standing else ceil(model.period / LONGEST_STEP - 1e-9)
    if standing:
        yield from _shared(a, riding, standing)
    else:
        yield "io[IO_ACC] = acceleration;"
    if steps > 1:
        yield f"io[IO_DT] /= {steps}.0;"
        yield f"for (int step = 0; step < {steps}; step++) {{"
    pad = "    " * (steps > 1)
    part = f" / {steps}.0" if steps > 1 else ""
    for law in laws:
        yield f"{pad}{_called(a, law)}"
        yield f"{pad}force += io[IO_OUT]{part};"
    if steps > 1:
        yield "}"


def _shared(a: AxisCode, riding: Laws, standing: Laws) -> Iterator[str]:
    """Statements that share an acceleration out between axis and base: the laws are linear."""
    yield "double pushed = 0.0, rides = 0.0, moved = 0.0, yields = 0.0;"
    yield "io[IO_WHEN] = 0.0; /* asked only: no state changes */"
    for laws, slot, still, slope in (
        (riding, "ACC", "pushed", "rides"), (standing, "NET", "moved", "yields")
    ):  # fmt: skip
        for law in laws:
            yield f"io[IO_{slot}] = 0.0;"
            yield _called(a, law)
            yield f"{still} += io[IO_OUT];"
            yield f"{slope} -= io[IO_OUT];"
            yield f"io[IO_{slot}] = 1.0;"
            yield _called(a, law)
            yield f"{slope} += io[IO_OUT];"
    mass = f"{a.prefix}_mass"
    yield f"rides = {mass} - rides;"
    yield f"moved = rides * (acceleration - moved / {mass}) - pushed;"
    yield f"moved /= 1.0 + rides * yields / ({mass} * {mass});"
    yield f"io[IO_NET] = moved / {mass};"
    yield "io[IO_ACC] = (moved + pushed) / rides;"
    yield "io[IO_WHEN] = 0.5;"


def _called(a: AxisCode, law: tuple[Fitted, str]) -> str:
    effect = law[0].effect
    state = f"state->{effect.name}" if effect.states else "0"
    return f"{law[1]}({a.prefix}_{effect.name}, {state}, io);"
