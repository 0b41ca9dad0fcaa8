"""The door: maps proposed for recordings that are drawn, `python -m benchmarks door --help`."""

from __future__ import annotations

import argparse
from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np

from benchmarks.door.recordings import draw
from benchmarks.door.verdict import Verdict, judge
from benchmarks.figures import Figure, Target, report
from twin.errors import InputError
from twin.importers.guess import propose

TITLE = "The door: maps proposed for recordings of other recorders"
FILES, SEED = 40, 9
ROWS = 1_000_000  # of a long recording


def measure() -> list[Figure]:
    """Forty files, and how long a long one takes."""
    with TemporaryDirectory() as folder:
        verdicts = judged(Path(folder), FILES, SEED)
        return [*figures(verdicts), _long(Path(folder))]


def judged(folder: Path, files: int, seed: int) -> list[Verdict]:
    """The verdicts on so many files, which are written into a folder."""
    out = []
    for number in range(files):
        recording = draw(folder, seed, number)
        begun = perf_counter()
        try:
            text = propose(recording.path).map_text({})
        except InputError as error:
            out.append(Verdict(recording, missed=[f"not read: {error}"]))
            continue
        out.append(judge(recording, text, perf_counter() - begun))
    return out


def figures(verdicts: Sequence[Verdict]) -> list[Figure]:
    """How many maps are right or asked for, and how many are wrong without a word."""
    words = Counter(v.word for v in verdicts)
    count = len(verdicts)
    good = words["right"] + words["asked"]
    told = ", ".join(f"{n} {w}" for w, n in words.most_common())
    return [
        Figure("maps that are right or ask for what is not known", good / count, "1",
               Target(low=0.9), told),
        Figure("maps that are wrong without a word, of forty", 40.0 * words["WRONG"] / count, "1",
               Target(high=1.0)),
    ]  # fmt: skip


def _long(folder: Path) -> Figure:
    rng = np.random.default_rng(SEED)
    t = np.arange(ROWS) / 10_000.0
    q = 0.05 * np.sin(5.0 * t) + 0.02 * np.sin(13.0 * t)
    table = np.column_stack([t, q, q, rng.standard_normal(ROWS)])
    path = folder / "long.csv"
    np.savetxt(path, table, delimiter=",", header="t,pos,pos_cmd,force", comments="", fmt="%.7g")
    begun = perf_counter()
    propose(path).map_text({})
    seconds = perf_counter() - begun
    return Figure("a map for a million rows", seconds, "s", Target(high=3.0))


def main(arguments: Sequence[str]) -> int:
    """Judge as many files as asked for; 0 where every target is met."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks door", description=__doc__)
    parser.add_argument("--files", type=int, default=FILES)
    parser.add_argument("--seed", type=int, default=SEED)
    parser.add_argument("--keep", type=Path, help="folder for the files and the maps")
    given = parser.parse_args(arguments)
    with TemporaryDirectory() as temporary:
        folder = given.keep or Path(temporary)
        folder.mkdir(parents=True, exist_ok=True)
        verdicts = judged(folder, given.files, given.seed)
    for v in verdicts:
        r = v.recording
        print(f"{r.path.name}  {v.word:8s} {v.seconds:5.2f} s  {r.recorder}, {r.fault}")
        for what in (
            *v.wrong,
            *v.assumed,
            *v.missed,
            *(a for a in v.asked if "scale" not in a and "constant" not in a),
        ):
            print(f"      {what}")
    return report(figures(verdicts))
