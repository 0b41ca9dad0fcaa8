"""Which of two logs chooses: `python -m benchmarks roles [--seed N] [-o FILE]`.

The drives of ``drives``, each diagnosed twice with one model: with the one log to fit and the other
to choose, and the other way round. Two answers are the same where each finding of the one is named,
or told to be level, by one of the other. A finding that only one has may be told to depend on which
log chooses: by the answer that has it, or by both; or the other may tell that its test log refuses
it, which is why it is not there.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from benchmarks.drives import CATALOGUE, HIDDEN, jobs_of
from benchmarks.figures import Figure, Target, report
from benchmarks.judgement import NUMBER, Row
from benchmarks.second_simulator.drives import DRIVES, Recorder, log_of
from identify.analysis.first_model import first_model
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.findings import Finding
from identify.workflow import diagnose

TITLE = "Which of two logs chooses"
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


def row(name: str, hidden: str, recorder: Recorder, seed: int) -> Row:
    """One drive, its two logs in both orders."""
    drive, (change, _) = DRIVES[name], HIDDEN[hidden]
    plant = change(drive, recorder)
    one, other, test = (log_of(drive, plant, recorder, 3 * seed + i) for i in range(3))
    model = first_model({"one": one, "other": other}, name, CATALOGUE)
    found = [
        diagnose(model, *pair, test, catalogue=CATALOGUE).axes["q"]
        for pair in ((one, other), (other, one))
    ]
    answers = [families(answer.findings) for answer in found]
    own = [{law.effect for law in answer.by_roles} for answer in found]
    lone = [alone(*found), alone(*found[::-1])]
    return {
        "case": f"{name} at {recorder.rate} Hz, {hidden}",
        "same": same(*answers),
        "told": all(effects <= says for effects, says in zip(lone, own, strict=True)),
        "told by both": all(effects <= says for effects in lone for says in own),
        "answers": [[sorted(family) for family in answer] for answer in answers],
        "by roles": [sorted(says) for says in own],
    }


def rows(seed: int, out: Path | None = None) -> list[Row]:
    """Of all drives; each is printed, and written to a file where one is given, as it ends."""
    found = []
    for job in jobs_of(seed).values():
        assert isinstance(job, partial)
        found.append(row(*job.args))
        own = found[-1]
        mark = "same" if own["same"] else "told" if own["told"] else "OTHER"
        print(f"{mark}: {own['case']}: {own['answers']}, {own['by roles']}", flush=True)
        if out:
            with out.open("a", encoding="utf-8") as file:
                file.write(json.dumps(own) + "\n")
    return found


def measure() -> list[Figure]:
    """On a seed that decided nothing."""
    return figures(rows(SEED))


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
    """Judge all drives of a seed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks roles", description=__doc__)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("-o", "--out", type=Path)
    given = parser.parse_args(arguments)
    return report(figures(rows(given.seed, given.out)))
