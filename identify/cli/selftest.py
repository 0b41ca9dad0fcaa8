"""`twin selftest`: how often the diagnosis names planted effects."""

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
    from identify.output.selftest import selftest_json, selftest_text
    from identify.output.words.selftest import trial_in_words
    from identify.selftest import FULL, QUICK, draw, run_all
    from identify.selftest.trial import TrialResult
    from twin.effects import load_catalogue

    if out:
        require_folder(out)
    catalogue = load_catalogue()
    names = [catalogue[name].name for name in only or ()] or None

    def tell(result: TrialResult, done: int, total: int) -> None:
        print(f"{done} of {total}: {trial_in_words(result)}", file=sys.stderr, flush=True)

    results = run_all((FULL if full else QUICK).cases(seed, names), progress=tell)
    if out:
        draw(results, out)
    say(selftest_text(results), selftest_json(results), as_json_)
