"""`twin reproduce`: the thesis's study on the twin."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from identify.cli.progress import progress_on_stderr
from identify.cli.shared import (
    Json,
    app,
    catalogue_with,
    machine_model,
    read_measured,
    say,
)
from twin.errors import InputError

if TYPE_CHECKING:
    from identify.thesis.chapters import Reproduction

REPORT, RESULTS = "thesis.html", "thesis.json"
SEED = 1


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
    log: Annotated[
        list[Path] | None,
        typer.Option(
            "--log", help="Log of a real machine to run chapters on, with --model; may be repeated."
        ),
    ] = None,
    model: Annotated[
        str | None, typer.Option("--model", help="Machine model (.toml) that goes with --log.")
    ] = None,
    axis: Annotated[str | None, typer.Option(help="Axis of --log, where several move.")] = None,
    seed: Annotated[
        int | None, typer.Option(help="Draws the noise of the twin.", show_default=str(SEED))
    ] = None,
    as_json_: Json = False,
) -> None:
    """Run the thesis's study on the twin; its printed numbers stand beside ours."""
    from identify import workflow
    from identify.thesis.chapters import reproduce_on_logs
    from twin.files import make_folder
    from twin.numbers import require_seed

    _require_one_source(log, model, small=small, seed=seed, axis=axis)
    drawn = SEED if seed is None else seed
    require_seed(drawn)
    make_folder(out)
    if log is not None and model is not None:
        machine = machine_model(model, catalogue_with(None))
        result = reproduce_on_logs(chapter or (), machine, dict(read_measured(log)), axis=axis)
    else:
        with progress_on_stderr() as progress:
            result = workflow.reproduce(chapter or (), small=small, seed=drawn, progress=progress)
    _write(out, result, as_json_)


def _write(out: Path, result: Reproduction, as_json_: bool) -> None:
    """Write the report and the numbers into a folder, and say them."""
    import json

    from identify.output.plain import plain
    from identify.output.report.thesis import write_reproduction
    from identify.output.reproduction import reproduction_json, reproduction_text
    from twin.files import write_atomically

    found = reproduction_json(result)
    write_reproduction(out / REPORT, result)
    write_atomically(out / RESULTS, json.dumps(plain(found)).encode())
    text = f"{reproduction_text(result)}\nreport: {out / REPORT}"
    say(text, {**found, "report": str(out / REPORT)}, as_json_)


def _require_one_source(
    log: list[Path] | None, model: str | None, *, small: bool, seed: int | None, axis: str | None
) -> None:
    """Raise InputError for options of the twin beside those of a real machine's logs."""
    if (log is None) != (model is None):
        raise InputError("--log and --model go together; give both, or neither to use the twin")
    if log is None and axis is not None:
        raise InputError("--axis chooses an axis of --log; leave it out, or give --log and --model")
    if log is not None and (small or seed is not None):
        name = "--small" if small else "--seed"
        raise InputError(
            f"{name} is for the twin, on which chapters are simulated; logs are used as they were "
            f"recorded: leave out {name}, or --log"
        )
