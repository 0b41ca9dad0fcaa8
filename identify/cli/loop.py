"""Commands of the loop: fit, compare, diagnose, add, agree, feedforward, frf, plan, demo."""

from __future__ import annotations

import sys
from collections.abc import Callable, Sequence
from dataclasses import replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from typer import Argument, Option

from identify.cli.command import Reply, progress_on_stderr, require_apart, tried
from identify.cli.shared import (
    CheckedRecordings,
    Done,
    Effects,
    FitLogs,
    Holdout,
    Logs,
    Model,
    ModelOption,
    Recordings,
    Report,
    Scheduler,
    Test,
    TestFunction,
    app,
    loaded,
    said_of,
    source_of,
    tell_first_look,
    with_logs,
    written,
)
from identify.output.machine import briefly, in_shell
from twin.errors import InputError
from twin.telling import heard

if TYPE_CHECKING:
    from identify.output.words.next_step import Source
    from identify.results.results import Comparison, Diagnosis, FitResult, SimulationFit
    from twin.model.machine import MachineModel


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
    out: Annotated[Path | None, written("Fitted model to write.")] = None,
    objective: Annotated[
        Objective,
        Option(
            help="What is brought near the measurement: the force along the measured "
            "motion, or the motion simulated from the command alone."
        ),
    ] = Objective.FORCE,
    test_function: TestFunction = None,
    effects: Effects = None,
) -> Reply:
    """Identify the parameters of the model's effects.

    Example: twin fit proton_xy fit.mcap --holdout held.mcap -o fitted.toml
    """
    from identify import workflow
    from identify.output.words.fit import objectives_in_words
    from twin.model.file import save_model

    machine, catalogue = loaded(model, effects)
    job = partial(workflow.fit, catalogue=catalogue, test_function=test_function)
    done = with_logs(job, machine, logs, holdout, test, fits=True)
    result: FitResult | SimulationFit = done.result
    alarms: list[str] = []
    if objective is Objective.SIMULATION:
        with progress_on_stderr() as progress:
            result = workflow.fit_simulation(done.result, progress=progress)
        alarms = objectives_in_words(result)
    failed = tried(partial(save_model, result.model, out)) if out else ()
    said = said_of(result, [*done.warnings, *alarms], left_out=done.left_out)
    return replace(said, unwritten=failed)


@app.command()
def compare(
    model: Model,
    logs: Logs,
    html: Report = None,
    mcap: Annotated[
        Path | None,
        Option(help="The first log measured, modelled and their difference, as MCAP."),
    ] = None,
    test_function: TestFunction = None,
    effects: Effects = None,
) -> Reply:
    """Print the errors of the model, and where it fails.

    Example: twin compare fitted.toml test.mcap -o report.html
    """
    from identify import workflow

    machine, _ = loaded(model, effects)
    job = partial(workflow.compare, test_function=test_function)
    done = with_logs(job, machine, logs)
    writes: list[Callable[[], object]] = []
    if html:
        source = source_of(model, test_function, effects)
        writes.append(partial(_report, html, source, done, logs))
    if mcap:
        writes.append(lambda: workflow.side_by_side_of(done.result).write(mcap))
    failed = tried(*writes)
    said = said_of(done.result, done.warnings, left_out=done.left_out)
    return replace(said, unwritten=failed)


@app.command()
def diagnose(
    model: Model,
    logs: FitLogs,
    holdout: Holdout = None,
    test: Test = None,
    html: Report = None,
    better: Annotated[
        Path | None,
        Option("--model", help="Model to write with all that was found, fitted together."),
    ] = None,
    test_function: TestFunction = None,
    effects: Effects = None,
) -> Reply:
    """Find which physical effect is missing, with the evidence for it.

    Example: twin diagnose fitted.toml fit.mcap --holdout held.mcap -o why.html --model better.toml
    """
    from identify import workflow
    from identify.output.as_json import answer_of
    from identify.output.shown.diagnoses import diagnosis_blocks
    from identify.output.text import to_text

    machine, catalogue = loaded(model, effects)
    tell_first_look(machine, [*logs, *(holdout or ())], catalogue)
    job = partial(workflow.diagnose, catalogue=catalogue, test_function=test_function)
    done = with_logs(job, machine, logs, holdout, test, fits=True)
    source = replace(
        source_of(model, test_function, effects), written=str(better) if better else None
    )
    writes: list[Callable[[], object]] = []
    if html:
        writes.append(partial(_report, html, source, done, logs))
    if better:
        writes.append(partial(_save_with_bodies, done.result.model, better, machine))
    failed = tried(*writes)
    answer = answer_of(done.result, data_faults=done.findings, left_out=done.left_out)
    text = to_text(diagnosis_blocks(done.result, source))
    warnings = [*done.warnings, *_of_rotors(machine, logs)]
    return Reply(text, answer, warnings, unwritten=failed)


