"""`twin reproduce`: the thesis's study on the twin."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from identify.cli.shared import Json, app, bars_on_stderr, say

REPORT, RESULTS = "thesis.html", "thesis.json"


@app.command()
def reproduce(
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder to write into.")] = Path("out"),
    chapter: Annotated[
        list[str] | None,
        typer.Option("--chapter", help="simulation, cable, ...; all if left out; may be repeated."),
    ] = None,
    small: Annotated[
        bool, typer.Option("--small", help="Fewer speeds, trials and passes.")
    ] = False,
    seed: Annotated[int, typer.Option(help="Draws the noise.")] = 1,
    as_json_: Json = False,
) -> None:
    """Run the thesis's study on the twin; its printed numbers stand beside ours."""
    import json

    from identify import workflow
    from identify.output.plain import plain
    from identify.output.report.thesis import write_reproduction
    from identify.output.reproduction import reproduction_json, reproduction_text
    from twin.files import make_folder, write_atomically

    make_folder(out)
    with bars_on_stderr() as bars:
        result = workflow.reproduce(chapter or (), small=small, seed=seed, progress=bars)
    found = reproduction_json(result)
    write_reproduction(out / REPORT, result)
    write_atomically(out / RESULTS, json.dumps(plain(found)).encode())
    text = f"{reproduction_text(result)}\nreport: {out / REPORT}"
    say(text, {**found, "report": str(out / REPORT)}, as_json_)
