"""The command line: `twin COMMAND`."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from twin.errors import InputError

if TYPE_CHECKING:
    from identify.workflow import Progress
    from twin.effects import Catalogue
    from twin.log import Log
    from twin.model import StageModel

app = typer.Typer(
    help="Find out why the model and the machine disagree.",
    add_completion=False,
    no_args_is_help=True,
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)

Logs = Annotated[list[Path], typer.Argument(metavar="LOG...", help="MCAP logs to fit on.")]
Model = Annotated[str, typer.Argument(metavar="MODEL", help="Stage model (.toml).")]
Holdout = Annotated[
    list[Path] | None, typer.Option("--holdout", help="MCAP log held out; may be repeated.")
]
Window = Annotated[
    float | None,
    typer.Option("--window", help="Weak-form window in s; from the noise if left out."),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Effects = Annotated[
    list[Path] | None, typer.Option("--effects", help="Your own effect file; may be repeated.")
]


def main() -> None:
    """Entry point of `twin`: errors are one line, exit code 2."""
    try:
        code = app(standalone_mode=False)
    except InputError as error:
        code = _fail(str(error))
    except KeyboardInterrupt:
        code = _fail("interrupted")
    except Exception as error:
        # Usage errors; their class has moved between versions of the command-line library.
        if not hasattr(error, "format_message"):
            raise
        code = _fail(f"{error.format_message()} See `twin --help`.")
    sys.exit(code if isinstance(code, int) else 0)


def _fail(message: str) -> int:
    print(f"twin: {' '.join(message.split())}", file=sys.stderr)
    return 2


@contextmanager
def _bars() -> Iterator[Progress]:
    """Progress bars on standard error, one for each kind of work."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    tasks: dict[str, Any] = {}
    console = Console(stderr=True)
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as bars:

        def show(what: str, done: int, total: int) -> None:
            if what not in tasks:
                tasks[what] = bars.add_task(what, total=total)
            bars.update(tasks[what], completed=done)

        yield show


def _say(text: str, result: dict[str, Any], as_json: bool) -> None:
    from identify.output import plain

    print(json.dumps(plain(result)) if as_json else text)


def _catalogue(files: list[Path] | None) -> Catalogue:
    from twin.effects import load_catalogue

    return load_catalogue(files or ())


def _model(name: str, catalogue: Catalogue) -> StageModel:
    from twin.model_file import load_model

    return load_model(name, catalogue)


def _logs(paths: list[Path] | None) -> dict[str, Log]:
    from twin.log import read_log

    return {str(path): read_log(path) for path in paths or ()}


def _check_output(path: Path) -> None:
    """Fail before the work, not after it."""
    if not path.parent.is_dir():
        raise InputError(f"{path}: its folder does not exist; create {path.parent} first")


@app.command()
def simulate(
    experiment: Annotated[str, typer.Argument(help="tracking, moves, cable_pass, ...")],
    model: Annotated[str, typer.Option("--model", help="Stage model (.toml).")] = "proton_xy",
    out: Annotated[Path, typer.Option("--out", "-o", help="MCAP log to write.")] = Path("log.mcap"),
    seed: Annotated[int, typer.Option(help="Same seed, same log.")] = 0,
    duration: Annotated[float, typer.Option(help="s")] = 20.0,
    axis: Annotated[str | None, typer.Option(help="Axis that moves, where one does.")] = None,
    effects: Effects = None,
    as_json: Json = False,
) -> None:
    """Run an experiment on the twin in MuJoCo and log it as MCAP."""
    from functools import partial

    from twin.experiments import simulate as run
    from twin.log import write_log

    _check_output(out)
    stage = _model(model, _catalogue(effects))
    with _bars() as bars:
        log = run(
            stage, experiment, seed=seed, duration=duration, axis=axis,
            progress=partial(bars, "simulating"),
        )  # fmt: skip
        write_log(log, out, progress=partial(bars, "writing"))
    result = {"log": str(out), "samples": len(log), "sample_rate": log.sample_rate, "unit": "Hz"}
    _say(f"{out}: {len(log)} samples at {log.sample_rate:g} Hz", result, as_json)


@app.command("import")
def import_(
    source: Annotated[Path, typer.Argument(help="CSV, MAT, Parquet, HDF5 or TDMS file.")],
    mapping: Annotated[Path, typer.Option("--map", help="Columns, units, scale, sign, rate.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="MCAP log to write.")],
    as_json: Json = False,
) -> None:
    """Turn a machine's recording into an MCAP log."""
    from twin.log import write_log
    from twin.log.importers import import_log, load_mapping

    _check_output(out)
    log = import_log(source, load_mapping(mapping))
    write_log(log, out)
    result = {"log": str(out), "samples": len(log), "sample_rate": log.sample_rate, "unit": "Hz"}
    _say(f"{out}: {len(log)} samples at {log.sample_rate:g} Hz", result, as_json)


@app.command()
def check(logs: Logs, as_json: Json = False) -> None:
    """Say whether logs are fit for identification, and what is wrong with them."""
    from twin.log.check import check_log

    reports = {name: check_log(log) for name, log in _logs(logs).items()}
    ok = all(report.ok for report in reports.values())
    lines = [f"{name}: {report}" for name, report in reports.items()]
    result = {
        "ok": ok,
        "logs": {
            name: [
                {"severity": f.severity.name.lower(), "axis": f.axis, "what": f.what,
                 "where": f.where, "remedy": f.remedy}
                for f in report.findings
            ]
            for name, report in reports.items()
        },
    }  # fmt: skip
    _say("\n".join(lines), result, as_json)
    if not ok:
        raise typer.Exit(1)


@app.command()
def recover(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Damaged MCAP log.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="MCAP log of what is intact.")],
    as_json: Json = False,
) -> None:
    """Keep the intact part of a damaged log."""
    from twin.log import recover_log, write_log

    _check_output(out)
    good, recovery = recover_log(log)
    write_log(good, out)
    result = {"log": str(out), "kept": recovery.kept, "lost": list(recovery.lost)}
    _say(str(recovery), result, as_json)


