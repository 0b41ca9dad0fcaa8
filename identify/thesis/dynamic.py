"""Chapter "dynamic": stiffness and damping of the bristles, in closed loop and in open loop.

The thesis found closed-loop reversals of 4 um useless for LuGre, and turned to an open-loop sine of
force, whose position error it minimised by a simplex search from rest. Here the uncertainty of both
records is computed, and the same sine is fitted by the simplex search and by a fit of simulated
motion that estimates where the record begins. The records begin a quarter of a period after the
drive, so that the bristles are bent and the axis moves as they begin. The machine is stepped ten
times finer than the logs' samples of 1 ms. In open loop the command is what was asked for, so that
it is known without the noise of a measured current.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import datasets
from identify.dataset.prepared_log import PreparedLog
from identify.estimation.evidence import rms
from identify.estimation.prescribed_motion import force_along
from identify.estimation.presliding import Presliding
from identify.estimation.replay import Beginning, Replay, measured_beginning
from identify.estimation.simulated_motion import MotionFit, fit_simulated_motion
from identify.thesis.cable import of_position
from identify.thesis.chapter import Chapter, Recovered
from identify.thesis.informed import Informed, informed
from identify.thesis.track import APART, FIRST
from twin.core.control import Controller
from twin.effect import Kind
from twin.effects import Catalogue
from twin.experiments.follow import follow
from twin.experiments.kinds import Reversals
from twin.experiments.named import simulate
from twin.experiments.trajectory import open_loop_sine
from twin.log import AxisLog, Log
from twin.model.machine import AxisModel, MachineModel
from twin.model.parameters import ParameterReference, free_parameters, read, write
from twin.progress import Progress
from twin.simulator import FineSimulator

Array = NDArray[np.float64]

DYNAMIC = ("sigma0", "sigma1")
AMPLITUDE, PERIOD = 0.21, 3.0  # N, s, of the thesis's sine
LATE = PERIOD / 4.0  # s, by which the recording begins after the drive
REVERSAL, REVERSALS = 4e-6, 50  # m, to and fro
TEST_FUNCTION = 0.1  # s
EVALUATIONS = 120  # of the simplex search
SHOWN_EVERY = 0.01  # s, of the motions that are kept for the picture


@dataclass(frozen=True)
class Size:
    """duration: s of each sine."""

    places: int
    duration: float


FULL = Size(9, 30.0)
SMALL = Size(1, 6.0)


@dataclass(frozen=True, eq=False)
class Trace:
    """Motion at one place, (n,) s and m: measured, and simulated from rest and from where it began.

    All with the values of the fit.
    """

    time: Array
    measured: Array
    from_rest: Array
    from_estimate: Array


@dataclass(frozen=True, eq=False)
class DynamicResult:
    """The chapter's results. places (k,) m.

    closed, opened: what reversals in closed loop and the sine say. simplex, fitted: dynamic
    parameters at the places by the thesis's way and by ours; seconds: usual time of each, s.
    first_period, afterwards: RMS position error (k, 2) m, simulated from rest and from the
    estimated beginning, with the values of the fit.
    """

    places: Array
    closed: Informed
    opened: Informed
    simplex: Mapping[str, Recovered]
    fitted: Mapping[str, Recovered]
    seconds: tuple[float, float]
    first_period: Array
    afterwards: Array
    trace: Trace


@dataclass(frozen=True, eq=False)
class _Place:
    """What one place gives: parameters by both ways, seconds of each, errors, the motions.

    errors (2, 2) m RMS: in the first period and afterwards, from rest and as estimated.
    """

    simplex: Array
    fitted: Array
    seconds: tuple[float, float]
    errors: Array
    trace: Trace


def run(
    models: Sequence[MachineModel],
    catalogue: Catalogue,
    size: Size,
    rng: np.random.Generator,
    progress: Progress,
) -> DynamicResult:
    """Record the sine at places of the first axis, and identify the dynamic part at each."""
    (model,) = models
    name, axis = next(iter(model.axes.items()))
    quiet = model.with_axis(name, replace(axis, hardware=replace(axis.hardware, current_noise=0.0)))
    places = np.array([FIRST + APART * (9 // size.places) * i for i in range(size.places)])
    known = _dynamic_part_free(axis)
    where = free_parameters(known)
    found = []
    for i, place in enumerate(places):
        progress("open-loop sines", i, len(places))
        log = _late(_sine(quiet, name, float(place), size, rng), name)
        found.append(_at_place(known, _prepared(quiet, name, log), rng))
    whole = _sine(model, name, float(places[0]), size, rng)
    true, seconds = read(known, where), np.median([f.seconds for f in found], axis=0)
    return DynamicResult(
        places=places,
        closed=_closed(model, name, known, float(places[0]), rng),
        opened=informed(known, name, whole, _prepared(model, name, whole)),
        simplex=_recovered(where, true, np.array([f.simplex for f in found])),
        fitted=_recovered(where, true, np.array([f.fitted for f in found])),
        seconds=(float(seconds[0]), float(seconds[1])),
        first_period=np.array([f.errors[0] for f in found]),
        afterwards=np.array([f.errors[1] for f in found]),
        trace=found[0].trace,
    )


def _at_place(
    known: AxisModel, prepared: Sequence[PreparedLog], rng: np.random.Generator
) -> _Place:
    """The dynamic part by both ways, and the motion that the fitted values make."""
    log, begun = prepared[0], perf_counter()
    simplex = _by_simplex(known, log, rng)
    between = perf_counter()
    found = _fitted(known, prepared, rng)
    seconds = (between - begun, perf_counter() - between)
    rest, own = _errors(found.axis, log, found.beginnings[0])
    cut = round(PERIOD / log.motion.sample_period)
    errors = [[rms(e[part]) for e in (rest, own)] for part in (slice(cut), slice(cut, None))]
    return _Place(
        simplex=simplex,
        fitted=read(found.axis, free_parameters(known)),
        seconds=seconds,
        errors=np.array(errors),
        trace=_trace(log, found.beginnings[0].first, rest, own),
    )


def _recovered(
    where: Sequence[ParameterReference], true: Array, rows: Array
) -> dict[str, Recovered]:
    return {
        c.parameter.name: Recovered(t, column, c.parameter.unit)
        for c, t, column in zip(where, true, rows.T, strict=True)
    }


def _dynamic_part_free(axis: AxisModel) -> AxisModel:
    """The axis with everything known but stiffness and damping of its friction."""
    effects = []
    for f in axis.effects:
        own = DYNAMIC if f.effect.kind is Kind.FRICTION else ()
        effects.append(replace(f, fixed=frozenset(n for n in f.values if n not in own)))
    return replace(axis, effects=tuple(effects), mass_fixed=True)


def _sine(
    model: MachineModel, name: str, place: float, size: Size, rng: np.random.Generator
) -> Log:
    """The thesis's open-loop sine, which carries the cable's force as well."""
    setpoint = open_loop_sine(
        list(model.axes).index(name), amplitude=AMPLITUDE, period=PERIOD,
        offset=-_cable(model.axes[name], place), duration=LATE + size.duration, at=(place,),
        sample_rate=model.sample_rate,
    )  # fmt: skip
    noise, current = rng.spawn(2)
    return follow(
        model, setpoint, (noise, current), name="open_loop_sine", seed=0, simulator=FineSimulator,
        controllers={a: Controller() for a in model.axes},
    )  # fmt: skip


def _late(log: Log, name: str) -> Log:
    """The record from LATE on."""
    late = round(LATE * log.sample_rate)
    own = {key: column[late:] for key, column in log.axes[name].columns.items()}
    truth = {key: column[late:] for key, column in log.truth[name].items()}
    return Log(log.sample_rate, {name: AxisLog(own)}, truth={name: truth})


def _cable(axis: AxisModel, place: float) -> float:
    """Force of the smooth forces of position there, N, which passes measure (chapter "cable")."""
    forces = [f for f in axis.effects if of_position(f.effect)]
    kept = replace(axis, effects=tuple(forces))
    return float(force_along(kept, np.array([place]), np.zeros(1), 1.0, Kind.FORCE)[0])


def _by_simplex(axis: AxisModel, log: PreparedLog, rng: np.random.Generator) -> Array:
    """Stiffness and damping by the thesis's search and start rules, simulated from rest."""
    from scipy.optimize import minimize

    where, replay = free_parameters(axis), Replay(axis, log)
    at_rest = _at_rest(axis, log)

    def cost(x: Array) -> float:
        return rms(replay.error(write(axis, where, x), at_rest))

    deflection = np.ptp(replay.position) / 2.0
    static = next(f for f in axis.effects if f.effect.kind is Kind.FRICTION).values["Fs"]
    stiffness = static / deflection
    start = np.array([stiffness, rng.uniform(0.0, stiffness)])
    bounds = [(c.parameter.lower, c.parameter.upper) for c in where]
    options = {"maxfev": EVALUATIONS, "xatol": 1e-4, "fatol": 1e-12}
    found = minimize(cost, start, method="Nelder-Mead", bounds=bounds, options=options)
    return np.asarray(found.x)


