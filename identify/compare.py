"""How far model and measurement are apart, in numbers, and where: misfit by region."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.fit import rms
from identify.freerun import free_run, rms_error
from identify.noise import floor_of
from identify.residual import Windowed, moving, residual, sticks
from identify.spectrum import bands
from identify.structure import UNITS, gathered
from identify.study import Study
from identify.whiteness import ResidualTests, loop_of, residual_tests
from twin.effect import Kind
from twin.log import Log
from twin.model import AxisModel, StageModel

Array = NDArray[np.float64]

REGIONS = 24  # bins along a coordinate
ABOVE_FLOOR = 1.5  # error over noise floor from which a region counts as bad
LEAST_SHARE = 0.02  # part of the squared error, beyond that of the time, from which it is told
PITCH = 0.034  # m, of the rollers, where the model has no other


@dataclass(frozen=True, eq=False)
class MisfitMap:
    """Misfit along one coordinate: bin centres (n,), mean and RMS force error (n,) N.

    share (n,): part of the whole squared force error in each bin; visited (n,): part of the time,
    or by frequency of the squared force that is to be explained. floor (n,): RMS of what noise
    alone leaves in each bin, N. By frequency there is no mean.
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


@dataclass(frozen=True)
class Region:
    """A bad place: a bin of a coordinate with its error (N), ratio to floor and share of error."""

    coordinate: str
    unit: str
    low: float
    high: float
    rms: float
    ratio: float
    share: float

    def in_words(self) -> str:
        """E.g. "position between 12 and 26 mm: 0.12 N, 14 times the noise floor, ..."."""
        what = self.coordinate.replace("_", " ")
        span = f"{what} between {self.low:.4g} and {self.high:.4g} {self.unit}"
        if self.coordinate == "direction":
            span = "moving forwards" if self.low > -0.5 else "moving backwards"
        return (
            f"{span}: {self.rms:.3g} N RMS, {self.ratio:.1f} times the noise floor, "
            f"{100 * self.share:.0f} % of the squared error"
        )


@dataclass(frozen=True, eq=False)
class AxisComparison:
    """One axis over some logs.

    force_error: N RMS of the windowed residual, by log. floor: N. position_error: m RMS of the free
    run, by log. residual (n,) N, coordinates name -> (n,). maps, worst regions, residual tests.
    """

    axis: str
    force_error: Mapping[str, float]
    floor: float
    position_error: Mapping[str, float]
    position_floor: float
    residual: Array
    logs: Sequence[Windowed]
    coordinates: Mapping[str, Array]
    maps: Sequence[MisfitMap]
    worst: Sequence[Region]
    tests: ResidualTests

    @property
    def total_error(self) -> float:
        """RMS force error over all logs, N."""
        return rms(self.residual)

    @property
    def ratio(self) -> float:
        """Force error over the noise floor."""
        return self.total_error / self.floor


def compare_axis(
    model: StageModel, study: Study, logs: Mapping[str, Log], position_error: Mapping[str, float]
) -> AxisComparison:
    """Force errors of one axis over the study's fit logs, with maps of where they are."""
    axis = model.axes[study.axis]
    kept = moving(study.fit, sticks(axis))
    every = residual(axis, study.fit)
    floor = floor_of(axis, study.fit)
    where = gathered(study.fit)
    where["roller_phase"] = np.mod(where["position"], roller_pitch(axis))
    force, where = every[kept], {k: v[kept] for k, v in where.items()}
    maps = [misfit_map(name, force, values, floor) for name, values in where.items()]
    maps.append(misfit_by_frequency(axis, study.fit))
    noise = float(np.mean([w.motion.position_noise for w in study.fit]))
    return AxisComparison(
        axis=study.axis,
        force_error=_by_log(axis, study),
        floor=floor,
        position_error=position_error,
        position_floor=noise,
        residual=force,
        logs=study.fit,
        coordinates=where,
        maps=maps,
        worst=worst_regions(maps),
        tests=residual_tests(study.fit, every, kept, floor, loop_of(logs, study.axis)),
    )


def _by_log(axis: AxisModel, study: Study) -> dict[str, float]:
    return {w.motion.name: rms(residual(axis, [w])[moving([w], sticks(axis))]) for w in study.fit}


def position_errors(
    model: StageModel, logs: Mapping[str, Log], progress: Callable[[int, int], None]
) -> dict[str, dict[str, float]]:
    """Free-running position error, axis -> log name -> m RMS."""
    out: dict[str, dict[str, float]] = {a: {} for a in model.axes}
    for i, (name, log) in enumerate(logs.items()):
        progress(i, len(logs))
        run = free_run(model, log)
        for axis in model.axes:
            out[axis][name] = rms_error(run, axis)
    return out


def roller_pitch(axis: AxisModel) -> float:
    """The roller pitch of the model (m), or that of the Proton stage."""
    for f in axis.effects:
        if f.effect.kind is Kind.FORCE and "pitch" in f.values:
            return f.values["pitch"]
    return PITCH


def misfit_map(name: str, residual: Array, coordinate: Array, floor: float) -> MisfitMap:
    """Misfit of a residual (n,) N over bins of equal width of a coordinate (n,); floor in N."""
    if name == "direction":
        edges = np.array([-1.5, 0.0, 1.5])
    else:
        edges = np.linspace(coordinate.min(), coordinate.max() + 1e-15, REGIONS + 1)
    index = np.clip(np.searchsorted(edges, coordinate, side="right") - 1, 0, len(edges) - 2)
    bins = len(edges) - 1
    count = np.maximum(np.bincount(index, minlength=bins), 1)
    square = np.bincount(index, residual**2, bins)
    return MisfitMap(
        coordinate=name,
        unit="m" if name == "roller_phase" else UNITS[name],
        centre=0.5 * (edges[1:] + edges[:-1]),
        low=edges[:-1],
        high=edges[1:],
        mean=np.bincount(index, residual, bins) / count,
        rms=np.sqrt(square / count),
        share=square / max(square.sum(), np.finfo(float).tiny),
        visited=np.bincount(index, minlength=bins) / len(index),
        floor=np.full(bins, floor),
    )


def misfit_by_frequency(axis: AxisModel, logs: Sequence[Windowed]) -> MisfitMap:
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
    )


def worst_regions(maps: Sequence[MisfitMap], count: int = 3) -> list[Region]:
    """The regions with most error against the time spent there, one a coordinate.

    None where the error is at the noise floor.
    """
    found = []
    for m in maps:
        excess = np.where(m.rms > ABOVE_FLOOR * m.floor, m.share - m.visited, 0.0)
        i = int(np.argmax(excess))
        if excess[i] < LEAST_SHARE:
            continue
        found.append(
            (
                float(excess[i]),
                Region(
                    m.coordinate, m.unit, float(m.low[i]), float(m.high[i]), float(m.rms[i]),
                    float(m.rms[i] / m.floor[i]), float(m.share[i]),
                ),
            )
        )  # fmt: skip
    found.sort(key=lambda pair: -pair[0])
    return [region for _, region in found[:count]]
