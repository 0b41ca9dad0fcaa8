"""How long test functions should be, from what the logs hold, and where a log begins to tell.

Long ones are quiet, as they average noise away, and with it all that is fast: the cogging of a
motor at speed, bumps passed in a hundredth of a second. The shortest that is quiet is taken, or a
shorter one at which a force shows that the quiet one hides.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from identify.dataset.motion import Motion
from identify.dataset.noise_floor import quiet_floor
from identify.dataset.prepared_log import PreparedLog, moving
from identify.dataset.test_function import LEAST_BLOCKS, LOOK, SHORTEST, TestFunction
from twin.model.machine import INERTIA, MASS, AxisModel
from twin.signals import Array

TEST_FUNCTIONS = (SHORTEST, 0.05, 0.1, 0.2)  # s, tried in this order
QUIET = 0.01  # largest noise floor, as a part of the force that the inertia does not explain
FOREIGN = 10.0  # times the RMS of what is left of the force later on
HELD = 0.1  # of the force itself

Motions = Sequence[Motion]


@dataclass(frozen=True)
class AtLength:
    """What shows at one length: N RMS of the force that a mass, friction and a constant leave.

    floor: N RMS, what noise alone leaves.
    """

    length: float
    left: float
    floor: float

    @property
    def structure(self) -> float:
        """N RMS of what is left beyond noise."""
        return float(np.sqrt(max(self.left**2 - self.floor**2, 0.0)))

    @property
    def information(self) -> float:
        """What it tells beside noise, in nats per second of the logs.

        As a channel: as often as test functions are new, the logarithm of signal to noise (C. E.
        Shannon, Communication in the Presence of Noise, 1949).
        """
        return float(np.log(max(self.left / self.floor, 1.0))) / self.length

    def shows_more_than(self, quiet: AtLength) -> bool:
        """Whether it holds a force, sure beside its noise, that a quieter scale hides."""
        # times the noise floor, and the power at a quiet length, from which a force shows
        shows = 2.0
        return self.left > shows * self.floor and self.structure**2 > shows * quiet.structure**2

    @classmethod
    def of(cls, length: float, motions: Motions) -> AtLength:
        columns, forces, test_functions = regressors(motions, length)
        each = zip(motions, test_functions, strict=True)
        logs = [PreparedLog.of(m, w.length) for m, w in each]
        moved = moving(logs, sticks=True)  # at rest friction balances what it is given
        if moved.sum() > len(columns):
            columns, forces = columns[:, moved], forces[moved]
        gains = np.linalg.lstsq(columns.T, forces, rcond=None)[0]
        left = forces - columns.T @ gains
        mass = max(float(gains[0]), _least_mass(motions))
        return cls(length, float(np.sqrt(np.mean(left**2))), quiet_floor(AxisModel(mass), logs))


def choose_length(
    motions_at: Callable[[float | None], tuple[Motions, ...]], *, imposed: bool = False
) -> float:
    """Length of the test functions, s, for the logs to fit and those that choose.

    motions_at: these for test functions of a length, whose blocks are short enough for it; for
    None as long as their noise asks for. imposed: whether there is no mass.
    """
    motions, others = motions_at(None)
    chosen = choose_test_function(motions, others, imposed=imposed)
    shorter = [length for length in TEST_FUNCTIONS if length < chosen]
    if imposed or not shorter:
        return chosen
    quiet = AtLength.of(chosen, motions)
    for length in shorter:
        finer = motions_at(length)[0]
        if length < LEAST_BLOCKS * max(m.period for m in finer):
            continue
        if AtLength.of(length, finer).shows_more_than(quiet):
            return length
    return chosen


def choose_test_function(motions: Motions, others: Motions = (), *, imposed: bool = False) -> float:
    """The shortest test function (s) whose noise floor is small against the force to be explained.

    others: motions whose blocks it must also be long enough for. imposed: whether there is no mass.
    """
    mass = 0.0 if imposed else inertia(motions)
    longest_block = max(m.period for m in (*motions, *others))
    for length in TEST_FUNCTIONS:
        if length < LEAST_BLOCKS * longest_block:
            continue
        logs = [PreparedLog.of(motion, length) for motion in motions]
        rest = np.concatenate([
            log.test_function.mean(m.net) - mass * log.test_function.acceleration(m.velocity)
            for log, m in zip(logs, motions, strict=True)
        ])  # fmt: skip
        if quiet_floor(AxisModel(mass), logs) < QUIET * np.sqrt(np.mean(rest**2)):
            return length
    return max(TEST_FUNCTIONS[-1], LEAST_BLOCKS * longest_block)


def inertia(motions: Motions, length: float = LOOK) -> float:
    """Rough moved mass (kg): command regressed on acceleration, direction and speed."""
    columns, forces, _ = regressors(motions, length)
    gains = np.linalg.lstsq(columns.T, forces, rcond=None)[0]
    return float(max(gains[0], _least_mass(motions)))


def _least_mass(motions: Motions) -> float:
    return INERTIA.lower if motions[0].units.rotary else MASS.lower


def regressors(motions: Motions, length: float) -> tuple[Array, Array, list[TestFunction]]:
    """Acceleration, direction, speed and 1 by test functions (4, n), the force (n,) N, and these.

    length: s, of the test functions; of slow samples they are as short as can be.
    """
    columns, forces, test_functions = [], [], []
    for m in motions:
        w = TestFunction.at_least(length, m.period)
        direction = w.mean(np.sign(m.velocity))
        columns.append(
            np.stack(
                [w.acceleration(m.velocity), direction, w.mean(m.velocity), np.ones_like(direction)]
            )
        )
        forces.append(w.mean(m.net))
        test_functions.append(w)
    return np.hstack(columns), np.concatenate(forces), test_functions


def beginnings(motions: Motions) -> dict[str, float]:
    """Logs with a beginning that the later motion does not explain, and its end in each, s.

    An axis that hangs in its cogging or its stiction while the controller builds up force, or that
    is still held by a brake, obeys no law of motion. One such moment may hold most of the squared
    error of a log, and every parameter would serve it. The later motion of all logs tells a mass, a
    friction and a constant.
    """
    columns, forces, test_functions = regressors(motions, LOOK)
    times = [w.mean(m.time) for m, w in zip(motions, test_functions, strict=True)]
    logs = np.repeat(np.arange(len(motions)), [len(t) for t in times])
    ends = [0.1 * float(m.time[-1]) for m in motions]  # of a log, that a beginning may last
    late = np.concatenate([t > end for t, end in zip(times, ends, strict=True)])
    gains = np.linalg.lstsq(columns[:, late].T, forces[late], rcond=None)[0]
    left = np.abs(forces - columns.T @ gains)
    usual = float(np.sqrt(np.mean(left[late] ** 2)))
    left[left < HELD * np.abs(forces)] = 0.0
    found = [
        _first_usual(left[logs == k], times[k], FOREIGN * usual, 2.0 * test_functions[k].length)
        for k in range(len(motions))
    ]
    return {
        m.name: begun
        for m, begun, end in zip(motions, found, ends, strict=True)
        if 2.0 * LOOK <= begun <= end
    }


def _first_usual(left: Array, time: Array, most: float, about: float) -> float:
    """Time s from which the force left (n,) N is at most so large; 0 where it is from the start.

    about: s, within which no force may be larger.
    """
    step = float(time[1] - time[0]) if len(time) > 1 else 1.0
    width = max(round(about / step), 1)
    padded = np.pad(left, (width // 2, (width - 1) // 2), mode="symmetric")
    ordinary = np.flatnonzero(sliding_window_view(padded, width).max(axis=1) <= most)
    return float(time[ordinary[0]]) if len(ordinary) and ordinary[0] else 0.0
