"""Chapter "simulation": the thesis's simulation study, on its own machine with LuGre friction.

Static part: a Stribeck curve through the velocity-friction map of 50 speeds, each direction apart,
then averaged. Dynamic part: stiffness and damping from reversals of +-50 um. Both repeated with
measurement noise of a signal-to-noise ratio. Each motion is simulated once. The noise of a plateau
is drawn as one number: the weighted mean of white Gaussian samples is Gaussian, with their variance
over the effective number of samples.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import astuple, replace
from functools import partial

import numpy as np

from identify.dataset.motion import motion_of
from identify.dataset.preparation import datasets
from identify.dataset.prepared_log import PreparedLog
from identify.estimation.evidence import rms
from identify.estimation.force_balance import residual
from studies.curves.dynamic_friction import DYNAMIC, dynamic_part_free, fit_bristles
from studies.curves.friction_curve import StribeckCurve, fit_stribeck
from studies.curves.velocity_map import VelocityMap
from studies.drawing import BLUE, ORANGE, Picture
from studies.telling import Line, Panel, picture
from studies.thesis import shared
from studies.thesis.shared import SIDES, Array, Found, Numbers, friction_of
from twin.engine import engine
from twin.experiments.kinds import Reversals, Staircase
from twin.logs import AxisLog, Log
from twin.model.machine import AxisModel, MachineModel
from twin.model.parameters import ParameterReference, free_parameters, write
from twin.simulation.simulate import simulate
from twin.simulation.simulators import MujocoSimulator, ReducedSimulator

TITLE = "Simulation study"
STATIC = ("Fc", "Fs", "v0", "sigma2")
TEST_FUNCTION = 0.1  # s, of the reversals: half a move
AMPLITUDE = 50e-6  # m, of the reversals
GENTLE = 1e-3  # of the acceleration limit: reversals in which friction outweighs inertia
FACTORS = np.linspace(0.5, 1.5, 41)  # of the true value, for the sensitivity curves
# Means of 100 trials at 80 dB that the thesis prints, in SI units.
PRINTED = {"Fc": 0.2850, "Fs": 0.3350, "v0": 0.0100, "sigma2": 0.0179, "sigma0": 259.9927,
           "sigma1": 0.6001}  # fmt: skip
COLORS = dict(zip(PRINTED, (BLUE, ORANGE, "#3a8f5c", "#8a5fb0", "#b08a2e", "#c2476b"), strict=True))


# Speeds m/s, span m, reversals, trials, signal-to-noise ratios dB (the first is the study's own).
WHOLE = (
    (*(k / 1000 for k in range(1, 10)), *(k / 100 for k in range(1, 42))), 0.2, 20, 100,
    (80.0, 60.0, 40.0, 30.0, 20.0),
)  # fmt: skip
SMALL = (
    (0.001, 0.002, 0.003, 0.005, 0.008, 0.012, 0.02, 0.03, 0.045, 0.07),
    0.03,
    4,
    10,
    (80.0, 40.0),
)


def run(small: bool, rng: np.random.Generator) -> Found:
    """Run the study on a machine whose friction has the thesis's parameters."""
    speeds, span, repeats, trials, ratios = SMALL if small else WHOLE
    simulator = ReducedSimulator if small else MujocoSimulator
    model, name, axis = shared.machine("simulation")
    values, effect = friction_of(axis).values, friction_of(axis).effect
    maps = []
    for speed in speeds:
        moves = Staircase(name, speeds=(speed,), span=span, longest_plateau=1e4)
        moved = motion_of(simulate(model, moves, simulator=simulator), name, "moves", ripples=())
        maps.append(VelocityMap.of(axis, moved))
    found = VelocityMap.joined(maps)
    reversals = Reversals(name, repeats=repeats, amplitude=AMPLITUDE, effort=GENTLE, dwell=0.02)
    log = simulate(model, reversals, simulator=simulator)
    with engine() as (workers, _):
        of_noise = [partial(_trial, model, found, log, snr) for snr in ratios]
        rows = [[*workers.map(trial, rng.spawn(trials))] for trial in of_noise]
    by_snr, tried = {}, {}
    for snr, each in zip(ratios, rows, strict=True):
        tried[snr] = dict(zip(PRINTED, np.array(each).T, strict=True))
        by_snr[f"{snr:g}"] = {
            p: shared.recovered(values[p], tried[snr][p], effect.parameter(p).unit, printed)
            for p, printed in PRINTED.items()
        }
    true = StribeckCurve(*(values[p] for p in STATIC))
    force = sensitivity(axis, np.abs(found.velocity), true, prepared(model, log))
    own = ratios[0]
    numbers = {
        "snr_db": own, "trials": trials, "parameters": by_snr[f"{own:g}"], "by_snr_db": by_snr,
        "sensitivity": {"factors": FACTORS, "force_error": force, "unit": "N"},
        "map": {"velocity": found.velocity, "velocity_unit": "m/s", "friction": found.friction,
                "friction_unit": "N"},
    }  # fmt: skip
    return Found(numbers, words(numbers), pictures(numbers, found, true, tried[own]))


