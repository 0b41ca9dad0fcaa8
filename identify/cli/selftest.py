"""`twin selftest`: does the diagnosis name what is planted?"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from identify.cli.shared import Json, app, require_folder, say


@app.command()
def selftest(
    full: Annotated[bool, typer.Option("--full", help="All strengths, many machines.")] = False,
    seed: Annotated[int, typer.Option(help="Draws the machines.")] = 1,
    only: Annotated[
        list[str] | None, typer.Option("--only", help="Plant this effect only; may be repeated.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Picture of the confusion matrix.")
    ] = None,
    as_json_: Json = False,
) -> None:
    """Plant effects in machines drawn at random, and count how often they are named."""
    from identify.selftest import FULL, QUICK, coverage, draw, rates, run_all, selftest_json
    from identify.selftest.trial import Outcome
    from twin.effects import load_catalogue

    if out:
        require_folder(out)
    catalogue = load_catalogue()
    names = [catalogue[name].name for name in only or ()] or None

    def tell(outcome: Outcome, done: int, total: int) -> None:
        print(f"{done} of {total}: {outcome.in_words()}", file=sys.stderr, flush=True)

    outcomes = run_all((FULL if full else QUICK).cases(seed, names), progress=tell)
    if out:
        draw(outcomes, out)
    lines = [r.in_words() for r in rates(outcomes)]
    lines += [f"  interval of {rate.in_words()}" for rate in coverage(outcomes).values()]
    say("\n".join(lines), selftest_json(outcomes), as_json_)
