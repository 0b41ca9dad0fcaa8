"""Other drives, from their logs alone: `python -m benchmarks drives [--seed N] [-o FILE]`.

As a user goes: a first model of one log (`twin new`), then the diagnosis with a log of another run.
What is right to say was written down before any diagnosis. Every drive has friction with presliding
and an encoder of its own, which the first model lacks: to name these is right beside anything.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from functools import partial
from itertools import cycle
from pathlib import Path
from time import process_time

import numpy as np

from benchmarks.figures import Figure, Target, report
from benchmarks.judgement import Expected, Row, judged, row_of, stated_wrong
from benchmarks.second_simulator.drives import DRIVES, Drive, Plant, Recorder, log_of
from identify.analysis.first_model import first_model
from identify.workflow import diagnose
from twin.effects import load_catalogue

TITLE = "Drives of other kinds, from their logs alone"
SEED = 60
CATALOGUE = load_catalogue()
RUBS = ("lugre", "leuven", "modified_leuven", "gms", "dahl", "presliding_hysteresis", "stribeck")
KNOWN = (*RUBS, "encoder_quantization")
RATED, FREQUENCY = 12.0, 25.0  # samples a period at least, and Hz at most, of the mode
Change = Callable[[Drive, Recorder], Plant]


def having(**parts: float) -> Change:
    """A plant with forces that are these parts of its friction."""

    def change(drive: Drive, recorder: Recorder) -> Plant:
        own = drive.plant
        return own._replace(**{name: part * own.friction for name, part in parts.items()})

    return change


def plain(**values: float) -> Change:
    """A plant with these values."""
    return lambda drive, recorder: drive.plant._replace(**values)


def sprung(drive: Drive, recorder: Recorder) -> Plant:
    """A spring that at the end of the travel is as strong as the friction."""
    return drive.plant._replace(spring=drive.plant.friction / drive.travel)


def flexible(drive: Drive, recorder: Recorder) -> Plant:
    """Half of the mass on a spring."""
    half, turn = 0.5 * drive.plant.mass, 2.0 * np.pi * min(FREQUENCY, recorder.rate / RATED)
    spring, loss = 0.5 * half * turn**2, 0.06 * 0.5 * half * turn
    return drive.plant._replace(mass=half, load=half, coupling=spring, loss=loss)


HIDDEN: dict[str, tuple[Change, Expected]] = {
    "nothing": (plain(), Expected(known=KNOWN)),
    "stribeck": (having(static=1.8), Expected(RUBS, shapes=("coulomb_viscous",), known=KNOWN)),
    "cogging": (having(cogging=0.3), Expected(("cogging",), known=KNOWN)),
    "two coggings": (having(cogging=0.3, second=0.2), Expected(("cogging",), known=KNOWN)),
    "gravity": (having(weight=1.5), Expected(("gravity",), ("spring", "cogging"), known=KNOWN)),
    "hysteresis": (having(hysteresis=0.5), Expected(RUBS, ("cable_hysteresis",), known=KNOWN)),
    "asymmetry": (
        plain(asymmetry=0.4), Expected(("asymmetric_friction",), ("constant_force",), known=KNOWN)
    ),
    "friction by position": (
        plain(modulation=0.3),
        Expected(
            ("friction_ripple", "position_dependent_friction"), shapes=("coulomb_viscous",),
            known=KNOWN,
        ),
    ),
    "ripple": (
        plain(ripple=0.15),
        Expected(
            ("force_constant_ripple",), ("position_dependent_force_constant",), known=KNOWN
        ),
    ),
    "spring": (sprung, Expected(("spring",), ("cable_slab", "gravity"), known=KNOWN)),
    "flexible": (flexible, Expected(("flexible_mode",), ("base_vibration",), known=KNOWN)),
    "lag": (
        plain(lag=0.004),
        Expected(("actuator_lag",), ("actuator_delay", "encoder_delay"), known=KNOWN),
    ),
}  # fmt: skip


def row(name: str, hidden: str, recorder: Recorder, seed: int) -> Row:
    """One drive with one thing hidden, diagnosed."""
    drive, (change, expected) = DRIVES[name], HIDDEN[hidden]
    plant = change(drive, recorder)
    training, selection, test = (log_of(drive, plant, recorder, 3 * seed + i) for i in range(3))
    begun = process_time()
    model = first_model({"training": training}, name, CATALOGUE)
    found = diagnose(model, training, selection, test, catalogue=CATALOGUE)
    spent = process_time() - begun
    return row_of(f"{name} at {recorder.rate} Hz, {hidden}", expected, found.axes["q"], spent)


def jobs_of(seed: int) -> dict[str, Callable[[], Row]]:
    """A job for each drive and each thing that it hides, its recorders in turn."""
    jobs: dict[str, Callable[[], Row]] = {}
    for i, name in enumerate(DRIVES):
        recorders = cycle(DRIVES[name].recorders)
        for j, hidden in enumerate(HIDDEN):
            job = partial(row, name, hidden, next(recorders), 1000 * seed + len(HIDDEN) * i + j)
            jobs[f"{name}, {hidden}"] = job
    return jobs


def measure() -> list[Figure]:
    """Rates on a seed that decided nothing."""
    return figures(judged(jobs_of(SEED), None))


def figures(rows: Sequence[Row]) -> list[Figure]:
    """How often what is hidden is named, and what is named wrongly."""
    hiding = [r for r in rows if not r["case"].endswith("nothing")]
    named = sum(r["named"] for r in hiding)
    wrong = [f["effect"] for r in rows for f in r["findings"] if f["mark"] == "wrong"]
    stated = stated_wrong(rows)
    return [
        Figure("what is hidden, named", named / len(hiding), "1", note=f"{named} of {len(hiding)}"),
        Figure("wrong names", len(wrong) / len(rows), "1", note=", ".join(wrong) or "none"),
        Figure(
            "wrong names stated at 90 % or more", len(stated) / len(rows), "1", Target(high=0.03),
            "; ".join(stated) or "none",
        ),
    ]  # fmt: skip


def main(arguments: Sequence[str]) -> int:
    """Judge all drives of a seed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks drives", description=__doc__)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("-o", "--out", type=Path)
    given = parser.parse_args(arguments)
    return report(figures(judged(jobs_of(given.seed), given.out)))
