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

from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np
from scipy.optimize import minimize

from identify.dataset.preparation import datasets
from identify.dataset.prepared_log import PreparedLog
from identify.estimation.evidence import rms
from identify.estimation.fit import Outcome, finished, fit_axis
from identify.estimation.force_along import force_along
from identify.estimation.intervals import half_widths
from identify.estimation.open_loop import Beginning, OpenLoopRun, measured_beginning
from studies.curves.dynamic_friction import dynamic_part_free, fit_dynamic_part
from studies.drawing import BLUE, GREY, ORANGE, Picture
from studies.telling import Line, Panel, picture
from studies.thesis import shared
from studies.thesis.shared import Array, Found, Numbers, friction_of
from twin.effect import Kind
from twin.experiments.kinds import OpenLoopSine, Reversals
from twin.logs import AxisLog, Log
from twin.model.machine import AxisModel, MachineModel
from twin.model.parameters import free_parameters, read, write
from twin.simulation.loop import Controller

TITLE = "Dynamic parameters"
AMPLITUDE, PERIOD = 0.21, 3.0  # N, s, of the thesis's sine
LATE = PERIOD / 4.0  # s, by which the recording begins after the drive
REVERSAL, REVERSALS = 4e-6, 50  # m, to and fro
TEST_FUNCTION = 0.1  # s
EVALUATIONS = 120  # of the simplex search
SHOWN_EVERY = 10  # samples, of the motions that are drawn
WAYS = ("from_rest", "beginning_estimated")


def run(small: bool, rng: np.random.Generator) -> Found:
    """Record the sine at places of the track, and identify the dynamic part at each."""
    model, name, axis = shared.machine("track")
    quiet = model.with_axis(name, shared.with_hardware(axis, current_noise=0.0))
    places, duration = shared.places(1 if small else shared.PLACES), 6.0 if small else 30.0
    known = dynamic_part_free(axis)
    found = []
    for place in map(float, places):
        log = late(sine(quiet, name, place, duration, rng), name)
        found.append(at_place(known, prepared(quiet, log), rng))
    simplex, fitted, seconds, errors, motions = zip(*found, strict=True)
    first = float(places[0])
    whole = sine(model, name, first, duration, rng)
    reversals = Reversals(name, repeats=REVERSALS, amplitude=REVERSAL, dwell=0.02, at=(first,))
    records = {"closed_loop": shared.recorded(model, reversals, rng), "open_loop": whole}
    parts = zip(("first_period", "after"), np.transpose(errors, (1, 2, 0)), strict=True)
    numbers = {
        "position": places, "position_unit": "m", "unit": "m",
        "records": {k: informed(known, log, prepared(model, log)) for k, log in records.items()},
        "simplex": _recovered(known, np.array(simplex)),
        "parameters": _recovered(known, np.array(fitted)),
        "seconds_at_a_place": dict(zip(("simplex", "fit"), np.median(seconds, axis=0),
                                       strict=True)),
        "position_error": {part: dict(zip(WAYS, errors, strict=True)) for part, errors in parts},
    }  # fmt: skip
    return Found(numbers, words(numbers), pictures(*motions[0][:, ::SHOWN_EVERY]))


def prepared(model: MachineModel, log: Log) -> tuple[PreparedLog, ...]:
    """A record as it is fitted."""
    (dataset,) = datasets(model, {"log": log}, {}, TEST_FUNCTION).values()
    return dataset.training


def _recovered(known: AxisModel, found: Array) -> dict[str, Numbers]:
    """found (places, 2)."""
    where = free_parameters(known)
    columns = zip(where, read(known, where), found.T, strict=True)
    return {
        c.parameter.name: shared.recovered(true, values, c.parameter.unit)
        for c, true, values in columns
    }


def at_place(
    known: AxisModel, logs: Sequence[PreparedLog], rng: np.random.Generator
) -> tuple[Array, Array, Array, Array, Array]:
    """The dynamic part by both ways (2,), seconds (2,) of each, errors and motions of the fit.

    errors (2, 2) m RMS: in the first period and afterwards, simulated from rest and from the
    estimated beginning. motions (4, n): time s, measured position and both errors, m.
    """
    (log,), start = logs, perf_counter()
    simplex = by_simplex(known, log, rng)
    between = perf_counter()
    fit = fit_dynamic_part(known, logs, rng)
    seconds = np.array([between - start, perf_counter() - between])
    replay, begun, period = OpenLoopRun(fit.axis, log), fit.beginnings[0], log.motion.sample_period
    errors = np.array([replay.error(fit.axis, b) for b in (at_rest(fit.axis, log), begun)])
    measured = log.motion.position_at_samples(0.0)[begun.first :]
    time, cut = (begun.first + np.arange(len(measured))) * period, round(PERIOD / period)
    by_part = [[rms(e) for e in part] for part in (errors[:, :cut], errors[:, cut:])]
    fitted, motions = read(fit.axis, free_parameters(known)), np.array([time, measured, *errors])
    return simplex, fitted, seconds, np.array(by_part), motions


