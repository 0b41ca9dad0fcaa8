"""The noise floor of a fit with its parts and its uncertainty: one for all that is told of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from identify.dataset.drive import is_noise
from identify.dataset.noise_floor import (
    Noise,
    median_spectrum,
    noises_of,
    passed,
    rounding_in,
    together,
    unrounded,
)
from identify.dataset.prepared_log import PreparedLog
from twin.model.machine import AxisModel
from twin.signals import Array

SCATTER = 0.1  # of a part's RMS, by which its estimate misses it; see tests of the noise floor
OF_ROUNDING = 0.3  # the same of rounding, whose slow steps depend on where the axis turns
SURE = 2.0  # standard errors from the floor to its low and high end
PIECE = 64  # test functions of a piece, whose spectrum tells what the residual leaves room for
PASSED = 0.25  # of the power at rest


@dataclass(frozen=True)
class NoiseFloor:
    """What noise alone leaves in a force residual, N RMS by test functions.

    low, high: between which it is, with a probability of 95 %. parts: N RMS of each, whose squares
    make up that of value: "sensors", white; "rounding" of the readings, where the axis has an
    encoder with steps; "aliasing" of the command by a thinned log; "force", that no sensor makes.
    """

    value: float
    low: float
    high: float
    parts: Mapping[str, float]

    @property
    def follows_motion(self) -> bool:
        """Whether most of its square is rounding and its aliases, whose size the motion sets."""
        moved = sum(self.parts[name] ** 2 for name in ("rounding", "aliasing"))
        return moved > 0.5 * self.value**2

    def at_most(self, error: float) -> NoiseFloor:
        """The same where an error, N RMS, leaves room for no more; its parts fall alike."""
        if error >= self.value:
            return self
        fall = error / self.value
        parts = {name: fall * size for name, size in self.parts.items()}
        return replace(self, value=error, low=min(self.low, error), parts=parts)


def noise_beside(
    axis: AxisModel, logs: Sequence[PreparedLog], left: Sequence[Array] = ()
) -> NoiseFloor:
    """The noise floor of these logs, or less where what is left leaves no room for it.

    left: of each log (n,) N, what the axis leaves, zero where it tells nothing. Noise leaves no
    less than itself, so that the floor is at most its RMS. One that is below all that the floor may
    be refutes the noise of the force: it was the controller's answer to readings that the log does
    not hold, or a load that strikes within its play. Its level is then what the residual leaves
    room for, and how large it could be is that of the logs.
    """
    noises = noises_of(axis, [log.motion for log in logs])
    floor = _of_parts(axis, logs, noises)
    error = _rms_of(left)
    if error < floor.low:
        rooms = [_within(_room_in(*each), each[1]) for each in zip(left, noises, logs, strict=True)]
        less = _of_parts(axis, logs, rooms)
        floor = replace(less, high=floor.high) if less.value < floor.value else floor
    return floor.at_most(error)


def _within(room: float, noise: Noise) -> Noise:
    """The noise with ``room``, N^2/Hz, for a white one of the force; folded where that was."""
    if noise.folded == 0.0:
        return replace(noise, force=room)
    force = min(noise.force, room)
    return replace(noise, force=force, folded=room - force)


def _of_parts(axis: AxisModel, logs: Sequence[PreparedLog], noises: Sequence[Noise]) -> NoiseFloor:
    """The floor of logs with these noises."""
    motions = [log.motion for log in logs]
    sensors = [replace(unrounded(n, m), folded=0.0) for n, m in zip(noises, motions, strict=True)]
    folds = [replace(n, force=n.folded, reading=0.0, folded=0.0) for n in noises]

    def size(each: Sequence[Noise]) -> float:
        pairs = zip(each, logs, strict=True)
        return together([passed(n, w.motion, w.test_function) for n, w in pairs], motions)

    rounds, told = rounding_in(axis, logs), any(is_noise(f.effect) for f in axis.effects)
    parts = {
        "sensors": size(sensors),
        "rounding": rounds if told else 0.0,
        "aliasing": size(folds),
        "force": float(np.sqrt(np.mean([log.force_noise**2 for log in logs]))),
    }
    errors = dict.fromkeys(parts, SCATTER) | {"rounding": OF_ROUNDING}
    errors["aliasing"] += 0.5 * max(n.scatter for n in noises)
    power = sum(size**2 for size in parts.values())
    scatter = SURE * np.sqrt(sum((2.0 * errors[k] * v**2) ** 2 for k, v in parts.items()))
    low = np.sqrt(max(power - scatter, 0.0))
    high = np.sqrt(power + scatter + (0.0 if told else rounds**2))
    return NoiseFloor(float(np.sqrt(power)), float(low), float(high), parts)


def _rms_of(left: Sequence[Array]) -> float:
    """RMS of what is left of all logs where it tells something."""
    told = np.concatenate([np.zeros(0), *(r[r != 0.0] for r in left)])
    return float(np.sqrt(np.mean(told**2))) if len(told) else np.inf


def _room_in(left: Array, noise: Noise, log: PreparedLog) -> float:
    """White noise of the force, N^2/Hz, that what is left (n,) N of a log leaves room for.

    In the octave below where test functions pass a quarter of the power: what a model lacks is
    slower.
    """
    test = log.test_function
    step = test.stride * test.period
    told = np.count_nonzero(left) / max(len(left), 1)
    if told * len(left) < PIECE:
        return noise.force
    frequency, power = median_spectrum(left, PIECE, step, left == 0.0)
    passed = np.interp(
        frequency, noise.frequency, test.response(log.motion.sample_period, noise.segment)
    )
    own = np.interp(frequency, noise.frequency, noise.reading * noise.bend)
    room = np.maximum(power / (told * passed) - own, 0.0)
    top = float(frequency[np.flatnonzero(passed < PASSED * passed[0])[0]])
    return float(room[(frequency > 0.5 * top) & (frequency <= top)].mean())
