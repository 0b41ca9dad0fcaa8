"""The noise floor of a fit with its parts and its uncertainty: one for all that is told of it.

A smooth path through the instants at which a reading changes restores most of what rounding to an
encoder's steps took away (`identify.dataset.readings`). These instants are known to one sample
only. What remains unknown is white noise, as of the rounding of a fast motion: a twelfth of the
squared step, times the part of the samples at which the reading changes.

Over the position, rounding is a sawtooth. At a speed v its k-th harmonic, which has 6/(pi k)^2 of
its power, is a tone of k v/step, folded at the sample rate: a motion of even speed has its rounding
at no other frequency. By what a reading strays from an even motion, beyond its rounding, all that
is told and every tone becomes white: the k-th harmonic keeps exp(-(2 pi k)^2 s^2) of its power,
with s rms in steps (B. Widrow, I. Kollar, Quantization Noise, 2008, chapter 4).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from identify.dataset.drive import knows_rounding
from identify.dataset.motion import Motion
from identify.dataset.noise import Noise, noises_of
from identify.dataset.path import Slip
from identify.dataset.prepared_log import (
    PreparedLog,
    motor_gain,
    moving,
    on_blocks,
    split_by_log,
    sticks,
    total_force,
)
from identify.dataset.readings import rate_gain, white_rounding
from identify.dataset.spectrum import median_spectrum
from identify.rules import RULE
from twin.model.machine import AxisModel
from twin.signals import Array, between, local_parabola

RESOLVED = 1e-8  # of a force: what numbers keep through its averages; no recorder resolves as much
_PARTS: WeakKeyDictionary[PreparedLog, dict[tuple[bool, int], tuple[float, float]]]
_PARTS = WeakKeyDictionary()


@dataclass(frozen=True)
class NoiseFloor:
    """What noise alone leaves in a force residual, N RMS by test functions.

    low, high: between which it is, with a probability of 95 %. most: the upper end without what
    rounding may add that the axis does not know, which is what a model lacks. parts: N RMS of each,
    whose squares make up that of value: "sensors", white, and at least what numbers keep of the
    force; "rounding" of the readings, where the axis has an encoder with steps; "aliasing" of the
    command by a thinned log; "path", what laws with memory make of what the readings do not tell of
    it; "force", that no sensor makes.
    """

    value: float
    low: float
    high: float
    most: float
    parts: Mapping[str, float]

    @property
    def sure(self) -> float:
        """The error, N RMS, from which it is surely more than noise."""
        return max(RULE.at_floor * self.value, self.most)

    @property
    def known(self) -> float:
        """What is known to make noise, N RMS: all of it but the force that no sensor makes.

        That force is what a fit left and nothing measured predicts, and so no floor to set an error
        against.
        """
        unknown = self.parts.get("force", 0.0)
        return self.value if not unknown else float(np.sqrt(max(self.value**2 - unknown**2, 0.0)))

    @property
    def follows_motion(self) -> bool:
        """Whether most of its square is rounding and its aliases, whose size the motion sets."""
        moved = sum(self.parts[name] ** 2 for name in ("rounding", "aliasing", "path"))
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

    left: of each log (n,) N, what the axis leaves, zero where it says nothing. A fit never leaves
    less than the noise, so the floor is at most the RMS of it. Where it is below the whole range of
    the floor, the force noise was estimated too high: it was the controller's answer to readings
    that the log does not hold, or impacts within a play. It is then reduced to what the spectrum of
    the residual allows; the upper end of the range stays.
    """
    noises, gain = noises_of(axis, [log.motion for log in logs]), motor_gain(axis, logs)
    floor = _of_parts(axis, logs, noises, gain)
    told = np.concatenate([np.zeros(0), *(r[r != 0.0] for r in left)])
    error = float(np.sqrt(np.mean(told**2))) if len(told) else np.inf
    if error < floor.low:
        made = (gain * own for own in left)
        rooms = [_within_room(*each) for each in zip(made, noises, logs, strict=True)]
        less = _of_parts(axis, logs, rooms, gain)
        floor = replace(less, high=floor.high) if less.value < floor.value else floor
    return floor.at_most(error)


