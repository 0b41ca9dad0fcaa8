"""A model to begin with, from logs alone: mass, the simplest friction, a constant force.

The values are of one linear regression: the force by test functions in motion, on acceleration,
direction, speed, 1 and what the place does: a spring, or gravity where an axis turns. Each is
believed by its t-value over blocks of the logs, as what so rough a model leaves is coloured.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import floor, log10

import numpy as np

from identify.dataset.bodies import Bodies, bodies_along
from identify.dataset.coordinates import excitation
from identify.dataset.given_logs import is_driven, nothing_told, require_samples, telling_in
from identify.dataset.motion import LONGEST_BLOCK, SHORTEST_BLOCK, Motion, motion_of
from identify.dataset.prepared_log import stands
from identify.dataset.readings import ripples_of_widest
from identify.dataset.test_function import TestFunction
from identify.estimation.evidence import rms
from identify.estimation.least_squares import orthonormal, unabsorbed
from twin.effect import LEAST, MOST, Effect, Excitation, Kind
from twin.effects import Catalogue
from twin.errors import InputError
from twin.logs import Log
from twin.model.file import storable
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel
from twin.model.units import AxisUnits
from twin.signals import Array, stretches

LENGTHS = (0.1, 0.05, 0.02)  # s, of the test functions: the first that tells the mass
BLOCKS = 30  # of time, for the scatter of a value
ROWS = 4 * BLOCKS  # test functions in motion, that tell the values and how sure they are
Masses = float | Mapping[str, float]  # kg; by axis, or of the only one that moves
NAMES = ("mass", "coulomb", "viscous", "constant")  # of the first columns; others are of the place


@dataclass(frozen=True)
class FirstValues:
    """mass kg, None where the logs do not tell it; coulomb N, viscous N s/m, 0 where there is none.

    constant: N that the command takes beside the others, 0 where the logs do not ask for it.
    static: N, None where the axis does not break away from rest by more than its Coulomb friction.
    reversed: kg less than 0, of which force and motion are; 0 where they are of no such mass.
    """

    mass: float | None
    coulomb: float
    viscous: float
    constant: float
    static: float | None
    reversed: float = 0.0


@dataclass(frozen=True)
class Regression:
    """Gains of columns (k, n) in a force (n,), their t-values, and what is left, N RMS."""

    gains: Array
    t: Array
    left: float

    def sure(self, name: str) -> float:
        """A gain that is believed, else 0."""
        at = NAMES.index(name)
        sure = 3.0  # t-value from which a value is the logs', and no accident of one of their parts
        return float(self.gains[at]) if abs(self.t[at]) > sure else 0.0


def first_values(motions: Sequence[Motion], mass: float | None = None) -> FirstValues:
    """The values that the logs of an axis tell; mass: kg, where it is known."""
    place = _place(motions)
    if mass is not None:
        columns, force = _both_ways(*_rows(motions, LENGTHS[0], place))
        beside = _with_friction(_without(columns, "mass"), force - mass * columns[0])
        return _values(motions, place, beside, mass)
    for length in LENGTHS:
        columns, force = _both_ways(*_rows(motions, length, place))
        columns = _without_image(columns)
        found = _with_friction(columns, force)
        # of the force's RMS; below, friction that is not known hides the inertia
        least_inertial = 0.005
        least = least_inertial * float(np.std(force)) / max(float(np.std(columns[0])), 1e-300)
        if (told := found.sure("mass")) > least:
            return _values(motions, place, found, told)
    # As it is, its friction would push.
    against = _with_friction(columns, -force).sure("mass")
    unknown = replace(_values(motions, place, found, float(found.gains[0])), mass=None)
    return replace(unknown, reversed=-against if against > least else 0.0)


def _values(
    motions: Sequence[Motion], place: tuple[float, bool], found: Regression, mass: float
) -> FirstValues:
    """With the friction and the constant that a regression found beside a mass, kg."""
    coulomb, static = found.sure("coulomb"), _static(motions, found, mass, place)
    # times the Coulomb friction, from which static friction is more than a peak's noise
    more = 1.05
    return FirstValues(
        mass=mass,
        coulomb=coulomb,
        viscous=found.sure("viscous"),
        constant=found.sure("constant"),
        static=static if static is not None and static > more * coulomb > 0.0 else None,
    )


def friction_left(motions: Sequence[Motion], length: float) -> float:
    """N RMS that mass, friction, a constant and the place leave by test functions of that length.

    length: s.
    """
    return _with_friction(*_rows(motions, length, _place(motions))).left


def _place(motions: Sequence[Motion]) -> tuple[float, bool]:
    """The middle of the positions, m, and whether the axis turns."""
    position = np.concatenate([m.position for m in motions])
    turns = 1.0  # rad, from which gravity is a sine of the angle, and no spring
    return float(position.mean()), motions[0].units.rotary and np.ptp(position) > turns


def _of_place(position: Array, place: tuple[float, bool]) -> Array:
    """(2, n) what forces of the place follow."""
    middle, turns = place
    if turns:
        return np.stack([np.sin(position), np.cos(position)])
    return np.stack([position - middle, np.zeros_like(position)])


def _rows(
    motions: Sequence[Motion], length: float, place: tuple[float, bool]
) -> tuple[Array, Array]:
    """The columns (6, n) and the force (n,) N by test functions, of those without a rest.

    Of all, where the axis comes to rest within nearly every one.
    """
    columns, going = [], []
    for m in motions:
        w = TestFunction.at_least(length, m.period)
        along = [np.sign(m.velocity), m.velocity, np.ones_like(m.velocity)]
        means = w.mean(np.stack([*along, *_of_place(m.position, place), m.net]))
        columns.append(np.concatenate([w.acceleration(m.velocity)[None], means]))
        # part of a test function, from which what static friction holds is in its force
        at_rest = 0.02
        going.append(w.mean(stands(m).astype(float)) < at_rest)
    rows, kept = np.hstack(columns), np.concatenate(going)
    rows = rows[:, kept] if np.count_nonzero(kept) >= ROWS else rows
    return rows[:-1], rows[-1]


def _with_friction(columns: Array, force: Array) -> Regression:
    """With both kinds of friction where both are sure, else with one, Coulomb's where it may be."""
    both = _regressed(columns, force)
    if min(both.sure("coulomb"), both.sure("viscous")) > 0.0:
        return both
    dry = _regressed(_without(columns, "viscous"), force)
    wet = _regressed(_without(columns, "coulomb"), force)
    nearly = 1.5  # times what viscous friction leaves, up to which Coulomb's is believed
    if dry.sure("coulomb") > 0.0 and dry.left < nearly * wet.left:
        return dry
    if wet.sure("viscous") > 0.0:
        return wet
    return _regressed(_without(_without(columns, "coulomb"), "viscous"), force)


