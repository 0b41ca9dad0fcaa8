"""Whether a signal has the same samples in two logs: whatever its sign, its place, its rounding.

Two runs of one program may agree in all but their noise, which no two runs have in common. So
whatever linear filter h is laid over a signal of one run, it differs from that of the other by the
noise that it passes, of power s^2 |h|^2, at least. A copy comes nearer.

That holds of noise that shows beyond the step of the readings. Where a coarse encoder hides it, a
good machine may repeat most readings from run to run, and with them what its controller makes of
them. There a copy is what agrees in every sample: every k-th one or the mean of k, of either sign,
to within its rounding.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from math import comb

import numpy as np

from twin.signals import Array, usual_size

Power = Callable[[Array], float]

DIGITS = 1e-7  # of the largest value: what text of eight digits leaves of a number
DOUBLE = 1e-12  # of the largest value: what a sum of doubles leaves of it
EXACT = 1e-3  # times the size of what is fast in a signal; a filter that is found leaves less
FEW = 20  # steps, or samples, that agree by chance: of as many as expected none is seen in e^20
ALIKE = 1e-3  # by which steps may differ that are one, as text rounds them
TAPS, MOST_TAPS = 10, 100  # of a filter to a side: samples of the thinner log, and of the other
WINDOW = 2048  # samples of a signal that are compared at once
OWN = 8  # samples to a side, which a filter of order 8 remembers: what decimation usually takes
SAMPLES_A_TAP = 8  # at least, or a filter could be found by chance


@dataclass(frozen=True)
class Nearest:
    """What is nearest to a thinner signal: samples of the other or means of them, times ``sign``.

    rest: (n,) what differs. mean: whether it is of means.
    """

    rest: Array
    sign: float
    mean: bool

    @property
    def left(self) -> float:
        """Between which values the differences lie."""
        return float(np.ptp(self.rest))


@dataclass(frozen=True, eq=False)
class Pair:
    """A window of a signal in two logs.

    long: samples of the log with the higher rate, from ``lead`` before to ``lead`` behind. short:
    (n,) samples of the other log, one for ``every`` of these. steps: of the readings of each, 0
    where none shows.
    """

    long: Array
    short: Array
    every: float
    lead: float
    steps: tuple[float, float]

    @cached_property
    def noise(self) -> tuple[float, float]:
        """Power of the noise in each signal that shows beyond the step of its readings, or 0."""
        long, short = map(_beyond, (self.long, self.short), self.steps)
        return long, short

    @property
    def varies(self) -> bool:
        """Whether the short signal does, by so many steps that chance repeats them in no other."""
        changes = np.count_nonzero(np.diff(self.short))
        return bool(changes >= FEW and np.ptp(self.short) >= FEW * self.steps[1])

    @property
    def size(self) -> float:
        """The largest value."""
        return float(max(np.abs(self.long).max(), np.abs(self.short).max()))

    def sampled(self, shift: int) -> Array:
        """The long signal (n,) at the samples of the short one, or so many samples later."""
        at = self.lead + shift + self.every * np.arange(len(self.short))
        first = np.floor(at).astype(int)
        part = at - first
        return (1.0 - part) * self.long[first] + part * self.long[first + np.ceil(part).astype(int)]

    @cached_property
    def nearest(self) -> Nearest:
        """The nearest to the short signal among samples and means, up to a constant."""
        each, n = round(self.every), len(self.short)
        sums = np.concatenate([[0.0], np.cumsum(self.long - self.long.mean())])
        tried = [(self.sampled(shift), False) for shift in range(-each, each + 1)]
        if each == self.every > 1.0:
            for first in range(int(self.lead) - 2 * each, int(self.lead) + each):
                edges = sums[first : first + each * (n + 1) : each]
                tried.append(((edges[1:] - edges[:-1]) / each, True))
        return min(
            (
                Nearest(self.short - sign * values, sign, mean)
                for values, mean in tried
                for sign in (1.0, -1.0)
            ),
            key=lambda found: found.left,
        )

    @property
    def is_another_motion(self) -> bool:
        """Whether positions part by more than a filter or noise does, which is told at once."""
        apart, most = float(np.var(self.nearest.rest)), 0.25 * float(np.var(self.short))
        # a half, and ten times the noise, RMS; noise is in all that changes between samples
        if apart <= most:
            return False
        sure = apart > 50.0 * max(_changes(self.long), _changes(self.short))
        return sure or apart > 100.0 * max(self.noise)

    @property
    def grid(self) -> float:
        """The step of a rounding by which a copy may be off: none where the readings are its own.

        Means of k readings are a k-th of their step apart.
        """
        long, short = self.steps
        own = long / self.every if self.nearest.mean else long
        if abs(short - own) <= ALIKE * own:
            return 0.0
        return short if self.nearest.mean else max(long, short)

    @property
    def columns(self) -> list[Array]:
        """The long signal (n,) at the samples of the short one and about them."""
        reach = taps(self.every, len(self.short))
        return [self.sampled(shift) for shift in range(-reach, reach + 1)]

    def filtered(self, power: Power) -> tuple[float, float]:
        """Power that the best filter of the long signal leaves of the short one; of noise in it.

        A filter that remembers its output is one of the samples beside each as well. Of the noise
        that it passes the least by two measures: one holds of white noise, one of a smooth motion.
        """
        known = np.column_stack([column[OWN:-OWN] for column in self.columns])
        both = np.column_stack([known, beside(self.short)])
        rest, weights = rest_of(self.short[OWN:-OWN], both)
        weights = weights[: known.shape[1]]
        white = noise_power(self.long, power) * float(weights @ weights)
        return mean_square(rest), min(noise_power(known @ weights, power), white)

    @property
    def is_rounded(self) -> bool:
        """Whether the signals differ by a rounding to the step of one of them.

        While it changes, it leaves differences of any size up to its step, where two runs with a
        step in common have the same readings or others.
        """
        left, rest = self.nearest.left, self.nearest.rest
        moving = np.abs(np.diff(self.short - rest)) > DOUBLE * self.size
        inner = np.abs(rest - 0.5 * (rest.max() + rest.min()))[1:] < 0.25 * left
        within = left <= 1.001 * self.grid + 2.0 * DOUBLE * self.size
        return within and bool(4 * np.sum(inner & moving) > np.sum(moving))

    @property
    def digits(self) -> float:
        """What text leaves of their values, or less where a step of the readings would hide."""
        digits = 2.0 * DIGITS * self.size
        coarse = self.steps[0] > 0.0 and not any(self.noise)
        return min(digits, 0.1 * self.steps[0]) if coarse else digits

    def agrees(self, random: bool) -> bool | None:
        """Whether the samples are the same; None where a rounding hides what could tell.

        random: whether noise that shows is known to be another in each run.
        """
        if self.nearest.left <= DOUBLE * self.size:
            return True
        if not self.varies:
            return None
        noise = max(self.noise) ** 0.5 if random else 0.0
        if self.is_rounded:  # of so many readings the noise of two runs would carry beyond it
            return True if not noise or len(self.short) * noise > FEW * self.grid else None
        if self.nearest.left <= self.digits:
            return True if not noise or noise > self.digits else None
        digits = (DIGITS * self.size) ** 2
        if random and self.noise[0]:
            rest, passed = self.filtered(usual_power)
            same = rest < 0.5 * passed  # of two runs all of it is left, and noise of the other
        else:
            rest, passed = self.filtered(mean_square)
            same = rest < EXACT**2 * passed and noise_power(self.long, mean_square) > digits
        if same:
            return True
        hidden = max(self.grid**2 / 12.0, 0.0 if any(self.noise) else digits)
        follows = hidden > max(self.noise) and rest < 1.5 * hidden and self.follows(1.5 * hidden)
        return None if follows else False

    def follows(self, most: float) -> bool:
        """Whether a filter of the long signal alone leaves less power of the short one."""
        return mean_square(rest_of(self.short, np.column_stack(self.columns))[0]) < most


def taps(every: float, samples: int) -> int:
    """To how many samples of the log with the higher rate a filter may reach, to each side."""
    return max(1, min(round(TAPS * every), MOST_TAPS, samples // (2 * SAMPLES_A_TAP) - OWN))


def beside(signal: Array) -> Array:
    """The samples beside each of a signal (n,), but for its ends, (n - 2 OWN, 2 OWN)."""
    shifts = [k for k in range(2 * OWN + 1) if k != OWN]
    return np.column_stack([signal[k : k + len(signal) - 2 * OWN] for k in shifts])


def rest_of(wanted: Array, known: Array) -> tuple[Array, Array]:
    """What known signals (n, k) leave of one (n,), up to a constant; and their weights (k,).

    As large as it is where the weights were not fitted to it.
    """
    known = known - known.mean(axis=0)
    wanted = wanted - wanted.mean()
    basis, triangle = np.linalg.qr(known)
    weights = np.linalg.lstsq(triangle, basis.T @ wanted, rcond=DOUBLE)[0]
    fitted = (len(weights) + 1) / len(wanted)
    return (wanted - known @ weights) / (1.0 - fitted) ** 0.5, np.asarray(weights, float)


def mean_square(values: Array) -> float:
    """Power of values (n,)."""
    return float(np.mean(values**2))


def usual_power(values: Array) -> float:
    """Power of noise (n,) beside which something else is fast now and then, such as a reversal."""
    return usual_size(values) ** 2


def noise_power(signal: Array, power: Power) -> float:
    """Power of what is white in a signal (n,), at most: neither differences nor neighbours tell it.

    Of differences by the order with the least, as a motion is smooth.
    """
    part = signal[: 2 * WINDOW]
    rest, _ = rest_of(part[OWN:-OWN], beside(part))
    differing = (power(np.diff(part, k)) / comb(2 * k, k) for k in range(2, 7))
    return min(*differing, power(rest))


def _changes(signal: Array) -> float:
    """Power of what changes from sample to sample: twice that of white noise, and the motion's."""
    return float(np.var(np.diff(signal)))


