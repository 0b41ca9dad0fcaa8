"""Commands of the loop: fit, compare, diagnose, add, demo."""

from __future__ import annotations

import shlex
import sys
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from identify.cli.apart import require_apart
from identify.cli.progress import progress_on_stderr
from identify.cli.shared import (
    MEANINGLESS,
    Effects,
    FitLogs,
    Holdout,
    Json,
    Logs,
    Model,
    Test,
    TestFunction,
    app,
    catalogue_with,
    left_out,
    machine_model,
    read_checked,
    require_folder,
    require_report,
    say,
    unconfirmed,
    with_roles,
)

if TYPE_CHECKING:
    from identify.output.report import Source


class Objective(StrEnum):
    """What a fit brings near the measurement."""

    FORCE = "force"
    SIMULATION = "simulation"


@app.command()
def fit(
    model: Model,
    logs: FitLogs,
    holdout: Holdout = None,
    test: Test = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="Fitted model to write.")] = None,
    objective: Annotated[
        Objective,
        typer.Option(
            help="What is brought near the measurement: the force along the measured "
            "motion, or the motion simulated from the command alone."
        ),
    ] = Objective.FORCE,
    test_function: TestFunction = None,
    effects: Effects = None,
    as_json_: Json = False,
) -> None:
    """Identify the parameters of the model's effects.

    Example: twin fit proton_xy fit.mcap --holdout held.mcap -o fitted.toml
    """
    from identify import workflow
    from identify.output import as_json
    from identify.output import text as as_text
    from identify.output.as_json import simulation_fit_json
    from identify.output.words.fit import objectives_in_words
    from twin.model.file import save_model

    if out:
        require_folder(out)
    catalogue = catalogue_with(effects)
    result, findings, silent = with_roles(
        partial(workflow.fit, catalogue=catalogue, test_function=test_function),
        machine_model(model, catalogue), logs, holdout, test, MEANINGLESS,
    )  # fmt: skip
    fitted, text, found = result.model, as_text.fit_text(result), as_json.fit_json(result)
    alarms: list[str] = []
    if objective is Objective.SIMULATION:
        with progress_on_stderr() as progress:
            refined = workflow.fit_simulation(result, progress=progress)
        fitted, text, found = refined.model, str(refined), simulation_fit_json(refined)
        alarms = objectives_in_words(refined)
        found |= {"objectives_disagree": alarms}
    if out:
        save_model(fitted, out)
    say(text, {**found, "left_out": silent}, as_json_, [*findings, *silent, *alarms])


def source_of(model: str) -> Source:
    """What a page is made of, as it stands in the command line."""
    from identify.output.report import Source

    return Source(shlex.join(["twin", *sys.argv[1:]]), model)


@app.command()
def compare(
    model: Model,
    logs: Logs,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="HTML report.")] = None,
    mcap: Annotated[
        Path | None,
        typer.Option(help="The first log measured, modelled and their difference, as MCAP."),
    ] = None,
    test_function: TestFunction = None,
    effects: Effects = None,
    as_json_: Json = False,
) -> None:
    """Print the errors of the model, and where it fails.

    Example: twin compare fitted.toml test.mcap -o report.html
    """
    from identify import workflow
    from identify.output import as_json
    from identify.output import text as as_text

    if out:
        require_report(out)
    if mcap:
        require_folder(mcap)
    machine = machine_model(model, catalogue_with(effects))
    recorded, findings = read_checked(logs)
    with progress_on_stderr() as progress, left_out() as silent:
        result = workflow.compare(machine, recorded, test_function=test_function, progress=progress)
    if out:
        from identify.output.report import write_report

        write_report(
            out, title=f"{machine.name}: model against measurement", diagnosis=None,
            comparison=result, history=machine.history, assumed=unconfirmed(findings),
            source=source_of(model),
        )  # fmt: skip
    if mcap:
        workflow.side_by_side_of(result).write(mcap)
    told = {**as_json.compare_json(result), "left_out": silent}
    say(as_text.compare_text(result), told, as_json_, [*findings, *silent])