def _both_ways(columns: Array, force: Array) -> tuple[Array, Array]:
    """Less the constant, where the motion goes one way: it would be the friction of that way."""
    one_way = 0.8  # mean direction from which nine tenths of the motion go one way
    straight = abs(np.mean(np.sign(columns[1]))) > one_way
    return _without(columns, "constant") if straight else columns, force


def _without_image(columns: Array) -> Array:
    """Less the columns of the place that acceleration makes, as of a position that is a sine.

    Such a motion tells of mass and spring only what they make together, and a first model has no
    spring.
    """
    made = orthonormal(columns[[0, NAMES.index("constant")]].T)
    # 0.1 of a column, RMS: less of it friction makes, which bends a sine
    least = 0.1
    sizes = np.linalg.norm(columns, axis=1)
    own = np.linalg.norm(unabsorbed(columns.T, made), axis=0) > least * sizes
    own[: len(NAMES)] = True
    return columns * own[:, None]


def _without(columns: Array, name: str) -> Array:
    kept = columns.copy()
    kept[NAMES.index(name)] = 0.0
    return kept


def _regressed(columns: Array, force: Array) -> Regression:
    """Least squares, with the scatter between blocks of time."""
    size = np.linalg.norm(columns, axis=1)
    size = np.where(size > 0.0, size, 1.0)
    scaled = columns / size[:, None]
    inverse = np.linalg.pinv(scaled @ scaled.T, rcond=1e-10, hermitian=True)
    gains = inverse @ scaled @ force
    left = force - gains @ scaled
    scores = np.stack([part.sum(axis=1) for part in np.array_split(scaled * left, BLOCKS, axis=1)])
    variance = np.diag(inverse @ (scores.T @ scores) @ inverse)
    rounding = 1e-9  # of the force: smaller gains of columns of unit size are none
    error = np.sqrt(np.maximum(variance, 0.0)) + rounding * float(np.linalg.norm(force))
    error = np.maximum(error, np.finfo(float).tiny)  # of no force at all
    return Regression(gains / size, gains / error, rms(left))


