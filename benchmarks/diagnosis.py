"""Diagnosis: every absent effect of the catalogue tried on two logs."""

from __future__ import annotations

from time import perf_counter

import numpy as np

from benchmarks.figures import Figure
from benchmarks.timing import interleaved
from identify import workflow
from identify.candidates import absent_effects
from twin.effects import load_catalogue
from twin.experiments import simulate
from twin.model_file import load_model
from twin.native import law_address

DURATION = 20.0  # s of each log
TITLE = f"Diagnosis: the whole catalogue over two logs of {DURATION:g} s, both axes"
FITS = 3  # baseline fits before the diagnosis, and again after it


def measure() -> list[Figure]:
    """Time of a diagnosis over that of the baseline fit it begins with."""
    catalogue = load_catalogue()
    for effect in catalogue.values():
        law_address(effect)  # compiled before anything is timed
    model = load_model("proton_xy", catalogue)
    machine = load_model("example_machine", catalogue)
    logs = {e: simulate(machine, e, seed=4, duration=DURATION) for e in ("tracking", "moves")}
    tried = sum(len(absent_effects(axis, catalogue)) for axis in model.axes.values())

    def fits() -> list[float]:
        return [float(t) for t in interleaved([lambda: workflow.fit(model, logs)], FITS)[:, 0]]

    before = fits()
    begun = perf_counter()
    workflow.diagnose(model, logs, catalogue=catalogue)
    diagnosis = perf_counter() - begun
    fit = float(np.median(before + fits()))
    return [
        Figure(
            "diagnosis over one baseline fit", diagnosis / fit, "1",
            note=f"{diagnosis:.1f} s against {fit:.2f} s; it fits, tries {tried} effects and "
            "compares",
        ),
        Figure("the same for one effect tried", (diagnosis / fit - 1.0) / tried, "1"),
    ]  # fmt: skip
