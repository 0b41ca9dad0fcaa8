"""Mass, friction and constant force of an axis before there is a model.

The values are of one linear regression: the force by test functions in motion, on acceleration,
direction, speed, 1 and what the place does: a spring, or gravity where an axis turns. Each is
believed by its t-value over blocks of the logs, as what so rough a model leaves is coloured.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.dataset.motion import Motion
from identify.dataset.prepared_log import stands
from identify.dataset.test_function import TestFunction
from identify.estimation.evidence import rms
from identify.estimation.least_squares import orthonormal, unabsorbed
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
class FirstRegression:
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
        least_inertial = 0.005  # of the force's RMS; below, unknown friction hides the inertia
        # 1e-300: of an axis that does not move, no division by zero
        least = least_inertial * float(np.std(force)) / max(float(np.std(columns[0])), 1e-300)
        if (told := found.sure("mass")) > least:
            return _values(motions, place, found, told)
    # As it is, its friction would push.
    against = _with_friction(columns, -force).sure("mass")
    unknown = replace(_values(motions, place, found, float(found.gains[0])), mass=None)
    return replace(unknown, reversed=-against if against > least else 0.0)


def _values(
    motions: Sequence[Motion], place: tuple[float, bool], found: FirstRegression, mass: float
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


def _place(motions: Sequence[Motion]) -> tuple[float, bool]:
    """The middle of the positions, m, and whether the axis turns."""
    position = np.concatenate([m.position for m in motions])
    turns = 1.0  # rad, from which gravity is a sine of the angle, and no spring
    return float(position.mean()), motions[0].units.rotary and bool(np.ptp(position) > turns)


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

    And whose force was recorded throughout. Of all, where nearly every one holds a rest.
    """
    columns, going = [], []
    for m in motions:
        w = TestFunction.at_least(length, m.period)
        along = [np.sign(m.velocity), m.velocity, np.ones_like(m.velocity)]
        means = w.mean(np.stack([*along, *_of_place(m.position, place), m.net]))
        columns.append(np.concatenate([w.acceleration(m.velocity)[None], means]))
        # part of a test function, from which what static friction holds is in its force
        at_rest = 0.02
        going.append(w.mean((stands(m) | m.cut_off).astype(float)) < at_rest)
    rows, kept = np.hstack(columns), np.concatenate(going)
    rows = rows[:, kept] if np.count_nonzero(kept) >= ROWS else rows
    return rows[:-1], rows[-1]


def _with_friction(columns: Array, force: Array) -> FirstRegression:
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


def _regressed(columns: Array, force: Array) -> FirstRegression:
    """Least squares, with the scatter between blocks of time."""
    size = np.linalg.norm(columns, axis=1)
    size = np.where(size > 0.0, size, 1.0)
    scaled = columns / size[:, None]
    # 1e-10, below which a combination of columns is rounding
    inverse = np.linalg.pinv(scaled @ scaled.T, rcond=1e-10, hermitian=True)
    gains = inverse @ scaled @ force
    left = force - gains @ scaled
    scores = np.stack([part.sum(axis=1) for part in np.array_split(scaled * left, BLOCKS, axis=1)])
    variance = np.diag(inverse @ (scores.T @ scores) @ inverse)
    rounding = 1e-9  # of the force: smaller gains of columns of unit size are none
    error = np.sqrt(np.maximum(variance, 0.0)) + rounding * float(np.linalg.norm(force))
    error = np.maximum(error, np.finfo(float).tiny)  # of no force at all
    return FirstRegression(gains / size, gains / error, rms(left))


def _static(
    motions: Sequence[Motion], found: FirstRegression, mass: float, place: tuple[float, bool]
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