@app.command()
def diagnose(
    model: Model,
    logs: FitLogs,
    holdout: Holdout = None,
    test: Test = None,
    out: Annotated[Path | None, typer.Option("--out", "-o", help="HTML report.")] = None,
    test_function: TestFunction = None,
    effects: Effects = None,
    as_json_: Json = False,
) -> None:
    """Find which physical effect is missing, with the evidence for it.

    Example: twin diagnose fitted.toml fit.mcap --holdout held.mcap -o diagnosis.html
    """
    from identify import workflow
    from identify.output import as_json
    from identify.output import text as as_text

    if out:
        require_report(out)
    catalogue = catalogue_with(effects)
    machine = machine_model(model, catalogue)
    result, findings, silent = with_roles(
        partial(workflow.diagnose, catalogue=catalogue, test_function=test_function),
        machine,
        logs,
        holdout,
        test,
    )
    if out:
        from identify.output.report import write_report

        write_report(
            out, title=f"{machine.name}: what the model lacks", diagnosis=result,
            comparison=result.comparison, history=result.model.history,
            assumed=unconfirmed(findings), source=source_of(model),
        )  # fmt: skip
    told = {**as_json.diagnose_json(result, findings), "left_out": silent}
    say(as_text.diagnose_text(result), told, as_json_, [*findings, *silent])


@app.command()
def add(
    effect: Annotated[str, typer.Argument(metavar="EFFECT", help="Name from `twin effects`.")],
    model: Model,
    logs: FitLogs,
    out: Annotated[Path, typer.Option("--out", "-o", help="Model with the effect.")],
    holdout: Holdout = None,
    test: Test = None,
    axis: Annotated[
        str | None, typer.Option(help="Axis; the one that it improves most if left out.")
    ] = None,
    test_function: TestFunction = None,
    shape: Annotated[
        bool,
        typer.Option("--shape", help="The model has the effect: give its law the shape found."),
    ] = False,
    effects: Effects = None,
    as_json_: Json = False,
) -> None:
    """Add an effect, or the shape of one, refit, and record the error before and after.

    Example: twin add cogging fitted.toml fit.mcap --holdout held.mcap -o better.toml
    """
    from identify import workflow
    from identify.output import as_json
    from identify.output import text as as_text
    from twin.model.file import save_model

    require_folder(out)
    catalogue = catalogue_with(effects)
    chosen, made = catalogue[effect], workflow.add_shape if shape else workflow.add
    result, findings, silent = with_roles(
        partial(made, chosen, axis=axis, test_function=test_function),
        machine_model(model, catalogue), logs, holdout, test, MEANINGLESS,
    )  # fmt: skip
    save_model(result.model, out)
    told = {**as_json.add_json(result), "left_out": silent}
    say(as_text.add_text(result), told, as_json_, [*findings, *silent])
    if not result.kept:
        raise typer.Exit(1)


@app.command()
def demo(
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder to write into.")] = Path("demo"),
    seed: Annotated[int, typer.Option(help="Draws the machine and its hidden effect.")] = 2,
    model: Annotated[str, typer.Option("--model", help="Machine model (.toml).")] = "proton_xy",
    effects: Effects = None,
    as_json_: Json = False,
) -> None:
    """Run the whole loop on a machine with a hidden effect.

    Example: twin demo -o demo
    """
    from identify.demo import BETTER
    from identify.demo import demo as run
    from identify.output import as_json

    require_apart({"-o": out / BETTER}, {"--model": model})
    catalogue = catalogue_with(effects)
    machine = machine_model(model, catalogue)

    def tell(text: str) -> None:
        print(text, file=sys.stderr if as_json_ else sys.stdout, flush=True)

    with progress_on_stderr() as progress:
        result = run(machine, catalogue, out, seed, tell, progress)
    hidden = result.hidden.effect.name
    summary = {
        "hidden": hidden,
        "named": result.named,
        "report": str(result.report),
        "diagnosis": as_json.diagnose_json(result.diagnosis),
        "addition": result.addition and as_json.add_json(result.addition),
    }
    verdict = "the diagnosis is right" if result.named else "the diagnosis did not name it"
    say(f"5. the hidden effect was {hidden}: {verdict}\nreport: {result.report}", summary, as_json_)
    if not result.named:
        raise typer.Exit(1)
