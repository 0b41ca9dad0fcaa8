"""Commands on the machine's side: from simulate and import to effects, export and example."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Annotated

import typer

from identify.cli.progress import progress_on_stderr
from identify.cli.shared import (
    CheckedRecordings,
    Effects,
    Json,
    Logs,
    Model,
    ModelOption,
    app,
    catalogue_with,
    machine_model,
    say,
)
from twin.errors import InputError
from twin.export import find_exporter, format_names
from twin.files import require_writable


@app.command()
def simulate(
    experiment: Annotated[
        str, typer.Argument(help="tracking, moves, cable_pass, ...; or a .toml from `twin plan`.")
    ],
    model: ModelOption = "proton_xy",
    out: Annotated[Path, typer.Option("--out", "-o", help="MCAP log to write.")] = Path("log.mcap"),
    seed: Annotated[int, typer.Option(help="Same seed, same log.")] = 0,
    duration: Annotated[
        float | None, typer.Option(help="Length in s, 20 if left out; a file has its own.")
    ] = None,
    axis: Annotated[str | None, typer.Option(help="Axis that moves, where one does.")] = None,
    setpoints: Annotated[
        Path | None, typer.Option(help="Setpoints to write as CSV, to be run on a machine.")
    ] = None,
    effects: Effects = None,
    as_json_: Json = False,
) -> None:
    """Run an experiment on the twin in MuJoCo and log it as MCAP.

    Example: twin simulate moves --model example_machine --duration 10 -o fit.mcap
    """
    from identify.output.answers.machine import LogAnswer
    from twin.experiments.file import SUFFIX, load_experiment, write_setpoints
    from twin.experiments.lasting import missed
    from twin.experiments.named import DURATION, Reach, find_experiment, simulate_parts
    from twin.logs import record_log

    for file in (out, setpoints):
        if file is not None:
            require_writable(file)
    stage = machine_model(model, catalogue_with(effects))
    chosen = load_experiment(experiment) if experiment.endswith(SUFFIX) else experiment
    reach = Reach(stage)
    with progress_on_stderr() as progress:
        parts = simulate_parts(
            stage, chosen, seed=seed, duration=duration, axis=axis,
            progress=partial(progress, "simulating"),
        )  # fmt: skip
        samples = record_log(map(reach.take, parts), out)
    if setpoints is not None:
        if isinstance(chosen, str):
            chosen = find_experiment(chosen, stage, axis, duration or DURATION)
        write_setpoints(chosen, stage, seed, setpoints)
    rate = stage.sample_rate
    answer = LogAnswer(
        log=str(out),
        samples=samples,
        sample_rate=rate,
        setpoints=str(setpoints) if setpoints else None,
    )
    asked = None if duration is None else missed(duration, samples / rate)
    warnings = [*reach.warnings(), *([asked] if asked else [])]
    say(f"{out}: {samples} samples at {rate:g} Hz", answer, as_json_, warnings)


@app.command("import")
def import_(
    sources: Annotated[
        list[Path],
        typer.Argument(metavar="FILE...", help="CSV, MAT, JSON, Parquet, HDF5, TDMS or MCAP."),
    ],
    mapping: Annotated[
        Path | None, typer.Option("--map", help="Columns, units, scale, sign, rate.")
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="MCAP log to write; or the map.")
    ] = None,
    guess: Annotated[
        bool, typer.Option("--guess", help="Propose a map for FILE, with reasons.")
    ] = False,
    as_json_: Json = False,
) -> None:
    """Turn a machine's recording into an MCAP log.

    Example: twin import recording.csv --map map.toml -o run.mcap
    """
    from identify.output.answers.machine import LogAnswer
    from twin.checks import check_assumed
    from twin.importers import import_log, load_mapping
    from twin.logs import write_log

    if out is not None:
        require_writable(out)
    if guess:
        _guess(sources, out, as_json_)
        return
    if mapping is None or out is None:
        raise InputError("give --map MAP and -o LOG; --guess proposes a map")
    log = import_log(sources, load_mapping(mapping))
    write_log(log, out)
    answer = LogAnswer(log=str(out), samples=len(log), sample_rate=log.sample_rate)
    resampled = [v for k, v in log.metadata.items() if k.startswith("resampled")]
    unsure = [str(f) for axis in log.axes for f in check_assumed(axis, log.metadata)]
    said = [*resampled, *(f"{out}: warning: {finding}" for finding in unsure)]
    say(f"{out}: {len(log)} samples at {log.sample_rate:g} Hz", answer, as_json_, said)


def _guess(sources: list[Path], out: Path | None, as_json_: bool) -> None:
    """Print or write a proposed map; exit code 1 where something is missing in it."""
    from identify.output.answers.machine import MapAnswer
    from twin.files import write_atomically
    from twin.importers.guess import guess_map

    if len(sources) != 1:
        raise InputError(f"--guess was given {len(sources)} files; give one at a time")
    found = guess_map(sources[0])
    if out is not None:
        write_atomically(out, found.text.encode())
    text = found.text if out is None else f"{out}: a map to be read and corrected"
    say(text, MapAnswer.of(found, map=found.text), as_json_, found.missing)
    if found.missing:
        raise typer.Exit(1)


@app.command()
def new(
    logs: Logs,
    out: Annotated[Path, typer.Option("--out", "-o", help="Machine model (.toml) to write.")],
    mjcf: Annotated[
        Path | None,
        typer.Option("--mjcf", help="MJCF or URDF file whose joints are the axes of the logs."),
    ] = None,
    as_json_: Json = False,
) -> None:
    """Propose a first model from logs: mass, friction, constant force, and their hardware.

    Example: twin new run.mcap -o model.toml
    """
    from identify.analysis.first_model import first_model, not_determined
    from identify.output.answers.machine import NewModelAnswer
    from twin.effects import load_catalogue
    from twin.model.file import read_mjcf, save_model

    require_writable(out)
    recorded = CheckedRecordings(logs)
    bodies = None if mjcf is None else (mjcf.name, read_mjcf(mjcf))
    model = first_model(dict(recorded), out.stem, load_catalogue(), bodies)
    save_model(model, out)
    unknown = {axis: not_determined(found) for axis, found in model.axes.items()}
    notes = [
        f"axis {axis}: {label} is not determined, as the axis does not break away from rest by "
        "more than its Coulomb friction; it is set to that"
        for axis, labels in unknown.items()
        for label in labels
    ]
    text = f"{out}: axes {', '.join(model.axes)}; now `twin fit {out} {logs[0]} -o fitted.toml`"
    answer = NewModelAnswer(model=str(out), axes=list(model.axes), not_determined=unknown)
    say("\n".join([text, *notes]), answer, as_json_, recorded.findings)


@app.command()
def info(logs: Logs, as_json_: Json = False) -> None:
    """Tell what is in logs: length, rate, axes, signals with units and ranges, and faults.

    Example: twin info fit.mcap
    """
    from identify.output.answers.machine import info_answer
    from identify.output.machine import info_text
    from twin.checks.long import log_info

    found = {str(path): log_info(path) for path in logs}
    say(info_text(found), info_answer(found), as_json_)


@app.command()
def check(logs: Logs, as_json_: Json = False) -> None:
    """Say whether logs are fit for identification, and what is wrong with them.

    Example: twin check run.mcap
    """
    from identify.output.answers.machine import check_answer
    from identify.output.machine import check_text
    from twin.checks.long import check_file

    reports = {str(path): check_file(path) for path in logs}
    say(check_text(reports), check_answer(reports), as_json_)
    if not all(report.ok for report in reports.values()):
        raise typer.Exit(1)


@app.command()
def recover(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="Damaged MCAP log.")],
    out: Annotated[Path, typer.Option("--out", "-o", help="MCAP log of what is intact.")],
    unproved: Annotated[
        bool, typer.Option("--unproved", help="Keep samples that no checksum proves as well.")
    ] = False,
    as_json_: Json = False,
) -> None:
    """Keep the intact parts of a damaged log: the longest at OUT, the others beside it.

    Example: twin recover bad.mcap -o good.mcap
    """
    from identify.output.answers.machine import RecoveryAnswer
    from twin.logs import recover_file

    require_writable(out)
    recovery, files = recover_file(log, out, unproved=unproved)
    others = {str(path): text for path, text in files.items() if path != out}
    answer = RecoveryAnswer.of(
        recovery, log=str(out), not_proved=recovery.unproved, others=list(others)
    )
    written = [f"{path}: {text}" for path, text in others.items()]
    say("\n".join([str(recovery), *written]), answer, as_json_)


@app.command()
def effects(
    name: Annotated[str | None, typer.Argument(help="One effect in full.")] = None,
    plot: Annotated[
        Path | None, typer.Option(help="Draw what the effect leaves in the force (.png, .svg).")
    ] = None,
    files: Effects = None,
    check_: Annotated[
        bool, typer.Option("--check", help="Run the laws that every effect obeys.")
    ] = False,
    as_json_: Json = False,
) -> None:
    """Print the catalogue, or one effect with its equation, units and source; or check it.

    Example: twin effects cogging --plot cogging.png
    """
    from identify.output.answers.machine import EffectsAnswer, effect_answer, laws_answer
    from identify.output.machine import draw, effect_text, effects_text, laws_text

    catalogue = catalogue_with(files)
    if check_:
        from twin.laws.verdict import check_effect

        if plot is not None:
            raise InputError(f"--check draws nothing; give --plot {plot} in a command of its own")
        names = [f.stem for f in files or ()] if name is None else [name]
        if not names:
            raise InputError(
                "--check was given no effect; give the NAME of one, or your own file with --effects"
            )
        reports = [check_effect(effect) for effect in [catalogue[name] for name in names]]
        say(laws_text(reports), laws_answer(reports), as_json_)
        if not all(report.ok for report in reports):
            raise typer.Exit(1)
        return
    if name is not None:
        chosen = catalogue[name]
        if plot is not None:
            from identify.experiment_design.planting import signature

            require_writable(plot)
            draw(chosen, *signature(chosen, catalogue), plot)
        say(effect_text(chosen), effect_answer(chosen), as_json_)
        return
    if plot is not None:
        raise InputError(f"--plot {plot}: draws one effect; give its NAME")
    everything = list(catalogue.values())
    answer = EffectsAnswer(effects=[effect_answer(e) for e in everything])
    say(effects_text(everything), answer, as_json_)


@app.command()
def export(
    model: Model,
    to: Annotated[str, typer.Option("--to", help=f"{', '.join(format_names())}.")],
    logs: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[LOG...]", help="MCAP logs on which losses are told in N."),
    ] = None,
    out: Annotated[Path, typer.Option("--out", "-o", help="Folder to write into.")] = Path(
        "export"
    ),
    effects: Effects = None,
    as_json_: Json = False,
) -> None:
    """Write the model for a controller or another tool, and tell what that cannot hold of it.

    Example: twin export better.toml --to c -o controller
    """
    from identify.output.answers.machine import ExportAnswer
    from identify.output.machine import export_text
    from twin.files import make_folder, write_atomically

    exporter = find_exporter(to)
    recorded = CheckedRecordings(logs)
    made = exporter.export(machine_model(model, catalogue_with(effects)), recorded)
    make_folder(out)
    files = [out / name for name in made.files]
    for file, content in zip(files, made.files.values(), strict=True):
        write_atomically(file, content.encode() if isinstance(content, str) else content)
    names = [str(file) for file in files]
    answer = ExportAnswer.of(made, format=to, files=names)
    say("\n".join([*names, export_text(made)]), answer, as_json_, recorded.findings)


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
    from identify.output.answers.machine import ExampleAnswer, ExamplesAnswer
    from twin.examples import EXAMPLES, write_example

    if name is None:
        width, told = max(map(len, EXAMPLES)), {key: e.summary for key, e in EXAMPLES.items()}
        lines = [f"{key:{width}s}  {summary}" for key, summary in told.items()]
        say("\n".join(lines), ExamplesAnswer(examples=told), as_json_)
        return
    into = out or Path(name)
    chosen, files = write_example(name, into)
    lines = [f"{into}: {', '.join(file.name for file in files)}"]
    lines += [f"data: {chosen.data}"] if chosen.data else []
    lines += ["now:", f"  cd {into}", *(f"  {command}" for command in chosen.commands)]
    answer = ExampleAnswer.of(chosen, folder=str(into), files=[str(file) for file in files])
    say("\n".join(lines), answer, as_json_)
