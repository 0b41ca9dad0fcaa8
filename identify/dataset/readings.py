"""What the readings of an encoder hold beside the motion: steps, errors that repeat, noise.

No axis moves by fourth differences at the log's own rate, so that these hold the noise of the
readings and their fast errors. Rounding makes differences that are multiples of a step, at any
speed. An error that repeats along the track gives them a line over position, at any speed: the
fourth difference of a sine at speed v is the sine, times (2 sin(pi v dt/period))^4, never of the
other sign. A tone in time gives a line as well at constant speed, but at no other; and so does the
rounding of readings to a step, of step/pi at most.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from statistics import NormalDist, median_high

import numpy as np

from identify.dataset.spectrum import (
    MOST_LINES,
    ScatteredSignal,
    fitted_levels,
    median_spectrum,
    strongest_line,
)
from identify.dataset.test_function import LOOK, TestFunction
from identify.rules import RULE
from twin.logs import Log
from twin.signals import Array, between, cubic_through, usual_size, white_noise

FEWEST_CYCLES = 20  # over the travel, of an error of the reading
ENOUGH = 200_000  # samples, whose noise tells that of all
GATHERED = 0.5  # mean cosine of differences in turns of a step; 0 where they do not gather


def resolution_of(moved: Array) -> float:
    """Step (m) of readings that moved by so much (n,) m a sample; 0 where none shows.

    Of two steps, a fine one of the log's numbers and a coarse one of the encoder, the coarse
    counts. By the characteristic function of second differences (B. Widrow, I. Kollar, Quantization
    Noise, 2008, chapter 4), which comes back towards one at one cycle a step. Equal accelerations
    gather as well, but beyond the coarsest step that readings tell: where they change at few
    samples only, it is sqrt(7/(2 few)) times their noise.
    """
    fewest = 0.01  # of the samples, at which a reading must change to tell a step
    bins = 4096  # of differences, in the first three multiples of the coarsest step
    moved = moved[:ENOUGH]
    # 70: squared binomials of a fourth difference, summed; 3.5 = 7/2, as above
    noise = float(np.sqrt(np.mean(np.diff(moved, 3) ** 2) / 70.0)) if len(moved) > 3 else 0.0
    coarsest = noise * np.sqrt(3.5 / fewest)  # m
    apart = np.abs(np.diff(moved))
    # 3.5 steps hold three multiples and the half beyond
    near = apart[apart < 3.5 * coarsest]
    if len(near) <= fewest * len(apart):
        return 0.0
    width = 3.5 * coarsest / (bins - 1)  # m
    counts = np.bincount(np.rint(near / width).astype(int), minlength=bins)
    gathered = np.fft.rfft(counts, 8 * bins).real / len(near)
    cycles = np.asarray(np.fft.rfftfreq(8 * bins, width))[1:-1]
    dip = np.minimum.accumulate(gathered)
    back = (gathered - dip) / np.maximum(1.0 - dip, np.finfo(float).eps)
    tops = (back[1:-1] > back[:-2]) & (back[1:-1] >= back[2:]) & (back[1:-1] > GATHERED)
    tops &= cycles * coarsest > 1.0
    return _refined(np.abs(moved), 1.0 / float(cycles[np.argmax(tops)])) if tops.any() else 0.0


def _refined(apart: Array, step: float) -> float:
    """A step by more and more of its multiples among distances (n,) m; 0 where they are none."""
    # steps: of one multiple, of four, of sixteen, between which none is confused
    for reach in (1.5, 4.5, 16.5):
        near = apart[(apart > 0.5 * step) & (apart < reach * step)]
        if len(near):
            counts = np.rint(near / step)
            step = float(near @ counts / (counts @ counts))
    return step if not len(near) or np.cos(2.0 * np.pi * near / step).mean() > GATHERED else 0.0


def rounding(readings: Array, step: float) -> Array:
    """What rounding to a step (m) made of the position that readings (n,) m tell, (n,) m, about.

    Where a reading changes, the position was half way. Between such times it went by the cubic that
    has the slopes of the parabolas through three changes, within half a step of the reading. Zero
    before the first change and after the last; where every reading is another, nothing of it shows.
    """
    out = np.zeros(len(readings))
    times, middle = _passed(readings, step) if step else (out[:0], out[:0])
    if len(times) < 3:
        return out
    inside = np.arange(np.ceil(times[0]), times[-1], dtype=int)
    path = cubic_through(times, middle, inside)
    out[inside] = np.clip(readings[inside] - path, -0.5 * step, 0.5 * step)
    return out


def _passed(readings: Array, step: float) -> tuple[Array, Array]:
    """When (m,) samples readings (n,) m passed half way between two steps (m), and these (m,) m.

    A reading that turns back sooner than it passes the next step, before and after, turns by noise
    about one time, the mean.
    """
    at = np.flatnonzero(np.abs(np.diff(readings)) > 0.5 * step)
    times: Array = np.asarray(at + 0.5, float)
    middle: Array = 0.5 * (readings[at] + readings[at + 1])
    apart, back = np.diff(times), np.abs(np.diff(middle)) < 0.5 * step
    on = np.concatenate([[-1], np.flatnonzero(~back), [-1]])  # the last of a list where none is
    if len(on) == 2:
        return times, middle
    after = np.cumsum(np.append(0, ~back[:-1]))  # how many go on before each
    longest = np.append(apart, np.inf)
    nearest = np.minimum(longest[on[after]], longest[on[after + 1]])
    group = np.concatenate([[0], np.cumsum(~(back & (apart < nearest)))])
    count = np.bincount(group)
    return np.bincount(group, times) / count, np.bincount(group, middle) / count


def ripples_of_widest(logs: Iterable[Log], axis: str) -> tuple[float, ...]:
    """Periods (m) at which the readings of an axis err, by the log with the longest travel.

    All logs are of one encoder. Empty where no log has the axis.
    """
    having = [log.axes[axis] for log in logs if axis in log.axes]
    widest = max(having, key=lambda signals: float(np.ptp(signals.position)), default=None)
    return () if widest is None else ripple_periods(widest.position)


def noise_of_most(logs: Iterable[Log], axis: str) -> float:
    """White noise (m rms) that the readings of an axis exceed in less than half of the logs.

    All logs are of one encoder; where in one of them readings are held or lost, it seems to have
    more. inf where no log has the axis.
    """
    having = [log.axes[axis].position[:ENOUGH] for log in logs if axis in log.axes]
    return median_high(map(white_noise, having)) if having else np.inf


def ripple_periods(readings: Array) -> tuple[float, ...]:
    """Periods (m) at which readings (n,) m err along the track, the strongest first.

    Only errors larger than those of rounding, and slower than every second step, as readings
    repeat with their steps by themselves.
    """
    return _ripple_periods(np.asarray(readings[:ENOUGH], float).tobytes())


@lru_cache(maxsize=16)  # logs, which the commands of one process and its axes ask for again
def _ripple_periods(logged: bytes) -> tuple[float, ...]:
    # share of the differences' variance that a line takes; a weaker one makes no noise
    least = 0.01
    readings = np.frombuffer(logged)
    step = resolution_of(np.diff(readings))
    place, bend = readings[2:-2], np.diff(readings, 4)
    usual = usual_size(bend)
    outlier = 20.0  # times the usual size, to which larger differences are cut
    bend = np.clip(bend, -outlier * usual, outlier * usual)
    if not bend.any() or not (span := float(np.ptp(place))):
        return ()
    # Of more cycles than a few times the samples, some fit by chance.
    cycles = min(1 << 18, 16 * len(bend))  # over the travel
    finest = min(cycles / span, 0.5 / step if step else np.inf)
    found: list[float] = []
    for _ in range(MOST_LINES):
        frequency, share = strongest_line(
            ScatteredSignal(place, bend), FEWEST_CYCLES / span, finest, least
        )
        chance = np.log(cycles) + 0.5 * len(bend) * np.log1p(-min(share, 0.5))
        if share < least or chance > np.log(RULE.line_chance):
            break
        bends = np.diff(_waves(readings, 1.0 / frequency), 4, axis=0)
        gains = _gains(bends, bend)
        made = bends @ gains
        if np.hypot(*gains) > step / np.pi and _at_every_speed(readings, bend, made, usual):
            found.append(1.0 / frequency)
        bend = bend - made
    return tuple(found)


def ripple(readings: Array, periods: tuple[float, ...]) -> Array:
    """The part (n,) m of readings (n,) m that repeats with these periods (m) along the track."""
    if not periods:
        return np.zeros(len(readings))
    some = readings[:ENOUGH]
    bends = np.hstack([np.diff(_waves(some, p), 4, axis=0) for p in periods])
    gains = _gains(bends, np.diff(some, 4)).reshape(-1, 2)
    return np.asarray(sum(_waves(readings, p) @ g for p, g in zip(periods, gains, strict=True)))


def _waves(readings: Array, period: float) -> Array:
    """Sine and cosine (n, 2) of a period (m) at readings (n,) m."""
    turn = 2.0 * np.pi * readings / period
    return np.stack([np.sin(turn), np.cos(turn)], axis=1)


def _gains(columns: Array, wanted: Array) -> Array:
    return np.asarray(
        # 1e-9, below which a column is a combination of others
        np.linalg.lstsq(columns.T @ columns, columns.T @ wanted, rcond=1e-9)[0],
        float,
    )


def _at_every_speed(readings: Array, bend: Array, made: Array, noise: float) -> bool:
    """Whether a ripple that fits all differences (n - 4,) m does so in most ranges of speed.

    Of those in which it would be missed. made: (n - 4,) m, its part of the differences. noise: m,
    their usual size.
    """
    speeds = 10  # ranges of speed in which a line over the position is looked for
    speed = np.abs(readings[4:] - readings[:-4])
    among = np.minimum((speeds / speed.max() * speed).astype(int), speeds - 1)
    power = np.bincount(among, made**2, speeds)
    found = np.bincount(among, made * bend, speeds)
    sure = NormalDist().inv_cdf(1.0 - 0.5 * RULE.line_chance)
    shown = power > (sure * noise) ** 2
    return bool(shown.sum() > 1 and np.median(found[shown] / power[shown]) > 0.5)


def white_rounding(step: float, period: float) -> float:
    """One-sided power, m^2/Hz, of rounding to a step (m) at speed, by samples of a period (s)."""
    return step**2 / 12.0 * 2.0 * period


def together(position: Array, velocity: Array | None, period: float) -> tuple[Array, float]:
    """The position (n,) m that readings and a velocity (n,) m/s tell, and the velocity's weight.

    Both tell the same motion, so that their difference holds the noise of both and nothing else:
    white noise of the velocity, and that of the position, differenced. The position p that both
    make most likely minimises

        sum((p_k - x_k)^2) + w sum((p_{k+1} - p_k - u_k dt)^2)

    with the weight w (1) the variance of x over that of u dt. A velocity that is late, as filtered
    ones are, is moved back first. It has no weight where there is none, where it does not fit the
    position, or was computed from it.
    """
    if velocity is None or not np.isfinite(velocity).all():
        return position, 0.0
    rate, mean = between(position, period), 0.5 * (velocity[1:] + velocity[:-1])
    look = TestFunction.at_least(LOOK, period)
    columns = np.stack([look.mean(mean), look.acceleration(mean)], axis=1)
    gain, late = np.linalg.lstsq(columns, look.mean(rate), rcond=None)[0]
    alike = 0.02  # largest relative difference of a measured velocity from the rate of the position
    latest = 0.01  # s, that it may be late
    if abs(gain - 1.0) > alike or abs(late) > latest:
        return position, 0.0
    at = np.arange(len(mean), dtype=float)
    on_time = gain * np.interp(at + late / gain / period, at, mean)
    weight = _weight(rate - on_time, period, white_noise(position))
    return (_most_likely(position, on_time * period, weight) if weight else position), weight


def _weight(difference: Array, period: float, noise: float) -> float:
    """Variance of the position over that of the velocity's steps, from their difference m/s.

    0 where the difference does not show the position's own noise (m rms).
    """
    # 4096 samples of the spectra at most; long, as a quiet velocity shows at low frequencies
    segment = min(4096, len(difference) // 4)
    frequency, power = median_spectrum(
        difference, segment, period, np.zeros(len(difference), dtype=bool)
    )
    beside = np.cos(np.pi * frequency * period) ** 2  # two velocities are averaged
    shapes = np.stack([beside, rate_gain(frequency, period)], axis=1)
    white, differenced = map(float, fitted_levels(shapes[1:-1], power[1:-1]))
    shown = np.sqrt(differenced / (2.0 * period))
    return differenced / white / period**2 if white > 0.0 and shown > 0.5 * noise else 0.0


def _most_likely(position: Array, steps: Array, weight: float) -> Array:
    """Position (n,) m of least squares by readings (n,) m and steps (n - 1,) m."""
    from scipy.linalg import solveh_banded  # only logs with a velocity need it

    middle = np.full(len(position), 1.0 + 2.0 * weight)
    middle[[0, -1]] = 1.0 + weight
    beside = np.full(len(position), -weight)
    wanted = position - np.diff(weight * steps, prepend=0.0, append=0.0)
    return np.asarray(solveh_banded(np.stack([beside, middle]), wanted))


def rate_gain(frequency: Array, period: float) -> Array:
    """Power gain (k,) 1/s^2 from a signal to its difference over one period."""
    return np.asarray((2.0 - 2.0 * np.cos(2.0 * np.pi * frequency * period)) / period**2)


def part_left(weight: float, frequency: Array, period: float) -> Array:
    """Power (k,) of the position's noise over that of the readings; 1 without a velocity."""
    heard = weight * rate_gain(frequency, period) * period**2
    # A step has the mean of two velocities, whose noise is less by the squared cosine.
    beside = np.cos(np.pi * frequency * period) ** 2
    return np.asarray((1.0 + heard * beside) / (1.0 + heard) ** 2)