def _static(
    motions: Sequence[Motion], found: Regression, mass: float, place: tuple[float, bool]
) -> float | None:
    """The friction (N) at which the axis breaks away from rest; None where it seldom does.

    mass: kg.
    """
    smoothed = 5  # blocks, over which the force at rest is averaged before its peak is taken
    needed = []
    for m in motions:
        rest = stands(m)
        driven = m.net - mass * m.acceleration - found.gains[3]
        driven = driven - found.gains[4:] @ _of_place(m.position, place)
        driven = np.convolve(driven, np.ones(smoothed) / smoothed, "same")
        # s at rest before a motion begins from rest
        stood = max(round(0.05 / m.period), smoothed)
        needed += [
            float(np.max(driven[last - stood : last] * np.sign(m.velocity[last])))
            for first, last in stretches(rest)
            if last - first >= stood and last < len(rest)
        ]
    return float(np.median(needed)) if len(needed) >= 5 else None  # that tell a static friction


def first_model(
    logs: Mapping[str, Log],
    name: str,
    catalogue: Catalogue,
    bodies: tuple[str, str] | None = None,
    mass: Masses | None = None,
) -> MachineModel:
    """A model to begin with: of each axis that moves its mass and the simplest friction.

    And a constant force where the logs ask for it. Static friction is that of Coulomb where the
    axis does not break away from rest (``not_determined``). Hardware is what the logs show: travel,
    speed, acceleration and force that were reached, the step and the noise of the encoder. bodies:
    name and text of an MJCF or URDF file, whose joints or fixed tendons are the axes of their
    names, or of those of their actuators; each log then holds all of them. mass: kg where it is
    known, by axis, or of the only one that moves; it is held, and the rest is found beside it.
    Raises InputError where no log says anything, where the logs differ in sample rate, where they
    do not tell the mass, or lack a joint, and for a mass that no axis can have.
    """
    require_samples(logs)
    rates = sorted({log.sample_rate for log in logs.values()})
    if len(rates) != 1:
        raise InputError(
            f"the logs are sampled at {', '.join(f'{r:g}' for r in rates)} Hz; give one rate"
        )
    names = tuple(dict.fromkeys(axis for log in logs.values() for axis in log.axes))
    begun = MachineModel(name, {}, rates[0])
    if bodies is not None:
        begun = _of_joints(begun, names, *bodies)
    own = begun.axes if mass is None else _held(mass, logs, names, begun)
    told = {a: telling_in(logs, a, driven=is_driven(own.get(a))) for a in names}
    if not any(going for going, _ in told.values()):
        raise nothing_told(names, logs.values(), (silent for _, silent in told.values()))
    taken = {n: bodies_along(begun, log, n) for n, log in logs.items()}
    axes = {
        a: _first_axis(going, a, {n: taken[n].get(a) for n in going}, own.get(a), catalogue)
        for a, (going, _) in told.items()
        if going
    }
    return with_stated(replace(begun, axes={**begun.axes, **axes}), catalogue)


def with_stated(model: MachineModel, catalogue: Catalogue) -> MachineModel:
    """The model with what its MuJoCo file states of its joints, at the values of the file.

    Rotors and springs are held, as the masses of the file are; friction is not, which no file knows
    for long: its values are those to begin with.
    """
    if not model.joints:
        return model
    from twin.model.bodies import stated_in  # MuJoCo takes long to load

    for axis, attributes in stated_in(model).items():
        for effect in catalogue.values():
            if effect.of_joint is None:
                continue
            values = effect.of_joint(attributes)
            if effect.is_present({**effect.starts(), **values}):
                own = _as_stated(model.axes[axis], effect, values)
                model = model.with_axis(axis, own)
    return model


def _as_stated(axis: AxisModel, effect: Effect, values: Mapping[str, float]) -> AxisModel:
    """An axis with an effect at the values of the file; of a friction those that are not 0."""
    if effect.kind is not Kind.FRICTION:
        law = Fitted.at_start(effect, values, axis.units)
        return axis.with_effect(replace(law, fixed=frozenset(law.values)))
    known = axis.friction if axis.friction and axis.friction.effect.name == effect.name else None
    given = {n: v for n, v in values.items() if v}
    begun = {} if known is None else known.values
    return axis.with_effect(Fitted.at_start(effect, {**begun, **given}, axis.units))


def unused(model: MachineModel, logs: Mapping[str, Log]) -> dict[str, str]:
    """By name, the logs that say nothing of an axis of a first model, and why."""
    silent = (telling_in(logs, a, driven=is_driven(own))[1] for a, own in model.axes.items())
    return {name: why for each in silent for name, why in each.items()}


