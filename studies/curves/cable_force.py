"""The force of the cable slab from passes in both directions at constant speed, spikes kept out.

Of what the axis feels, command - mass x acceleration, the part that is the same in both directions
is a force of position, the part that turns with direction is friction: L. Jia 2023, cable pass,
F_cable = -(F_pos + F_neg)/2. Local polynomials with Gaussian weights (the thesis smooths with a
Gaussian) go through it where no spike is. The smoothing is linear, so the scatter of the smoothed
pairs of passes gives the band of their mean.

A spike is a stretch in which the force of either direction stands out of its smooth part by several
times the noise. What is smooth is found without the spikes, and they without it, in turns; the
first time by a running median. Rollers are equally far apart, so the pitch is the slope of the
spikes' places over their numbers, with the standard error of that regression.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from identify.dataset.preparation import datasets
from identify.dataset.prepared_log import PreparedLog
from identify.estimation.force_balance import residual
from identify.estimation.intervals import CONFIDENCE_LEVEL
from studies.curves.velocity_map import only_axis
from twin.errors import InputError
from twin.logs import GivenLogs, logs_by_name
from twin.model.machine import AxisModel, MachineModel
from twin.signals import Array, stretches, usual_size

TEST_FUNCTION = 0.02  # s, short enough for spikes of a few millimetres at 0.1 m/s


@dataclass(frozen=True, eq=False)
class Passes:
    """position (k,) m; forwards, backwards (p, k) N: what drove the axis there on each pass."""

    position: Array
    forwards: Array
    backwards: Array

    @classmethod
    def of(cls, axis: AxisModel, logs: Sequence[PreparedLog]) -> Passes:
        """The passes of some logs, on the stretch that all of them cover.

        Raises InputError where there are not two in each direction, or nothing in common.
        """
        forwards, backwards = _each_way(axis, logs)
        count = min(len(forwards), len(backwards))
        if count < 2:
            raise InputError(
                f"the logs hold {len(forwards)} passes forwards and {len(backwards)} backwards at "
                "constant speed; the force of the cable needs two each way (`twin simulate "
                "cable_pass`)"
            )
        every = [*forwards, *backwards]
        low, high = max(x[0] for x, _ in every), min(x[-1] for x, _ in every)
        if high <= low:
            raise InputError(
                f"the {len(every)} passes at constant speed have no stretch of the track in "
                "common; give logs of passes over the same stretch (`twin simulate cable_pass`)"
            )
        unsettled = 0.03  # of the track at its ends, where friction still remembers the reversal
        cut = unsettled * (high - low)
        # positions: several in a spike of a few millimetres
        grid = np.linspace(low + cut, high - cut, 600)
        both = ([np.interp(grid, x, f) for x, f in way[:count]] for way in (forwards, backwards))
        return cls(grid, *map(np.stack, both))

    def part(self, positions: slice) -> Passes:
        """The same at some of the positions."""
        return Passes(
            self.position[positions], self.forwards[:, positions], self.backwards[:, positions]
        )

    @property
    def alike(self) -> Array:
        """(p, k) N, the force of position by pairs of passes: -(F_pos + F_neg)/2."""
        return -0.5 * (self.forwards + self.backwards)


def _each_way(axis: AxisModel, logs: Sequence[PreparedLog]) -> list[list[tuple[Array, Array]]]:
    """Position m and force N of the passes forwards, and of those backwards, by rising position.

    A pass is a run at the fastest constant speed of its log, nearly as long as the longest.
    """
    bare = replace(axis, effects=())
    ways: dict[float, list[tuple[Array, Array]]] = {1.0: [], -1.0: []}
    for log in logs:
        mean, force = log.test_function.mean, residual(bare, [log])
        position, velocity = mean(log.motion.position), mean(log.motion.velocity)
        speed = float(np.quantile(np.abs(velocity), 0.9))
        # of the pass speed, by which the speed may differ on a pass
        steady = np.abs(np.abs(velocity) - speed) < 0.05 * speed
        signed = np.where(steady, np.sign(velocity), 0.0)
        edges = [0, *(np.flatnonzero(np.diff(signed)) + 1), len(signed)]
        for first, last in pairwise(edges):
            if way := signed[first] * (last - first > 1):
                rising = slice(None, None, int(way))
                ways[way].append((position[first:last][rising], force[first:last][rising]))
    longest = {way: max((len(x) for x, _ in found), default=0) for way, found in ways.items()}
    shortest = 0.5  # of the longest pass, below which a stretch is no pass
    return [
        [(x, f) for x, f in found if len(x) > shortest * longest[way]]
        for way, found in ways.items()
    ]


def smoother(position: Array, kept: NDArray[np.bool_]) -> Array:
    """Matrix (k, k) from forces on the grid to their local polynomials, of what is kept."""
    smoothing = 0.02  # of the track, standard deviation of the Gaussian weights
    order = 2  # of the local polynomials
    r = (position - position[:, None]) / (smoothing * float(np.ptp(position)))
    weight = np.exp(-0.5 * r**2) * kept
    moments = np.stack([np.sum(weight * r**n, axis=1) for n in range(2 * order + 1)], axis=1)
    powers = np.arange(order + 1)
    normal = moments[:, powers[:, None] + powers]
    value = np.zeros((len(position), order + 1, 1))
    value[:, 0] = 1.0
    share = np.linalg.solve(normal, value)[..., 0]
    return np.asarray(weight * sum(share[:, [n]] * r**n for n in powers))


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
    edge = 3.0  # times the noise, down to which a spike reaches
    from scipy.ndimage import median_filter  # no fit needs it

    sides = np.stack([found.forwards.mean(axis=0), -found.backwards.mean(axis=0)])
    median = 0.1  # of the track, over which the running median goes: wider than two spikes
    samples = max(round(median * sides.shape[1]), 3)
    rises = sides - median_filter(sides, (1, samples), mode="nearest")
    for _ in range(6):  # of what is smooth and the spikes in turns; both have settled by then
        rises = sides - sides @ smoother(found.position, _size(rises) < edge).T
    size = _size(rises)
    spikes = []
    for first, last in stretches(size > edge):
        whole = first > 0 and last < len(size)  # a spike at the end is seen in part
        outstanding = 8.0  # times the noise: none of 600 values of noise is as large
        if whole and size[first:last].max() > outstanding:
            place, own = found.position[first:last], rises[:, first:last]
            centre = float(np.average(place, weights=np.abs(own).sum(axis=0)))
            tops = [float(rise[np.argmax(np.abs(rise))]) for rise in own]
            spikes.append(Spike(centre, float(np.ptp(place)), *tops))
    return tuple(spikes)


def _size(rises: Array) -> Array:
    """Rise (2, k) N of either direction in units of its noise, the larger of both (k,)."""
    noise = [max(usual_size(rise), np.finfo(float).tiny) for rise in rises]
    return np.max(np.abs(rises) / np.array(noise)[:, None], axis=0)


def pitch_of(spikes: tuple[Spike, ...]) -> Pitch | None:
    """The pitch of spikes that are equally far apart; None of fewer than three."""
    if len(spikes) < 3:  # spikes that tell a pitch
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


@dataclass(frozen=True, eq=False)
class CableForce:
    """What passes tell of the force of position.

    position (k,) m. force, band (k,) N: the cable's, and the half width of its 90 % band. with_all
    (k,) N: the same with the spikes left in. kept (k,): where no spike is. pitch: None where fewer
    than three spikes are found.
    """

    passes: Passes
    force: Array
    band: Array
    with_all: Array
    kept: NDArray[np.bool_]
    spikes: tuple[Spike, ...]
    pitch: Pitch | None

    @property
    def position(self) -> Array:
        """(k,) m."""
        return self.passes.position

    @classmethod
    def of(cls, found: Passes) -> CableForce:
        """The force that passes both ways have in common, without their spikes."""
        from scipy.special import stdtrit  # no fit needs it

        spikes = find_spikes(found)
        kept = np.ones(len(found.position), dtype=bool)
        for spike in spikes:
            margin = 0.25  # of a spike's width, that is kept out on either side of it
            kept &= np.abs(found.position - spike.centre) > (0.5 + margin) * spike.width
        ends = np.flatnonzero(kept)
        between = slice(ends[0], ends[-1] + 1)  # beyond a spike at the end nothing is known
        found, kept = found.part(between), kept[between]
        smoothed = found.alike @ smoother(found.position, kept).T
        count = len(smoothed)
        quantile = stdtrit(count - 1, 0.5 + CONFIDENCE_LEVEL / 2.0)
        return cls(
            passes=found,
            force=smoothed.mean(axis=0),
            band=quantile * smoothed.std(axis=0, ddof=1) / np.sqrt(count),
            with_all=smoother(found.position, np.ones_like(kept)) @ found.alike.mean(axis=0),
            kept=kept,
            spikes=spikes,
            pitch=pitch_of(spikes),
        )


def cable_force(
    model: MachineModel,
    logs: GivenLogs,
    *,
    axis: str | None = None,
    test_function: float = TEST_FUNCTION,
) -> CableForce:
    """The force of the cable slab, and the spikes of rollers, from passes in both directions.

    Only the mass of the model is used. test_function: s, the finest detail. Raises InputError where
    the logs hold fewer than two passes each way.
    """
    name, dataset = only_axis(datasets(model, logs_by_name(logs), {}, test_function), axis)
    return CableForce.of(Passes.of(model.axes[name], dataset.training))