def _of_rotors(machine: MachineModel, logs: Sequence[Path]) -> list[str]:
    """The rotors that the file of a mechanism states as before their gears."""
    if not machine.joints:
        return []
    from identify.analysis.motor_rotor import rotors_before_gears
    from identify.output.words.recording import rotor_in_words

    first = Recordings(logs[:1])[str(logs[0])]
    return [rotor_in_words(found, machine) for found in rotors_before_gears(machine, first)]


def _save_with_bodies(made: MachineModel, out: Path, given: MachineModel) -> None:
    """Write a model, and beside it its MuJoCo file under its own name where it is another one."""
    from twin.files import write_atomically
    from twin.model.file import save_model

    if made.mjcf != given.mjcf:
        file = _copy_of(given, out)
        made = replace(made, mjcf_name=file.name)
        write_atomically(file, (made.mjcf or "").encode())
    save_model(made, out)


def _report(
    out: Path, source: Source, done: Done[Comparison] | Done[Diagnosis], logs: Sequence[Path]
) -> None:
    """Write the report of a result, with what its model says of the loop on these logs."""
    from identify import workflow
    from identify.output.shown.report import write_report
    from identify.output.shown.subject import Subject

    result, before = done.result, None
    if isinstance(result, workflow.Diagnosis):
        before = result.fitted if result.effect else None
    with progress_on_stderr() as progress, heard():  # what says nothing was told already
        known = workflow.on_machine(result.model, Recordings(logs), before, progress=progress)
    write_report(out, Subject.of(result, source, machine=known, findings=done.findings))


@app.command()
def add(
    effect: Annotated[
        str,
        Argument(metavar="EFFECT", help="Name from `twin effects`; with --found an answer's file."),
    ],
    model: Model,
    logs: FitLogs,
    out: Annotated[Path, written("Model with the effect.")],
    holdout: Holdout = None,
    test: Test = None,
    axis: Annotated[
        str | None, Option(help="Axis; the one that it improves most if left out.")
    ] = None,
    test_function: TestFunction = None,
    shape: Annotated[
        bool,
        Option("--shape", help="The model has the effect: give its law the shape found."),
    ] = False,
    found: Annotated[
        bool,
        Option("--found", help="Add all that EFFECT found: an answer of `twin diagnose --json`."),
    ] = False,
    effects: Effects = None,
) -> Reply:
    """Add an effect, or the shape of one, refit, and record the error before and after.

    Of a machine of joints, link_mass corrects a body: it is written into a copy of the MuJoCo file.
    With --found, EFFECT is a saved answer, and all that it found is added.

    Example: twin add cogging fitted.toml fit.mcap --holdout held.mcap -o better.toml
    """
    from identify import adding
    from identify.dataset.body import LINK_MASS
    from identify.output.as_json import found_in

    ignored = [*(["--axis"] if axis else []), *(["--shape"] if shape else [])]
    if ignored and (found or effect == LINK_MASS):
        what = "--found adds all that an answer found" if found else f"{LINK_MASS} is of all axes"
        raise InputError(f"{' and '.join(ignored)}: {what}; leave it out")
    machine, catalogue = loaded(model, effects)
    job: Callable[..., Any]  # an Addition, AllAdded or a CorrectedBody
    if found:
        with_all = found_in(Path(effect), machine, catalogue)
        job = partial(adding.add_found, with_all, test_function=test_function)
    elif effect == LINK_MASS:
        file = _copy_of(machine, out).name
        job = partial(
            adding.correct_body, file=file, catalogue=catalogue, test_function=test_function
        )
    else:
        call = adding.add_shape if shape else adding.add
        job = partial(call, catalogue[effect], axis=axis, test_function=test_function)
    done: Done[Any] = with_logs(job, machine, logs, holdout, test, fits=True)
    return _with_model(done, out, machine, done.result.kept)


