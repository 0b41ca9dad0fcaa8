"""`twin selftest`: how often the diagnosis names planted effects."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from identify.cli.shared import Json, app, require_folder, say

Full = Annotated[
    bool, typer.Option("--full", help="Many machines, drawn with the seed of this version.")
]
Seed = Annotated[int | None, typer.Option(help="Draws the machines.")]
Only = Annotated[
    list[str] | None, typer.Option("--only", help="Plant this effect only; may be repeated.")
]
Again = Annotated[
    list[str] | None,
    typer.Option("--case", help="One machine again, by the name printed; may be repeated."),
]
Matrix = Annotated[
    Path | None, typer.Option("--out", "-o", help="Picture of the confusion matrix.")
]
Reliability = Annotated[
    Path | None,
    typer.Option("--reliability", help="Picture of confidence against how often right."),
]


@app.command()
def selftest(
    full: Full = False,
    seed: Seed = None,
    only: Only = None,
    case: Again = None,
    out: Matrix = None,
    reliability: Reliability = None,
    as_json_: Json = False,
) -> None:
    """Plant effects in machines drawn at random, and count how often they are named.

    Example: twin selftest --only cogging
    """
    from identify.output.selftest import selftest_json, selftest_text, trial_in_words
    from identify.selftest import (
        FULL,
        QUICK,
        TrialResult,
        draw,
        draw_reliability,
        parse_case,
        release_seed,
        run_all,
    )  # fmt: skip
    from identify.selftest.design import DEVELOPMENT
    from identify.selftest.laws import OUTSIDE
    from identify.selftest.variations import VARIATIONS
    from twin.effects import load_catalogue

    for path in (out, reliability):
        if path:
            require_folder(path)
    catalogue = load_catalogue()
    names = [catalogue[name].name for name in only or ()] or None
    chosen = seed if seed is not None else release_seed() if full else DEVELOPMENT
    cases = [parse_case(text, {*catalogue, *OUTSIDE}, VARIATIONS) for text in case or ()]

    def tell(result: TrialResult, done: int, total: int) -> None:
        print(f"{done} of {total}: {trial_in_words(result)}", file=sys.stderr, flush=True)

    results = run_all(cases or (FULL if full else QUICK).cases(chosen, names), progress=tell)
    if out:
        draw(results, out)
    if reliability:
        draw_reliability(results, reliability)
    say(selftest_text(results, chosen), selftest_json(results, chosen), as_json_)
