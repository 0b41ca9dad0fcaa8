"""A model to begin with, from logs alone: mass, the simplest friction, a constant force.

The values are of one linear regression: the force by test functions in motion, on acceleration,
direction, speed, 1 and what the place does: a spring, or gravity where an axis turns. Each is
believed by its t-value over blocks of the logs, as what so rough a model leaves is coloured.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.dataset.bodies import Bodies, bodies_along
from identify.dataset.coordinates import excitation
from identify.dataset.given_logs import require_samples
from identify.dataset.motion import (
    LONGEST_BLOCK,
    SHORTEST_BLOCK,
    SHORTEST_LOG,
    Motion,
    motion_of,
)
from identify.dataset.prepared_log import stands
from identify.dataset.readings import ripples_of_widest
from identify.dataset.test_function import TestFunction
from identify.estimation.evidence import rms
from twin.checks import moves
from twin.effect import Excitation, Kind
from twin.effects import Catalogue
from twin.errors import InputError
from twin.logs import Log
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel
from twin.model.units import AxisUnits
from twin.signals import Array, stretches

LENGTHS = (0.1, 0.05, 0.02)  # s, of the test functions: the first that tells the mass
BLOCKS = 30  # of time, for the scatter of a value
ROWS = 4 * BLOCKS  # test functions in motion, that tell the values and how sure they are
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


def first_values(motions: Sequence[Motion]) -> FirstValues:
    """The values that the logs of an axis tell."""
    place = _place(motions)
    for length in LENGTHS:
        columns, force = _rows(motions, length, place)
        one_way = 0.8  # mean direction from which nine tenths of the motion go one way
        if abs(np.mean(np.sign(columns[1]))) > one_way:
            columns = _without(columns, "constant")  # it would be the friction of that way
        found = _with_friction(columns, force)
        # of the force's RMS; below, friction that is not known hides the inertia
        least_inertial = 0.005
        least = least_inertial * float(np.std(force)) / max(float(np.std(columns[0])), 1e-300)
        mass = found.sure("mass")
        if mass > least:
            break
    # As it is, its friction would push.
    against = 0.0 if mass > least else _with_friction(columns, -force).sure("mass")
    coulomb = found.sure("coulomb")
    static = _static(motions, found, place)
    # times the Coulomb friction, from which static friction is more than a peak's noise
    more = 1.05
    return FirstValues(
        mass=mass if mass > least else None,
        coulomb=coulomb,
        viscous=found.sure("viscous"),
        constant=found.sure("constant"),
        static=static if static is not None and static > more * coulomb > 0.0 else None,
        reversed=-against if against > least else 0.0,
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
    return Regression(gains / size, gains / error, rms(left))


def _static(
    motions: Sequence[Motion], found: Regression, place: tuple[float, bool]
) -> float | None:
    """The friction (N) at which the axis breaks away from rest; None where it seldom does."""
    smoothed = 5  # blocks, over which the force at rest is averaged before its peak is taken
    needed = []
    for m in motions:
        rest = stands(m)
        driven = m.net - found.gains[0] * m.acceleration - found.gains[3]
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
) -> MachineModel:
    """A model to begin with: of each axis that moves its mass and the simplest friction.

    And a constant force where the logs ask for it. Static friction is that of Coulomb where the
    axis does not break away from rest (``not_determined``). Hardware is what the logs show: travel,
    speed, acceleration and force that were reached, the step and the noise of the encoder. bodies:
    name and text of an MJCF or URDF file, whose joints or fixed tendons are the axes of their
    names, or of those of their actuators; each log then holds all of them. Raises InputError where
    no axis moves, where the logs differ in sample rate, and where they do not tell the mass, or
    lack a joint.
    """
    require_samples(logs)
    rates = sorted({log.sample_rate for log in logs.values()})
    if len(rates) != 1:
        raise InputError(
            f"the logs are sampled at {', '.join(f'{r:g}' for r in rates)} Hz; give one rate"
        )
    names = dict.fromkeys(axis for log in logs.values() for axis in log.axes)
    begun = MachineModel(name, {}, rates[0])
    if bodies is not None:
        begun = _of_joints(begun, tuple(names), *bodies)
    taken = {n: bodies_along(begun, log, n) for n, log in logs.items()}
    axes = {}
    for axis in names:
        going = {n: log for n, log in logs.items() if axis in log.axes and moves(log, axis)}
        if going:
            motions, found = _told(axis, going, taken)
            constant = next(iter(going.values())).axes[axis].force_constant
            joint = begun.axes.get(axis)
            axes[axis] = _first_axis(axis, motions, found, constant, catalogue, joint)
    if not axes:
        raise InputError(f"no axis moves in {', '.join(logs)}; give a log in which one does")
    return replace(begun, axes={**begun.axes, **axes})


def _told(
    axis: str, logs: Mapping[str, Log], taken: Mapping[str, Mapping[str, Bodies]]
) -> tuple[list[Motion], FirstValues]:
    """The motions of an axis in logs, and the values that they tell; taken: its bodies by log."""
    ripples = ripples_of_widest(logs.values(), axis)
    # Long blocks hide an axis that swings within them, and of short ones noise hides more.
    for longest in (LONGEST_BLOCK, SHORTEST_BLOCK):
        motions = [
            motion_of(log, axis, n, (), longest, ripples, taken.get(n, {}).get(axis))
            for n, log in logs.items()
        ]
        found = first_values(motions)
        if found.mass is not None:
            break
    return motions, found


def values_of(log: Log, axis: str) -> FirstValues | None:
    """The first values of an axis of a log; None where it does not move or lasts too short."""
    if not moves(log, axis) or len(log) / log.sample_rate < SHORTEST_LOG:
        return None
    return _told(axis, {"the log": log}, {})[1]


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
    axis: str,
    motions: Sequence[Motion],
    found: FirstValues,
    force_constant: float | None,
    catalogue: Catalogue,
    joint: AxisModel | None,
) -> AxisModel:
    """joint: the axis without effects where it is a joint, whose inertia is known."""
    test_function = 0.02  # s, over which the acceleration that was reached is averaged
    covered, units = excitation(motions, None), motions[0].units
    if found.mass is None and joint is None:
        names = ", ".join(m.name for m in motions)
        if found.reversed:
            raise InputError(
                f"axis {axis}: in {names} force and motion are as if the {units.mass_name} were "
                f"{found.reversed:.2g} {units.mass}; give the force or the position the sign -1 "
                "in the import map"
            )
        raise InputError(
            f"axis {axis}: {names} cannot tell the {units.mass_name}, as acceleration makes too "
            "little of the force; give a log with faster changes of speed"
        )
    reached = max(
        float(np.abs(TestFunction.at_least(test_function, m.period).acceleration(m.velocity)).max())
        for m in motions
    )
    margin = 0.05 * covered.travel  # of the way that was covered, beyond its ends
    low, high = covered.position_low - margin, covered.position_high + margin
    hardware = Hardware(
        travel=(_shown(low), _shown(high)),
        force_constant=1.0 if force_constant is None else force_constant,
        force_limit=_shown(2.0 * covered.force_max),
        encoder_resolution=_shown(covered.resolution),
        encoder_noise=_shown(max(m.position_noise for m in motions)),
        velocity=_shown(covered.speed_max),
        acceleration=_shown(reached),
        jerk=_shown(reached / test_function),
    )
    effects = _first_effects(found, catalogue, covered, units, joint is not None)
    if joint is not None:
        return replace(joint, hardware=hardware, effects=effects)
    return AxisModel(_shown(found.mass or 0.0), hardware, effects, rotary=units.rotary)


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
