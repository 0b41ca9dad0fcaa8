"""What a motion explains of a force: a small regression by smooth test functions.

    F = m a + Fv v + Fc sign(v) + c0 + c1 q + c2 q^2 + c3 q^3

Over each test function the motion is that of a mass with friction: m, Fv and Fc are at least 0,
while what the place does (springs, gravity) may be anything. Times are in samples, so that nothing
of it needs the sample rate.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from twin.signals import Array, between

LONGEST = 1 << 15  # rows; of more rows, means over blocks are taken, which tell the same
SHORTEST = 8  # samples of a test function
FEWEST = 100  # test functions in motion, that tell seven gains
OVERLAP = 4  # test functions that hold each sample


@dataclass(frozen=True)
class Explained:
    """What of the variance of a force the motion explains, 0 to 1, by the best length.

    forward: as the force that moves a mass against friction. backward: the same of the force with
    its sign reversed. free: of any signs. inertia, friction: what these make of the force in the
    free fit, RMS as a part of its own; negative where they help the motion.
    t_inertia: how sure the inertia is, over what is left. helps: the part of what the forward fit
    leaves that Coulomb friction below 0 would take.
    both_ways: whether the axis moves in both directions; else no sign is told.
    """

    forward: float
    backward: float
    free: float
    inertia: float
    friction: float
    t_inertia: float
    helps: float
    both_ways: bool

    @property
    def is_turned(self) -> bool:
        """Whether the force moves a mass against friction with its sign reversed alone.

        So does the part of a command that takes back too large a feedforward of friction.
        """
        clear = 3.0  # times what that leaves, the sign as it is leaves; in any force a part is left
        left, right = 1.0 - self.forward, max(1.0 - self.backward, 0.02)
        return self.both_ways and self.explains and left > clear * right

    @property
    def accelerates(self) -> int:
        """The sign with which the force accelerates the mass; 0 where that is not sure."""
        sure = 3.0  # t-value, from which the inertia is no accident
        return int(np.sign(self.inertia)) if self.t_inertia > sure else 0

    @property
    def pushes(self) -> bool:
        """Whether the force helps the motion where friction resists it: a part of it is missing."""
        told = 0.1  # of the force
        against = self.both_ways and self.explains and self.friction < -told
        return against or self.is_partial

    @property
    def is_partial(self) -> bool:
        """Whether it does so for sure: friction below 0 is all that is left, and enough of it.

        A drag that grows with the square of the speed looks like it too, and leaves more.
        """
        all_but = 0.9  # of what is left
        enough = 1e-3  # of the squared force
        is_explained = self.both_ways and self.explains
        return is_explained and self.helps > all_but and self.free - self.forward > enough

    @property
    def explains(self) -> bool:
        """Whether the motion makes most of the force."""
        return self.best > 0.5

    @property
    def best(self) -> float:
        """By whichever sign explains more."""
        return max(self.forward, self.backward)


NOTHING = Explained(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, False)


def thinned(column: Array) -> Array:
    """Means over blocks of a long column (n,), at most LONGEST of them."""
    samples = -(-len(column) // LONGEST)
    if samples == 1:
        return column
    whole = len(column) // samples * samples
    return np.asarray(column[:whole].reshape(-1, samples).mean(axis=1))


def explained(position: Array, forces: Sequence[Array]) -> list[Explained]:
    """What of each force (n,) the motion (n,) explains; all as of ``thinned``."""
    found = [NOTHING] * len(forces)
    if not forces or np.ptp(position) == 0.0:
        return found
    stacked = np.stack(forces)
    width = SHORTEST
    while width * FEWEST <= OVERLAP * len(position) and width < len(position):
        rows = MotionRows.of(position, width)
        if rows is None:
            break
        means = rows.means(stacked)
        found = [max(one, rows.fit(f), key=lambda e: e.best)
                 for one, f in zip(found, means, strict=True)]  # fmt: skip
        width *= 2
    return found


@dataclass(frozen=True)
class MotionRows:
    """A motion by test functions of ``width`` samples, of those in which it does not rest.

    columns (3, k): acceleration, velocity, its sign. place (4, k): orthonormal, of the position.
    """

    width: int
    kept: np.ndarray
    columns: Array
    place: Array

    @classmethod
    def of(cls, position: Array, width: int) -> MotionRows | None:
        """None where the motion is too short for that width."""
        if len(position) < 2 * width:
            return None
        steps = between(position, 1.0)
        weights = _weights(width)
        r = _places(width)
        slope = -4.0 * r * (1.0 - r**2)  # of the weight, never of the signal; of any size
        smooth = max(width // 4, 2)
        slow = np.convolve(steps, np.full(smooth, 1.0 / smooth), "same")
        creep = 0.02  # of the usual highest speed, below which the axis rests
        resting = np.abs(slow) <= creep * float(np.quantile(np.abs(slow), 0.98))
        sign = np.where(resting, 0.0, np.sign(slow))
        windows = _windows(steps, width)
        acceleration, velocity = -(windows @ slope), windows @ weights
        signs, middle = _windows(sign, width) @ weights, _windows(position[:-1], width) @ weights
        at_rest = _windows(resting.astype(float), width).mean(axis=1)
        kept = at_rest < 0.1  # part of a test function
        if np.count_nonzero(kept) < FEWEST:
            kept = np.ones(len(kept), dtype=bool)
        place = middle[kept] - middle[kept].mean()
        place /= np.abs(place).max() + np.finfo(float).tiny
        powers = np.stack([np.ones_like(place), place, place**2, place**3])
        rows = np.stack([acceleration, velocity, signs])[:, kept]
        return cls(width, kept, rows, np.linalg.qr(powers.T)[0].T)

    def means(self, forces: Array) -> Array:
        """(m, k) of forces (m, n)."""
        weights = _weights(self.width)
        return np.stack([(_windows(f[:-1], self.width) @ weights)[self.kept] for f in forces])

    def fit(self, force: Array) -> Explained:
        """What of a force (k,) the motion explains."""
        total = float(np.sum((force - force.mean()) ** 2))
        if total <= 1e-20 * float(force @ force):
            return NOTHING
        left = _without(force[None], self.place)[0]
        rows = _without(self.columns, self.place)
        size, whole = np.linalg.norm(rows, axis=1), np.linalg.norm(self.columns, axis=1)
        # part of a column, below which the place says the same: the acceleration of a sine
        own = 0.03
        told = size > own * whole
        scaled = np.where(told[:, None], rows / np.where(told, size, 1.0)[:, None], 0.0)
        gram, product = scaled @ scaled.T, scaled @ left
        power = float(left @ left)
        forward, backward = (_at_least_zero(gram, sign * product) for sign in (1.0, -1.0))
        free = np.linalg.lstsq(gram, product, rcond=1e-10)[0]
        taken = float(free @ product)
        moved, spread = free[0] * scaled[0], float(np.std(force)) * np.sqrt(len(force))
        rubbed = free[1] * scaled[1] + free[2] * scaled[2]
        against = np.sign(float(rubbed @ self.columns[1])) if told[1] else np.sign(free[2])
        # test functions overlap, and so do what they leave
        noise = (power - taken + 1e-12 * total) * 2.0 * OVERLAP / len(force)
        error = np.sqrt(noise * np.linalg.pinv(gram, rcond=1e-10)[0, 0])
        return Explained(
            1.0 - (power - forward) / total, 1.0 - (power - backward) / total,
            1.0 - (power - taken) / total,
            float(np.sign(free[0]) * np.linalg.norm(moved) / spread),
            float(against * np.linalg.norm(rubbed) / spread),
            float(abs(free[0]) / error) if error > 0.0 else 0.0,
            float((taken - forward) / (power - forward + 1e-6 * total)) if free[2] < 0.0 else 0.0,
            self.both_ways,
        )  # fmt: skip

    @property
    def both_ways(self) -> bool:
        """Whether a part of the motion goes either way."""
        part = float(np.mean(self.columns[1] > 0.0))
        return 0.1 < part < 0.9


def _places(width: int) -> Array:
    """Of its samples within a test function, between -1 and 1."""
    return np.asarray((2.0 * np.arange(width) - (width - 1)) / (width + 1))


def _weights(width: int) -> Array:
    """(1 - r^2)^2 over a test function, of unit sum."""
    weights = (1.0 - _places(width) ** 2) ** 2
    return np.asarray(weights / weights.sum())


def _windows(signal: Array, width: int) -> Array:
    return sliding_window_view(signal, width)[:: max(width // OVERLAP, 1)]


def _without(rows: Array, place: Array) -> Array:
    """Rows (r, k) less what orthonormal ones (p, k) hold of them."""
    return np.asarray(rows - (rows @ place.T) @ place)


def _at_least_zero(gram: Array, product: Array) -> float:
    """What the best gains at least 0 take of the power of a force."""
    best = 0.0
    for count in range(1, len(product) + 1):
        for some in map(list, combinations(range(len(product)), count)):
            found = np.linalg.lstsq(gram[np.ix_(some, some)], product[some], rcond=1e-10)[0]
            taken = float(found @ product[some])
            best = max(best, taken) if found.min() >= 0.0 else best
    return best