def _beyond(signal: Array, step: float) -> float:
    """Power of the noise of a signal (n,) beyond its rounding to a step; 0 where none shows."""
    power = noise_power(signal, usual_power)
    more = power - 1.5 * step**2 / 12.0  # rounding is white in the mean; less so at some speeds
    shown = 0.25  # of all that is fast
    return more if more > shown * power and power > (DOUBLE * np.abs(signal).max()) ** 2 else 0.0


def step_of(readings: Array) -> float:
    """Step of readings (n,), of which all their changes are multiples; 0 where none shows."""
    if len(readings) > 1 << 17:  # of which as many tell it, from all over the log
        starts = np.linspace(0, len(readings) - WINDOW, 64).astype(int)
        readings = np.concatenate([readings[at : at + WINDOW] for at in starts])
    least = DOUBLE * float(np.abs(readings).max(initial=0.0))
    changes = np.concatenate([np.abs(np.diff(readings, k)) for k in (1, 2)])
    changes = changes[changes > least]
    if len(changes) < 8:  # by chance a few are multiples of the least
        return 0.0
    step = float(changes.min())
    near = changes[changes < 200.0 * step]  # beyond, its error adds up
    multiples = np.round(near / step)
    off = np.abs(near - multiples * step) > 0.02 * step + least
    rests = bool(np.any(np.diff(readings) == 0.0))
    # 0.05 of the changes: of noise, far fewer are so near the least one
    told = len(near) >= 0.05 * len(changes) and (rests or multiples.max() > 1.0)
    return step if told and off.mean() < 1e-3 else 0.0
