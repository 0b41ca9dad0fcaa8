"""The step between an encoder's readings, from the distances between them."""

from __future__ import annotations

import numpy as np

from twin.signals import Array, cubic_through, usual_size

GAP = 8.0  # ratio of differences between readings that only a resolution leaves empty
WHOLE = 0.15  # of a step, RMS, by which such differences may miss whole steps
FEWEST = 0.01  # of the differences, that tell a step
STEPS = (1.0, 6.0)  # times the noise of readings, that a step which makes it may be; at speed 3.5
CLOSE = 1.005  # ratio of one step that is tried to the next
BINS = 64  # in the least step that is tried
MULTIPLES = 3  # of a step, up to which differences gather
GATHERED = 0.75  # mean cosine of differences in turns of a step; 0 where they do not gather
SECOND = 0.05  # of those differences, that gather about a second multiple; one may be a speed


def resolution_of(moved: Array) -> float:
    """Step (m) of readings that moved by so much (n,) m a sample; 0 where none shows.

    Of two steps, a fine one of the log's numbers and a coarse one of the encoder, the coarse
    counts. At speed differences gather about its multiples. In slow motion they are near 0 or near
    whole steps, with a wide gap between.
    """
    apart = np.sort(np.abs(moved))
    apart = apart[len(apart) // 100 :]
    fewest = round(FEWEST * len(apart))
    # The fourth difference of readings, as in twin.signals.white_noise.
    noise = usual_size(np.diff(moved, 3)) / 70**0.5 if len(moved) > MULTIPLES else 0.0
    if noise > 0.0 and (step := _gathering(apart, noise, fewest)):
        return step
    for held in (apart[apart > 0.0], np.maximum(apart, np.finfo(float).tiny)):
        if step := step_of(held, fewest):
            return step
    return 0.0


def step_of(apart: Array, fewest: int) -> float:
    """Step of which rising distances (n,) m are near whole multiples, or 0."""
    if len(apart) < 2 or fewest < 1:
        return 0.0
    widest = int(np.argmax(apart[1:] / apart[:-1]))
    step = apart[widest + 1]
    if step < GAP * apart[widest] or not fewest <= len(apart) - widest:
        return 0.0
    step, missed = _refined(apart[widest + 1 :], step)
    return step if missed < WHOLE else 0.0


def _refined(apart: Array, step: float) -> tuple[float, float]:
    """A step by more and more of its multiples, and by how much (1, RMS) they miss whole ones."""
    for reach in (1.5, 4.5, 16.5):
        near = apart[apart < reach * step]
        if not len(near):
            return step, 0.0
        counts = np.rint(near / step)
        step = float(near @ counts / (counts @ counts))
    return step, float(np.std(near / step - counts))


def _gathering(apart: Array, noise: float, fewest: int) -> float:
    """The largest step about whose first multiples rising distances (n,) m gather, or 0.

    By their characteristic function (B. Widrow, I. Kollar, Quantization Noise, 2008, chapter 4).
    Only a step that would make the noise (m rms) of the readings: equal speeds gather as well.
    """
    least, most = (ratio * noise for ratio in STEPS)
    width = least / BINS
    ends = np.searchsorted(apart, [0.5 * least, (MULTIPLES + 0.5) * most])
    counts = np.bincount((apart[slice(*ends)] / width).astype(int))
    middle = width * (np.arange(len(counts)) + 0.5)
    for step in np.geomspace(most, least, round(np.log(most / least) / np.log(CLOSE))):
        near = slice(*np.searchsorted(middle, [0.5 * step, (MULTIPLES + 0.5) * step]))
        number, turns = counts[near], middle[near] / step
        if number.sum() <= fewest or number @ np.cos(2.0 * np.pi * turns) < GATHERED * number.sum():
            continue
        each = np.bincount(np.rint(turns).astype(int), number, MULTIPLES + 1)[1:]
        if np.sort(each)[-2] > SECOND * number.sum():
            return _refined(apart[apart > 0.5 * step], float(step))[0]
    return 0.0


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
    times: Array = np.asarray(at + 0.5)
    middle: Array = 0.5 * (readings[at] + readings[at + 1])
    apart, back = np.diff(times), np.abs(np.diff(middle)) < 0.5 * step
    on = np.concatenate([[-1], np.flatnonzero(~back), [-1]])  # the last of a list where none is
    if len(on) == 2:
        return times, middle
    after = np.searchsorted(on[1:-1], np.arange(len(apart)))
    longest = np.append(apart, np.inf)
    nearest = np.minimum(longest[on[after]], longest[on[after + 1]])
    group = np.concatenate([[0], np.cumsum(~(back & (apart < nearest)))])
    count = np.bincount(group)
    return np.bincount(group, times) / count, np.bincount(group, middle) / count
