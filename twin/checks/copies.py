"""Whether a log is a copy of another: displaced, mirrored, thinned, rounded, cut, or all of that.

What is compared is not the motion, which a program repeats, but what differs from run to run (see
``same_samples``). Where a signal is another in each of two logs, these are two recordings, whatever
else agrees: a force that is commanded without feedback is the same in every run.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from math import ceil

import numpy as np

from twin.checks.same_samples import ALIKE, WINDOW, Pair, step_of, taps
from twin.logs.log import Log
from twin.signals import Array

COMPARED = ("position", "force", "current")  # fields of a log
LAGS = 1 << 16  # samples to which a log is averaged to find where another is in it
PLACES = 4  # of which each is tried: a motion that repeats has several
CHANCE = 30.0  # times the power of a correlation by chance: of 65536 lags, once in a hundred pairs
LEAST_PART = 8  # times as long may the shorter log be as what it shares with the other
WINDOWS, LEAST = 8, 128  # that are compared, evenly spaced; samples of one at least
CLOCK = 1e-3  # by which rates may differ that are one: they are told by clocks
AGREEING = 0.75  # of the windows: some samples of a copy may be mended

Key = tuple[str, str]  # axis, field


@dataclass(frozen=True)
class Copy:
    """A log that holds a stretch of the recording of another, or all of it.

    copy, original: their names. axis: on which it shows. mirrored, rounded: the fields whose sign
    is turned, and that have a coarser step. displaced: by how much the position is, in ``unit``.
    rate: Hz, where it is lower, else None. start, stop: s of the original. part: of the copy that
    it is, 0..1. whole: whether the original has no more.
    """

    copy: str
    original: str
    axis: str
    mirrored: tuple[str, ...]
    rounded: tuple[str, ...]
    displaced: float
    unit: str
    rate: float | None
    start: float
    stop: float
    part: float
    whole: bool

    @property
    def is_complete(self) -> bool:
        """Whether the copy holds nothing else."""
        return self.part > 0.9  # a few samples at its ends may be of its own

    def __str__(self) -> str:
        names = ((self.mirrored, "mirrored"), (self.rounded, "rounded"))
        ways = [f"{' and '.join(fields)} {how}" for fields, how in names if fields]
        if self.displaced:
            ways.append(f"displaced by {self.displaced:.4g} {self.unit}")
        if self.rate is not None:
            ways.append(f"thinned to {self.rate:.6g} Hz")
        if not self.whole:
            ways.append(f"its {self.start:.4g} to {self.stop:.4g} s")
        some = "" if self.is_complete else f"in {100.0 * self.part:.0f} % "
        return f"{some}a copy of {self.original}" + (f" ({', '.join(ways)})" if ways else "")


def copies(logs: Mapping[str, Log]) -> tuple[Copy, ...]:
    """The pairs of logs, given by name, that are one recording, or share a stretch of one.

    Of two that agree in everything the later is the copy. What is all of it a copy is compared with
    no others.
    """
    found: dict[str, Copy] = {}
    shared: list[Copy] = []
    for pair in combinations([ComparedLog(name, log) for name, log in logs.items()], 2):
        if any(recording.name in found for recording in pair):
            continue
        copy = _copy(*pair)
        if copy is not None and copy.is_complete:
            found[copy.copy] = copy
        elif copy is not None:
            shared.append(copy)
    return *found.values(), *shared


@dataclass(frozen=True, eq=False)
class ComparedLog:
    """A log with the signals that are compared."""

    name: str
    log: Log

    @cached_property
    def signals(self) -> dict[Key, Array]:
        """Position and command (n,) of each axis, where they are numbers."""
        out = {}
        for axis, own in self.log.axes.items():
            for field in COMPARED[: 2 if "force" in own.columns else 3]:
                values = own.columns.get(field)
                if values is not None and np.isfinite(values).all():
                    out[axis, field] = values
        return out

    @cached_property
    def steps(self) -> dict[Key, float]:
        """Step of the readings of each signal, 0 where none shows."""
        return {key: step_of(values) for key, values in self.signals.items()}


def _copy(first: ComparedLog, second: ComparedLog) -> Copy | None:
    """What two recordings share, if they are one."""
    a, b = _finer_first(first, second)
    every = a.log.sample_rate / b.log.sample_rate
    if abs(every - round(every)) < CLOCK * every:
        every = float(round(every))
    if min(len(a.log) / every, len(b.log)) < LEAST:
        return None
    for begin in _places(a, b, every):
        stretch = Stretch(a, b, every, begin)
        if stretch.agreeing:
            return stretch.copy
    return None


def _finer_first(first: ComparedLog, second: ComparedLog) -> tuple[ComparedLog, ComparedLog]:
    """Two recordings, that first of which the other may be a copy: by rate, steps, length."""
    rates = first.log.sample_rate, second.log.sample_rate
    if abs(rates[1] - rates[0]) > CLOCK * rates[0]:
        return (first, second) if rates[0] > rates[1] else (second, first)
    for key in sorted(
        first.signals.keys() & second.signals.keys(), key=lambda k: k[1], reverse=True
    ):
        if abs(first.steps[key] - second.steps[key]) > ALIKE * first.steps[key]:
            coarse = first.steps[key] > second.steps[key]
            return (second, first) if coarse else (first, second)
    return (first, second) if len(first.log) >= len(second.log) else (second, first)


# --- where one recording is in the other -----------------------------------------------------


def _places(a: ComparedLog, b: ComparedLog, every: float) -> Iterator[int]:
    """Numbers of the sample of a at which b may begin, the likeliest first.

    By the phases of their spectra, so that what is fast and weak counts as much as the motion.
    """
    fewer = max(1, ceil(max(len(a.log) / every, len(b.log)) / LAGS))
    power, length = np.zeros(1), 1
    for key in a.signals.keys() & b.signals.keys():
        long = np.diff(_averaged(a.signals[key], every * fewer), 2)
        short = np.diff(_averaged(b.signals[key], fewer), 2)
        size, length = 1 << (len(long) + len(short)).bit_length(), len(long)
        across = np.fft.rfft(long, size) * np.conj(np.fft.rfft(short, size))
        # 1e-14 of the largest power: less is what doubles leave of a number
        least = max(1e-14 * float(np.abs(across).max()), np.finfo(float).tiny)
        phase = across / np.maximum(np.abs(across), least)
        usual = max(float(np.mean(np.abs(phase) ** 2)), np.finfo(float).tiny) / size
        power = power + np.fft.irfft(phase, size) ** 2 / usual
    for _ in range(PLACES):
        best = int(np.argmax(power))
        if power[best] < CHANCE:
            return
        lag = best if best < length else best - len(power)
        yield _refined(a, b, every, round(lag * fewer * every), ceil(fewer * every) + 1)
        power[np.arange(best - 2, best + 3) % len(power)] = 0.0


def _averaged(signal: Array, over: float) -> Array:
    """Means of a signal over so many samples each; values at these where they are no whole ones."""
    if over != round(over):
        return np.interp(np.arange(0.0, len(signal) - 1, over), np.arange(len(signal)), signal)
    each = int(over)
    return signal[: len(signal) // each * each].reshape(-1, each).mean(axis=1)


def _refined(a: ComparedLog, b: ComparedLog, every: float, begin: int, reach: int) -> int:
    """The number within reach of which the signals differ least, up to sign and a constant."""
    shifts = np.arange(-reach, reach + 1)
    differ = np.zeros(len(shifts))
    about = Stretch(a, b, every, begin)
    for first, count in about.windows[:: max(1, len(about.windows) // 3)]:
        count = min(count, 256)
        at = begin + np.round(every * (first + np.arange(count))).astype(int)
        for key in about.keys:
            long = a.signals[key][np.clip(at + shifts[:, None], 0, len(a.log) - 1)]
            long = long - long.mean(axis=1, keepdims=True)
            short = b.signals[key][first : first + count]
            short = short - short.mean()
            power = np.mean(long**2, axis=1) + np.mean(short**2)
            alike = 2.0 * np.abs(long @ short) / count
            differ += (power - alike) / np.maximum(power, np.finfo(float).tiny)
    return begin + int(shifts[np.argmin(differ)])


@dataclass(frozen=True, eq=False)
class Stretch:
    """What two recordings would share if the samples of b, one for ``every`` of a, begin there."""

    a: ComparedLog
    b: ComparedLog
    every: float
    begin: int

    @cached_property
    def keys(self) -> list[Key]:
        """The signals that both have."""
        return [key for key in self.a.signals if key in self.b.signals]

    @cached_property
    def lead(self) -> int:
        """Samples of a before and behind a window that a filter reaches."""
        return max(taps(self.every, WINDOW), 2 * ceil(self.every)) + 2

    @cached_property
    def windows(self) -> list[tuple[int, int]]:
        """First sample of b, and number, of each window; none where too little is in both."""
        long, short = len(self.a.log), len(self.b.log)
        first = max(0, ceil((self.lead - self.begin) / self.every))
        last = min(short, int((long - self.lead - self.begin) / self.every))
        shared = last - first
        if shared < max(LEAST, min(short, long / self.every) / LEAST_PART):
            return []
        count = min(WINDOW, shared)
        number = min(WINDOWS, shared // count)
        return [(int(at), count) for at in np.linspace(first, last - count, number)]

    def pair(self, key: Key, window: tuple[int, int]) -> Pair:
        """A signal of both in a window."""
        first, count = window
        at = self.begin + self.every * first
        begin = int(at) - self.lead
        stop = int(at + self.every * (count - 1)) + self.lead + 2
        long, short = self.a.signals[key][begin:stop], self.b.signals[key][first : first + count]
        steps = self.a.steps[key], self.b.steps[key]
        return Pair(long, short, self.every, self.lead + at - int(at), steps)

    def agrees_in(self, window: tuple[int, int]) -> bool | None:
        """Whether all that moves is the same in a window; None where nothing moves."""
        moves = shows = False
        for axis in (axis for axis, field in self.keys if field == "position"):
            position = self.pair((axis, "position"), window)
            if not position.varies:  # at rest any two logs agree
                continue
            moves, same = True, not position.is_another_motion and position.agrees(True)
            if same is False:
                return False
            shows = shows or same is True
            random = position.noise[0] > 0.0  # so that the command of a controller is as well
            for key in (k for k in self.keys if k[0] == axis and k[1] != "position"):
                command = self.pair(key, window)
                same = command.agrees(random)
                if same is False:
                    return False
                # Without noise it may be commanded without feedback, and the same in every run.
                shows = shows or (same is True and random and command.noise[0] > 0.0)
        return shows if moves else None

    @cached_property
    def agreeing(self) -> list[tuple[int, int]]:
        """The windows in which they agree; none where in too many they do not."""
        yes: list[tuple[int, int]] = []
        no = 0
        for window in self.windows:
            told = self.agrees_in(window)
            yes += [window] if told else []
            no += told is False
            if no > (1.0 - AGREEING) * len(self.windows):
                return []
        return yes if len(yes) >= AGREEING * (len(yes) + no) else []

    @property
    def copy(self) -> Copy:
        """In which ways b is a copy of a."""
        pairs = {key: self.pair(key, self.agreeing[0]) for key in self.keys}
        turned = [key for key, pair in pairs.items() if pair.nearest.sign < 0.0]
        place = next(k for k in pairs if k[1] == "position" and np.ptp(pairs[k].short) > 0.0)
        moved, a, b = pairs[place], self.a.log, self.b.log
        apart = float(np.mean(moved.short - moved.nearest.sign * moved.sampled(0)))
        first, stop = max(0, self.begin), min(len(a), self.begin + self.every * len(b))
        return Copy(
            self.b.name,
            self.a.name,
            axis=place[0],
            mirrored=_fields(turned),
            rounded=_fields(k for k in pairs if self.b.steps[k] > (1.0 + ALIKE) * self.a.steps[k]),
            # 0.01 of the motion: less may be that of a sample, or of a filter's gain
            displaced=abs(apart) if abs(apart) > 0.01 * np.ptp(self.b.signals[place]) else 0.0,
            unit=a.axes[place[0]].kind.position,
            rate=b.sample_rate if self.every != 1.0 else None,
            start=first * a.period,
            stop=stop * a.period,
            part=min(1.0, (stop - first) / (self.every * len(b))),
            whole=stop - first > len(a) - 3.0 * self.every,
        )


def _fields(keys: Iterable[Key]) -> tuple[str, ...]:
    return tuple(dict.fromkeys(field for _, field in keys))
