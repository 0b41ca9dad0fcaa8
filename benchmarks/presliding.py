"""Stiff contacts under noisy readings: `python -m benchmarks presliding [--seed N] [-o FILE]`.

Twenty axes that rest between moves, each on a contact of micrometres (LuGre, Dahl, GMS, or layers
that slip one after another), whose readings have noise of 0.3 to 12 % of its bristle; and the same
with an encoder whose steps scatter as much. As a user goes: a first model of one log (`twin new`),
its true law added (`twin add`), whose values are held against the true ones, and a diagnosis, which
may name that law or one of its kin, and nothing else.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from time import process_time

import numpy as np

from benchmarks.figures import Figure, Target, report
from benchmarks.judgement import WRONG, Expected, Row, judged, row_of
from benchmarks.second_simulator.contacts import (
    DAHL,
    GMS,
    KINDS,
    LAYERS,
    LUGRE,
    Contact,
    drawn,
    log_of,
)
from identify.adding import add
from identify.analysis.first_model import first_model
from identify.workflow import diagnose
from twin.effects import load_catalogue
from twin.logs import Log
from twin.model.machine import AxisModel, Fitted, MachineModel

TITLE = "Stiff contacts whose readings have noise of 0.3 to 12 % of the bristle, with rests"
SEED = 49
CATALOGUE = load_catalogue()
NOISE = (0.003, 0.0075, 0.02, 0.05, 0.12)  # of the bristle
KIN = (LUGRE, DAHL, GMS, LAYERS, "leuven", "modified_leuven")
STIFFNESS, LEVEL = 0.2, 0.02  # relative errors allowed


@dataclass(frozen=True)
class Values:
    """Relative errors of the stiffness and the level of the true law, added to the first model."""

    stiffness: float
    level: float


def row(kind: str, noise: float, seed: int, by: Callable[[Contact], Contact]) -> Row:
    """One contact: the values of its law, and what a diagnosis says; by: its readings."""
    rng = np.random.default_rng([SEED, seed])
    contact = by(drawn(kind, noise, rng))
    training, selection, test = (log_of(contact, rng) for _ in range(3))
    begun = process_time()
    model = first_model({"training": training}, "contact", CATALOGUE)
    found = diagnose(model, training, selection, test, catalogue=CATALOGUE).axes["q"]
    spent = process_time() - begun
    level, stiffness = _estimates(kind, model, training, selection)
    values = Values(stiffness / contact.stiffness - 1.0, level / contact.coulomb - 1.0)
    expected = Expected((kind,), KIN, known=("stribeck",))
    case = f"{kind} {seed}, noise of {noise:.2%} of {contact.coulomb / contact.stiffness:.2g} m"
    return row_of(case, expected, found, spent) | asdict(values)


def _estimates(kind: str, model: MachineModel, log: Log, holdout: Log) -> tuple[float, float]:
    """Level N and stiffness N/m at rest of the true law, added to a first model and fitted."""
    if kind == LAYERS:  # which are all of the friction
        viscous = Fitted.at_start(CATALOGUE["viscous_friction"])
        axis = model.axes["q"].without("coulomb_viscous").with_effect(viscous)
        model = model.with_axis("q", axis)
    values = _values(add(kind, model, log, holdout).model.axes["q"], kind)
    if kind != LAYERS:
        return values["Fc"], values["sigma0"]
    forces = np.array([values[f"f{i}"] for i in range(4)])
    return float(forces.sum()), float(forces @ 2.0 ** np.arange(4) / values["reach"])


def _values(axis: AxisModel, effect: str) -> dict[str, float]:
    return dict(axis[effect].values)


def noisy(contact: Contact) -> Contact:
    """As it was drawn."""
    return contact


def stepped(contact: Contact) -> Contact:
    """With an encoder whose steps scatter as much as the noise that was drawn, and little noise."""
    return replace(contact, noise=0.03 * contact.noise, step=12.0**0.5 * contact.noise)


READINGS = {"": noisy, "steps, ": stepped}  # by what is said before a figure of theirs


def jobs_of(seed: int, by: Callable[[Contact], Contact]) -> dict[str, Callable[[], Row]]:
    """A job for each kind of contact and each amount of noise; by: its readings."""
    pairs = [(kind, noise) for noise in NOISE for kind in KINDS]
    return {
        f"{kind}, {noise:.2%}": partial(row, kind, noise, 100 * seed + i, by)
        for i, (kind, noise) in enumerate(pairs)
    }


def measure() -> list[Figure]:
    """Figures on a seed that decided nothing."""
    return of_seed(SEED, None)


def of_seed(seed: int, out: Path | None) -> list[Figure]:
    """The contacts of a seed under noise, and under the steps of an encoder."""
    found = {said: judged(jobs_of(seed, by), out) for said, by in READINGS.items()}
    return [
        replace(figure, what=f"{said}{figure.what}")
        for said, rows in found.items()
        for figure in figures(rows)
    ]


def figures(rows: Sequence[Row]) -> list[Figure]:
    """How many values are near the true ones, what is named, and what is named wrongly."""
    wrong = [f["effect"] for r in rows for f in r["findings"] if f["mark"] == WRONG]
    stiff, level = (np.abs([r[name] for r in rows]) for name in ("stiffness", "level"))
    return [
        Figure(
            "stiffness within 20 %", float((stiff < STIFFNESS).mean()), "1", Target(low=0.95),
            f"median error {np.median(stiff):.1%}, largest {stiff.max():.1%}",
        ),
        Figure(
            "level within 2 %", float((level < LEVEL).mean()), "1", Target(low=0.95),
            f"median error {np.median(level):.2%}, largest {level.max():.2%}",
        ),
        Figure(
            "named, or told as a tie of its kin", float(np.mean([r["named"] for r in rows])), "1",
            Target(low=0.95),
        ),
        Figure(
            "named as another effect", len(wrong) / len(rows), "1", Target(high=0.0),
            ", ".join(wrong) or "none",
        ),
    ]  # fmt: skip


def main(arguments: Sequence[str]) -> int:
    """Judge the twenty contacts of a seed, read in two ways."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks presliding", description=__doc__)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("-o", "--out", type=Path)
    given = parser.parse_args(arguments)
    return report(of_seed(given.seed, given.out))