def known_floor(axis: AxisModel, logs: Sequence[PreparedLog], left: Array) -> float:
    """What is known to make noise in the force residual of these logs, N RMS.

    left (n,): N, what the axis leaves, zero where it says nothing; noise is part of it.
    """
    return noise_beside(axis, logs, split_by_log(left, logs)).known


def floor_of(axis: AxisModel, logs: Sequence[PreparedLog]) -> float:
    """RMS noise floor in N of the force residual of these logs.

    What the rounding of readings makes is a part of it where the axis has that effect, or an
    encoder of that step; else it is what the model lacks.
    """
    return noise_beside(axis, logs).value


def quiet_floor(axis: AxisModel, logs: Sequence[PreparedLog]) -> float:
    """RMS in N of what white noise and the rounding of readings leave in the force residual.

    Whatever of it the axis knows: test functions are to be as long as it asks for.
    """
    motions = [log.motion for log in logs]
    noises = noises_of(axis, motions)
    pairs = zip(noises, motions, logs, strict=True)
    white = _together(
        [_unrounded(n, m).passed(m, log.test_function) for n, m, log in pairs], motions
    )
    return float(np.hypot(white, rounding_in(axis, logs)))


def rounding_in(axis: AxisModel, logs: Sequence[PreparedLog]) -> float:
    """RMS in N of what the rounding of readings adds to the force residual of these logs."""
    motions = [log.motion for log in logs]
    parts = []
    for noise, log in zip(noises_of(axis, motions), logs, strict=True):
        own = _unrounded(noise, log.motion).reading / (2.0 * log.motion.sample_period)
        parts.append(_rounding_variance(log, sticks(axis), noise.segment, own))
    return axis.weighed.mass * _together(parts, motions)


def _of_parts(
    axis: AxisModel, logs: Sequence[PreparedLog], noises: Sequence[Noise], gain: float
) -> NoiseFloor:
    """The floor of logs with these noises of the motor's force; gain: of that over the command."""
    motions = [log.motion for log in logs]

    def size(each: Sequence[Noise]) -> float:
        pairs = zip(each, logs, strict=True)
        return _together([n.passed(w.motion, w.test_function) for n, w in pairs], motions) / gain

    sensors = [_unrounded(n, m) for n, m in zip(noises, motions, strict=True)]
    rounds, told = rounding_in(axis, logs) / gain, knows_rounding(axis, motions)
    white = size([replace(n, folded=0.0) for n in sensors])
    resolved = RESOLVED * _together([float(np.mean(log.command**2)) for log in logs], motions)
    parts = {
        "sensors": float(np.hypot(white, resolved)),
        "rounding": rounds if told else 0.0,
        "aliasing": size([replace(n, force=n.folded, reading=0.0, folded=0.0) for n in noises]),
        "path": _together([_of_path(axis, log) for log in logs], motions) / gain,
        "force": float(np.sqrt(np.mean([log.force_noise**2 for log in logs]))),
    }
    # of a part's RMS, by which its estimate misses it, see tests of the noise floor; the slow steps
    # of rounding depend on where the axis turns
    errors = dict.fromkeys(parts, 0.1) | {"rounding": 0.3, "path": 0.5}
    errors["aliasing"] += 0.5 * max(n.scatter for n in noises)
    power = sum(size**2 for size in parts.values())
    sure = NormalDist().inv_cdf(1.0 - 0.5 * RULE.chance)
    scatter = sure * np.sqrt(sum((2.0 * errors[k] * v**2) ** 2 for k, v in parts.items()))
    low = np.sqrt(max(power - scatter, 0.0))
    most = float(np.sqrt(power + scatter))
    high = most if told else float(np.hypot(most, rounds))
    return NoiseFloor(float(np.sqrt(power)), float(low), high, most, parts)


