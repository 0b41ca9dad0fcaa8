"""Recordings of a mechanism's joints that are not of what its MuJoCo file needs.

The bodies of a mechanism take other torques of all joints where one of them goes the wrong way, and
of its torque they tell the whole. So each way in which a recording is often another is tried: the
weight taken out of the torques, as drivers do that compensate it; a torque of the other sign, or of
the other side of a gear or in another unit, which is a multiple of it; a position of the other
sign, with its torque or alone, in degrees, or of the motor before its gear; two joints exchanged.
What the simplest friction and a rotor leave of the torques of all joints tells which is right; of
several, one after the other is found.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import pi

import numpy as np

from identify.analysis.first_values import LENGTHS
from identify.dataset.bodies import bodies_along
from identify.dataset.motion import motion_of
from identify.dataset.test_function import TestFunction
from twin.checks import moves
from twin.logs import Log
from twin.model.machine import MachineModel
from twin.signals import Array

SIGNALS = ("position", "force", "current")  # a velocity has a unit and a sign of its own
TORQUES = SIGNALS[1:]
LEAST_LEFT = 0.01  # of a joint's squared torque: where none leaves as much, all is right
Reader = Callable[[Log], Log]


@dataclass(frozen=True)
class Recording:
    """How a recording is another than the machine's file needs, and how it is read right.

    said: in words, with what to change in the import map. axis: of which it makes most. before,
    after: parts of its torque, 0..1, that bodies and friction leave as it is and as it is read.
    read: makes of a log one as it is read right.
    """

    said: str
    axis: str
    before: float
    after: float
    read: Reader


def misassigned(model: MachineModel, log: Log) -> Recording | None:
    """How a log is another than the file of a mechanism needs; None where it is not.

    model: its axes are joints of a mechanism.
    """
    going = [axis for axis in model.joints if moves(log, axis)]
    head = head_of(model, log)
    found: Recording | None = None
    for _ in going:  # each may be another in a way of its own
        tried = _best_of(model, head, going)
        if tried is None:
            break
        head = tried.read(head)
        found = tried if found is None else _both(found, tried)
    return found


def head_of(model: MachineModel, log: Log) -> Log:
    """As much of a log as tells it of the joints of a mechanism, positions and torques alone."""
    return _thinned(_plain(log), len(model.joints))


def _both(first: Recording, then: Recording) -> Recording:
    said = f"{first.said}; and {then.said}"
    return replace(first, said=said, read=InTurn((first.read, then.read)))


def _best_of(model: MachineModel, log: Log, going: Sequence[str]) -> Recording | None:
    """The way by which least is left of a log, where it is clearly less than as it is."""
    plain = balances(model, log, going)
    parts = np.array([plain[axis].left() for axis in going])
    if max(parts, default=0.0) < LEAST_LEFT:
        return None
    most_tried = 8  # joints, those that leave most: each asks for the torques of all joints anew
    worst = sorted(zip(parts, going, strict=True), reverse=True)[:most_tried]
    suspects = [axis for axis in going if axis in {a for _, a in worst}]
    tried = [*_of_torques(model, plain, going, suspects)]
    for way, said in _of_positions(model, log, suspects):
        otherwise = balances(model, way(log), going)
        tried.append((np.array([otherwise[a].left() for a in going]), way, said))
    floor = np.maximum(parts, LEAST_LEFT)
    # Joint by joint, as one whose coupling or friction the model lacks may leave most of all.
    falls = [np.maximum(left, LEAST_LEFT) / floor for left, _, _ in tried]
    best = int(np.argmin([own.prod() for own in falls]))
    if falls[best].prod() >= 0.5:  # product over the joints, below which another way is believed
        return None
    left, way, said = tried[best]
    most = int(np.argmin(falls[best]))
    before, after = (float(each[most]) ** 0.5 for each in (parts, left))
    return Recording(said, going[most], before, after, way)


@dataclass(frozen=True, eq=False)
class Balance:
    """The torque of one joint by test functions, (n,) each, N m or N.

    torque: as recorded. bodies: all that the bodies take, of which weight their weight. columns
    (3, n): acceleration, direction and speed, of rotor and friction.
    """

    torque: Array
    bodies: Array
    weight: Array
    columns: Array

    def left(self, weight: float = 1.0, torque: float = 1.0) -> float:
        """Part of the squared torque that is left, less its mean.

        weight: part of the weight that is in the torque. torque: what it is to be times.
        """
        from scipy.optimize import nnls  # SciPy takes long to load

        asked = torque * self.torque - self.bodies + (1.0 - weight) * self.weight
        centred = np.vstack([self.columns, asked])
        centred -= centred.mean(axis=1, keepdims=True)
        size = np.linalg.norm(centred[:-1], axis=1)
        size[size == 0.0] = 1.0
        _, left = nnls((centred[:-1] / size[:, None]).T, centred[-1])
        # Of the larger of both: a torque of nothing is no better than one that is right
        whole = max(float(np.std(torque * self.torque)), float(np.std(self.bodies)))
        return float((left / (whole or 1.0)) ** 2) / len(asked)

    def inertia(self) -> tuple[float, float]:
        """Inertia, kg m^2 (kg), that the torque asks for beside bodies and rotor, and its error.

        Between reversals: there a friction with a memory looks like an inertia that is less.
        """
        # 0.999 of a step in one direction, as a mean of signs tells it
        going = np.abs(self.columns[1]) > 0.999
        asked = (self.torque - self.bodies)[going]
        beside = np.vstack([self.columns, np.ones_like(self.torque)])[:, going].T
        if len(asked) <= beside.shape[1]:
            return 0.0, np.inf
        gains = np.linalg.lstsq(beside, asked, rcond=None)[0]
        others, of_others = beside[:, 1:], np.linalg.pinv(beside[:, 1:])
        own = beside[:, 0] - others @ (of_others @ beside[:, 0])
        overlap = 4.0  # test functions that hold each instant
        noise = float(np.std(asked - beside @ gains)) * np.sqrt(overlap)
        return float(gains[0]), noise / max(float(np.linalg.norm(own)), np.finfo(float).tiny)

    def ratio(self) -> float:
        """How many times the torque is what the bodies take, friction beside it."""
        from identify.estimation.least_squares import orthonormal, unabsorbed

        beside = orthonormal(np.vstack([self.columns[1:], np.ones_like(self.torque)]).T)
        made, bodies = (unabsorbed(v, beside) for v in (self.torque, self.bodies))
        return float(made @ bodies) / (float(bodies @ bodies) or 1.0)


def balances(model: MachineModel, log: Log, going: Sequence[str]) -> dict[str, Balance]:
    """By joint that moves, the balance of its torque."""
    from twin.model.bodies import mechanism_in  # MuJoCo takes long to load

    taken, mechanism, out = bodies_along(model, log, ""), mechanism_in(model), {}
    place, *_ = taken[going[0]].along()
    still = np.zeros_like(place)
    weights = mechanism.along(place, still, still)[1]
    for axis in going:
        motion = motion_of(log, axis, "", ripples=(), bodies=taken[axis])
        w = TestFunction.at_least(LENGTHS[0], motion.period)
        fine = len(motion.raw[1]) // len(motion.command)
        assert motion.bodies is not None
        weight = weights[mechanism.axes.index(axis), motion.bodies.samples]
        weight = weight.reshape(-1, fine).mean(axis=1)
        along = [np.sign(motion.velocity), motion.velocity, motion.command, motion.net, weight]
        way, speed, torque, net, own = w.mean(np.stack(along))
        acceleration = w.acceleration(motion.velocity)
        rotor = model.axes[axis].weighed.mass - model.axes[axis].mass
        bodies = torque - net + (taken[axis].mass + rotor) * acceleration
        out[axis] = Balance(torque, bodies, own, np.stack([acceleration, way, speed]))
    return out


def _of_torques(
    model: MachineModel, plain: Mapping[str, Balance], going: Sequence[str], asked: Sequence[str]
) -> Iterator[tuple[Array, Reader, str]]:
    """What is left of each joint where torques are others, with how it is read and told."""
    as_it_is = np.array([plain[a].left() for a in going])
    without = np.array([plain[axis].left(weight=0.0) for axis in going])
    said = (
        "the recorded torques have the weight of the links taken out, as drivers do that "
        "compensate it: import the whole torque of the motors (their current times its constant)"
    )
    yield without, WithWeight(model), said
    every, ways, all_said = as_it_is.copy(), list[Reader](), list[str]()
    for axis in asked:
        factor, said = _factor(axis, plain[axis].ratio())
        if factor != 1.0:
            left, at = as_it_is.copy(), going.index(axis)
            every[at] = left[at] = plain[axis].left(torque=factor)
            ways.append(Scaled((axis,), factor, TORQUES))
            all_said.append(said)
            yield left, ways[-1], said
    if ways[1:]:
        yield every, InTurn(tuple(ways)), "; ".join(all_said)


def _factor(axis: str, ratio: float) -> tuple[float, str]:
    """By what to take a torque times that is so many times that of the bodies, and in words."""
    far = 4.0  # times, from which neither a constant that is off nor a rotor makes it
    if 1.0 / far < abs(ratio) < far:
        said = f"axis {axis}: its torque has the other sign (sign = -1 of its force in the map)"
        return (-1.0, said) if ratio < 0.0 else (1.0, "")
    if not 1e-4 < abs(ratio) < 1e4:  # times, beyond any gear
        return 1.0, ""
    sign = " and has the other sign" if ratio < 0.0 else ""
    return 1.0 / ratio, (
        f"axis {axis}: its torque is {abs(ratio):.3g} times that of the joint{sign}, as that of "
        f"the motor before a gear of {1.0 / abs(ratio):.3g}, or in another unit (scale = "
        f"{1.0 / ratio:.4g} of its force in the map)"
    )


def _of_positions(
    model: MachineModel, log: Log, suspects: Sequence[str]
) -> Iterator[tuple[Reader, str]]:
    for axis in suspects:
        said = f"axis {axis}: with the other sign of its position"
        sign = "(sign = -1 in the map)"
        yield Scaled((axis,), -1.0), f"{said} {sign}"
        yield Scaled((axis,), -1.0, SIGNALS), f"{said} and torque {sign}"
    turning = [axis for axis in model.joints if model.axes[axis].rotary]
    for axes in (turning, *([axis] for axis in suspects if axis in turning)):
        named = f"ax{'es' if axes[1:] else 'is'} {', '.join(axes)}"
        span = max((float(np.ptp(log.axes[axis].position)) for axis in axes), default=1.0)
        # rad: of a joint that turns around and more, and of one that hardly moves
        for unit, factor, seems in (
            ("deg", pi / 180.0, span > 2.0 * pi),
            ("rad", 180.0 / pi, span < 0.1),
        ):
            said = f'{named}: with positions in {unit} (unit = "{unit}" in the map)'
            if seems:
                yield Scaled(tuple(axes), factor), said
    for one, other in combinations(suspects, 2):
        if model.axes[one].units == model.axes[other].units:
            yield Exchanged(one, other), f"axes {one} and {other}: exchanged"


@dataclass(frozen=True)
class Scaled:
    """Some signals of some axes of a log, times a factor."""

    axes: tuple[str, ...]
    factor: float
    fields: tuple[str, ...] = ("position",)

    def __call__(self, log: Log) -> Log:
        """The log with them so."""
        out = {}
        for axis in self.axes:
            own = log.axes[axis]
            out[axis] = replace(own, columns={n: self._of(n, c) for n, c in own.columns.items()})
        return replace(log, axes={**log.axes, **out})

    def _of(self, name: str, column: Array) -> Array:
        return self.factor * column if name in self.fields else column


@dataclass(frozen=True)
class Exchanged:
    """Two axes of a log, each in the place of the other."""

    one: str
    other: str

    def __call__(self, log: Log) -> Log:
        """The log with them so."""
        swapped = {self.one: log.axes[self.other], self.other: log.axes[self.one]}
        return replace(log, axes={**log.axes, **swapped})


@dataclass(frozen=True)
class InTurn:
    """Several ways, one after the other."""

    ways: tuple[Reader, ...]

    def __call__(self, log: Log) -> Log:
        """The log as all of them read it."""
        for way in self.ways:
            log = way(log)
        return log


@dataclass(frozen=True)
class WithWeight:
    """The torques of a log with the weight of a machine's bodies in them."""

    model: MachineModel

    def __call__(self, log: Log) -> Log:
        """The log with them so."""
        from twin.model.bodies import mechanism_in

        mechanism = mechanism_in(self.model)
        place = np.stack([log.axes[axis].position for axis in mechanism.axes])
        # A force holds until the next sample
        middle = np.concatenate([0.5 * (place[:, 1:] + place[:, :-1]), place[:, -1:]], axis=1)
        weights = mechanism.along(middle, *2 * [np.zeros_like(middle)])[1]
        axes = {}
        for axis, weight in zip(mechanism.axes, weights, strict=True):
            own = log.axes[axis]
            constant = {"force": 1.0, "current": own.force_constant or np.inf}
            columns = {
                n: c + weight / constant[n] if n in TORQUES else c for n, c in own.columns.items()
            }
            axes[axis] = replace(own, columns=columns)
        return replace(log, axes={**log.axes, **axes})


def _plain(log: Log) -> Log:
    """The log with positions and torques alone."""
    axes = {}
    for name, own in log.axes.items():
        kept = {n: own.columns[n] for n in SIGNALS if n in own.columns}
        axes[name] = replace(own, columns=kept)
    return replace(log, axes=axes)


def _thinned(log: Log, joints: int) -> Log:
    """The beginning of a log, in steps that its bodies need.

    240 s of all joints together tell it, in steps of 5 ms: a force is that of all of a step.
    """
    seconds, step = 240.0, 0.005  # as above
    every = max(round(step / log.period), 1)
    count = min(round(seconds / joints / log.period), len(log)) // every
    axes = {}
    for name, own in log.axes.items():
        columns = {
            n: c[: count * every : every]
            if n == "position"
            else c[: count * every].reshape(count, every).mean(axis=1)
            for n, c in own.columns.items()
        }
        axes[name] = replace(own, columns=columns)
    return Log(log.sample_rate / every, axes)
