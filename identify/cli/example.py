"""The command that writes an example to begin with."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from identify.cli.shared import Json, app, say


@app.command()
def example(
    name: Annotated[
        str | None, typer.Argument(help="Which example; all are listed if left out.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="New folder; NAME if left out.")
    ] = None,
    as_json_: Json = False,
) -> None:
    """Write an example with its data and the commands to type, or list the examples.

    Example: twin example hidden_effect
    """
    from twin.examples import EXAMPLES, write_example

    if name is None:
        width = max(map(len, EXAMPLES))
        lines = [f"{key:{width}s}  {one.summary}" for key, one in EXAMPLES.items()]
        say("\n".join(lines), {"examples": {k: e.summary for k, e in EXAMPLES.items()}}, as_json_)
        return
    into = out or Path(name)
    chosen, files = write_example(name, into)
    lines = [f"{into}: {', '.join(file.name for file in files)}"]
    lines += [f"data: {chosen.data}"] if chosen.data else []
    lines += ["now:", f"  cd {into}", *(f"  {command}" for command in chosen.commands)]
    result = {
        "folder": str(into), "files": [str(file) for file in files],
        "commands": list(chosen.commands), "data": chosen.data,
    }  # fmt: skip
    say("\n".join(lines), result, as_json_)