THROUGHOUT = 0.99  # of the weight of a test function: all of it but for rounding


def _of_path(axis: AxisModel, log: PreparedLog) -> float:
    """Mean square, N^2, of what laws with memory make of what the readings do not tell of a path.

    By the two paths that every second reading tells, from the first and from the second on. Half
    of what laws differ by along them is the readings' noise, as it is in the path of all readings.
    By what their mean differs from that of all readings, paths miss what lies between: a reversal
    is missed by the square of the sample period, so that all readings miss a third of it
    (L. F. Richardson, Phil. Trans. R. Soc. A 210 (1911)). Not where the axis stands, as what they
    hold there balances the force.
    """
    motion = log.motion
    own = replace(axis, effects=tuple(f for f in axis.effects if f.effect.remembers))
    if motion.path is None or not own.effects:
        return 0.0
    rests = log.test_function.mean(motion.path.stands.astype(float)) > THROUGHOUT
    told = moving([log], sticks(axis)) & ~rests
    if not told.any():
        return 0.0
    table = on_blocks(own)
    free = np.zeros_like(motion.path.stands)
    beside = (Slip(half - motion.path.velocity, free) for half in motion.path.by_halves)
    every = total_force(table, motion)
    one, other = (total_force(table, replace(motion, slip=slip)) for slip in beside)
    noise = log.test_function.mean(0.5 * (one - other))[told]
    missed = log.test_function.mean(0.5 * (one + other) - every)[told] / 3.0
    return float(np.mean(noise**2 + missed**2))


def _within_room(left: Array, noise: Noise, log: PreparedLog) -> Noise:
    """The noise less what of it what is left (n,) N of a log has no room for; of white force.

    In the octave below where test functions pass a quarter of the power: what a model lacks is
    slower.
    """
    piece = 64  # test functions of a piece, whose spectrum tells what the residual leaves room for
    test = log.test_function
    told = np.count_nonzero(left) / max(len(left), 1)
    if told * len(left) < piece:
        return noise
    frequency, power = median_spectrum(left, piece, test.stride * test.period, left == 0.0)
    response = test.response(log.motion.sample_period, noise.segment)
    passed = np.interp(frequency, noise.frequency, response)
    own = np.interp(frequency, noise.frequency, noise.reading * noise.bend)
    room = np.maximum(power / (told * passed) - own, 0.0)
    # 0.25 of the power, half of the size: beyond, the test functions pass little
    top = float(frequency[np.flatnonzero(passed < 0.25 * passed[0])[0]])
    white = float(room[(frequency > 0.5 * top) & (frequency <= top)].mean())
    if noise.folded == 0.0:
        return replace(noise, force=white)
    force = min(noise.force, white)
    return replace(noise, force=force, folded=white - force)


def _unrounded(noise: Noise, motion: Motion) -> Noise:
    """The noise less that of rounding at speed, which is as white as other noise of readings."""
    white = white_rounding(motion.resolution, motion.sample_period)
    return replace(noise, reading=max(noise.reading - white, 0.0))


def _together(variances: Sequence[float], motions: Sequence[Motion]) -> float:
    seconds = [m.signals.shape[1] * m.period for m in motions]  # as many test functions has each
    return float(np.sqrt(np.average(variances, weights=seconds)))


def _rounding_variance(log: PreparedLog, sticks: bool, segment: int, own: float) -> float:
    """Mean square, (m/s^2)^2, of what rounding adds to the accelerations of a log.

    sticks: whether the axis has static friction, so that test functions at rest tell nothing.
    segment: samples of the transform that tells what the test functions pass. own: variance, m^2,
    of the readings' white noise before they were rounded.
    """
    if log.motion.resolution == 0.0:
        return 0.0
    if _kept(1, own / log.motion.resolution**2) < RULE.line_chance:  # white noise, and no tones
        return _white(log, *_gain(log, segment))
    known = _PARTS.setdefault(log, {})  # a property of the log alone, which every fit asks for
    if (sticks, segment) not in known:
        known[sticks, segment] = _parts(log, sticks, segment)
    told, hidden = known[sticks, segment]
    return max(_kept(1, own / log.motion.resolution**2) * told + hidden, 0.0)