def _held(
    mass: Masses, logs: Mapping[str, Log], names: Sequence[str], begun: MachineModel
) -> dict[str, AxisModel]:
    """The axes whose mass (kg) is given, with it and nothing else. Raises InputError."""
    if begun.axes:
        raise InputError(
            f"the bodies of {begun.mjcf_name} have their mass there; give none beside them"
        )
    if not isinstance(mass, Mapping):
        moving = [a for a in names if telling_in(logs, a, driven=False)[0]]
        if len(moving) > 1:
            raise InputError(
                f"a mass of {mass:g}: {', '.join(moving)} move; give it by axis, as in "
                f"{moving[0]}={mass:g}"
            )
        mass = dict.fromkeys(moving, mass)
    if unknown := mass.keys() - set(names):
        raise InputError(
            f"a mass of axis {', '.join(unknown)}: the logs have {', '.join(names)}; name one of "
            "them"
        )
    kinds = {a: next(log.axes[a].kind for log in logs.values() if a in log.axes) for a in mass}
    for axis, value in mass.items():
        if value != 0.0 and not LEAST <= value <= MOST:
            name, unit = kinds[axis].mass_name, kinds[axis].mass
            raise InputError(
                f"axis {axis}: {name} = {value:g} {unit}: give a number from {LEAST:g} to "
                f"{MOST:g}, in {unit}, or 0 where the motion is imposed"
            )
    return {
        a: AxisModel(float(value), mass_fixed=True, rotary=kinds[a].rotary)
        for a, value in mass.items()
    }


def _told(
    axis: str, logs: Mapping[str, Log], bodies: Mapping[str, Bodies | None], mass: float | None
) -> tuple[list[Motion], FirstValues]:
    """The motions of an axis in logs, and the values that they tell.

    bodies: by log, of a joint. mass: kg, where it is known.
    """
    ripples = ripples_of_widest(logs.values(), axis)
    # Long blocks hide an axis that swings within them, and of short ones noise hides more.
    for longest in (LONGEST_BLOCK, SHORTEST_BLOCK):
        motions = [
            motion_of(log, axis, n, (), longest, ripples, bodies.get(n)) for n, log in logs.items()
        ]
        found = first_values(motions, mass)
        if found.mass is not None:
            break
    return motions, found


def values_of(log: Log, axis: str) -> FirstValues | None:
    """The first values of an axis of a log; None where it says nothing of them."""
    going, _ = telling_in({"the log": log}, axis)
    return _told(axis, going, {}, None)[1] if going else None


def _of_joints(begun: MachineModel, names: Sequence[str], file: str, text: str) -> MachineModel:
    """The machine whose axes are the joints or tendons of those names, without effects."""
    from twin.mujoco.mechanism import joints_of  # MuJoCo takes long to load
    from twin.mujoco.transmission import proposed

    given = proposed(text, file, names)
    axes = {
        axis: AxisModel(j.inertia, mass_fixed=True, rotary=j.rotary, joint=given[axis])
        for axis, j in joints_of(text, file, given).items()
    }
    return replace(begun, axes=axes, mjcf=text, mjcf_name=file)


def not_determined(axis: AxisModel) -> list[str]:
    """Labels of what the logs did not tell of a first model: it has the value of something else."""
    return [
        f"{f.effect.name}.{p.name}"
        for f in axis.effects
        for p in f.effect.parameters
        if p.at_least is not None and f.values[p.name] == f.values[p.at_least]
    ]


def _first_axis(
    logs: Mapping[str, Log],
    axis: str,
    bodies: Mapping[str, Bodies | None],
    own: AxisModel | None,
    catalogue: Catalogue,
) -> AxisModel:
    """bodies: by log, of a joint. own: with its mass alone where that is known. InputError."""
    known = None if own is None or own.joint is not None else own.mass
    motions, found = _told(axis, logs, bodies, known)
    covered, units = excitation(motions, None), motions[0].units
    if own is None:
        if found.mass is None or _of_constant_force(motions):
            raise _untold(axis, motions, found)
        own = AxisModel(_shown(found.mass), rotary=units.rotary)
    constant = next(iter(logs.values())).axes[axis].force_constant
    hardware = _hardware(motions, covered, 1.0 if constant is None else constant)
    effects = _first_effects(found, catalogue, covered, units, own.joint is not None)
    return replace(own, hardware=hardware, effects=effects)