@app.command()
def fit(
    model: Model,
    logs: Logs,
    holdout: Holdout = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Fitted model to write.")] = None,
    window: Window = None,
    effects: Effects = None,
    as_json: Json = False,
) -> None:
    """Identify the parameters of the model's effects."""
    from identify import output, workflow
    from twin.model_file import save_model

    if out:
        _check_output(out)
    stage = _model(model, _catalogue(effects))
    with _bars() as bars:
        result = workflow.fit(stage, _logs(logs), _logs(holdout), window=window, progress=bars)
    if out:
        save_model(result.model, out)
    _say(output.fit_text(result), output.fit_json(result), as_json)


@app.command()
def compare(
    model: Model,
    logs: Logs,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="HTML report.")] = None,
    window: Window = None,
    effects: Effects = None,
    as_json: Json = False,
) -> None:
    """Say how far model and machine are apart, and where the model fails."""
    from identify import output, workflow

    if out:
        _check_output(out)
    stage = _model(model, _catalogue(effects))
    result = workflow.compare(stage, _logs(logs), window=window)
    if out:
        from identify.report import write_report

        write_report(
            out, title=f"{stage.name}: model against measurement", diagnosis=None,
            comparison=result, history=stage.history,
        )  # fmt: skip
    _say(output.compare_text(result), output.compare_json(result), as_json)


@app.command()
def diagnose(
    model: Model,
    logs: Logs,
    holdout: Holdout = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="HTML report.")] = None,
    window: Window = None,
    effects: Effects = None,
    as_json: Json = False,
) -> None:
    """Say which physical effect is missing, with the evidence for it."""
    from identify import output, workflow

    if out:
        _check_output(out)
    catalogue = _catalogue(effects)
    stage = _model(model, catalogue)
    with _bars() as bars:
        result = workflow.diagnose(
            stage, _logs(logs), _logs(holdout), catalogue=catalogue, window=window, progress=bars
        )
    if out:
        from identify.report import write_report

        write_report(
            out, title=f"{stage.name}: what the model lacks", diagnosis=result,
            comparison=result.comparison, history=result.model.history,
        )  # fmt: skip
    _say(output.diagnose_text(result), output.diagnose_json(result), as_json)


@app.command()
def add(
    effect: Annotated[str, typer.Argument(metavar="EFFECT", help="Name from `twin effects`.")],
    model: Model,
    logs: Logs,
    out: Annotated[Path, typer.Option("--out", "-o", help="Model with the effect.")],
    holdout: Holdout = None,
    axis: Annotated[
        str | None, typer.Option(help="Axis; the one it helps most if left out.")
    ] = None,
    window: Window = None,
    effects: Effects = None,
    as_json: Json = False,
) -> None:
    """Add an effect, refit, and record the error before and after."""
    from identify import output, workflow
    from twin.model_file import save_model

    _check_output(out)
    catalogue = _catalogue(effects)
    chosen = catalogue[effect]
    stage = _model(model, catalogue)
    with _bars() as bars:
        result = workflow.add(
            chosen, stage, _logs(logs), _logs(holdout), axis=axis, window=window, progress=bars
        )
    save_model(result.model, out)
    _say(output.add_text(result), output.add_json(result), as_json)
    if not result.kept:
        raise typer.Exit(1)


@app.command()
def effects(
    name: Annotated[str | None, typer.Argument(help="One effect in full.")] = None,
    files: Effects = None,
    as_json: Json = False,
) -> None:
    """Print the catalogue, or one effect with its equation, units and source."""
    from identify import output

    catalogue = _catalogue(files)
    if name is not None:
        chosen = catalogue[name]
        _say(output.effect_text(chosen), output.effect_json(chosen), as_json)
        return
    everything = list(catalogue.values())
    _say(
        output.effects_text(everything),
        {"effects": [output.effect_json(e) for e in everything]},
        as_json,
    )


@app.command()
def demo(
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder to write into.")] = Path("demo"),
    seed: Annotated[int, typer.Option(help="Draws the machine and its hidden effect.")] = 2,
    model: Annotated[str, typer.Option("--model", help="Stage model (.toml).")] = "proton_xy",
    effects: Effects = None,
    as_json: Json = False,
) -> None:
    """Run the whole loop on a machine with an effect that the analysis is not told of."""
    from identify import output
    from identify.demo import demo as run

    catalogue = _catalogue(effects)
    stage = _model(model, catalogue)

    def say(text: str) -> None:
        print(text, file=sys.stderr if as_json else sys.stdout, flush=True)

    with _bars() as bars:
        result = run(stage, catalogue, out, seed, say, bars)
    hidden = result.hidden.effect.name
    summary = {
        "hidden": hidden,
        "named": result.named,
        "report": str(result.report),
        "diagnosis": output.diagnose_json(result.diagnosis),
        "addition": result.addition and output.add_json(result.addition),
    }
    verdict = "the diagnosis is right" if result.named else "the diagnosis did not name it"
    _say(f"5. hidden was {hidden}: {verdict}\nreport: {result.report}", summary, as_json)
    if not result.named:
        raise typer.Exit(1)