def _parts(log: PreparedLog, sticks: bool, segment: int) -> tuple[float, float]:
    """Mean square of what readings without noise tell less what they then do not hide, and hidden.

    Both (m/s^2)^2; the second is what is hidden where noise lets the readings tell nothing.
    """
    motion = log.motion
    dt, kept = motion.sample_period, moving([log], sticks)
    frequency, gain = _gain(log, segment)
    white = _white(log, frequency, gain)
    still = np.abs(motion.raw[0]) * dt < 0.5 * motion.resolution
    told = log.fine.acceleration(between(motion.rounding, dt)) ** 2
    told -= white * log.fine.mean(still.astype(float))
    hidden = white + log.fine.mean(_tones(log, white, frequency, gain))
    counted = kept if kept.any() else ~kept
    return float(told[counted].mean()), float(hidden[counted].mean())


def _gain(log: PreparedLog, segment: int) -> tuple[Array, Array]:
    """Frequencies (k,) Hz of a segment, and the power gain from a reading to an acceleration."""
    dt = log.motion.sample_period
    frequency: Array = np.asarray(np.fft.rfftfreq(segment, dt), dtype=float)
    return frequency, rate_gain(frequency, dt) ** 2 * log.test_function.response(dt, segment)


def _white(log: PreparedLog, frequency: Array, gain: Array) -> float:
    """Mean square, (m/s^2)^2, of rounding that is white; frequency, gain: (k,) Hz and 1/s^4."""
    white = white_rounding(log.motion.resolution, log.motion.sample_period)
    return float(np.trapezoid(white * gain, frequency))


def _uneven(log: PreparedLog) -> tuple[Array, Array]:
    """By what readings stray from an even motion, squared steps, and its steps a sample: (n,)."""
    readings, step = log.motion.readings, log.motion.resolution
    # 501 samples that tell a speed to a 10^-4 of a step a sample; more would take time
    width = (min(len(log.fine.weights), 501) - 1) | 1
    path = local_parabola(readings, width)
    sums = np.cumsum(np.pad(((readings - path) / step) ** 2, (width // 2 + 1, width // 2)))
    square = (sums[width:] - sums[:-width]) / width
    return np.maximum(square[1:] - 1.0 / 12.0, 0.0), np.abs(np.diff(path)) / step


def _kept(harmonic: int, strayed: Array | float) -> Any:
    """Part of a harmonic's power that stays, where readings stray by so many squared steps."""
    return np.exp(-((2.0 * np.pi * harmonic) ** 2) * strayed)


def _tones(log: PreparedLog, white: float, frequency: Array, gain: Array) -> Array:
    """Mean square (n,), (m/s^2)^2, that tones of even motion pass above what they would if white.

    white: of all of rounding. frequency (k,): Hz. gain (k,): power gain from a reading to an
    acceleration, 1/s^4.
    """
    strayed, steps = _uneven(log)
    above = np.zeros(len(steps))
    for k in range(1, 8 + 1):  # that hold 93 % of the power; others are taken as white
        share = 6.0 / (np.pi * k) ** 2
        # Noise leaves few of which enough is kept, and these take the time; slower ones are told.
        most = np.log(share / RULE.line_chance) / (2.0 * np.pi * k) ** 2
        left = np.flatnonzero((k * steps > 0.5) & (strayed < most))
        turns = k * steps[left]
        tone = np.interp(np.abs(turns - np.rint(turns)) / log.motion.sample_period, frequency, gain)
        part = share * _kept(k, strayed[left])
        above[left] += part * (log.motion.resolution**2 / 12.0 * tone - white)
    return above