def _untold(axis: str, motions: Sequence[Motion], found: FirstValues) -> InputError:
    """That the motion of an axis does not tell its mass, and what to do."""
    names, units = ", ".join(m.name for m in motions), motions[0].units
    if found.reversed:
        return InputError(
            f"axis {axis}: in {names} force and motion are as if the {units.mass_name} were "
            f"{found.reversed:.2g} {units.mass}; give the force or the position the sign -1 "
            "in the import map"
        )
    if told := _of_constant_force(motions):
        return InputError(
            f"axis {axis}: {names}: {told}; give logs of other forces, or the {units.mass_name} "
            f"itself, in {units.mass}, which is then held"
        )
    return InputError(
        f"axis {axis}: {names} cannot tell the {units.mass_name}, as acceleration makes too "
        f"little of the force; give a log with faster changes of speed, or the {units.mass_name} "
        f"itself, in {units.mass}, which is then held"
    )


def _of_constant_force(motions: Sequence[Motion]) -> str:
    """What a force that never changes tells of mass and friction; empty where it changes.

    m a + b v + Fc = F: of one motion all of m, b and F - Fc may be larger by a factor.
    """
    units = motions[0].units
    force = np.concatenate([m.net for m in motions])
    level, constant = float(np.median(force)), 0.01  # part of it, by which a constant one changes
    if not np.std(force) < constant * abs(level):
        return ""
    w = [TestFunction.at_least(LENGTHS[0], m.period) for m in motions]
    rows = list(zip(w, motions, strict=True))
    acceleration = np.concatenate([f.acceleration(m.velocity) for f, m in rows])
    velocity = np.concatenate([f.mean(m.velocity[None])[0] for f, m in rows])
    columns = np.column_stack([np.ones_like(velocity), -velocity])
    pushed, damped = np.linalg.lstsq(columns, acceleration, rcond=None)[0]
    name = units.mass_name
    return (
        f"the force is {level:.3g} {units.force} throughout, which tells only viscous friction / "
        f"{name} = {damped:.4g} 1/s and ({abs(level):.3g} {units.force} - Coulomb friction) / "
        f"{name} = {abs(pushed):.4g} {units.acceleration}"
    )


def _hardware(motions: Sequence[Motion], covered: Excitation, force_constant: float) -> Hardware:
    """What the logs show of it, less what no model's file may hold; force_constant: N/A."""
    test_function = 0.02  # s, over which the acceleration that was reached is averaged
    reached = max(
        float(np.abs(TestFunction.at_least(test_function, m.period).acceleration(m.velocity)).max())
        for m in motions
    )
    margin = 0.05 * covered.travel  # of the way that was covered, beyond its ends
    digits = 2 - floor(log10(covered.travel))  # of a hundredth of the way, wherever it lies
    return storable(
        Hardware(
            travel=(
                round(covered.position_low - margin, digits),
                round(covered.position_high + margin, digits),
            ),
            force_constant=force_constant,
            force_limit=_shown(2.0 * covered.force_max),
            encoder_resolution=_shown(covered.resolution),
            encoder_noise=_shown(max(m.position_noise for m in motions)),
            velocity=_shown(covered.speed_max),
            acceleration=_shown(reached),
            jerk=_shown(reached / test_function),
        )
    )


def _first_effects(
    found: FirstValues, catalogue: Catalogue, covered: Excitation, units: AxisUnits, is_joint: bool
) -> tuple[Fitted, ...]:
    """The simplest friction, and a constant force where there is one, with what was found.

    Of a joint always: its current has an offset, and what the bodies weigh is not known well (M.
    Gautier, A. Janot, P.-O. Vandanjon, IEEE Trans. Control Systems Technology 21 (2013), 428-444).
    """
    known = [e for e in catalogue.values() if not e.is_nonparametric]
    frictions = (e for e in known if e.kind is Kind.FRICTION)
    friction = min(frictions, key=lambda e: (len(e.parameters), len(e.states)))
    static = found.coulomb if found.static is None else found.static
    values = {"Fc": found.coulomb, "Fs": static, "sigma2": found.viscous}
    own = {n: _shown(v) for n, v in values.items() if n in friction.starts(covered)}
    effects = [Fitted.at_start(friction, {**friction.starts(covered), **own}, units)]
    constant = is_joint or found.constant
    for force in (e for e in known if e.kind is Kind.FORCE and not e.states and constant):
        if [p.unit for p in force.parameters] == ["N"]:
            level = {force.parameters[0].name: _shown(-found.constant)}
            effects.append(Fitted.at_start(force, level, units))
    return tuple(effects)


def _shown(value: float) -> float:
    return float(f"{value:.3g}")
