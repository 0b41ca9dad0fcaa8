"""Commands of the loop: fit, compare, diagnose, add, agree, plan, demo."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Sequence
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from identify.cli.apart import require_apart
from identify.cli.progress import progress_on_stderr
from identify.cli.shared import (
    MEANINGLESS,
    CheckedRecordings,
    Effects,
    FitLogs,
    Holdout,
    Json,
    Logs,
    Model,
    ModelOption,
    Recordings,
    Report,
    Test,
    TestFunction,
    app,
    catalogue_with,
    left_out,
    machine_model,
    require_report,
    say,
    tell,
    with_roles,
)
from twin.errors import InputError
from twin.files import require_writable

if TYPE_CHECKING:
    from identify.experiment_design.rival_hypotheses import Rival
    from identify.results.results import Comparison, Diagnosis, FitResult, SimulationFit
    from twin.effects import Catalogue


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
    from identify.output.words.fit import objectives_in_words
    from twin.model.file import save_model

    if out:
        require_writable(out)
    catalogue = catalogue_with(effects)
    fitted, findings, silent = with_roles(
        partial(workflow.fit, catalogue=catalogue, test_function=test_function),
        machine_model(model, catalogue), logs, holdout, test, MEANINGLESS,
    )  # fmt: skip
    warnings = [*findings, *silent]
    result: FitResult | SimulationFit = fitted
    if objective is Objective.SIMULATION:
        with progress_on_stderr() as progress:
            result = moved = workflow.fit_simulation(fitted, progress=progress)
        warnings += objectives_in_words(moved)
    if out:
        save_model(result.model, out)
    tell(result, as_json_, warnings, left_out=silent)


@app.command()
def compare(
    model: Model,
    logs: Logs,
    out: Report = None,
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

    require_report(out)
    if mcap:
        require_writable(mcap)
    machine, recorded = machine_model(model, catalogue_with(effects)), CheckedRecordings(logs)
    with progress_on_stderr() as progress, left_out() as silent:
        result = workflow.compare(machine, recorded, test_function=test_function, progress=progress)
    title = f"{machine.name}: model against measurement"
    same = _options(test_function, effects)
    _report(out, title, model, same, None, result, recorded.findings)
    if mcap:
        workflow.side_by_side_of(result).write(mcap)
    tell(result, as_json_, [*recorded.findings, *silent], left_out=silent)


@app.command()
def diagnose(
    model: Model,
    logs: FitLogs,
    holdout: Holdout = None,
    test: Test = None,
    out: Report = None,
    test_function: TestFunction = None,
    effects: Effects = None,
    as_json_: Json = False,
) -> None:
    """Find which physical effect is missing, with the evidence for it.

    Example: twin diagnose fitted.toml fit.mcap --holdout held.mcap -o diagnosis.html
    """
    from identify import workflow

    require_report(out)
    catalogue = catalogue_with(effects)
    machine = machine_model(model, catalogue)
    job = partial(workflow.diagnose, catalogue=catalogue, test_function=test_function)
    result, findings, silent = with_roles(job, machine, logs, holdout, test)
    title = f"{machine.name}: what the model lacks"
    same = _options(test_function, effects)
    _report(out, title, model, same, result, result.comparison, findings)
    told = {"data_faults": findings, "left_out": silent}
    tell(result, as_json_, [*findings, *silent], **told)


def _options(test_function: float | None, effects: list[Path] | None) -> str:
    """Options as they are typed."""
    length = [] if test_function is None else ["--test-function", f"{test_function:g}"]
    return shlex.join([*length, *(text for f in effects or () for text in ("--effects", str(f)))])


def _report(
    out: Path | None,
    title: str,
    name: str,
    options: str,
    diagnosis: Diagnosis | None,
    comparison: Comparison,
    findings: Sequence[str],
) -> None:
    """Write the report that was asked for.

    name: of the given model. options: that the next command needs as well. findings: on the logs.
    """
    if out is None:
        return
    from identify.output.report import Source, write_report

    model = comparison.model if diagnosis is None else diagnosis.model
    write_report(
        out, title=title, diagnosis=diagnosis, comparison=comparison, history=model.history,
        assumed=[line for line in findings if "the import map assumes" in line],
        faults=[line for line in findings if ": error: " in line],
        source=Source(shlex.join(["twin", *sys.argv[1:]]), name, options=options),
    )  # fmt: skip


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
    from twin.model.file import save_model

    require_writable(out)
    catalogue = catalogue_with(effects)
    chosen, made = catalogue[effect], workflow.add_shape if shape else workflow.add
    result, findings, silent = with_roles(
        partial(made, chosen, axis=axis, test_function=test_function),
        machine_model(model, catalogue), logs, holdout, test, MEANINGLESS,
    )  # fmt: skip
    save_model(result.model, out)
    tell(result, as_json_, [*findings, *silent], left_out=silent)
    if not result.kept:
        raise typer.Exit(1)


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

    catalogue = catalogue_with(effects)
    fits = [machine_model(name, catalogue) for name in (a, b)]
    with progress_on_stderr() as progress:
        progress("comparing the fits", 0, 1)
        result = workflow.agree(*fits, catalogue=catalogue)
    tell(result, as_json_, a=a, b=b)
    if not result.agrees:
        raise typer.Exit(1)


@app.command()
def plan(
    model: Model,
    logs: Annotated[
        list[Path] | None, typer.Argument(metavar="[LOG...]", help="Existing MCAP logs.")
    ] = None,
    between: Annotated[
        tuple[str, str] | None,
        typer.Option(help="Two effects to add to the model, or two fitted models (.toml)."),
    ] = None,
    axis: Annotated[str | None, typer.Option(help="Axis to be explained.")] = None,
    duration: Annotated[float, typer.Option(help="Length of the experiment in s.")] = 20.0,
    out: Annotated[Path, typer.Option("--out", "-o", help="Experiment to write (.toml).")] = Path(
        "experiment.toml"
    ),
    holdout: Holdout = None,
    test_function: TestFunction = None,
    effects: Effects = None,
    as_json_: Json = False,
) -> None:
    """Choose the experiment that decides between explanations; `twin simulate` runs it.

    Example: twin plan fitted.toml --between cogging wear --duration 8 -o next.toml
    """
    from identify import workflow
    from identify.output.answers.diagnoses import answer_of
    from identify.output.text import plan_text
    from twin.experiments.file import ENDING, SUFFIX, save_experiment, write_setpoints

    if out.suffix != SUFFIX:
        raise InputError(f"{out}: an experiment is a {SUFFIX} file; give such a name")
    require_writable(out)
    catalogue = catalogue_with(effects)
    machine = machine_model(model, catalogue)
    rivals = [_rival(name, catalogue) for name in between or ()]
    recorded = CheckedRecordings(logs, beside=holdout)
    with progress_on_stderr() as progress:
        result = workflow.plan(
            machine, recorded, Recordings(holdout, beside=logs), between=rivals,
            catalogue=catalogue, axis=axis, duration=duration, test_function=test_function,
            progress=progress,
        )  # fmt: skip
    text, table = plan_text(result), out.with_suffix(ENDING)
    made: dict[str, str] = {}
    if result.decides:
        chosen = result.chosen
        save_experiment(chosen.experiment, out, *text.splitlines()[:3], units=chosen.units)
        write_setpoints(chosen.experiment, machine, 0, table)
        text += (
            f"\n{table}: the setpoints, to be run on the machine"
            f"\n{out}: the experiment; `twin simulate {out} --model MODEL -o LOG` simulates it"
        )
        made = {"file": str(out), "setpoints": str(table)}
    say(text, answer_of(result, **made), as_json_, recorded.findings)
    if not result.decides:
        raise typer.Exit(1)


def _rival(name: str, catalogue: Catalogue) -> Rival:
    """The model of that file, or the effect of that name."""
    if name.endswith(".toml"):
        return replace(machine_model(name, catalogue), name=name)
    return catalogue[name]


@app.command()
def demo(
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder to write into.")] = Path("demo"),
    seed: Annotated[int, typer.Option(help="Draws the machine and its hidden effect.")] = 2,
    model: ModelOption = "proton_xy",
    effects: Effects = None,
    as_json_: Json = False,
) -> None:
    """Run the whole loop on a machine with a hidden effect.

    Example: twin demo -o demo
    """
    from identify.demo import BETTER
    from identify.demo import demo as run
    from identify.output.answers.diagnoses import DemoAnswer, answer_of

    require_apart({"-o": out / BETTER}, {"--model": model})
    catalogue = catalogue_with(effects)
    machine = machine_model(model, catalogue)

    def line(text: str) -> None:
        print(text, file=sys.stderr if as_json_ else sys.stdout, flush=True)

    with progress_on_stderr() as progress:
        result = run(machine, catalogue, out, seed, line, progress)
    hidden = result.hidden.effect.name
    answer = DemoAnswer.of(
        result,
        hidden=hidden,
        report=str(result.report),
        diagnosis=answer_of(result.diagnosis),
        addition=result.addition and answer_of(result.addition),
    )
    verdict = "the diagnosis is right" if result.named else "the diagnosis did not name it"
    say(f"5. the hidden effect was {hidden}: {verdict}\nreport: {result.report}", answer, as_json_)
    if not result.named:
        raise typer.Exit(1)
