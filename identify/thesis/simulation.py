"""Chapter "simulation": the thesis's simulation study, on its own machine with LuGre friction.

Static part: a Stribeck curve through the velocity-friction map of 50 speeds, each direction apart,
then averaged. Dynamic part: stiffness and damping from reversals of +-50 um. Both repeated with
measurement noise of a signal-to-noise ratio. Each motion is simulated once. The noise of a plateau
is drawn as one number: the weighted mean of white Gaussian samples is Gaussian, with their variance
over the effective number of samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import datasets
from identify.dataset.motion import motion_of
from identify.dataset.prepared_log import PreparedLog
from identify.estimation.evidence import rms
from identify.estimation.force_balance import residual
from identify.estimation.presliding import Presliding
from identify.estimation.stribeck_curve import StribeckCurve, fit_stribeck
from identify.estimation.velocity_map import VelocityMap, velocity_map
from identify.thesis.chapter import Chapter, Recovered
from identify.thesis.maps_of_logs import map_of_logs
from identify.thesis.printed import SIMULATION
from twin.effect import Kind
from twin.effects import Catalogue
from twin.experiments.kinds import Reversals, Staircase
from twin.experiments.named import simulate
from twin.log import AxisLog, Log
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.model.parameters import ParameterReference, write
from twin.progress import Progress
from twin.simulator import MujocoSimulator, ReducedSimulator

Array = NDArray[np.float64]

STATIC = ("Fc", "Fs", "v0", "sigma2")
DYNAMIC = ("sigma0", "sigma1")
TEST_FUNCTION = 0.1  # s, of the reversals: half a move
AMPLITUDE = 50e-6  # m, of the reversals
GENTLE = 1e-3  # of the acceleration limit: reversals in which friction outweighs inertia
FACTORS = np.linspace(0.5, 1.5, 41)  # of the true value, for the sensitivity curves
DIRECTIONS = (1.0, -1.0)


@dataclass(frozen=True)
class Size:
    """How much of the study is run. speeds: m/s, span: m. snr: dB, the first is the study's own."""

    speeds: Sequence[float]
    span: float
    repeats: int
    trials: int
    snr: Sequence[float]
    simulator: type[MujocoSimulator] | type[ReducedSimulator]


FULL = Size(
    speeds=(*(k / 1000 for k in range(1, 10)), *(k / 100 for k in range(1, 42))),
    span=0.2,
    repeats=20,
    trials=100,
    snr=(80.0, 60.0, 40.0, 30.0, 20.0),
    simulator=MujocoSimulator,
)
SMALL = Size(
    speeds=(0.001, 0.002, 0.003, 0.005, 0.008, 0.012, 0.02, 0.03, 0.045, 0.07),
    span=0.03,
    repeats=4,
    trials=10,
    snr=(80.0, 40.0),
    simulator=ReducedSimulator,
)


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """RMS force error (N), by parameter, of a value that is ``factors`` times the true one."""

    factors: Array
    force: Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class SimulationResult:
    """The chapter's results. map: without noise. by_snr: ratio in dB -> parameters by name."""

    map: VelocityMap
    true: StribeckCurve
    by_snr: Mapping[float, Mapping[str, Recovered]]
    sensitivity: Sensitivity
    trials: int

    @property
    def snr(self) -> float:
        """The study's own signal-to-noise ratio, dB."""
        return next(iter(self.by_snr))

    @property
    def parameters(self) -> Mapping[str, Recovered]:
        """What was found at that ratio."""
        return self.by_snr[self.snr]


def run(
    models: Sequence[MachineModel],
    catalogue: Catalogue,
    size: Size,
    rng: np.random.Generator,
    progress: Progress,
) -> SimulationResult:
    """Run the study on the first axis of a machine whose friction has these parameters."""
    (model,) = models
    name, axis = next(iter(model.axes.items()))
    friction = next(f for f in axis.effects if f.effect.kind is Kind.FRICTION)
    found = _map(model, name, size, progress)
    reversals = Reversals(
        name, repeats=size.repeats, amplitude=AMPLITUDE, effort=GENTLE, dwell=0.02
    )
    log = simulate(model, reversals, simulator=size.simulator)
    motion = log.axes[name]
    clean = Clean(motion.position, motion.force, log.truth[name][friction.effect.name])
    trial = partial(_trial, model, name, friction, found, clean)
    by_snr = {}
    for i, snr in enumerate(size.snr):
        rows = []
        for k in range(size.trials):
            progress("trials with noise", i * size.trials + k, len(size.snr) * size.trials)
            rows.append(trial(10.0 ** (-snr / 20.0), rng))
        by_snr[snr] = _recovered(friction, np.array(rows))
    true = StribeckCurve(*(friction.values[p] for p in STATIC))
    logs = _prepared(model, name, clean.noisy(0.0, rng))
    return SimulationResult(
        found, true, by_snr, _sensitivity(axis, friction, found, true, logs), size.trials
    )