def _trial(
    model: MachineModel, found: VelocityMap, log: Log, snr: float, rng: np.random.Generator
) -> Array:
    """The parameters (6,) that the map and the reversals tell with noise of a ratio, dB."""
    ((name, axis),) = model.axes.items()
    noise = 10.0 ** (-snr / 20.0)
    static = static_of(noisy_map(found, noise, rng))
    felt = log.truth[name][friction_of(axis).effect.name]
    logs = prepared(model, noisy(log, felt, noise, rng))
    return np.array([*static, *dynamic_of(axis, static, logs, rng)])


def noisy_map(found: VelocityMap, noise: float, rng: np.random.Generator) -> VelocityMap:
    """The map with noise of that part of the friction in every sample that a plateau averages."""
    spread = noise * np.abs(found.friction) / np.sqrt(found.samples)
    return replace(found, friction=found.friction + spread * rng.standard_normal(len(spread)))


def noisy(log: Log, friction: Array, noise: float, rng: np.random.Generator) -> Log:
    """Position and command with white noise of this part of position's and friction's RMS."""
    ((name, own),) = log.axes.items()
    moved, felt = (
        noise * np.std(signal) * rng.standard_normal(len(signal))
        for signal in (own.position, friction)
    )
    columns = {"position": own.position + moved, "force": own.force + felt}
    return Log(log.sample_rate, {name: AxisLog(columns)})


def prepared(model: MachineModel, log: Log) -> tuple[PreparedLog, ...]:
    """The reversals as they are fitted."""
    ((name, own),) = log.axes.items()
    bare = Log(model.sample_rate, {name: AxisLog({"position": own.position, "force": own.force})})
    return datasets(model, {"reversals": bare}, {}, TEST_FUNCTION)[name].training


def static_of(found: VelocityMap) -> Array:
    """The static parameters (4,): of the curve through each direction, averaged."""
    curves = []
    for one_way in map(found.towards, SIDES):
        weight = np.sqrt(one_way.samples) / one_way.friction
        curves.append(astuple(fit_stribeck(np.abs(one_way.velocity), one_way.friction, weight)))
    return np.asarray(np.mean(curves, axis=0)[: len(STATIC)])


def dynamic_of(
    axis: AxisModel, static: Array, logs: Sequence[PreparedLog], rng: np.random.Generator
) -> list[float]:
    """Stiffness and damping from the reversals, with these static parameters."""
    effect = friction_of(axis).effect
    known = [ParameterReference(effect.name, effect.parameter(p)) for p in STATIC]
    fitted = fit_bristles(dynamic_part_free(write(axis, known, static)), logs, rng)
    return [friction_of(fitted).values[p] for p in DYNAMIC]


