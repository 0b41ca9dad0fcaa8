"""What repeats along the track in the readings themselves: an error of the reading, not its noise.

No axis moves by fourth differences at the log's own rate, so that these hold the noise of the
readings and their fast errors. An error that repeats along the track gives them a line over
position, at any speed: the fourth difference of a sine at speed v is the sine, times
(2 sin(pi v dt/period))^4, never of the other sign. A tone in time gives a line as well at constant
speed, but at no other; and so does the rounding of readings to a step, of step/pi at most.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from identify.dataset.resolution import resolution_of
from identify.dataset.spectral_lines import strongest_line
from identify.dataset.spectrum import Record
from twin.logs import Log
from twin.signals import Array, usual_size

ORDER = 4  # of the differences
FEWEST_CYCLES = 20  # over the travel
FINEST_CYCLES = 1 << 18  # over the travel
OF_A_STEP = 0.5  # cycles to a resolution step, beyond which readings repeat by themselves
LEAST = 0.01  # share of the differences' variance that a line takes; a weaker one makes no noise
MOST = 6  # lines
ENOUGH = 200_000  # readings
OUTLIER = 20.0  # times the usual size, to which larger differences are cut
SPEEDS = 10  # ranges of speed in which a line is looked for
SURE = 4.0  # times its noise, that a line must have in a range of speeds to be missed there


def ripples_of_widest(logs: Iterable[Log], axis: str) -> tuple[float, ...]:
    """Periods (m) at which the readings of an axis err, by the log with the longest travel.

    All logs are of one encoder. Empty where no log has the axis.
    """
    having = [log.axes[axis] for log in logs if axis in log.axes]
    widest = max(having, key=lambda signals: float(np.ptp(signals.position)), default=None)
    return () if widest is None else ripple_periods(widest.position)


def ripple_periods(readings: Array) -> tuple[float, ...]:
    """Periods (m) at which readings (n,) m err along the track, the strongest first."""
    readings = readings[:ENOUGH]
    step = resolution_of(np.diff(readings))
    place = readings[ORDER // 2 : len(readings) - ORDER // 2]
    bend = np.diff(readings, ORDER)
    usual = usual_size(bend)
    bend = np.clip(bend, -OUTLIER * usual, OUTLIER * usual)
    if not bend.any() or not (span := float(np.ptp(place))):
        return ()
    finest = min(FINEST_CYCLES / span, OF_A_STEP / step if step else np.inf)
    found: list[float] = []
    for _ in range(MOST):
        frequency, share = strongest_line(Record(place, bend), FEWEST_CYCLES / span, finest)
        if share < LEAST:
            break
        bends = np.diff(_waves(readings, 1.0 / frequency), ORDER, axis=0)
        gains = _gains(bends, bend)
        made = bends @ gains
        beyond_rounding = np.hypot(*gains) > step / np.pi
        if beyond_rounding and _at_every_speed(readings, bend, made, usual):
            found.append(1.0 / frequency)
        bend = bend - made
    return tuple(found)


def ripple(readings: Array, periods: tuple[float, ...]) -> Array:
    """The part (n,) m of readings (n,) m that repeats with these periods (m) along the track."""
    if not periods:
        return np.zeros(len(readings))
    some = readings[:ENOUGH]
    bends = np.hstack([np.diff(_waves(some, p), ORDER, axis=0) for p in periods])
    gains = _gains(bends, np.diff(some, ORDER)).reshape(-1, 2)
    return np.asarray(sum(_waves(readings, p) @ g for p, g in zip(periods, gains, strict=True)))


def _waves(readings: Array, period: float) -> Array:
    """Sine and cosine (n, 2) of a period (m) at readings (n,) m."""
    turn = 2.0 * np.pi * readings / period
    return np.stack([np.sin(turn), np.cos(turn)], axis=1)


def _gains(columns: Array, wanted: Array) -> Array:
    return np.asarray(np.linalg.lstsq(columns.T @ columns, columns.T @ wanted, rcond=1e-9)[0])


def _at_every_speed(readings: Array, bend: Array, made: Array, noise: float) -> bool:
    """Whether a ripple that fits all differences (n - 4,) m does so in most ranges of speed.

    made: (n - 4,) m, its part of them. noise: m, their usual size.
    """
    speed = np.abs(readings[ORDER:] - readings[:-ORDER])
    among = np.minimum((SPEEDS / speed.max() * speed).astype(int), SPEEDS - 1)
    power = np.bincount(among, made**2, SPEEDS)
    found = np.bincount(among, made * bend, SPEEDS)
    shown = power > (SURE * noise) ** 2
    return bool(shown.sum() > 1 and np.median(found[shown] / power[shown]) > 0.5)
