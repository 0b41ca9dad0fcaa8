"""`python -m studies.thesis`: run the study, write its report and its numbers, and say them."""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from identify.cli.command import progress_on_stderr
from identify.output.answers import plain
from studies.thesis.reproduction import reproduce
from twin.errors import InputError
from twin.files import make_folder, write_atomically
from twin.numbers import require_seed

REPORT, RESULTS = "thesis.html", "thesis.json"


def main(given: Sequence[str] | None = None) -> int:
    """Run chapters; exit code 2 with one line for bad input."""
    parser = argparse.ArgumentParser("python -m studies.thesis", description=__doc__)
    parser.add_argument("-o", "--out", type=Path, default=Path("out"), help="folder to write into")
    chapter = "simulation, cable, ...; all if left out; may be repeated"
    parser.add_argument("--chapter", action="append", default=[], metavar="NAME", help=chapter)
    parser.add_argument("--small", action="store_true", help="fewer speeds, trials and passes")
    parser.add_argument("--seed", type=int, default=1, help="draws the noise of the twin")
    parser.add_argument("--json", action="store_true", help="print one JSON object, nothing else")
    asked = parser.parse_args(given)
    try:
        require_seed(asked.seed)
        make_folder(asked.out)
        with progress_on_stderr() as shown:
            done = reproduce(asked.chapter, small=asked.small, seed=asked.seed, progress=shown)
        report, found = asked.out / REPORT, done.numbers()
        done.write(report)
        write_atomically(asked.out / RESULTS, json.dumps(plain(found)).encode())
    except InputError as error:
        print(f"thesis: {error}", file=sys.stderr)
        return 2
    told = json.dumps(plain({**found, "report": str(report)}))
    print(told if asked.json else f"{done}\nreport: {report}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