def sensitivity(
    axis: AxisModel, speed: Array, true: StribeckCurve, logs: Sequence[PreparedLog]
) -> dict[str, Array]:
    """RMS force error of each parameter by factor: static on the map, dynamic on the reversals."""
    force = {}
    for p in STATIC:
        curves = [replace(true, **{p: f * getattr(true, p)}) for f in FACTORS]
        force[p] = np.array([rms(curve(speed) - true(speed)) for curve in curves])
    for where in free_parameters(dynamic_part_free(axis)):
        value = friction_of(axis).values[where.parameter.name]
        moved = [write(axis, [where], [f * value]) for f in FACTORS]
        force[where.parameter.name] = np.array([rms(residual(a, logs)) for a in moved])
    return force


def words(n: Numbers) -> list[str]:
    """The largest error of a mean, the printed one, what the cost reacts to; each parameter."""
    found = n["parameters"]
    name = max(found, key=lambda p: abs(found[p]["error"]))
    off = {p: printed / found[p]["true"] - 1.0 for p, printed in PRINTED.items()}
    furthest = max(off, key=lambda p: abs(off[p]))
    ends = {p: n["sensitivity"]["force_error"][p].max() for p in STATIC}
    most, least = (pick(ends, key=lambda p: ends[p]) for pick in (max, min))
    return [
        f"of the means of {n['trials']} trials at {n['snr_db']:g} dB none is further than "
        f"{100.0 * abs(found[name]['error']):.2g} % from the planted value ({name})",
        f"of the thesis's printed means {furthest} is furthest: {100.0 * off[furthest]:+.2f} %",
        f"of the static parameters the cost reacts most to {most}, least to {least}",
        *(
            f"{p}: planted {r['true']:.7g} {r['unit']}, found {r['mean']:.7g} +- {r['sd']:.1g} "
            f"({100.0 * r['error']:+.4f} %), thesis {r['printed']:.7g}"
            for p, r in found.items()
        ),
    ]


def pictures(
    n: Numbers, found: VelocityMap, true: StribeckCurve, trials: Mapping[str, Array]
) -> list[Picture]:
    """The map, the distributions, the sensitivity."""
    speed = np.geomspace(np.abs(found.velocity).min(), np.abs(found.velocity).max(), 300)
    plateaus = [
        Line(np.abs(one.velocity), one.friction, side, color, mark)
        for one, side, color, mark in zip(map(found.towards, SIDES), SIDES.values(),
                                          (BLUE, ORANGE), "ox", strict=True)
    ]  # fmt: skip
    planted = Line(speed, true(speed), "planted", width=0.9)
    off = [
        Panel(
            Line(1e6 * (np.sort(values) / n["parameters"][p]["true"] - 1.0),
                 np.arange(1, len(values) + 1) / len(values), color=BLUE),
            title=p, xlabel="Off the planted value (ppm)", ylabel="Part of the trials",
        )
        for p, values in trials.items()
    ]  # fmt: skip
    reaction = [
        Panel(*(Line(FACTORS, 1e3 * n["sensitivity"]["force_error"][p], p, COLORS[p])
                for p in names),
              xlabel="Value over the planted one (1)", ylabel="Force error, RMS (mN)")
        for names in (STATIC, DYNAMIC)
    ]  # fmt: skip
    return [
        picture("Friction at constant speed, simulated in closed loop and averaged on the last "
                "half of each plateau, and the planted curve.",
                Panel(*plateaus, planted, xscale="log", xlabel="Speed (m/s)",
                      ylabel="Friction (N)"), height=3.4),
        picture(f"Which part of the {n['trials']} trials at {n['snr_db']:g} dB found less.", *off,
                across=3),
        picture("RMS force error when one parameter is off by a factor: static parameters on the "
                "map, dynamic ones on the reversals.", *reaction, across=2),
    ]  # fmt: skip
