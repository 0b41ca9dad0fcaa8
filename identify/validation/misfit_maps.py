"""How large the error of a model is, and where: by coordinate, and by frequency in bands."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from identify.dataset.coordinates import gathered
from identify.dataset.dataset import Dataset, by_log
from identify.dataset.floor import noise_beside
from identify.dataset.noise_floor import Noise, noises_of
from identify.dataset.prepared_log import (
    PreparedLog,
    at_rest,
    moving,
    on_blocks,
    split_by_log,
    sticks,
    total_force,
)
from identify.dataset.spectrum import densities, pieces_of
from identify.estimation.evidence import effective_samples, rms
from identify.estimation.fit import Fit
from identify.estimation.force_balance import residual
from identify.estimation.residual_dependence import UNITS, unit_of
from identify.validation.free_run import FreeRun, drift_of_noise, free_run, rms_error
from identify.validation.whiteness import ResidualTests, loop_of, residual_tests
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.model.units import LINEAR, AxisUnits
from twin.parallel import spread
from twin.signals import Array

SHORTEST = 8  # blocks of the test functions used here, the fewest allowed
SEGMENT = 4.0  # s of each part of a log that is transformed
LEAST_PASSED = 0.2  # of the force's power that the test functions must pass
OCTAVE_PARTS = 2  # bands an octave


@dataclass(frozen=True, eq=False)
class Bands:
    """RMS force by frequency band: low, high (k,) Hz; error, noise and to_explain (k,) N.

    to_explain: command less inertia, the force that the effects must explain.
    """

    low: Array
    high: Array
    error: Array
    noise: Array
    to_explain: Array


def bands(axis: AxisModel, logs: Sequence[PreparedLog]) -> Bands:
    """RMS force error of the model by band over some logs, and that of the noise alone.

    The test functions are the shortest possible, and the spectrum is divided by their power
    response, up to the frequency at which they pass a fifth of the power. Where static friction is
    undetermined the error counts as zero.
    """
    noises = noises_of(axis, [log.motion for log in logs])
    spectra = [_spectrum(axis, log, noise) for log, noise in zip(logs, noises, strict=True)]
    weights = [log.motion.time[-1] for log in logs]
    frequency = min((s[0] for s in spectra), key=lambda f: f[-1])
    powers = [
        np.average([np.interp(frequency, s[0], s[i]) for s in spectra], axis=0, weights=weights)
        for i in (1, 2, 3)
    ]
    edges = _edges(frequency)
    width = frequency[1] - frequency[0]
    first = np.searchsorted(frequency, edges[:-1])
    stop = np.searchsorted(frequency, edges[-1])
    sums = [np.sqrt(np.add.reduceat(p[:stop], first) * width) for p in powers]
    return Bands(edges[:-1], edges[1:], *sums)


def _spectrum(axis: AxisModel, log: PreparedLog, noise: Noise) -> tuple[Array, Array, Array, Array]:
    """Of one log: frequencies Hz, power N^2/Hz of error, noise and what is to be explained."""
    motion = log.motion
    short = PreparedLog.of(motion, SHORTEST * motion.period)
    force = np.where(moving([short], sticks(axis)), residual(axis, [short]), 0.0)
    period = short.test_function.stride * motion.period
    segment = min(round(SEGMENT / period), len(force))
    both = np.stack([force, short.command - axis.mass * short.acceleration])
    pieces = pieces_of(both, segment)
    power = densities(pieces - pieces.mean(axis=-1, keepdims=True), period).mean(axis=1)
    frequency = np.asarray(np.fft.rfftfreq(segment, period), dtype=float)
    ratio = round(period / motion.sample_period)
    passed = short.test_function.response(motion.sample_period, segment * ratio)[: len(frequency)]
    passed_band = (passed > LEAST_PASSED) & (frequency > 0.0)
    frequency = frequency[passed_band]
    error, explain = power[:, passed_band] / passed[passed_band]
    return frequency, error, np.interp(frequency, noise.frequency, noise.power), explain


def _edges(frequency: Array) -> Array:
    """Edges (k + 1,) Hz of bands of part octaves, each with a frequency at least."""
    count = int(OCTAVE_PARTS * np.log2(frequency[-1] / frequency[0])) + 1
    top = frequency[-1] + 0.5 * (frequency[1] - frequency[0])
    edges = [top * 2.0 ** (-k / OCTAVE_PARTS) for k in range(count, -1, -1)]
    kept = [0.5 * frequency[0]]
    for edge in edges:
        if ((frequency >= kept[-1]) & (frequency < edge)).any():
            kept.append(edge)
    return np.array(kept)


REGIONS = 24  # bins along a coordinate
ABOVE_FLOOR = 1.5  # error over noise floor from which a region counts as bad
KNOWN_UNITS = {**UNITS, "command": LINEAR.force, "standstill": "1"}  # of a linear axis
# Coordinates with two values only: their edges.
TWO_SIDED = {"direction": np.array([-1.5, 0.0, 1.5]), "standstill": np.array([-0.5, 0.5, 1.5])}
CHANCE = 0.01  # probability that noise alone makes any region of all maps count as bad
LEAST_SHARE = 0.02  # least excess of a region's share of squared error over its share of time


@dataclass(frozen=True, eq=False)
class MisfitMap:
    """Misfit along one coordinate: bin centres (n,), mean and RMS force error (n,) in force_unit.

    share (n,): part of the whole squared force error in each bin; visited (n,): part of the time,
    or for frequency part of the squared force to be explained. floor (n,): noise floor of each bin,
    N RMS. For frequency the mean is not a number.
    """

    coordinate: str
    unit: str
    centre: Array
    low: Array
    high: Array
    mean: Array
    rms: Array
    share: Array
    visited: Array
    floor: Array
    force_unit: str = LINEAR.force


@dataclass(frozen=True)
class Region:
    """A bin of a coordinate with a large error: RMS, ratio to noise floor, share of squared error.

    rms: in ``force_unit``.
    """

    coordinate: str
    unit: str
    low: float
    high: float
    rms: float
    ratio: float
    share: float
    force_unit: str = LINEAR.force


@dataclass(frozen=True, eq=False, repr=False)
class AxisComparison:
    """One axis over some logs.

    force_error: N RMS of the force residual, by log. floor: N. position_error: m RMS of the free
    run, by log; position_floor: the same from measurement noise alone. residual (n,) N, coordinates
    name -> (n,). kept: which test functions of the logs in a row (all,) tell something, n of them.
    periods: lengths (m) at which effects of the model repeat along the track, by the coordinate
    that is the phase. curves: force (m,) N of each nonparametric effect along the motion of the
    logs in a row, by name.
    """

    axis: str
    force_error: Mapping[str, float]
    floor: float
    position_error: Mapping[str, float]
    position_floor: Mapping[str, float]
    residual: Array
    logs: Sequence[PreparedLog]
    coordinates: Mapping[str, Array]
    maps: Sequence[MisfitMap]
    worst: Sequence[Region]
    tests: ResidualTests
    kept: NDArray[np.bool_]
    periods: Mapping[str, float] = field(default_factory=dict)
    curves: Mapping[str, Array] = field(default_factory=dict)

    def __repr__(self) -> str:
        return f"<AxisComparison of {self.axis}: {self.total_error:.4g} N>"

    @property
    def units(self) -> AxisUnits:
        """The units of the axis."""
        return self.logs[0].motion.units

    @property
    def total_error(self) -> float:
        """RMS force error over all logs, N."""
        return rms(self.residual)

    @property
    def ratio(self) -> float:
        """Force error over the noise floor."""
        return self.total_error / self.floor


def compare_axis(
    model: MachineModel,
    dataset: Dataset,
    position_error: Mapping[str, float],
    position_floor: Mapping[str, float],
    floor: float | None = None,
) -> AxisComparison:
    """Force errors of one axis over the dataset's training logs, with maps of where they are.

    floor: noise floor, N RMS; as the model and what it leaves tell it where None.
    """
    axis = model.axes[dataset.axis]
    kept = moving(dataset.fit, sticks(axis))
    every = residual(axis, dataset.fit)
    force = every[kept]
    left = split_by_log(np.where(kept, every, 0.0), dataset.fit)
    if floor is None:
        floor = noise_beside(axis, dataset.fit, left).value
    where = {k: v[kept] for k, v in _coordinates(axis, dataset.fit).items()}
    maps = _maps(axis, dataset, floor, force, where)
    maps.append(misfit_by_frequency(axis, dataset.fit))
    return AxisComparison(
        axis=dataset.axis,
        force_error=_by_log(axis, dataset),
        floor=floor,
        position_error=position_error,
        position_floor=position_floor,
        residual=force,
        logs=dataset.fit,
        coordinates=where,
        maps=maps,
        worst=worst_regions(maps, effective_samples(force)),
        tests=residual_tests(dataset.fit, every, kept, floor, loop_of(dataset.fit)),
        kept=kept,
        periods={phase_name(name): period for name, period in periods(axis).items()},
        curves={
            f.effect.name: _along(f, dataset.fit) for f in axis.effects if f.effect.is_nonparametric
        },
    )


def _along(fitted: Fitted, logs: Sequence[PreparedLog]) -> Array:
    """The force (m,) N of an effect along the motion of logs in a row."""
    alone = AxisModel(1.0, effects=(fitted,), rotary=logs[0].motion.units.rotary)
    return np.concatenate([total_force(on_blocks(alone), log.motion) for log in logs])


def worst_region(fit: Fit, dataset: Dataset) -> Region | None:
    """Where the force error of a fit stands most above its noise floor; None where nowhere."""
    where = {k: v[fit.kept] for k, v in _coordinates(fit.axis, dataset.fit).items()}
    maps = _maps(fit.axis, dataset, fit.floor, fit.residual, where)
    return next(iter(worst_regions(maps, fit.samples)), None)


def _maps(
    axis: AxisModel, dataset: Dataset, floor: float, force: Array, where: Mapping[str, Array]
) -> list[MisfitMap]:
    """The misfit of a force (n,) N, with its noise floor in N, along each coordinate (n,)."""
    motion = dataset.fit[0].motion
    return [
        misfit_map(name, force, values, floor, unit_of(name, motion, KNOWN_UNITS), axis.units.force)
        for name, values in where.items()
    ]


def _coordinates(axis: AxisModel, logs: Sequence[PreparedLog]) -> dict[str, Array]:
    """Coordinates (n,) along which the error is shown: of the motion, and periods of the model."""
    where = gathered(logs)
    where["command"] = np.concatenate([log.command for log in logs])
    velocity = np.concatenate([log.test_function.mean(log.motion.velocity) for log in logs])
    where["standstill"] = at_rest(velocity).astype(float)
    for name, period in periods(axis).items():
        where[phase_name(name)] = np.mod(where["position"], period)
    return where


def _by_log(axis: AxisModel, dataset: Dataset) -> dict[str, float]:
    return {w.motion.name: rms(residual(axis, [w])[moving([w], sticks(axis))]) for w in dataset.fit}


def position_errors(
    model: MachineModel, found: Mapping[str, Dataset], progress: Callable[[int, int], None]
) -> tuple[dict[str, dict[str, float]], dict[str, dict[str, float]]]:
    """Free-running position error, and that of noise alone: axis -> log -> m RMS.

    There is none where the motion is imposed.
    """
    logs = {} if model.is_imposed else by_log(found)

    def run(parts: Mapping[str, PreparedLog]) -> tuple[FreeRun, FreeRun]:
        own = free_run(model, parts)
        return own, drift_of_noise(model, parts, own)

    errors: dict[str, dict[str, float]] = {a: {} for a in found}
    floors: dict[str, dict[str, float]] = {a: {} for a in found}
    for name, both in zip(logs, spread(run, logs.values(), progress), strict=True):
        for axis in logs[name]:
            errors[axis][name], floors[axis][name] = (rms_error(one, axis) for one in both)
    return errors, floors


def periods(axis: AxisModel) -> dict[str, float]:
    """Lengths (m) at which effects of the model repeat along the track, by effect."""
    return {
        f.effect.name: f.values[p.name]
        for f in axis.effects
        for p in f.effect.parameters
        if p.period
    }


def phase_name(effect: str) -> str:
    """Name of the coordinate that is the position within one period of an effect."""
    return f"{effect}_phase"


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
        edges = np.linspace(coordinate.min(), coordinate.max() + 1e-15, REGIONS + 1)
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
        rms=np.sqrt(square / count),
        share=square / max(square.sum(), np.finfo(float).tiny),
        visited=np.bincount(index, minlength=bins) / len(index),
        floor=np.full(bins, floor),
        force_unit=force_unit,
    )


def misfit_by_frequency(axis: AxisModel, logs: Sequence[PreparedLog]) -> MisfitMap:
    """Misfit of a model by frequency band, beside the noise's spectrum in the same bands."""
    found = bands(axis, logs)
    square = found.error**2
    return MisfitMap(
        coordinate="frequency",
        unit="Hz",
        centre=np.sqrt(found.low * found.high),
        low=found.low,
        high=found.high,
        mean=np.full(len(square), np.nan),
        rms=found.error,
        share=square / max(square.sum(), np.finfo(float).tiny),
        visited=found.to_explain**2 / max(np.sum(found.to_explain**2), np.finfo(float).tiny),
        floor=found.noise,
        force_unit=axis.units.force,
    )


