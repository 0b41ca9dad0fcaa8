"""Force spikes along the track: where they are, how high, and how far apart.

A spike is a stretch in which the force of either direction stands out of its smooth part by several
times the noise. What is smooth is found without the spikes, and they without it, in turns; the
first time by a running median. Rollers are equally far apart, so the pitch is the slope of the
spikes' places over their numbers, with the standard error of that regression.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.estimation.passes import Passes, smoother
from twin.signals import usual_size

Array = NDArray[np.float64]

MEDIAN = 0.1  # of the track, over which the running median goes: wider than two spikes
ROUNDS = 6
OUTSTANDING = 8.0  # times the noise
EDGE = 3.0  # times the noise, down to which a spike reaches
FEWEST = 3  # spikes that tell a pitch


@dataclass(frozen=True)
class Spike:
    """One spike: its centre and width in m, the braking force of its top by direction in N."""

    centre: float
    width: float
    ahead: float
    behind: float


@dataclass(frozen=True)
class Pitch:
    """Distance of neighbouring spikes and its standard error, m; phase: place of one of them."""

    value: float
    standard_error: float
    phase: float


def find_spikes(found: Passes) -> tuple[Spike, ...]:
    """The spikes on the track, from left to right."""
    sides = np.stack([found.forwards.mean(axis=0), -found.backwards.mean(axis=0)])
    rises = sides - _running_median(sides)
    for _ in range(ROUNDS):
        size = _size(rises)
        rises = sides - sides @ smoother(found.position, size < EDGE).T
    size = _size(rises)
    spikes = []
    edges = np.flatnonzero(np.diff(np.concatenate([[0], size > EDGE, [0]])))
    for first, last in edges.reshape(-1, 2):
        whole = first > 0 and last < len(size)  # a spike at the end is seen in part
        if whole and size[first:last].max() > OUTSTANDING:
            spikes.append(_spike(found.position, rises, slice(first, last)))
    return tuple(spikes)


def _running_median(sides: Array) -> Array:
    from scipy.ndimage import median_filter

    samples = max(round(MEDIAN * sides.shape[1]), 3)
    return np.asarray(median_filter(sides, (1, samples), mode="nearest"))


def _size(rises: Array) -> Array:
    """Rise (2, k) N of either direction in units of its noise, the larger of both (k,)."""
    noise = [max(usual_size(rise), np.finfo(float).tiny) for rise in rises]
    return np.max(np.abs(rises) / np.array(noise)[:, None], axis=0)


def _spike(position: Array, rises: Array, part: slice) -> Spike:
    weight = np.abs(rises[0][part]) + np.abs(rises[1][part])
    place = position[part]
    tops = [float(rise[part][np.argmax(np.abs(rise[part]))]) for rise in rises]
    centre = float(np.average(place, weights=weight))
    return Spike(centre, float(np.ptp(place)), tops[0], tops[1])


def pitch_of(spikes: tuple[Spike, ...]) -> Pitch | None:
    """The pitch of spikes that are equally far apart; None of fewer than three."""
    if len(spikes) < FEWEST:
        return None
    centres = np.array([s.centre for s in spikes])
    apart = np.diff(centres)
    step = float(np.median(apart))
    number = np.concatenate([[0.0], np.cumsum(np.maximum(np.rint(apart / step), 1.0))])
    rows = np.stack([number, np.ones_like(number)], axis=1)
    (value, phase), _, _, _ = np.linalg.lstsq(rows, centres, rcond=None)
    left = centres - rows @ (value, phase)
    spread = np.sqrt(float(left @ left) / (len(centres) - 2))
    error = spread / np.sqrt(float(np.sum((number - number.mean()) ** 2)))
    return Pitch(float(value), float(error), float(phase))
