"""The noise floor of a force residual, from the data alone.

The residual before averaging, with a from second differences, is pure noise at high frequency:
white noise of the measured force, S = A, and of the encoder, S = B (m (2 - 2 cos(w dt))/dt^2)^2.
A and B are fitted to its spectrum above the band of the effects; the test functions pass a part of
both. Where the encoder's noise hides that of the force in the whole band, the noise of the force is
taken from the command: the part that the controller did not compute from its readings. The force of
a machine is as noisy in each of its logs: one with far more power in the band has it from its
motion, such as a load that strikes within its play.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from identify.dataset.aliasing import folded
from identify.dataset.drive import actual_force, is_noise
from identify.dataset.motion import Motion
from identify.dataset.prepared_log import PreparedLog, at_rest, on_blocks, sticks, total_force
from identify.dataset.rounding import rounding_variance, white_rounding
from identify.dataset.spectrum import densities, pieces_of
from identify.dataset.test_function import TestFunction
from identify.dataset.velocity import part_left, rate_gain
from identify.dataset.whittle import fitted_levels
from twin.model.machine import AxisModel
from twin.signals import between

Array = NDArray[np.float64]

SEGMENT = 0.25  # s; short, so that most segments hold neither a reversal nor a spike
LEAST_KEPT = 0.25  # of the segments, where an axis rests in most
MOST_SEGMENTS = 64  # whose median is sure enough: with as many frequencies, to 1 % of the power
BAND = (50.0, 0.1, 0.45)  # fit from 50 Hz or this part of the sample rate, to that part of it
BAND_OF_BOTH = 0.25  # its end beside a measured velocity, whose noise vanishes towards 0.5
LOUDER = 2.0  # times the power of the quietest log, beyond which it is no noise: estimates scatter
PLAIN = 3.0  # times the reading's noise where the band begins; above it the force's noise shows


@dataclass(frozen=True, eq=False)
class Noise:
    """Measurement noise of one log, before it is averaged by test functions.

    frequency (k,): Hz. force: N^2/Hz, one-sided and white. most: the same, that the log leaves room
    for where the reading's noise hides it. reading: m^2/Hz, one-sided and white. bend (k,): power
    gain from a reading to the apparent force, N^2/m^2. segment: samples of the transform. folded:
    N^2/Hz, one-sided, of the command that a thinned log folds; scatter: its relative error.
    """

    frequency: Array
    force: float
    most: float
    reading: float
    bend: Array
    segment: int
    folded: float = 0.0
    scatter: float = 0.0

    @property
    def power(self) -> Array:
        """Power of the noise in the force residual, (k,) N^2/Hz."""
        return np.asarray(self.force + self.folded + self.reading * self.bend)


def floor_of(axis: AxisModel, logs: Sequence[PreparedLog]) -> float:
    """RMS noise floor in N of the force residual of these logs.

    What the rounding of readings makes is a part of it where the axis has that effect; else it is
    what the model lacks.
    """
    floor = unrounded_floor_of(axis, logs)
    if not any(is_noise(f.effect) for f in axis.effects):
        return floor
    return float(np.hypot(floor, rounding_in(axis, logs)))


def unrounded_floor_of(axis: AxisModel, logs: Sequence[PreparedLog]) -> float:
    """The floor (N RMS) that these logs would have, had their readings not been rounded."""
    motions = [log.motion for log in logs]
    noises = map(unrounded, noises_of(axis, motions), motions)
    parts = [passed(n, log.motion, log.test_function) for n, log in zip(noises, logs, strict=True)]
    own = np.sqrt(np.mean([log.force_noise**2 for log in logs]))  # which no sensor makes
    return float(np.hypot(together(parts, motions), own))


def unrounded(noise: Noise, motion: Motion) -> Noise:
    """The noise less that of rounding at speed, which is as white as other noise of readings."""
    white = white_rounding(motion.resolution, motion.sample_period)
    return replace(noise, reading=max(noise.reading - white, 0.0))


def rounding_in(axis: AxisModel, logs: Sequence[PreparedLog]) -> float:
    """RMS in N of what the rounding of readings adds to the force residual of these logs."""
    motions = [log.motion for log in logs]
    parts = []
    for noise, log in zip(noises_of(axis, motions), logs, strict=True):
        own = unrounded(noise, log.motion).reading / (2.0 * log.motion.sample_period)
        parts.append(rounding_variance(log, sticks(axis), noise.segment, own))
    return axis.weighed.mass * together(parts, motions)


def noise_floor(axis: AxisModel, logs: Sequence[tuple[Motion, TestFunction]]) -> float:
    """RMS in N of what white noise leaves in the force residual, that of rounding at speed too."""
    motions = [motion for motion, _ in logs]
    noises = noises_of(axis, motions)
    return together([passed(n, *log) for n, log in zip(noises, logs, strict=True)], motions)


def noises_of(axis: AxisModel, motions: Sequence[Motion]) -> tuple[Noise, ...]:
    """The noise of each log; of its force what the quietest of the same rate leaves room for."""
    return _noises_of(axis, tuple(motions))


@lru_cache(maxsize=4)  # a fit, its evidence and its comparison ask for the same
def _noises_of(axis: AxisModel, motions: tuple[Motion, ...]) -> tuple[Noise, ...]:
    noises = [noise_of(axis, motion) for motion in motions]
    quietest: dict[float, float] = {}
    for noise, motion in zip(noises, motions, strict=True):
        dt = motion.sample_period
        quietest[dt] = min(noise.most, quietest.get(dt, np.inf))
    least = [quietest[motion.sample_period] for motion in motions]
    noises = [
        replace(noise, force=low) if noise.force > LOUDER * low else noise
        for noise, low in zip(noises, least, strict=True)
    ]
    thinned = np.mean([noise.folded > 0.0 for noise in noises]) >= 0.5  # logs of one recorder
    return tuple(noises if thinned else [replace(noise, folded=0.0) for noise in noises])


def together(variances: Sequence[float], motions: Sequence[Motion]) -> float:
    seconds = [m.signals.shape[1] * m.period for m in motions]  # as many test functions has each
    return float(np.sqrt(np.average(variances, weights=seconds)))


def passed(noise: Noise, motion: Motion, test_function: TestFunction) -> float:
    """Variance, N^2, of the noise that a test function passes."""
    response = test_function.response(motion.sample_period, noise.segment)
    return float(np.trapezoid(noise.power * response, noise.frequency))


def _band(motion: Motion, frequency: Array) -> NDArray[np.bool_]:
    """Which frequencies (k,) Hz are above those of the effects."""
    dt = motion.sample_period
    top = BAND[2] if motion.velocity_weight == 0.0 else BAND_OF_BOTH
    return np.asarray((frequency > min(BAND[0], BAND[1] / dt)) & (frequency < top / dt))


def _bend(axis: AxisModel, motion: Motion, frequency: Array) -> Array:
    """Power gain (k,) from a position error m to the apparent force N."""
    dt = motion.sample_period
    gain = rate_gain(frequency, dt)
    return np.asarray((gain * axis.mass) ** 2 * part_left(motion.velocity_weight, frequency, dt))


def noise_of(axis: AxisModel, motion: Motion) -> Noise:
    """The measurement noise of one log, from its raw residual."""
    axis, dt = axis.weighed, motion.sample_period
    velocity = motion.unrippled
    # Noise in the command moves the axis as well; without the actuator's delay the two would not
    # cancel and would look like measurement noise.
    command = actual_force(axis, motion) + (motion.force - motion.raw[1])
    raw = 0.5 * (command[1:] + command[:-1]) - between(motion.momentum(axis.mass, velocity), dt)
    # The forces that the model explains, such as a bump passed at speed, are not noise either.
    table = on_blocks(axis)
    if table.labels:
        raw += _between_samples(total_force(table, motion), motion)
    # The median over segments ignores those with spikes and reversals.
    segment = min(max(round(SEGMENT / dt), 256), len(raw))
    frequency, power = median_spectrum(raw, segment, dt, _at_rest(axis, motion))
    half = np.cos(np.pi * frequency * dt) ** 2
    bend = _bend(axis, motion, frequency)
    band = _band(motion, frequency)
    force, reading = map(float, fitted_levels(np.stack([half, bend], axis=1)[band], power[band]))
    # Rounding is white in the mean alone: where it has less in the band, it has more below it.
    plain = max(reading, white_rounding(motion.resolution, dt))
    most = max(force, PLAIN * plain * float(bend[band][0]))
    if force < most:
        force = motion.command_noise
    more, scatter = folded(motion, frequency[band], power[band], half[band], bend[band])
    return Noise(frequency, force, most, reading, bend, segment, max(more - force, 0.0), scatter)


def _between_samples(force: Array, motion: Motion) -> Array:
    """Means over blocks (n,) N as values at the log's inner samples."""
    samples = np.arange(1, motion.raw.shape[1]) * motion.sample_period
    return np.asarray(np.interp(samples, motion.time, force))


