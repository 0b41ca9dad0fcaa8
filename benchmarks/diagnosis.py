"""Diagnosis: every absent effect of the catalogue tried on four logs."""

from __future__ import annotations

from functools import partial
from time import perf_counter

import numpy as np

from benchmarks.figures import Figure, Target
from benchmarks.timing import interleaved
from identify import workflow
from identify.estimation.variable_projection import absent_effects
from identify.selection.acceptance import Judged
from identify.selection.trying import Beside, tried_beside
from twin.core.native import law_address
from twin.effects import load_catalogue
from twin.model.file import load_model
from twin.parallel import parallel
from twin.simulation.simulate import simulate

DURATION = 30.0  # s of each log
EXPERIMENTS = ("tracking", "moves", "tracking", "moves")
TITLE = f"Diagnosis: the whole catalogue over four logs of {DURATION:g} s at 10 kHz, both axes"
FITS = 2  # baseline fits before the diagnoses, and again after them


def measure() -> list[Figure]:
    """Time of a diagnosis over that of the baseline fit, and of two threads over one."""
    catalogue = load_catalogue()
    for effect in catalogue.values():
        law_address(effect)  # compiled before anything is timed
    model = load_model("proton_xy", catalogue)
    machine = load_model("example_machine", catalogue)
    logs = {
        f"{e} {i}": simulate(machine, e, seed=i, duration=DURATION)
        for i, e in enumerate(EXPERIMENTS)
    }
    tried = sum(len(absent_effects(axis, catalogue)) for axis in model.axes.values())

    def fits() -> list[float]:
        return [float(t) for t in interleaved([lambda: workflow.fit(model, logs)], FITS)[:, 0]]

    before = fits()
    fitted = workflow.fit(model, logs)

    def ranked(count: int) -> None:
        with parallel(count):
            for axis, base in fitted.fits.items():
                tried_beside(Judged(base, fitted.datasets[axis]), Beside(catalogue))

    runs = interleaved([partial(ranked, 1), partial(ranked, 2)], 1)
    one, two = (float(t) for t in np.median(runs, axis=0))
    begun = perf_counter()
    workflow.diagnose(model, logs, catalogue=catalogue)
    diagnosis = perf_counter() - begun
    fit = float(np.median(before + fits()))
    return [
        Figure(
            "trying the whole catalogue over one baseline fit", two / fit, "1", Target(high=10.0),
            f"{two:.1f} s against {fit:.2f} s; {tried} effects on two threads",
        ),
        Figure("two threads, times faster than one", one / two, "1", Target(low=1.7)),
        Figure(
            "a whole diagnosis over one baseline fit", diagnosis / fit, "1",
            note=f"{diagnosis:.1f} s: fit, catalogue, what is left after the effect, comparison",
        ),
    ]  # fmt: skip