def _map(model: MachineModel, name: str, size: Size, progress: Progress) -> VelocityMap:
    maps = []
    for i, speed in enumerate(size.speeds):
        progress("moves at constant speed", i, len(size.speeds))
        moves = Staircase(name, speeds=(speed,), span=size.span, longest_plateau=1e4)
        log = simulate(model, moves, simulator=size.simulator)
        maps.append(velocity_map(model.axes[name], motion_of(log, name, f"{speed:g}", ripples=())))
    return VelocityMap.joined(maps)


@dataclass(frozen=True, eq=False)
class Clean:
    """Signals of the reversals without noise: position (n,) m, command and friction (n,) N."""

    position: Array
    force: Array
    friction: Array

    def noisy(self, noise: float, rng: np.random.Generator) -> tuple[Array, Array]:
        """Position and command with white noise of this part of position's and friction's RMS."""
        moved, felt = (noise * np.std(signal) for signal in (self.position, self.friction))
        n = len(self.position)
        return (
            self.position + moved * rng.standard_normal(n),
            self.force + felt * rng.standard_normal(n),
        )


def _trial(
    model: MachineModel,
    name: str,
    friction: Fitted,
    clean_map: VelocityMap,
    clean: Clean,
    noise: float,
    rng: np.random.Generator,
) -> list[float]:
    """The six parameters found in one noisy repetition."""  # fmt: skip
    spread = noise * np.abs(clean_map.friction) / np.sqrt(clean_map.samples)
    drawn = replace(
        clean_map, friction=clean_map.friction + spread * rng.standard_normal(len(spread))
    )
    static = np.mean([_static(drawn.towards(way)) for way in DIRECTIONS], axis=0)
    axis = model.axes[name]
    effect = friction.effect
    known = [ParameterReference(effect.name, effect.parameter(p)) for p in STATIC]
    axis = write(axis, known, static)
    part = Presliding(*(ParameterReference(effect.name, effect.parameter(p)) for p in DYNAMIC))
    fitted = part.fit(axis, _prepared(model, name, clean.noisy(noise, rng)), static[1], rng)
    return [*static, *(fitted[effect.name].values[p] for p in DYNAMIC)]


def _static(one_way: VelocityMap) -> tuple[float, ...]:
    weight = np.sqrt(one_way.samples) / one_way.friction
    return astuple(fit_stribeck(np.abs(one_way.velocity), one_way.friction, weight))[: len(STATIC)]


def _prepared(
    model: MachineModel, name: str, signals: tuple[Array, Array]
) -> tuple[PreparedLog, ...]:
    position, force = signals
    log = Log(model.sample_rate, {name: AxisLog({"position": position, "force": force})})
    return datasets(model, {"reversals": log}, {}, TEST_FUNCTION)[name].fit


def _recovered(friction: Fitted, rows: Array) -> dict[str, Recovered]:
    """rows (trials, 6): the parameters found."""
    return {
        p: Recovered(
            friction.values[p], column, friction.effect.parameter(p).unit, SIMULATION.get(p)
        )
        for p, column in zip((*STATIC, *DYNAMIC), rows.T, strict=True)
    }


def _sensitivity(
    axis: AxisModel,
    friction: Fitted,
    found: VelocityMap,
    true: StribeckCurve,
    logs: Sequence[PreparedLog],
) -> Sensitivity:
    """Static parameters on the map, dynamic ones on the reversals."""  # fmt: skip
    speed, force = np.abs(found.velocity), {}
    for p in STATIC:
        curves = [replace(true, **{p: f * getattr(true, p)}) for f in FACTORS]
        force[p] = np.array([rms(curve(speed) - true(speed)) for curve in curves])
    for p in DYNAMIC:
        where = [ParameterReference(friction.effect.name, friction.effect.parameter(p))]
        moved = [write(axis, where, [f * friction.values[p]]) for f in FACTORS]
        force[p] = np.array([rms(residual(a, logs)) for a in moved])
    return Sensitivity(FACTORS, force)


CHAPTER = Chapter(("thesis_simulation",), FULL, SMALL, run, map_of_logs)
