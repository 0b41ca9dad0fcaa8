"""The command that plans the next experiment."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from identify.cli.progress import progress_on_stderr
from identify.cli.shared import (
    Effects,
    Holdout,
    Json,
    Model,
    TestFunction,
    app,
    catalogue_with,
    machine_model,
    read_checked,
    read_measured,
    require_folder,
    say,
)
from twin.errors import InputError

if TYPE_CHECKING:
    from identify.experiment_design.rival_hypotheses import Rival
    from twin.effects import Catalogue

Out = Annotated[Path, typer.Option("--out", "-o", help="Experiment to write (.toml).")]


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
    out: Out = Path("experiment.toml"),
    holdout: Holdout = None,
    test_function: TestFunction = None,
    effects: Effects = None,
    as_json_: Json = False,
) -> None:
    """Choose the experiment that decides between explanations; `twin simulate` runs it.

    Example: twin plan fitted.toml --between cogging wear --duration 8 -o next.toml
    """
    from identify import workflow
    from identify.output import as_json
    from identify.output import text as as_text
    from twin.experiments.file import ENDING, SUFFIX, save_experiment, write_setpoints

    if out.suffix != SUFFIX:
        raise InputError(f"{out}: an experiment is a {SUFFIX} file; give such a name")
    require_folder(out)
    catalogue = catalogue_with(effects)
    machine = machine_model(model, catalogue)
    rivals = [_rival(name, catalogue) for name in between or ()]
    recorded, findings = read_checked(logs, beside=holdout)
    with progress_on_stderr() as progress:
        result = workflow.plan(
            machine, recorded, read_measured(holdout, beside=logs), between=rivals,
            catalogue=catalogue, axis=axis, duration=duration, test_function=test_function,
            progress=progress,
        )  # fmt: skip
    text, file, table = as_text.plan_text(result), None, out.with_suffix(ENDING)
    if result.decides:
        file = str(out)
        save_experiment(
            result.chosen.experiment, out, *text.splitlines()[:3], units=result.chosen.units
        )
        write_setpoints(result.chosen.experiment, machine, 0, table)
        text += (
            f"\n{table}: the setpoints, to be run on the machine"
            f"\n{out}: the experiment; `twin simulate {out} --model MODEL -o LOG` simulates it"
        )
    made = {"file": file, "setpoints": file and str(table)}
    say(text, {**as_json.plan_json(result), **made}, as_json_, findings)
    if not result.decides:
        raise typer.Exit(1)


def _rival(name: str, catalogue: Catalogue) -> Rival:
    """The model of that file, or the effect of that name."""
    if name.endswith(".toml"):
        return replace(machine_model(name, catalogue), name=name)
    return catalogue[name]
