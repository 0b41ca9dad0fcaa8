"""The self-test: machines with planted effects, and how often the diagnosis names them.

`python -m benchmarks selftest` plants effects in a few machines drawn at random, and counts how
often they are named. Every machine that failed is printed with the command that makes it again.
With `--results` alone, the full design goes into RESULTS and the pictures of the site.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Sequence
from pathlib import Path

from benchmarks.figures import Figure, Target
from benchmarks.selftest.design import DEVELOPMENT, FULL, QUICK, release_seed, run_all
from benchmarks.selftest.laws import OUTSIDE
from benchmarks.selftest.machines import Case, parse_case
from benchmarks.selftest.tally import rates
from benchmarks.selftest.trial import TrialResult
from benchmarks.selftest.variations import VARIATIONS
from benchmarks.selftest.words import (
    confusion_matrix,
    reliability_diagram,
    require_format,
    save,
    selftest_json,
    selftest_text,
    tell,
)
from twin.effects import load_catalogue
from twin.files import require_writable

TITLE = "Self-test: effects planted in machines drawn at random, logs of 12 s, one axis"
DOCS = Path(__file__).parents[2] / "docs"


def measure() -> list[Figure]:
    """Run the full design with the release's seed; draws the pictures that the site shows."""
    results = run_all(FULL.cases(release_seed()), progress=tell)
    save(confusion_matrix(results), DOCS / "selftest.png")
    save(reliability_diagram(results), DOCS / "reliability.png")
    return figures(results)


def figures(results: Sequence[TrialResult]) -> list[Figure]:
    """The rates with their targets."""
    return [
        Figure(r.what, r.value, "1", Target(*r.asked) if r.asked else None,
               f"{r.count} of {r.trials}")
        for r in rates(results)
    ]  # fmt: skip


def parser() -> argparse.ArgumentParser:
    """The options."""
    out = argparse.ArgumentParser(prog="python -m benchmarks selftest", description=__doc__)
    add = out.add_argument
    add("--full", action="store_true", help="many machines, drawn with the seed of this version")
    add("--seed", type=int, help="draws the machines")
    add(
        "--only", nargs="+", action="extend", default=[], metavar="EFFECT", help="plant these alone"
    )
    add(
        "--case", nargs="+", action="extend", default=[], metavar="NAME",
        help="machines again, by the names printed",
    )  # fmt: skip
    add("-o", "--out", type=Path, help="picture of the confusion matrix")
    add("--reliability", type=Path, help="picture of confidence against how often right")
    add("--json", action="store_true", help="print one JSON object")
    return out


def chosen(given: argparse.Namespace) -> tuple[int, list[Case]]:
    """The seed and the machines that options ask for. Raises InputError for names of none."""
    catalogue = load_catalogue()
    names = [catalogue[name].name for name in given.only] or None
    seed = given.seed if given.seed is not None else release_seed() if given.full else DEVELOPMENT
    cases = [parse_case(text, {*catalogue, *OUTSIDE}, VARIATIONS) for text in given.case]
    return seed, cases or (FULL if given.full else QUICK).cases(seed, names)


def main(arguments: Sequence[str]) -> int:
    """Run the machines asked for and print the rates, as text or as one JSON object."""
    given = parser().parse_args(arguments)
    pictures = ((confusion_matrix, given.out), (reliability_diagram, given.reliability))
    for _, path in pictures:
        if path:
            require_format(path)
            require_writable(path)
    seed, cases = chosen(given)
    results = run_all(cases, progress=tell)
    for picture, path in pictures:
        if path:
            save(picture(results), path)
    told = json.dumps(selftest_json(results, seed)) if given.json else selftest_text(results, seed)
    print(told)
    return 0
