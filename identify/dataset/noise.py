"""The measurement noise of a log, from the data alone.

The force residual before averaging, with a from second differences, is pure noise at high
frequency: white noise of the measured force, S = A, and of the encoder,
S = B (m (2 - 2 cos(w dt))/dt^2)^2. A and B are fitted to its spectrum above the band of the
effects. Where the encoder's noise hides that of the force in the whole band, the noise of the force
is taken from the command: the part that the controller did not compute from its readings. The force
of a machine is as noisy in each of its logs: one with far more power in the band has it from its
motion, such as a load that strikes within its play.

A thinned log holds every n-th command of a faster controller, but the axis moves by all of them.
What the controller makes of the noise and the steps of its readings lies at high frequencies:
thinning folds it down to all others, where it looks like force. Of that, the part with which the
logged command answers the logged reading error e is known: a fraction 1 - 1/n of the gain g, so
that the residual holds -e (g (1 - 1/n) - m w^2), and between its two terms the power has a dip that
no independent noises make. The coherence of the two is sqrt(1 - 1/n), whatever machine and
controller, and folded is the same fraction of the command's power near the log's Nyquist frequency.
Where the log has the control rate the axis moves by just what was logged, and there is no dip. The
rounding of readings at even speed can make one; but what is folded is white, and so no frequency
below the band is quieter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from identify.dataset.drive import actual_force, parts_of
from identify.dataset.motion import Motion
from identify.dataset.prepared_log import on_blocks, stands, sticks, total_force
from identify.dataset.readings import part_left, rate_gain, white_rounding
from identify.dataset.spectrum import densities, fitted_levels, median_spectrum, pieces_of
from identify.dataset.test_function import TestFunction
from twin.core.walks import walk_sets
from twin.effect import Kind
from twin.model.machine import AxisModel
from twin.signals import Array, between, rate

BAND = (50.0, 0.1, 0.45)  # fit from 50 Hz or this part of the sample rate, to that part of it
HALF = 0.25  # of the sample rate: beyond, a command has no motion, a measured velocity little noise


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

    def passed(self, motion: Motion, test_function: TestFunction) -> float:
        """Variance, N^2, of the noise that a test function passes."""
        response = test_function.response(motion.sample_period, self.segment)
        return float(np.trapezoid(self.power * response, self.frequency))


def noises_of(axis: AxisModel, motions: Sequence[Motion]) -> tuple[Noise, ...]:
    """The noise of each log; of its force what the quietest of the same rate leaves room for."""
    return _noises_of(axis, tuple(motions))


@lru_cache(maxsize=4)  # a fit, its evidence and its comparison ask for the same
def _noises_of(axis: AxisModel, motions: tuple[Motion, ...]) -> tuple[Noise, ...]:
    fastest = max((float(motion.raw[0].max()) for motion in motions), default=0.0)
    noises = [noise_of(axis, motion, fastest) for motion in motions]
    thinned = np.mean([noise.folded > 0.0 for noise in noises]) >= 0.5  # logs of one recorder
    out = []
    for own, motion in zip(noises, motions, strict=True):
        alike = [m.sample_period == motion.sample_period for m in motions]
        low = min(n.most for n, same in zip(noises, alike, strict=True) if same)
        # 2 times the power of the quietest log, beyond which it is no noise: estimates scatter
        force = low if own.force > 2.0 * low else own.force
        out.append(replace(own, force=force, folded=own.folded if thinned else 0.0))
    return tuple(out)


def noise_of(axis: AxisModel, motion: Motion, fastest: float | None = None) -> Noise:
    """The measurement noise of one log, from its raw residual.

    fastest: m/s, of all logs of the axis where there are others.
    """
    axis, dt = axis.weighed, motion.sample_period
    raw = _raw_residual(axis, motion)
    # The median over segments ignores those with spikes and reversals, and what may stick: static
    # friction then balances the command and its noise, whatever they are.
    still = stands(motion)
    rests = np.repeat(still & sticks(axis), motion.raw.shape[1] // len(still))[1:]
    # 0.25 s; short, so that most segments hold neither a reversal nor a spike
    segment = min(max(round(0.25 / dt), 256), len(raw))
    frequency, power = median_spectrum(raw, segment, dt, rests)
    half = np.cos(np.pi * frequency * dt) ** 2
    hung, speed = parts_of(axis, Kind.STRUCTURE), fastest or float(motion.raw[0].max())
    borne = _hung_gain(hung, dt, len(frequency), speed) if hung.effects else 1.0
    gain = (rate_gain(frequency, dt) * axis.mass) ** 2 * borne
    bend = np.asarray(gain * part_left(motion.velocity_weight, frequency, dt))
    first, beside, top = BAND
    top = HALF if motion.velocity_weight else top
    band = (frequency > min(first, beside / dt)) & (frequency < top / dt)
    force, reading = map(float, fitted_levels(np.stack([half, bend], axis=1)[band], power[band]))
    # A log without noise has the rounding of its numbers still.
    numbers = _rounding_of(motion.force, dt)
    force, reading = max(force, numbers), max(reading, _rounding_of(motion.position, dt))
    # Rounding is white in the mean alone: where it has less in the band, it has more below it.
    plain = max(reading, white_rounding(motion.resolution, dt))
    # times the reading's noise where the band begins; above it the force's noise shows
    most = max(force, 3.0 * plain * float(bend[band][0]))
    if force < most:  # by as much as the motor makes of its command
        made, asked = (np.mean(u**2) for u in (actual_force(axis, motion), motion.raw[1]))
        force = max(motion.command_noise * float(made / asked if asked else 1.0), numbers)
    more, scatter = _folded(motion, frequency[band], power[band], half[band], bend[band])
    # 2 bins that hold the slow motion; a dip leaves a quarter of what is folded, rounding a 20th
    if float((power / half)[2 : np.flatnonzero(band)[0]].min(initial=np.inf)) < 0.1 * more:
        more = scatter = 0.0
    return Noise(frequency, force, most, reading, bend, segment, max(more - force, 0.0), scatter)


# 16: more than a search asks by turns
@lru_cache(maxsize=16)
def _hung_gain(hung: AxisModel, period: float, lines: int, speed: float) -> Array:
    """Power (lines,) of the force that an acceleration of the axis takes, over that of its mass.

    At the frequencies of a transform of samples of ``period`` s. What hangs on the axis, or what
    this stands on, answers the noise of the readings as it does the motion: at its resonance with
    many times the force. By the answer to a jump to ``speed`` m/s, at which a play is crossed.
    """
    fine, long = 4, 16  # steps a sample; lines of a spectrum for each of these
    period = period / fine
    velocity = np.full(2 * (lines - 1) * fine * long, speed or 1.0)
    velocity[: fine * long] = 0.0
    table = on_blocks(hung)
    along = np.stack([np.cumsum(velocity) * period, velocity, np.zeros_like(velocity)])
    force, (first, last, *_) = np.zeros((1, len(velocity))), table.axes[0]
    walk_sets(
        table.entries, first, last, table.parameters[None], table.n_states, along,
        np.zeros_like(along), period, 0, force, table.masses[0], 0.0, table.remembers, velocity,
    )  # fmt: skip
    alone = np.fft.rfft(hung.mass * rate(velocity, period))
    taken = alone - np.fft.rfft(force[0])
    lowest = slice(0, (lines - 1) * long + 1)
    # 1e-300: no division by the zero at 0 Hz
    power = np.abs(taken[lowest]) ** 2 / np.maximum(np.abs(alone[lowest]) ** 2, 1e-300)
    means = np.add.reduceat(power[long // 2 :], np.arange(0, len(power) - long // 2, long)) / long
    return np.concatenate([power[:1], means])[:lines]


def _rounding_of(signal: Array, period: float) -> float:
    """Power, its unit^2/Hz, one-sided, of the rounding of a signal (n,) to the log's numbers."""
    return white_rounding(float(np.spacing(np.abs(signal).max())), period)


