"""Which of some logs chooses: `python -m benchmarks roles [--foreign] [--seed N] [-o FILE]`.

The drives of ``drives``, each diagnosed twice with one model: with the one log to fit and the other
to choose, and the other way round; and the machines of ``foreign``, of whose three logs each
chooses once. Two answers are the same where each finding of the one is named, or told to be level,
by one of the other. A finding that only one has may be told to depend on which log chooses: by the
answer that has it, or by both; or the other may tell that its test log refuses it, which is why it
is not there.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterable, Sequence
from functools import partial
from itertools import combinations, permutations
from pathlib import Path

from benchmarks.drives import CATALOGUE, HIDDEN, jobs_of
from benchmarks.figures import Figure, Target, report
from benchmarks.foreign import DURATION, FLOORS, FORMS, made
from benchmarks.judgement import NUMBER, Row, fitted
from benchmarks.second_simulator.drives import DRIVES, Recorder, log_of
from benchmarks.second_simulator.effects import INSIDE
from benchmarks.second_simulator.machine import logs_of
from identify.analysis.first_model import first_model
from identify.selection.diagnosis import AxisDiagnosis, diagnose_axis
from identify.selection.findings import Finding
from identify.workflow import diagnose

TITLE = "Which of some logs chooses"
SEED = 64


def families(findings: Sequence[Finding]) -> list[frozenset[str]]:
    """Of each finding its effect and those that are level with it."""
    return [frozenset(NUMBER.sub("", n) for n in (f.effect, *f.tied)) for f in findings]


def same(one: Sequence[frozenset[str]], other: Sequence[frozenset[str]]) -> bool:
    """Whether each finding of either is one of the other."""
    return len(one) == len(other) and all(
        any(a & b for b in there) for here, there in ((one, other), (other, one)) for a in here
    )


def alone(here: AxisDiagnosis, there: AxisDiagnosis) -> set[str]:
    """Effects that one answer names and the other neither names nor tells to be contradicted."""
    other = [*families(there.findings), *families(there.contradicted)]
    named = zip(here.findings, families(here.findings), strict=True)
    return {f.effect for f, family in named if not any(family & b for b in other)}


def row(case: str, found: Sequence[AxisDiagnosis]) -> Row:
    """The answers of one machine, of which another log chose each."""
    answers = [families(answer.findings) for answer in found]
    own = [{law.effect for law in answer.depends_on_roles} for answer in found]
    pairs = [*combinations(range(len(found)), 2)]
    lone = {(i, j): alone(found[i], found[j]) for i, j in permutations(range(len(found)), 2)}
    return {
        "case": case,
        "same": all(same(answers[i], answers[j]) for i, j in pairs),
        "told": all(effects <= own[i] for (i, _), effects in lone.items()),
        "told by both": all(effects <= own[i] & own[j] for (i, j), effects in lone.items()),
        "answers": [[sorted(family) for family in answer] for answer in answers],
        "by roles": [sorted(says) for says in own],
    }


def of_drive(name: str, hidden: str, recorder: Recorder, seed: int) -> Row:
    """One drive, its two logs in both orders."""
    drive, (change, _) = DRIVES[name], HIDDEN[hidden]
    plant = change(drive, recorder)
    one, other, test = (log_of(drive, plant, recorder, 3 * seed + i) for i in range(3))
    model = first_model({"one": one, "other": other}, name, CATALOGUE)
    pairs = (one, other), (other, one)
    found = [diagnose(model, *pair, test, catalogue=CATALOGUE).axes["q"] for pair in pairs]
    return row(f"{name} at {recorder.rate} Hz, {hidden}", found)


def of_machine(name: str, seed: int) -> Row:
    """One machine of the second simulator, bumps, cable and friction of forms of its own."""
    own = made(name, FLOORS, seed, [*FORMS])
    training, held_out = logs_of(own.machine, own.code, DURATION)
    logs, found = {**training, **held_out}, []
    for chosen in logs:
        rest = {n: log for n, log in logs.items() if n != chosen}
        dataset, base = fitted(own.model, "x", rest, {chosen: logs[chosen]})
        found.append(diagnose_axis(base, dataset, CATALOGUE))
    return row(f"{name} {seed}", found)


def rows_of(jobs: Iterable[Callable[[], Row]], out: Path | None = None) -> list[Row]:
    """Of all machines; each is printed, and written to a file where one is given, as it ends."""
    found = []
    for job in jobs:
        found.append(own := job())
        mark = "same" if own["same"] else "told" if own["told"] else "OTHER"
        print(f"{mark}: {own['case']}: {own['answers']}, {own['by roles']}", flush=True)
        if out:
            with out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(own) + "\n")
    return found


def drives(seed: int) -> list[Callable[[], Row]]:
    """The drives of a seed."""
    jobs = (job for job in jobs_of(seed).values() if isinstance(job, partial))
    return [partial(of_drive, *job.args) for job in jobs]


def machines(seed: int) -> list[Callable[[], Row]]:
    """The machines of the second simulator of a seed: nothing, and each effect of the catalogue."""
    return [partial(of_machine, name, seed) for name in ("nothing", *INSIDE)]


def measure() -> list[Figure]:
    """On seeds that decided nothing."""
    return figures(rows_of([*drives(SEED), *machines(SEED)]))


def figures(found: Sequence[Row]) -> list[Figure]:
    """How often the answer is the same."""
    alike = sum(r["same"] for r in found)
    told = sum(r["same"] or r["told"] for r in found)
    both = sum(r["same"] or r["told by both"] for r in found)
    return [
        Figure("the answer is the same, or says that it depends on it", told / len(found), "1",
               Target(low=0.95), f"{told} of {len(found)}"),
        Figure("the same, or both answers say so", both / len(found), "1",
               note=f"{both} of {len(found)}"),
        Figure("the answer is the same whichever log chooses", alike / len(found), "1",
               note=f"{alike} of {len(found)}"),
    ]  # fmt: skip


def main(arguments: Sequence[str]) -> int:
    """Judge all drives of a seed, or all machines of the second simulator."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks roles", description=__doc__)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--foreign", action="store_true", help="those of the second simulator")
    parser.add_argument("-o", "--out", type=Path)
    given = parser.parse_args(arguments)
    jobs = machines(given.seed) if given.foreign else drives(given.seed)
    return report(figures(rows_of(jobs, given.out)))
