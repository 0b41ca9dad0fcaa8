"""`twin agree`: whether two fits agree."""

from __future__ import annotations

from typing import Annotated

import typer

from identify.cli.progress import progress_on_stderr
from identify.cli.shared import Effects, Json, app, catalogue_with, machine_model, say


@app.command()
def agree(
    a: Annotated[str, typer.Argument(metavar="A", help="Fitted model (.toml).")],
    b: Annotated[str, typer.Argument(metavar="B", help="Fitted model (.toml).")],
    effects: Effects = None,
    as_json_: Json = False,
) -> None:
    """Say whether two fits agree within their uncertainties; exit code 1 where they do not.

    Example: twin agree monday.toml friday.toml
    """
    from identify import workflow
    from identify.output.as_json import agree_json
    from identify.output.text import agree_text

    catalogue = catalogue_with(effects)
    fits = [machine_model(name, catalogue) for name in (a, b)]
    with progress_on_stderr() as progress:
        progress("comparing the fits", 0, 1)
        result = workflow.agree(*fits, catalogue=catalogue)
    say(agree_text(result), {"a": a, "b": b, **agree_json(result)}, as_json_)
    if not result.agrees:
        raise typer.Exit(1)