@app.command()
def remove(
    effect: Annotated[str, Argument(metavar="EFFECT", help="Its name in the model.")],
    model: Model,
    logs: FitLogs,
    out: Annotated[Path, written("Model without the effect.")],
    holdout: Holdout = None,
    test: Test = None,
    axis: Annotated[str | None, Option(help="Axis; needed where several have it.")] = None,
    test_function: TestFunction = None,
    effects: Effects = None,
) -> Reply:
    """Take an effect out, refit the others, and record the error with it and without.

    Example: twin remove wear better.toml fit.mcap --holdout held.mcap -o without.toml
    """
    from identify import adding

    machine, _ = loaded(model, effects)
    job = partial(adding.remove, effect, axis=axis, test_function=test_function)
    return _with_model(with_logs(job, machine, logs, holdout, test, fits=True), out, machine, True)


def _with_model(done: Done[Any], out: Path, given: MachineModel, fine: bool) -> Reply:
    """What is said of a result whose model is written."""
    failed = tried(partial(_save_with_bodies, done.result.model, out, given))
    said = said_of(done.result, done.warnings, fine, left_out=done.left_out)
    return replace(said, unwritten=failed)


def _copy_of(machine: MachineModel, out: Path) -> Path:
    """The MuJoCo file beside a model that is written, which is never the user's own."""
    file = out.with_suffix(".xml")
    return file.with_stem(f"{file.stem}_corrected") if file.name == machine.mjcf_name else file


@app.command()
def agree(
    a: Annotated[str, Argument(metavar="A", help="Fitted model (.toml).")],
    b: Annotated[
        str, Argument(metavar="B", help="Fitted model (.toml), or what `twin export` wrote.")
    ],
    logs: Annotated[
        list[Path] | None,
        Argument(metavar="[LOG...]", help="MCAP logs that `twin export` was given."),
    ] = None,
    effects: Effects = None,
) -> Reply:
    """Say whether two fits agree within their uncertainties, or an export is still that of a model.

    Exit code 1 where they do not.

    Example: twin agree monday.toml friday.toml
    """
    from identify import workflow
    from twin.model.file import load_model

    first, catalogue = loaded(a, effects)
    if Path(b).suffix != ".toml" and Path(b).exists():
        return _export_agrees(a, first, Path(b), logs or [])
    if logs:
        raise InputError(f"{logs[0]}: two models are compared without logs; leave it out")
    second = load_model(b, catalogue)
    with progress_on_stderr() as progress:
        progress("comparing the fits", 0, 1)
        result = workflow.agree(first, second, catalogue=catalogue)
    return said_of(result, fine=result.agree, a=a, b=b)


def _export_agrees(name: str, model: MachineModel, path: Path, logs: Sequence[Path]) -> Reply:
    from identify.output.answers.machine import ExportAgreementAnswer
    from identify.output.machine import export_agreement_text
    from twin.export import compare_export

    found = compare_export(model, path, Recordings(logs))
    answer = ExportAgreementAnswer.of(found, a=name, b=path)
    return Reply(export_agreement_text(found, name, str(path)), answer, fine=found.agrees)


@app.command()
def feedforward(
    model: Model,
    logs: Logs,
    before: Annotated[str | None, Option("--before", help="Model to compare with (.toml).")] = None,
    effects: Effects = None,
) -> Reply:
    """Tell what the model is worth as feedforward: the tracking error with it, in simulation.

    Example: twin feedforward better.toml test.mcap --before fitted.toml
    """
    from identify import workflow
    from twin.model.file import load_model

    machine, catalogue = loaded(model, effects)
    earlier = None if before is None else load_model(before, catalogue)
    done = with_logs(partial(workflow.feedforward, before=earlier), machine, logs)
    return said_of(done.result, done.warnings)


@app.command()
def frf(
    logs: Annotated[
        list[str],
        Argument(metavar="LOG... [MODEL]", help="MCAP logs, and a model (.toml) beside them."),
    ],
    out: Annotated[Path | None, written("The responses to write (.csv, .mcap).")] = None,
    plot: Annotated[Path | None, Option(help="Bode diagram to write (.png, .svg, .pdf).")] = None,
    effects: Effects = None,
) -> Reply:
    """Tell the frequency response of force to position: mass, resonances, delay, margins.

    Example: twin frf multisine.mcap fitted.toml --plot bode.png
    """
    from identify import workflow
    from identify.output import require_picture, save_picture
    from identify.results.frequency import FORMATS

    if out and out.suffix not in FORMATS:
        raise InputError(f"--out {out}: end the name in {' or '.join(FORMATS)}")
    if plot:
        require_picture(plot)
    paths = [Path(name) for name in logs if not name.endswith(".toml")]
    models = [name for name in logs if name.endswith(".toml")]
    if len(models) > 1 or not paths:
        raise InputError(f"{' '.join(logs)}: give logs (.mcap) and one model (.toml) at most")
    machine = loaded(models[0], effects)[0] if models else None
    with progress_on_stderr() as progress, heard() as silent:
        recorded = CheckedRecordings(paths)
        result = workflow.frequency_response(recorded, machine, progress=progress)
    writes: list[Callable[[], object]] = [partial(result.write, out)] if out else []
    writes += [lambda: save_picture(result.plot(), plot)] if plot else []
    failed = tried(*writes)
    return replace(said_of(result, [*briefly(recorded.findings), *silent]), unwritten=failed)


