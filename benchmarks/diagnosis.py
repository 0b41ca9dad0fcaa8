"""Diagnosis: every absent effect of the catalogue tried on two logs."""

from __future__ import annotations

import numpy as np

from benchmarks.figures import Figure
from benchmarks.timing import interleaved, ratio
from identify import workflow
from identify.candidates import absent_effects
from twin.effects import load_catalogue
from twin.experiments import simulate
from twin.model_file import load_model

DURATION = 20.0  # s of each log
TITLE = f"Diagnosis: the whole catalogue over two logs of {DURATION:g} s, both axes"
ROUNDS = 2


def measure() -> list[Figure]:
    """Time of a diagnosis over that of the baseline fit it begins with."""
    catalogue = load_catalogue()
    model = load_model("proton_xy", catalogue)
    machine = load_model("example_machine", catalogue)
    logs = {e: simulate(machine, e, seed=4, duration=DURATION) for e in ("tracking", "moves")}
    tried = sum(len(absent_effects(axis, catalogue)) for axis in model.axes.values())
    fit, diagnosis = interleaved(
        [
            lambda: workflow.fit(model, logs),
            lambda: workflow.diagnose(model, logs, catalogue=catalogue),
        ],
        ROUNDS,
    ).T
    whole = ratio(diagnosis, fit)
    return [
        Figure(
            "diagnosis over one baseline fit", whole, "1",
            note=f"{np.median(diagnosis):.1f} s against {np.median(fit):.2f} s; it fits, tries "
            f"{tried} effects and compares",
        ),
        Figure("the same for one effect tried", (whole - 1.0) / tried, "1"),
    ]  # fmt: skip