def _at_rest(axis: AxisModel, motion: Motion) -> NDArray[np.bool_]:
    """Where the axis may stick, (n,) over the log's inner samples.

    Static friction then balances the command and its noise, whatever they are.
    """
    still = at_rest(motion.velocity)
    samples = motion.raw.shape[1] // len(still)
    return np.asarray(np.repeat(still & sticks(axis), samples)[1:])


def median_spectrum(
    signal: Array, segment: int, dt: float, left_out: NDArray[np.bool_]
) -> tuple[Array, Array]:
    """Welch's one-sided density with medians: frequency Hz, power unit^2/Hz, (segment // 2 + 1,).

    At least a quarter of the segments is used, those with the fewest left-out samples, and of very
    many as many as make the median sure.
    Medians are biased, see B. Allen et al., Phys. Rev. D 85, 122006 (2012).
    """
    out = pieces_of(left_out, segment).mean(axis=1)
    usable = np.flatnonzero(out <= np.quantile(out, LEAST_KEPT))
    pieces = pieces_of(signal, segment)[usable[:: -(-len(usable) // MOST_SEGMENTS)]]
    power = densities(_less_lines(pieces), dt)
    odd = np.arange(2, (len(pieces) - 1) // 2 * 2 + 1, 2)
    bias = 1.0 + np.sum(1.0 / (odd + 1.0) - 1.0 / odd)
    return np.asarray(np.fft.rfftfreq(segment, dt)), np.asarray(np.median(power, axis=0) / bias)


def _less_lines(pieces: Array) -> Array:
    """Pieces (k, n) less the straight line through each."""
    ramp = np.linspace(-1.0, 1.0, pieces.shape[1])
    slope = (pieces @ ramp) / (ramp @ ramp)
    return np.asarray(pieces - (pieces.mean(axis=1, keepdims=True) + slope[:, None] * ramp))
