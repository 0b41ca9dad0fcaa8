"""What the rounding of readings to an encoder's steps makes of a force residual.

Between the changes of a reading the axis goes by a smooth path through them, so that much of what
rounding did is told (``identify.dataset.resolution``). That a reading changed is known to a sample
only. This hides noise as white as the rounding of a fast motion, a twelfth of the squared step, but
less by the part of the samples at which the reading changes.

Over the position, rounding is a sawtooth. At a speed v its k-th harmonic, which has 6/(pi k)^2 of
its power, is a tone of k v/step, folded at the sample rate: a motion of even speed has its rounding
at no other frequency. By what a reading strays from an even motion, beyond its rounding, all that
is told and every tone becomes white: the k-th harmonic keeps exp(-(2 pi k)^2 s^2) of its power,
with s rms in steps (B. Widrow, I. Kollar, Quantization Noise, 2008, chapter 4).
"""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from identify.dataset.prepared_log import PreparedLog, moving
from identify.dataset.velocity import rate_gain
from twin.signals import Array, between, local_parabola

HARMONICS = 8  # that hold 93 % of the power; others are taken as white
WIDEST = 501  # samples that tell a speed to a 10^-4 of a step a sample; more would take time

_PARTS: WeakKeyDictionary[PreparedLog, dict[tuple[bool, int], tuple[float, float]]]
_PARTS = WeakKeyDictionary()


def white_rounding(step: float, period: float) -> float:
    """One-sided power, m^2/Hz, of rounding to a step (m) at speed, by samples of a period (s)."""
    return step**2 / 12.0 * 2.0 * period


def rounding_variance(log: PreparedLog, sticks: bool, segment: int, own: float) -> float:
    """Mean square, (m/s^2)^2, of what rounding adds to the accelerations of a log.

    sticks: whether the axis has static friction, so that test functions at rest tell nothing.
    segment: samples of the transform that tells what the test functions pass. own: variance, m^2,
    of the readings' white noise before they were rounded.
    """
    if log.motion.resolution == 0.0:
        return 0.0
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
    frequency: Array = np.asarray(np.fft.rfftfreq(segment, dt), dtype=float)
    gain = rate_gain(frequency, dt) ** 2 * log.test_function.response(dt, segment)
    white = motion.resolution**2 / 12.0 * 2.0 * dt * float(np.trapezoid(gain, frequency))
    still = np.abs(motion.raw[0]) * dt < 0.5 * motion.resolution
    told = log.fine.acceleration(between(motion.rounding, dt)) ** 2
    told -= white * log.fine.mean(still.astype(float))
    hidden = white + log.fine.mean(_tones(log, white, frequency, gain))
    counted = kept if kept.any() else ~kept
    return float(told[counted].mean()), float(hidden[counted].mean())


def _uneven(log: PreparedLog) -> tuple[Array, Array]:
    """By what readings stray from an even motion, squared steps, and its steps a sample: (n,)."""
    readings, step = log.motion.readings, log.motion.resolution
    width = (min(len(log.fine.weights), WIDEST) - 1) | 1
    path = local_parabola(readings, width)
    square = np.convolve(((readings - path) / step) ** 2, np.ones(width) / width, "same")
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
    for k in range(1, HARMONICS + 1):
        turns = k * steps
        tone = np.interp(np.abs(turns - np.rint(turns)) / log.motion.sample_period, frequency, gain)
        part = 6.0 / (np.pi * k) ** 2 * _kept(k, strayed) * (turns > 0.5)  # slower ones are told
        above += part * (log.motion.resolution**2 / 12.0 * tone - white)
    return above