def sine(
    model: MachineModel, name: str, place: float, duration: float, rng: np.random.Generator
) -> Log:
    """The thesis's open-loop sine, which carries the cable's force as well (chapter "cable")."""
    cable = replace(model.axes[name], effects=shared.of_position(model.axes[name]))
    force = force_along(cable, np.array([place]), np.zeros(1), 1.0, Kind.FORCE)
    pure = OpenLoopSine(name, LATE + duration, AMPLITUDE, PERIOD, at=(place,))
    setpoint = pure.setpoint(model, rng)
    setpoint = setpoint.part(0, len(setpoint))
    setpoint = replace(setpoint, force=setpoint.force - force)
    return shared.followed(model, setpoint, rng, {axis: Controller() for axis in model.axes})


def late(log: Log, name: str) -> Log:
    """The record from LATE on."""
    first = round(LATE * log.sample_rate)
    own = {key: column[first:] for key, column in log.axes[name].columns.items()}
    return Log(log.sample_rate, {name: AxisLog(own)})


def by_simplex(axis: AxisModel, log: PreparedLog, rng: np.random.Generator) -> Array:
    """Stiffness and damping by the thesis's search and start rules, simulated from rest."""
    where, replay, begin = free_parameters(axis), OpenLoopRun(axis, log), at_rest(axis, log)
    stiffness = friction_of(axis).values["Fs"] / (np.ptp(replay.position) / 2.0)
    found = minimize(
        lambda x: rms(replay.error(write(axis, where, x), begin)),
        np.array([stiffness, rng.uniform(0.0, stiffness)]), method="Nelder-Mead",
        bounds=[(c.parameter.lower, c.parameter.upper) for c in where],
        options={"maxfev": EVALUATIONS, "xatol": 1e-4, "fatol": 1e-12},
    )  # fmt: skip
    return np.asarray(found.x)


def at_rest(axis: AxisModel, log: PreparedLog) -> Beginning:
    """The beginning that the thesis assumes: where it is measured, at rest, nothing bent."""
    measured, _ = measured_beginning(axis, log)
    return replace(measured, velocity=0.0, states=np.zeros_like(measured.states))


def informed(known: AxisModel, log: Log, logs: Sequence[PreparedLog]) -> Numbers:
    """What one record says of the dynamic part.

    RMS change of the friction, and RMS noise of the measured force a sample; half widths of the
    90 % intervals at the planted values, and what a fit of the force residual from them finds.
    """
    where = free_parameters(known)
    names, true = [c.parameter.name for c in where], read(known, where)
    half = half_widths(finished(known, known, logs, Outcome.CONVERGED))
    found = read(fit_axis(known, logs).axis, where)
    (truth,) = log.truth.values()
    return {
        "friction_change": np.std(truth[friction_of(known).effect.name]), "unit": "N",
        "force_noise": known.hardware.current_noise * known.hardware.force_constant,
        "relative_half_width_90": dict(zip(names, half / true, strict=True)),
        "found_over_true": dict(zip(names, found / true, strict=True)),
    }  # fmt: skip


def words(n: Numbers) -> list[str]:
    """Why closed-loop reversals fail, what both searches find, and what the beginning explains."""
    shut, opened = n["records"]["closed_loop"], n["records"]["open_loop"]
    worst = {
        part: [max(errors[way]) for way in WAYS] for part, errors in n["position_error"].items()
    }
    seconds = n["seconds_at_a_place"]
    return [
        f"reversals of 4 um in closed loop change the friction by {shut['friction_change']:.2g} N, "
        f"the noise of the measured force is {shut['force_noise']:.2g} N: 90 % intervals of "
        f"{_intervals(shut)}; the open-loop sine changes it by {opened['friction_change']:.2g} N: "
        f"{_intervals(opened)}",
        *(
            f"{name}: planted {ours['true']:g} {ours['unit']}; simplex search from rest "
            f"{n['simplex'][name]['mean']:.5g}, fit of simulated motion {ours['mean']:.6g} +- "
            f"{ours['sd']:.1g} ({100.0 * ours['error']:+.3f} %)"
            for name, ours in n["parameters"].items()
        ),
        f"in the first period the simulation from rest is {worst['first_period'][0]:.2g} m RMS "
        f"off, from the estimated beginning {worst['first_period'][1]:.2g} m; afterwards "
        f"{worst['after'][0]:.2g} m and {worst['after'][1]:.2g} m (largest of "
        f"{len(n['position'])} places)",
        f"at one place the simplex search takes {seconds['simplex']:.2g} s, the fit of simulated "
        f"motion with its four starts {seconds['fit']:.2g} s, both on compiled laws",
    ]


def _intervals(record: Numbers) -> str:
    half_widths = record["relative_half_width_90"].items()
    return ", ".join(f"{name} +- {100.0 * half:.3g} %" for name, half in half_widths)


def pictures(time: Array, measured: Array, rest: Array, own: Array) -> list[Picture]:
    """The motion at one place, and both errors of the simulation."""
    motions = [Line(time, 1e3 * measured, "measured", GREY, width=3.0),
               Line(time, 1e3 * (measured + rest), "from rest", ORANGE)]  # fmt: skip
    return [
        picture("The open-loop sine at the first place, measured and simulated from the command "
                "alone with the fitted values; below the errors from rest, as in the thesis, and "
                "from the estimated beginning.",
                Panel(*motions, ylabel="Position (mm)"),
                Panel(Line(time, 1e3 * rest, color=ORANGE), ylabel="Error, from rest (mm)"),
                Panel(Line(time, 1e9 * own, color=BLUE), ylabel="Error, estimated (nm)",
                      xlabel=f"Time (s), of a sine of {PERIOD:g} s")),
    ]  # fmt: skip
