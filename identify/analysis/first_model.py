"""A model to begin with, from logs alone: mass, the simplest friction, a constant force.

Its values are those of ``first_values``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import floor, log10

import numpy as np

from identify.analysis.first_values import LENGTHS, FirstValues, first_values
from identify.dataset.bodies import Bodies, bodies_along
from identify.dataset.clipped import clipped_in
from identify.dataset.coordinates import excitation
from identify.dataset.given_logs import is_driven, none_informative, require_samples, telling_in
from identify.dataset.motion import LONGEST_BLOCK, SHORTEST_BLOCK, Motion, motion_of
from identify.dataset.readings import ripples_of_widest
from identify.dataset.test_function import TestFunction
from twin.effect import LEAST, MOST, Effect, Excitation, Kind
from twin.effects import Catalogue
from twin.errors import InputError
from twin.logs import Log
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel
from twin.model.units import AxisUnits

Masses = float | Mapping[str, float]  # kg; by axis, or of the only one that moves


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
        raise none_informative(names, logs.values(), (silent for _, silent in told.values()))
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


def _first_values(
    axis: str, logs: Mapping[str, Log], bodies: Mapping[str, Bodies | None], mass: float | None
) -> tuple[list[Motion], FirstValues]:
    """The motions of an axis in logs, and the values that they tell.

    bodies: by log, of a joint. mass: kg, where it is known.
    """
    ripples = ripples_of_widest(logs.values(), axis)
    clipped = {} if any(bodies.values()) else clipped_in(logs, axis)
    # Long blocks hide an axis that swings within them, and of short ones noise hides more.
    for longest in (LONGEST_BLOCK, SHORTEST_BLOCK):
        motions = [
            motion_of(log, axis, n, (), longest, ripples, bodies.get(n), clipped=clipped.get(n))
            for n, log in logs.items()
        ]
        found = first_values(motions, mass)
        if found.mass is not None:
            return motions, found
    # What one log that was recorded otherwise hides in all of them, the others tell.
    telling = [m for m in motions if first_values([m]).mass is not None]
    if telling and not found.reversed:
        found = first_values(telling)
    return motions, found


def values_of(log: Log, axis: str) -> FirstValues | None:
    """The first values of an axis of a log; None where it says nothing of them."""
    going, _ = telling_in({"the log": log}, axis)
    return _first_values(axis, going, {}, None)[1] if going else None


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
    motions, found = _first_values(axis, logs, bodies, known)
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
    """What the logs show of it, less what no hardware may be; force_constant: N/A."""
    test_function = 0.02  # s, over which the acceleration that was reached is averaged
    reached = max(
        float(np.abs(TestFunction.at_least(test_function, m.period).acceleration(m.velocity)).max())
        for m in motions
    )
    margin = 0.05 * covered.travel  # of the way that was covered, beyond its ends
    digits = 2 - floor(log10(covered.travel))  # of a hundredth of the way, wherever it lies
    return Hardware.of_allowed(
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
