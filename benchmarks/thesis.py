"""The thesis's study on the twin: how near to the planted values, and in what time.

The dynamic identification is held against the thesis's own method as a SciPy user would write it:
LuGre in `solve_ivp` (RK45), its position error in a Nelder-Mead search, from the thesis's start.
"""

from __future__ import annotations

from time import process_time

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.optimize import minimize

from benchmarks.figures import Figure, Target
from identify.dataset.preparation import datasets
from studies.curves.dynamic_friction import DYNAMIC, dynamic_part_free, fit_bristles
from studies.thesis.models import overall
from studies.thesis.reproduction import reproduce
from studies.thesis.shared import friction_of, machine
from twin.experiments.kinds import OpenLoopSine
from twin.model.parameters import ParameterReference, read
from twin.simulation.simulate import simulate

Array = NDArray[np.float64]

TITLE = "The thesis reproduced"
AMPLITUDE, PERIOD, DURATION = 0.21, 3.0, 30.0  # N, s, s: the thesis's open-loop sine
TEST_FUNCTION = 0.2  # s
SEED = 0
TOLERANCES = {"xatol": 1e-4, "fatol": 1e-14, "maxfev": 400}


def measure() -> list[Figure]:
    """All chapters, then the speed of its dynamic identification."""
    return [*_chapters(), *_dynamic()]


def _chapters() -> list[Figure]:
    begun = process_time()
    done = reproduce()
    spent, wall = process_time() - begun, sum(done.seconds.values())
    found = {name: chapter.numbers for name, chapter in done.chapters.items()}
    figures = [Figure("all chapters", spent, "s CPU", Target(high=600.0), f"{wall:.0f} s wall")]
    figures += [
        Figure(f"mean of {name} off the planted value", abs(p["error"]), "1", Target(high=1e-3))
        for name, p in found["simulation"]["parameters"].items()
    ]
    cable, dynamic, elements = found["cable"], found["dynamic"], found["future"]["elements"]
    off = abs(cable["pitch"]["mean"] - cable["pitch"]["true"])
    figures += [
        Figure(f"{name} of the open-loop sine off, largest of the places", p["largest_error"], "1",
               Target(high=2e-3))
        for name, p in dynamic["parameters"].items()
    ]  # fmt: skip
    rest, own = (max(e) for e in dynamic["position_error"]["first_period"].values())
    ratios = found["models"]["error_over_noise_floor"]
    return [
        *figures,
        Figure("misfit of the first period, from rest", 1e3 * rest, "mm"),
        Figure("the same from the estimated beginning", 1e6 * own, "um"),
        Figure("frictions fitted to their own data, largest error over noise floor",
               max(overall(by_law[law]) for law, by_law in ratios.items()), "1", Target(high=1.2)),
        Figure("elements chosen less planted", elements["found"] - elements["planted"], "1",
               Target(low=0.0, high=0.0)),
        Figure("pitch of the spikes off", 1e3 * off, "mm", Target(high=0.1)),
        Figure("cable force off, RMS", 1e3 * cable["rms_error"], "mN"),
    ]  # fmt: skip


def _dynamic() -> list[Figure]:
    model, name, axis = machine("simulation")
    friction = friction_of(axis)
    log = simulate(model, OpenLoopSine(name, DURATION, amplitude=AMPLITUDE, period=PERIOD))
    references = [ParameterReference(friction.effect.name, friction.effect.parameter(p))
                  for p in DYNAMIC]  # fmt: skip
    true = read(axis, references)

    def ours() -> Array:
        prepared = datasets(model, {"sine": log}, {}, TEST_FUNCTION)[name].training
        rng = np.random.default_rng(SEED)
        return read(fit_bristles(dynamic_part_free(axis), prepared, rng), references)

    ours()  # what is compiled is compiled
    begun = process_time()
    found = ours()
    own = process_time() - begun
    begun = process_time()
    simplex = _simplex(log.axes[name].position, log.period, axis.mass, dict(friction.values))
    theirs = process_time() - begun
    errors = [float(np.abs(x / true - 1.0).max()) for x in (found, simplex)]
    return [
        Figure("dynamic part, RK45 in Nelder-Mead over ours", theirs / own, "1",
               Target(low=300.0), f"{theirs:.1f} s against {own:.2f} s"),
        Figure("its error, ours", errors[0], "1", Target(high=max(errors[1], 1e-4))),
        Figure("its error, RK45 in Nelder-Mead", errors[1]),
    ]  # fmt: skip


def _simplex(position: Array, period: float, mass: float, v: dict[str, float]) -> Array:
    """Stiffness and damping by the thesis's method."""
    time = period * np.arange(len(position))

    def motion(t: float, state: Array, stiffness: float, damping: float) -> list[float]:
        _, speed, z = state
        level = v["Fc"] + (v["Fs"] - v["Fc"]) * np.exp(-((speed / v["v0"]) ** 2))
        rate = speed - stiffness * abs(speed) / level * z
        friction = stiffness * z + damping * rate + v["sigma2"] * speed
        return [speed, (AMPLITUDE * np.sin(2.0 * np.pi * t / PERIOD) - friction) / mass, rate]

    def cost(x: Array) -> float:
        run = solve_ivp(
            motion, (0.0, time[-1]), [position[0], 0.0, 0.0], t_eval=time, args=tuple(x),
            rtol=1e-6, atol=1e-9,
        )  # fmt: skip
        return float(np.sum((run.y[0] - position) ** 2)) if run.success else np.inf

    first = v["Fs"] / (np.ptp(position) / 2.0)
    start = (first, np.random.default_rng(SEED).uniform(0.0, first))
    bounds = [(1.0, None), (1e-6, None)]
    found = minimize(cost, start, method="Nelder-Mead", bounds=bounds, options=TOLERANCES)
    return np.asarray(found.x)