def worst_regions(maps: Sequence[MisfitMap], samples: float, count: int = 3) -> list[Region]:
    """The regions whose share of the error most exceeds their share of time, one a coordinate.

    samples: effective sample size of the residual. A region counts only where it exceeds the noise
    floor by more than the largest of as many regions of pure noise would.
    """
    tried = sum(int(np.count_nonzero(m.visited)) for m in maps)
    found = []
    for m in maps:
        excess = np.where(m.rms > ABOVE_FLOOR * m.floor, m.share - m.visited, 0.0)
        if excess.max() < LEAST_SHARE:
            continue
        from scipy.special import chdtri  # where no region stands out, as in a fit, nothing asks

        values = np.maximum(samples * m.visited, 1.0)
        chance = np.sqrt(chdtri(values, CHANCE / max(tried, 1)) / values)
        excess[~(m.rms > chance * m.floor)] = 0.0
        i = int(np.argmax(excess))
        if excess[i] < LEAST_SHARE:
            continue
        found.append(
            (
                float(excess[i]),
                Region(
                    m.coordinate, m.unit, float(m.low[i]), float(m.high[i]), float(m.rms[i]),
                    float(m.rms[i] / m.floor[i]), float(m.share[i]), m.force_unit,
                ),
            )
        )  # fmt: skip
    found.sort(key=lambda pair: -pair[0])
    return [region for _, region in found[:count]]