def _raw_residual(axis: AxisModel, motion: Motion) -> Array:
    """Force residual (n - 1,) N between the log's own samples.

    Noise in the command moves the axis as well; without the actuator's delay the two would not
    cancel and would look like measurement noise. The forces that the model explains, such as a bump
    passed at speed, are not noise either.
    """
    dt = motion.sample_period
    command = actual_force(axis, motion) + (motion.force - motion.raw[1])
    momentum = motion.momentum(axis.mass, motion.unrippled)
    raw = 0.5 * (command[1:] + command[:-1]) - between(momentum, dt)
    table = on_blocks(axis)
    if table.labels:
        samples = np.arange(1, motion.raw.shape[1]) * dt
        raw += np.interp(samples, motion.time, total_force(table, motion))
    return np.asarray(raw)


def _folded(
    motion: Motion, frequency: Array, power: Array, white: Array, bend: Array
) -> tuple[float, float]:
    """White power (N^2/Hz, one-sided) that thinning folded into a force residual; its rel. error.

    Zero where the residual's spectrum shows no dip. frequency (k,): Hz, of the band above the
    effects. power (k,): N^2/Hz, of the residual there. white, bend (k,): power gains of a white
    force and of a reading, N^2/m^2.
    """
    shapes = np.stack([white, bend, -np.sqrt(white * bend)], axis=1)
    level, reading, dip = map(float, fitted_levels(shapes, power))
    coherence = min(0.5 * dip / np.sqrt(level * reading), 1.0) if level * reading else 0.0
    coherent = 0.6  # least coherence: half of the samples left out make 0.71, chance less than 0.55
    if coherence < coherent:
        return 0.0, 0.0
    each = _near_nyquist(motion, float(frequency[1] - frequency[0]))
    folded = max(coherence**2, 0.5) * float(each.mean())  # half, where every other is left out
    shown = 0.25  # of the command's power near Nyquist, that the dip must show in the residual
    untold = 1e-3  # of what is folded, in the command beside what readings made of it; from 0.01
    if level <= shown * float(np.median(each)) or motion.command_noise <= untold * folded:
        return 0.0, 0.0
    return folded, float(each.std() / each.mean() / np.sqrt(max(len(each) / 2.0, 1.0)))


def _near_nyquist(motion: Motion, step: float) -> Array:
    """Power (pieces,) N^2/Hz of the command as logged near Nyquist, of frequencies a step apart.

    A command that was moved by a part of a sample was interpolated, which weakened what is fast.
    """
    dt, command = motion.sample_period, motion.raw[1]
    segment = min(max(round(1.0 / (step * dt)), 8), len(command))
    turns = np.fft.rfftfreq(segment)
    part = motion.ahead / dt % 1.0
    kept = np.abs(1.0 - part + part * np.exp(2j * np.pi * turns)) ** 2
    top = (turns > HALF) & (turns < BAND[2])
    pieces = pieces_of(command, segment)
    along = np.linspace(0.0, 1.0, segment)
    bent = pieces - pieces[:, :1] - along * (pieces[:, -1:] - pieces[:, :1])
    return np.asarray((densities(bent, dt)[:, top] / kept[top]).mean(axis=1))
