"""How large the error of a model is, and where: by coordinate, and by frequency in bands."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from identify.dataset.coordinates import gathered
from identify.dataset.dataset import Dataset
from identify.dataset.noise import Noise, noises_of
from identify.dataset.prepared_log import PreparedLog, at_rest, motor_gain, moving, sticks
from identify.dataset.spectrum import densities, pieces_of
from identify.estimation.fit import Fit
from identify.estimation.force_balance import unbalanced
from identify.estimation.residual_dependence import UNITS, unit_of
from twin.model.machine import AxisModel
from twin.model.units import LINEAR
from twin.record import Number, Values, record
from twin.signals import Array

ABOVE_FLOOR = 1.5  # error over noise floor from which a region counts as bad
LEAST_SHARE = 0.02  # least excess of a region's share of squared error over its share of time
TINY = np.finfo(float).tiny
KNOWN_UNITS = {**UNITS, "command": LINEAR.force, "standstill": "1"}  # of a linear axis
# Coordinates with two values only: their edges.
TWO_SIDED = {"direction": np.array([-1.5, 0.0, 1.5]), "standstill": np.array([-0.5, 0.5, 1.5])}


@record
class MisfitMap:
    """The force residual by bins (n,) of one coordinate."""

    coordinate: str
    unit: str
    centre: Values
    low: Values
    high: Values
    mean: Values
    """Of frequency bands not a number."""
    force_error: Values
    """RMS."""
    share: Values
    """Of the squared error."""
    visited: Values
    """Part of the time; of frequency bands that of the squared force to be explained."""
    noise_floor: Values
    force_unit: str = LINEAR.force


@record
class Region:
    """A bin of a coordinate with a large error."""

    coordinate: str
    coordinate_unit: str
    low: Number
    high: Number
    error: Number
    """RMS."""
    over_noise_floor: Number
    share_of_error: Number
    """Part of the squared error."""
    unit: str = LINEAR.force
    visited: Number = 0.0
    """Part of the time; of a frequency band that of the squared force."""


def worst_region(fit: Fit, dataset: Dataset) -> Region | None:
    """Where the force error of a fit stands most above its noise floor; None where nowhere."""
    where = {k: v[fit.kept] for k, v in coordinates(fit.axis, dataset.training).items()}
    maps = misfit_maps(fit.axis, dataset.training, fit.floor, fit.residual, where)
    return next(iter(worst_regions(maps, fit.samples)), None)


def coordinates(axis: AxisModel, logs: Sequence[PreparedLog]) -> dict[str, Array]:
    """Coordinates (n,) along which the error is shown: of the motion, and periods of the model."""
    where = gathered(logs)
    where["command"] = np.concatenate([log.command for log in logs])
    velocity = np.concatenate([log.test_function.mean(log.motion.velocity) for log in logs])
    where["standstill"] = at_rest(velocity).astype(float)
    for f in axis.effects:
        for p in (p for p in f.effect.parameters if p.period):
            where[f"{f.effect.name}_phase"] = np.mod(where["position"], f.values[p.name])
    return where


def misfit_maps(
    axis: AxisModel,
    logs: Sequence[PreparedLog],
    floor: float,
    force: Array,
    where: Mapping[str, Array],
) -> list[MisfitMap]:
    """The misfit of a force (n,) N, with its noise floor in N, along each coordinate (n,)."""
    motion = logs[0].motion
    units = {name: unit_of(name, motion, KNOWN_UNITS) for name in where}
    return [misfit_map(n, force, v, floor, units[n], axis.units.force) for n, v in where.items()]


def misfit_map(
    name: str,
    residual: Array,
    coordinate: Array,
    floor: float,
    unit: str | None = None,
    force_unit: str = LINEAR.force,
) -> MisfitMap:
    """Misfit of a residual (n,) N over bins of equal width of a coordinate (n,); floor in N.

    unit: of the coordinate, that on a linear axis where None.
    """
    if name in TWO_SIDED:
        edges = TWO_SIDED[name]
    else:
        regions = 24  # bins along a coordinate
        edges = np.linspace(coordinate.min(), coordinate.max() + 1e-15, regions + 1)
    index = np.clip(np.searchsorted(edges, coordinate, side="right") - 1, 0, len(edges) - 2)
    bins = len(edges) - 1
    count = np.maximum(np.bincount(index, minlength=bins), 1)
    square = np.bincount(index, residual**2, bins)
    return MisfitMap(
        coordinate=name,
        unit=unit or KNOWN_UNITS.get(name, LINEAR.position),
        centre=0.5 * (edges[1:] + edges[:-1]),
        low=edges[:-1],
        high=edges[1:],
        mean=np.bincount(index, residual, bins) / count,
        force_error=np.sqrt(square / count),
        share=square / max(square.sum(), TINY),
        visited=np.bincount(index, minlength=bins) / len(index),
        noise_floor=np.full(bins, floor),
        force_unit=force_unit,
    )


def misfit_by_frequency(axis: AxisModel, logs: Sequence[PreparedLog]) -> MisfitMap:
    """RMS force error of the model by frequency band over some logs, beside that of noise alone.

    The test functions are the shortest possible, and the spectrum is divided by their power
    response, up to the frequency at which they pass a fifth of the power. Where static friction is
    undetermined the error counts as zero.
    """
    noises = noises_of(axis, [log.motion for log in logs])
    spectra = [_spectrum(axis, log, noise) for log, noise in zip(logs, noises, strict=True)]
    weights = [log.motion.time[-1] for log in logs]
    frequency = min((s[0] for s in spectra), key=lambda f: f[-1])
    edges = _edges(frequency)
    width = frequency[1] - frequency[0]
    first, stop = np.searchsorted(frequency, edges[:-1]), np.searchsorted(frequency, edges[-1])
    error, noise, to_explain = (
        np.sqrt(np.add.reduceat(power[:stop], first) * width)
        for power in (
            np.average([np.interp(frequency, s[0], s[i]) for s in spectra], axis=0, weights=weights)
            for i in (1, 2, 3)
        )
    )
    gain = motor_gain(axis, logs)
    error, noise = error / gain, noise / gain
    return MisfitMap(
        coordinate="frequency",
        unit="Hz",
        centre=np.sqrt(edges[:-1] * edges[1:]),
        low=edges[:-1],
        high=edges[1:],
        mean=np.full(len(error), np.nan),
        force_error=error,
        share=error**2 / max(np.sum(error**2), TINY),
        visited=to_explain**2 / max(np.sum(to_explain**2), TINY),
        noise_floor=noise,
        force_unit=axis.units.force,
    )


def _spectrum(axis: AxisModel, log: PreparedLog, noise: Noise) -> tuple[Array, Array, Array, Array]:
    """Of one log: frequencies Hz, power N^2/Hz of error, noise and what is to be explained."""
    motion = log.motion
    shortest = 8  # blocks of the test functions of the spectrum, the fewest allowed
    short = PreparedLog.of(motion, shortest * motion.period)
    force = np.where(moving([short], sticks(axis)), unbalanced(axis, [short]), 0.0)
    period = short.test_function.stride * motion.period
    segment = min(round(4.0 / period), len(force))  # s of each part of a log that is transformed
    both = np.stack([force, short.command - axis.mass * short.acceleration])
    pieces = pieces_of(both, segment)
    power = densities(pieces - pieces.mean(axis=-1, keepdims=True), period).mean(axis=1)
    frequency = np.asarray(np.fft.rfftfreq(segment, period), dtype=float)
    ratio = round(period / motion.sample_period)
    passed = short.test_function.response(motion.sample_period, segment * ratio)[: len(frequency)]
    least_passed = 0.2  # of the force's power that the test functions must pass
    kept = (passed > least_passed) & (frequency > 0.0)
    frequency, (error, explain) = frequency[kept], power[:, kept] / passed[kept]
    return frequency, error, np.interp(frequency, noise.frequency, noise.power), explain


def _edges(frequency: Array) -> Array:
    """Edges (k + 1,) Hz of bands of part octaves, each with a frequency at least."""
    octave_parts = 2  # bands an octave
    count = int(octave_parts * np.log2(frequency[-1] / frequency[0])) + 1
    top = frequency[-1] + 0.5 * (frequency[1] - frequency[0])
    kept = [0.5 * frequency[0]]
    for edge in (top * 2.0 ** (-k / octave_parts) for k in range(count, -1, -1)):
        if ((frequency >= kept[-1]) & (frequency < edge)).any():
            kept.append(edge)
    return np.array(kept)


def worst_regions(maps: Sequence[MisfitMap], samples: float, count: int = 3) -> list[Region]:
    """The regions whose share of the error most exceeds their share of time, one a coordinate.

    samples: effective sample size of the residual. A region counts only where it exceeds the noise
    floor by more than the largest of as many regions of pure noise would.
    """
    tried = sum(int(np.count_nonzero(m.visited)) for m in maps)
    found = []
    for m in maps:
        excess = np.where(m.force_error > ABOVE_FLOOR * m.noise_floor, m.share - m.visited, 0.0)
        if excess.max() < LEAST_SHARE:
            continue
        from scipy.special import chdtri  # where no region stands out, as in a fit, nothing asks

        values = np.maximum(samples * m.visited, 1.0)
        # probability that noise alone makes any region of all maps count as bad
        chance = np.sqrt(chdtri(values, 0.01 / max(tried, 1)) / values)
        excess[~(m.force_error > chance * m.noise_floor)] = 0.0
        i = int(np.argmax(excess))
        low, high, error, floor, share, visited = (
            float(values[i])
            for values in (m.low, m.high, m.force_error, m.noise_floor, m.share, m.visited)
        )
        if excess[i] >= LEAST_SHARE:
            region = Region(
                m.coordinate, m.unit, low, high, error, error / floor, share, m.force_unit, visited
            )
            found.append((excess[i], region))
    found.sort(key=lambda pair: -pair[0])
    return [region for _, region in found[:count]]
