"""What the logs prove and a diagnosis does not say: `python -m benchmarks silence [--machines N]`.

Drives of the second simulator with five recordings each, half of them thinned without a filter, of
which one in most machines is spoiled. What is hidden counts where least squares that know its true
form prove it on held-out logs (``second_simulator.oracle``). As a user goes: a check of each
log, a first model of those to fit, the diagnosis. A spoiled log is to be named, a sound one is not.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from time import process_time

import numpy as np

from benchmarks.drives import CATALOGUE, HIDDEN, KNOWN
from benchmarks.figures import Figure, Target, report
from benchmarks.judgement import Expected, Row, judged, row_of, stated_wrong
from benchmarks.second_simulator.drives import DRIVES, Drive, Plant, Recorder
from benchmarks.second_simulator.oracle import is_otherwise, is_provable
from benchmarks.second_simulator.recordings import AXIS, PATHS, SPOILED, recordings
from identify.analysis.first_model import first_model
from identify.workflow import diagnose
from twin.checks import check_log
from twin.checks.report import Fault
from twin.logs import Log

TITLE = "What the logs prove, with one of five spoiled"
SEED, MACHINES = 83, 60
EFFECTS = tuple(name for name in HIDDEN if name != "nothing")
# Of which a check tells what is wrong with a log, and not how little a sound one tells.
# A jump ahead may be lost counts, or samples that are missing: both tell where it is wrong.
SPOILT = {
    Fault.ALIASED, Fault.OUTLIERS, Fault.STEP, Fault.MISSING, Fault.SATURATION, Fault.LAG,
}  # fmt: skip
SOUND = 0.3  # of the machines, whose logs are all sound


@dataclass(frozen=True)
class Case:
    """A drive, how it is logged, what it hides in which part of its usual size, what is spoiled.

    order: of the recordings; three to fit, one to choose, one to test.
    """

    drive: str
    recorder: Recorder
    hidden: str
    size: float
    spoiled: str | None
    which: str
    order: tuple[str, ...]
    seed: int

    def __str__(self) -> str:
        fault = f"{self.which} {self.spoiled}" if self.spoiled else "sound"
        logged = f"{self.recorder.rate} of {self.recorder.control} Hz"
        return f"{self.seed} {self.drive}, {logged}, {self.size:.1f} {self.hidden}, {fault}"

    @property
    def plants(self) -> tuple[Plant, Plant]:
        """The drive without what it hides, and with it."""
        drive = DRIVES[self.drive]
        full = HIDDEN[self.hidden][0](drive, self.recorder)
        if self.hidden == "flexible":  # which has no part
            return full._replace(load=0.0, mass=full.mass), full
        pairs = zip(drive.plant, full, strict=True)
        return drive.plant, Plant(*(a + self.size * (b - a) for a, b in pairs))

    @property
    def expected(self) -> Expected:
        """What is right to say of it."""
        own = HIDDEN[self.hidden][1]
        return replace(own, known_shapes=(*own.known_shapes, "coulomb_viscous"), known=KNOWN)


def cases(seed: int, machines: int) -> list[Case]:
    """The machines of a seed."""
    rng = np.random.default_rng(seed)
    return [_case(rng, 1000 * seed + i) for i in range(machines)]


def _case(rng: np.random.Generator, seed: int) -> Case:
    thinned = rng.uniform() < 0.5
    rate = int(rng.choice([1000, 2000]))
    control = int(rng.choice([4000, 5000, 10_000])) if thinned else rate
    if thinned and control % rate:
        rate = 1000
    spoiled = None if rng.uniform() < SOUND else str(rng.choice([*SPOILED]))
    which = str(rng.choice([*PATHS]))
    return Case(
        drive=str(rng.choice([*DRIVES])),
        recorder=Recorder(rate, control),
        hidden=str(rng.choice(EFFECTS)),
        size=float(rng.uniform(0.3, 1.0)),
        spoiled=spoiled,
        which="speeds" if spoiled == "aliased" else which,
        order=tuple(map(str, rng.permutation([*PATHS]))),
        seed=seed,
    )


def row(case: Case) -> Row:
    """One machine diagnosed, with what was provable and which logs were named."""
    plain, plant = case.plants
    drive: Drive = DRIVES[case.drive]
    logs = recordings(drive, plant, case.recorder, case.seed, case.spoiled, case.which)
    ordered = [(name, logs[name]) for name in case.order]
    training, selection, test = dict(ordered[:3]), dict(ordered[3:4]), dict(ordered[4:])
    begun = process_time()
    model = first_model(training, case.drive, CATALOGUE)
    found = diagnose(model, training, selection, test, catalogue=CATALOGUE)
    spent = process_time() - begun
    out = row_of(str(case), case.expected, found.axes[AXIS], spent)
    sound = [log for name, log in ordered if not (case.spoiled and name == case.which)]
    out["provable"] = is_provable(plant, plain, sound[:2], sound[2:])
    checked = {name: check_log(log) for name, log in ordered}
    of_all = {Fault.LAG} if plant.lag or plant.delay else set()  # which every log then has
    faults = SPOILT - of_all
    faulty = [n for n, c in checked.items() if any(f.fault in faults for f in c.findings)]
    refused = [name for name, report in checked.items() if not report.ok]
    odd = found.axes[AXIS].dataset.odd
    told = [*refused, *faulty, *([odd.log] if odd else [])]
    out["accused"] = sorted(set(told))
    out["spoiled"] = case.which if case.spoiled else None
    out["otherwise"] = _is_otherwise(case, logs[case.which], sound) if case.spoiled else False
    print(
        f"|   provable {out['provable']}, accused {told}, otherwise {out['otherwise']} |",
        flush=True,
    )
    return out


def _is_otherwise(case: Case, spoiled: Log, sound: Sequence[Log]) -> bool:
    """Whether the spoiled log shows it, beside the same one that nothing spoils."""
    plain, plant = case.plants
    drive: Drive = DRIVES[case.drive]
    plainly = recordings(drive, plant, case.recorder, case.seed, None, case.which)[case.which]
    return is_otherwise(plant, plain, sound, spoiled, plainly)


def jobs_of(seed: int, machines: int) -> dict[str, Callable[[], Row]]:
    """A job for each machine."""
    return {str(case): partial(row, case) for case in cases(seed, machines)}


def measure() -> list[Figure]:
    """Rates on a seed that decided nothing."""
    return figures(judged(jobs_of(SEED, MACHINES), None))


def figures(rows: Sequence[Row]) -> list[Figure]:
    """How often what is provable is named, what is stated wrongly, and which logs are named."""
    provable = [r for r in rows if r["provable"]]
    named = [r for r in provable if r["named"]]
    spoiled = [r for r in rows if r["spoiled"]]
    caught = [r for r in spoiled if r["spoiled"] in r["accused"]]
    showing = [r for r in spoiled if r["otherwise"]]
    blamed = [r["case"] for r in rows if {*r["accused"]} - {r["spoiled"]}]
    wrong = stated_wrong(rows)

    def of(name: str, some: Sequence[Row], among: Sequence[Row], least: float) -> Figure:
        share = len(some) / max(len(among), 1)
        return Figure(name, share, "1", Target(low=least), f"{len(some)} of {len(among)}")

    return [
        of("what is provable, named or equivalent", named, provable, 0.85),
        Figure("wrong names stated at 90 % or more", len(wrong) / max(len(rows), 1), "1",
               Target(high=1.0 / 60), "; ".join(wrong) or "none"),
        of("the spoiled log, named", caught, spoiled, 0.8),
        of("of those that show it, named", [r for r in caught if r["otherwise"]], showing, 0.8),
        Figure("machines of which a sound log is named", len(blamed) / max(len(rows), 1), "1",
               Target(high=0.0), "; ".join(blamed) or "none"),
    ]  # fmt: skip


def main(arguments: Sequence[str]) -> int:
    """Judge some machines of a seed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks silence", description=__doc__)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--machines", type=int, default=6)
    parser.add_argument("-o", "--out", type=Path)
    given = parser.parse_args(arguments)
    return report(figures(judged(jobs_of(given.seed, given.machines), given.out)))
