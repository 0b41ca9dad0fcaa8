"""Chapter "track": friction at nine places between the rollers, each direction apart.

Moves of 10 mm at the thesis's speeds, recorded at 1 kHz, are read in two ways. The thesis's: a map
of the last half of each move, and a curve through it. Ours: the whole law fitted to the logs of the
place, so that bristles which have not settled after 5 mm cost nothing. The cable's force is taken
off with the model, which knows it from passes (chapter "cable"). What is planted at a place is the
friction that the machine's laws reach when they go on at that place. The machine is stepped ten
times finer than the logs' samples of 1 ms: stepped as coarsely as those, its friction follows the
speed late, and the ramps of short moves make that 1e-4 N of Coulomb friction.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import datasets
from identify.dataset.motion import motion_of
from identify.estimation.curve_band import with_band
from identify.estimation.fit import Fit, fit_axis
from identify.estimation.map_curve import NAMES, stribeck_through
from identify.estimation.prescribed_motion import steady_friction
from identify.estimation.stribeck_curve import fit_stribeck
from identify.estimation.velocity_map import VelocityMap, velocity_map
from identify.thesis.chapter import Chapter
from identify.thesis.maps_of_logs import track_of_logs
from twin.effect import Kind
from twin.effects import Catalogue
from twin.experiments.kinds import Staircase
from twin.experiments.named import simulate
from twin.log import Log
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.progress import Progress
from twin.simulator import FineSimulator

Array = NDArray[np.float64]

SPAN = 0.01  # m
FIRST, APART = -0.136, 34e-3  # m, of the thesis's places
DIRECTIONS = (1.0, -1.0)
BRISK = 0.004  # m/s, above which moves are so short that they are repeated
FASTEST = 0.3  # of the velocity limit, which a move of 10 mm reaches and holds


@dataclass(frozen=True)
class Size:
    """speeds: m/s; those that a move does not hold are left out. repeats: of the brisk ones."""

    places: int
    speeds: Sequence[float]
    repeats: int


SPEEDS = (
    *(k / 1e4 for k in range(1, 10)), *(k / 1e3 for k in range(1, 15)),
    *(k / 1e3 for k in range(15, 250, 10)),
)  # fmt: skip
FULL = Size(9, SPEEDS, 6)
SMALL = Size(2, (0.002, 0.004, 0.006, 0.01, 0.02, 0.06), 2)


@dataclass(frozen=True, eq=False)
class Along:
    """One parameter in one direction at the places: found, half width (90 %), planted (k,)."""

    found: Array
    half: Array
    planted: Array
    unit: str

    @property
    def within(self) -> float:
        """Share of places whose interval holds what was planted."""
        return float(np.mean(np.abs(self.found - self.planted) <= self.half))

    @property
    def largest_error(self) -> float:
        """Over the planted value."""
        return float(np.abs(self.found / self.planted - 1.0).max())


@dataclass(frozen=True, eq=False)
class TrackResult:
    """The chapter's results. places (k,) m.

    maps, fits: by the thesis's way and by ours, direction (+1 or -1) -> parameters by name.
    """

    places: Array
    maps: Mapping[float, Mapping[str, Along]]
    fits: Mapping[float, Mapping[str, Along]]


Found = tuple[Array, Array]  # parameters (4,), half widths (4,) of their 90 % intervals


def run(
    models: Sequence[MachineModel],
    catalogue: Catalogue,
    size: Size,
    rng: np.random.Generator,
    progress: Progress,
) -> TrackResult:
    """Measure the friction of the first axis of a machine at each place, in both ways."""
    (model,) = models
    name, axis = next(iter(model.axes.items()))
    apart = 9 // size.places
    places = np.array([FIRST + APART * apart * i for i in range(size.places)])
    maps: dict[float, list[Found]] = {way: [] for way in DIRECTIONS}
    fits: dict[float, list[Found]] = {way: [] for way in DIRECTIONS}
    planted: dict[float, list[Array]] = {way: [] for way in DIRECTIONS}
    for i, place in enumerate(places):
        progress("friction along the track", i, len(places))
        logs = _logs(model, name, float(place), size, rng)
        # Simulated readings have no ripple that would have to be sought.
        motions = [motion_of(log, name, label, ripples=()) for label, log in logs.items()]
        found = VelocityMap.joined([velocity_map(axis, motion) for motion in motions])
        speeds = np.array(sorted({round(float(abs(v)), 6) for v in found.velocity}))
        local = _local_fit(model, name, logs, found)
        for way in DIRECTIONS:
            maps[way].append(_through(found.towards(way)))
            fits[way].append(_of_law(local, float(place), way * speeds))
            planted[way].append(_curve(axis, float(place), way * speeds))
    return TrackResult(
        places,
        {way: _along(axis, maps[way], planted[way]) for way in DIRECTIONS},
        {way: _along(axis, fits[way], planted[way]) for way in DIRECTIONS},
    )


def _along(axis: AxisModel, found: Sequence[Found], planted: Sequence[Array]) -> dict[str, Along]:
    units = {p.name: p.unit for f in axis.effects for p in f.effect.parameters}
    return {
        name: Along(
            np.array([values[j] for values, _ in found]),
            np.array([half[j] for _, half in found]),
            np.array([values[j] for values in planted]),
            units[name],
        )
        for j, name in enumerate(NAMES)
    }


def _logs(
    model: MachineModel, name: str, place: float, size: Size, rng: np.random.Generator
) -> dict[str, Log]:
    """A log of moves at each speed, to and fro."""
    logs = {}
    fastest = FASTEST * model.axes[name].hardware.velocity
    for speed in (s for s in size.speeds if s <= fastest):
        count = size.repeats if speed > BRISK else 1
        moves = Staircase(
            name, speeds=(speed,) * count, span=SPAN, longest_plateau=1e4, at=(place,)
        )
        seed = int(rng.integers(2**31))
        logs[f"{speed:g} m/s"] = simulate(model, moves, seed=seed, simulator=FineSimulator)
    return logs


def _through(one_way: VelocityMap) -> Found:
    """The curve through a map."""
    found = stribeck_through(one_way)
    return np.array([found.values[n] for n in NAMES]), np.array([found.half[n] for n in NAMES])


def _local_fit(model: MachineModel, name: str, logs: Mapping[str, Log], found: VelocityMap) -> Fit:
    """Friction and its modifiers fitted to the logs of one place, from the curve through its map.

    Of what varies along the track the first term alone is free: over one place it is a slope.
    """
    axis, prepared = model.axes[name], datasets(model, logs, {})[name]
    start = dict(
        zip(NAMES, _through(replace(found, velocity=np.abs(found.velocity)))[0], strict=True)
    )
    effects = []
    for f in axis.effects:
        if f.effect.kind is Kind.FRICTION:
            known = {p.name: float(start[p.name]) for p in f.effect.parameters if p.name in start}
            begun = Fitted.at_start(f.effect, {**f.effect.starts(), **known})
            effects.append(replace(begun, fixed=f.fixed))
        elif f.effect.kind is Kind.MODIFIER:
            begun = Fitted.at_start(f.effect, f.effect.starts(prepared.excitation))
            rest = {p.name for p in f.effect.strengths[1:]} if f.effect.reads("X") else set()
            effects.append(replace(begun, fixed=begun.fixed | rest))
        elif not any(p.period for p in f.effect.parameters):
            effects.append(replace(f, fixed=frozenset(f.values)))
    axis = replace(axis, effects=tuple(effects), mass_fixed=True)
    return fit_axis(axis, prepared.fit)


def _of_law(fit: Fit, place: float, velocity: Array) -> Found:
    """The curve of a fitted law in one direction, at these velocities (k,) m/s."""
    return with_band(fit, lambda axis: _curve(axis, place, velocity), fit.scaling.where)


def _curve(axis: AxisModel, place: float, velocity: Array) -> Array:
    """Parameters (4,) of the curve through the friction that an axis reaches at one place."""
    friction = np.array([steady_friction(axis, place, float(v)) for v in velocity])
    return np.array(astuple(fit_stribeck(np.abs(velocity), friction))[: len(NAMES)])


CHAPTER = Chapter(("thesis_track",), FULL, SMALL, run, track_of_logs)