@app.command()
def plan(
    model: Model,
    logs: Annotated[
        list[Path] | None, Argument(metavar="[LOG...]", help="Existing MCAP logs.")
    ] = None,
    between: Annotated[
        tuple[str, str] | None,
        Option(help="Two effects to add to the model, or two fitted models (.toml)."),
    ] = None,
    axis: Annotated[str | None, Option(help="Axis to be explained.")] = None,
    duration: Annotated[float, Option(help="Length of the experiment in s.")] = 20.0,
    out: Annotated[Path, written("Experiment to write (.toml).")] = Path("experiment.toml"),
    holdout: Holdout = None,
    test_function: TestFunction = None,
    scheduler: Scheduler = None,
    effects: Effects = None,
) -> Reply:
    """Choose the experiment that decides between explanations; `twin simulate` runs it.

    Example: twin plan fitted.toml --between cogging wear --duration 8 -o next.toml
    """
    from identify import workflow
    from twin.engine import engine, in_order
    from twin.experiments.file import SUFFIX, save_experiment
    from twin.export.setpoints import ENDING, write_setpoints

    if out.suffix != SUFFIX:
        raise InputError(f"{out}: an experiment is a {SUFFIX} file; give such a name")
    machine, catalogue = loaded(model, effects)
    job = partial(
        workflow.plan, between=between or (),
        catalogue=catalogue, axis=axis, duration=duration, test_function=test_function,
    )  # fmt: skip
    with engine(scheduler) as workers:
        done = with_logs(partial(job, over=partial(in_order, *workers)), machine, logs, holdout)
    if not done.result.decides:
        said = said_of(done.result, done.warnings, fine=False)
        earlier = f"; {out} is of an earlier plan" if out.exists() else ""
        return replace(said, text=f"{said.text}\nnothing is written{earlier}")
    chosen, table = done.result.chosen, out.with_suffix(ENDING)
    said = said_of(done.result, done.warnings, file=out, setpoints=table)
    head = said.text.splitlines()[:3]
    failed = tried(
        partial(save_experiment, chosen.experiment, out, *head, units=chosen.units),
        partial(write_setpoints, chosen.experiment, machine, 0, table),
    )
    if failed:
        return replace(said, unwritten=failed)
    own = (word for file in effects or () for word in ("--effects", file))
    run = in_shell("simulate", out, "--model", model, *own, "-o", out.with_suffix(".mcap"))
    text = (
        f"{said.text}\n{table}: the setpoints, to be run on the machine"
        f"\n{out}: the experiment; `{run}` simulates it"
    )
    return replace(said, text=text)


@app.command()
def demo(
    ctx: typer.Context,
    folder: Annotated[Path, written("Folder to write into.")] = Path("demo"),
    seed: Annotated[int, Option(help="Draws the machine and its hidden effect.")] = 2,
    model: ModelOption = "proton_xy",
    effects: Effects = None,
) -> Reply:
    """Run the whole loop on a machine with a hidden effect.

    Example: twin demo -o demo
    """
    from identify.demo import BETTER
    from identify.demo import demo as run
    from identify.output.answers.diagnoses import DemoAnswer, answer_of

    require_apart({"-o": folder / BETTER}, {"--model": model})
    machine, catalogue = loaded(model, effects)
    line = partial(print, file=sys.stderr if ctx.params["as_json"] else sys.stdout, flush=True)
    with progress_on_stderr() as progress:
        source = source_of(model, None, effects)
        result = run(machine, catalogue, folder, seed, source, line, progress)
    hidden = result.hidden.effect.name
    answer = DemoAnswer.of(
        result,
        hidden=hidden,
        diagnosis=answer_of(result.diagnosis),
        feedforward=result.feedforward and answer_of(result.feedforward),
    )
    verdict = "the diagnosis is right" if result.named else "the diagnosis did not name it"
    text = f"the hidden effect was {hidden}: {verdict}\nreport: {result.report}"
    return Reply(text, answer, fine=result.named)