def _at_rest(axis: AxisModel, log: PreparedLog) -> Beginning:
    """The beginning that the thesis assumes: where it is measured, at rest, nothing bent."""
    measured, _ = measured_beginning(axis, log)
    return replace(measured, velocity=0.0, states=np.zeros_like(measured.states))


def _fitted(axis: AxisModel, logs: Sequence[PreparedLog], rng: np.random.Generator) -> MotionFit:
    """The fit of simulated motion, begun at one of the force residual."""
    stiffness, damping = free_parameters(axis)
    static = next(f for f in axis.effects if f.effect.kind is Kind.FRICTION).values["Fs"]
    begun = Presliding(stiffness, damping).fit(axis, logs, static, rng)
    return fit_simulated_motion(begun, logs)


def _errors(axis: AxisModel, log: PreparedLog, begun: Beginning) -> tuple[Array, Array]:
    """Simulated less measured position from rest, and from that beginning."""
    replay = Replay(axis, log)
    return replay.error(axis, _at_rest(axis, log)), replay.error(axis, begun)


def _trace(log: PreparedLog, first: int, rest: Array, own: Array) -> Trace:
    step = round(SHOWN_EVERY / log.motion.sample_period)
    measured = log.motion.position_at_samples(0.0)[first:]
    time = np.asarray((first + np.arange(len(measured))) * log.motion.sample_period)
    simulated = (np.asarray(measured + error)[::step] for error in (rest, own))
    return Trace(time[::step], measured[::step], *simulated)


def _closed(
    model: MachineModel, name: str, known: AxisModel, place: float, rng: np.random.Generator
) -> Informed:
    """Reversals of 4 um at the first place."""
    reversals = Reversals(name, repeats=REVERSALS, amplitude=REVERSAL, dwell=0.02, at=(place,))
    seed = int(rng.integers(2**31))
    log = simulate(model, reversals, seed=seed, simulator=FineSimulator)
    return informed(known, name, log, _prepared(model, name, log))


def _prepared(model: MachineModel, name: str, log: Log) -> tuple[PreparedLog, ...]:
    return datasets(model, {"log": log}, {}, TEST_FUNCTION)[name].fit


CHAPTER = Chapter(("thesis_track",), FULL, SMALL, run)
