"""Commands about machines and logs: from simulate and new to export, example and view."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from identify.cli.command import Reply, progress_on_stderr
from identify.cli.shared import (
    CheckedRecordings,
    Effects,
    Logs,
    Model,
    ModelOption,
    Recordings,
    app,
    loaded,
    meaningless,
    was_kept,
    written,
)
from identify.output.machine import briefly, in_shell, not_determined_in_words
from twin.errors import InputError
from twin.export import find_exporter, format_names
from twin.telling import heard

if TYPE_CHECKING:
    from identify.analysis.first_model import Masses
    from identify.view.replay import Replay
    from twin.parallel import Progress


@app.command()
def simulate(
    experiment: Annotated[
        str, Argument(help="tracking, moves, cable_pass, ...; or a .toml from `twin plan`.")
    ],
    model: ModelOption = "proton_xy",
    out: Annotated[Path, written("MCAP log to write.")] = Path("log.mcap"),
    seed: Annotated[int, Option(help="Same seed, same log.")] = 0,
    duration: Annotated[
        float | None, Option(help="Length in s, 20 if left out; a file has its own.")
    ] = None,
    axis: Annotated[str | None, Option(help="Axis that moves, where one does.")] = None,
    setpoints: Annotated[
        Path | None,
        Option(help="Setpoints for a machine, to write: .csv, .yaml (ROS 2), .st (TwinCAT)."),
    ] = None,
    effects: Effects = None,
) -> Reply:
    """Run an experiment on the twin in MuJoCo and log it as MCAP.

    Example: twin simulate moves --model example_machine --duration 10 -o fit.mcap
    """
    from identify.output.answers.machine import LogAnswer
    from twin.experiments.file import SUFFIX, load_experiment
    from twin.experiments.named import DURATION, find_experiment, missed
    from twin.export.setpoints import write_setpoints
    from twin.logs import record_log
    from twin.simulation.simulate import Reach, simulate_parts

    stage, _ = loaded(model, effects)
    chosen = load_experiment(experiment) if experiment.endswith(SUFFIX) else experiment
    if setpoints is not None:
        run = chosen
        if isinstance(run, str):
            seconds = DURATION if duration is None else duration
            run = find_experiment(run, stage, axis, seconds)
        write_setpoints(run, stage, seed, setpoints)
    reach = Reach(stage)
    with progress_on_stderr() as progress:
        parts = simulate_parts(
            stage, chosen, seed=seed, duration=duration, axis=axis,
            progress=partial(progress, "simulating"),
        )  # fmt: skip
        samples = record_log(map(reach.take, parts), out)
    rate = stage.sample_rate
    answer = LogAnswer.of(log=out, samples=samples, sample_rate=rate, setpoints=setpoints)
    asked = None if duration is None else missed(duration, samples / rate)
    warnings = [*reach.warnings(), *([asked] if asked else [])]
    lines = [f"{out}: {samples} samples at {rate:g} Hz"]
    lines += [f"{setpoints}: the setpoints, to be run on the machine"] if setpoints else []
    return Reply("\n".join(lines), answer, warnings)


@app.command()
def new(
    logs: Logs,
    out: Annotated[Path, written("Machine model (.toml) to write.")],
    mjcf: Annotated[
        Path | None,
        Option("--mjcf", help="MJCF or URDF file whose joints or tendons are the axes."),
    ] = None,
    mass: Annotated[
        list[str] | None,
        Option(
            metavar="[AXIS=]NUMBER",
            help="Moved mass in kg (moment of inertia in kg m^2) where it is known, of an axis "
            "where several move; it is held, and the rest is found beside it.",
        ),
    ] = None,
    name: Annotated[
        str | None, Option(help="Name of the machine; that of the file if left out.")
    ] = None,
) -> Reply:
    """Propose a first model from logs: mass, friction, constant force, and their hardware.

    Example: twin new run.mcap -o model.toml
    """
    from identify.analysis.first_model import first_model, not_determined, unused
    from identify.analysis.motor_rotor import rotors_before_gears
    from identify.analysis.recording import misassigned
    from identify.output.answers.machine import NewModelAnswer
    from identify.output.words.recording import recording_in_words, rotor_in_words
    from twin.effects import load_catalogue
    from twin.files import kept_beside
    from twin.model.file import format_model, read_mjcf, save_model

    recorded = CheckedRecordings(logs, refused=meaningless(() if mjcf is None else (mjcf.stem,)))
    bodies = None if mjcf is None else (mjcf.name, read_mjcf(mjcf))
    read, known = dict(recorded), _masses(mass or ())
    with recorded.explaining():
        model = first_model(read, name or out.stem, load_catalogue(), bodies, known)
    kept = kept_beside(out, format_model(model).encode())
    save_model(model, out)
    first = next(iter(read.values()))
    doubt = misassigned(model, first) if model.joints else None
    rotors = [] if doubt else [*rotors_before_gears(model, first)]
    unknown = {axis: not_determined(found) for axis, found in model.axes.items()}
    text = (
        f"{out}: axes {', '.join(model.axes)}; now `{in_shell('diagnose', out, *_in_roles(logs))}`"
    )
    answer = NewModelAnswer.of(model=out, axes=list(model.axes), not_determined=unknown)
    doubts = [] if doubt is None else [f"{logs[0]}: warning: {recording_in_words(doubt)}"]
    silent = [f"{log} is left out: {why}" for log, why in unused(model, read).items()]
    doubts += [rotor_in_words(found, model) for found in rotors]
    doubts += [] if kept is None else [was_kept(out, kept)]
    warnings = [*briefly(recorded.findings), *silent, *doubts]
    return Reply("\n".join([text, *not_determined_in_words(unknown)]), answer, warnings)


def _in_roles(logs: Sequence[Path]) -> list[object]:
    """The logs as a diagnosis takes them: the last but one chooses, the last tests."""
    *training, selection, test = [*logs, None, None][: max(len(logs), 3)]
    roles = [("--holdout", selection), ("--test", test)]
    return [*training, *(word for role, log in roles if log for word in (role, log))]


def _masses(given: Sequence[str]) -> Masses | None:
    """The masses of axes as they were typed: a number alone, or "x=2.5"."""
    try:
        masses = {a: float(value) for a, _, value in (text.rpartition("=") for text in given)}
    except ValueError:
        raise InputError(
            f"--mass {' '.join(given)}: give a number in kg (kg m^2 of a rotary axis), as 2.5, or "
            "as x=2.5 where several axes move"
        ) from None
    return masses[""] if masses.keys() == {""} else masses or None


@app.command()
def info(
    logs: Logs,
    out: Annotated[
        Path | None,
        written("Its signals as a table: .csv, .mat, .parquet."),
    ] = None,
) -> Reply:
    """Tell what is in logs: length, rate, axes, signals with units and ranges, and faults.

    Example: twin info fit.mcap -o fit.csv
    """
    from identify.output.answers.machine import info_answer
    from identify.output.machine import info_text
    from twin.checks.long import log_info

    if out is not None:
        from twin.importers.table import write_table
        from twin.logs import read_log

        if len(logs) > 1:
            raise InputError(f"-o {out}: a table is of one log; give the logs one by one")
        write_table(read_log(logs[0]), out)
    found = {str(path): log_info(path) for path in logs}
    table = "" if out is None else f"\n{out}: its signals as a table"
    return Reply(f"{info_text(found)}{table}", info_answer(found))


@app.command()
def check(logs: Logs) -> Reply:
    """Say whether logs are fit for identification, what is wrong with them, and which are copies.

    Of three logs or more also which one disagrees with the others.

    Example: twin check run.mcap
    """
    from identify.dataset.odd_log import FEWEST
    from identify.output.answers.machine import check_answer
    from identify.output.machine import check_text
    from twin.checks.long import check_files

    reports = check_files(logs)
    if len(logs) >= FEWEST and all(report.ok for report in reports.values()):
        from identify.output.words.odd import with_odd
        from identify.workflow import odd_logs

        reports = with_odd(reports, odd_logs(logs))
    answer = check_answer(reports)
    return Reply(check_text(reports), answer, fine=answer.ok)


@app.command()
def cut(
    log: Annotated[Path, Argument(metavar="LOG", help="MCAP log.")],
    out: Annotated[Path, written("MCAP log to write.")],
    start: Annotated[float, Option("--from", help="Where it begins, s.")] = 0.0,
    stop: Annotated[
        float | None, Option("--to", help="Where it ends, s; the end of LOG if left out.")
    ] = None,
) -> Reply:
    """Write a stretch of a log as a log of its own.

    Example: twin cut run.mcap --from 1.5 --to 12 -o good.mcap
    """
    from identify.output.answers.machine import LogAnswer
    from twin.logs import cut_log, read_log, write_log

    made = cut_log(read_log(log), start, stop)
    write_log(made, out)
    answer = LogAnswer.of(log=out, samples=len(made), sample_rate=made.sample_rate)
    of = f"{made.metadata['cut']} of {log}"
    return Reply(f"{out}: {len(made)} samples at {made.sample_rate:g} Hz, {of}", answer)


@app.command()
def recover(
    log: Annotated[Path, Argument(metavar="LOG", help="Damaged MCAP log.")],
    out: Annotated[Path, written("MCAP log of what is intact.")],
    unproved: Annotated[
        bool, Option("--unproved", help="Keep samples that no checksum proves as well.")
    ] = False,
) -> Reply:
    """Keep the intact parts of a damaged log: the longest at OUT, the others beside it.

    Example: twin recover bad.mcap -o good.mcap
    """
    from identify.output.answers.machine import RecoveryAnswer
    from twin.logs import recover_file

    recovery, files = recover_file(log, out, unproved=unproved)
    others = {path: text for path, text in files.items() if path != out}
    answer = RecoveryAnswer.of(recovery, log=out, others=list(others))
    written = [f"{path}: {text}" for path, text in others.items()]
    return Reply("\n".join([str(recovery), *written]), answer)


@app.command()
def effects(
    name: Annotated[str | None, Argument(help="One effect in full.")] = None,
    plot: Annotated[
        Path | None, Option(help="Draw what the effect leaves in the force (.png, .svg).")
    ] = None,
    files: Effects = None,
    check_: Annotated[
        bool, Option("--check", help="Run the laws that every effect obeys.")
    ] = False,
) -> Reply:
    """Print the catalogue, or one effect with its equation, units and source; or check it.

    Example: twin effects cogging --plot cogging.png
    """
    from identify.output.answers.machine import EffectAnswer, EffectsAnswer, laws_answer
    from identify.output.machine import draw, effect_text, effects_text, laws_text
    from twin.effects import load_catalogue

    catalogue = load_catalogue(files or ())
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
        answer = laws_answer(reports)
        return Reply(laws_text(reports), answer, fine=answer.ok)
    if name is not None:
        chosen = catalogue[name]
        if plot is not None:
            from identify.experiment_design.planting import signature

            draw(chosen, *signature(chosen, catalogue), plot)
        return Reply(effect_text(chosen), EffectAnswer.of(chosen))
    if plot is not None:
        raise InputError(f"--plot {plot}: draws one effect; give its NAME")
    everything = list(catalogue.values())
    answers = EffectsAnswer.of(effects=everything)
    return Reply(effects_text(everything), answers)


@app.command()
def export(
    model: Model,
    to: Annotated[str, Option("--to", help=f"{', '.join(format_names())}.")],
    logs: Annotated[
        list[Path] | None,
        Argument(metavar="[LOG...]", help="MCAP logs on which losses are told in N."),
    ] = None,
    folder: Annotated[Path, written("Folder, or the only file.")] = Path("export"),
    effects: Effects = None,
) -> Reply:
    """Write the model for a controller or another tool, and tell what that cannot hold of it.

    Example: twin export better.toml --to c -o controller
    """
    from identify.output.answers.machine import ExportAnswer
    from identify.output.machine import export_text
    from twin.files import make_folder, write_atomically

    exporter = find_exporter(to)
    recorded = CheckedRecordings(logs or ())
    made = exporter.export(loaded(model, effects)[0], recorded)
    if len(made.files) == 1 and folder.suffix == Path(next(iter(made.files))).suffix:
        files = [folder]
    else:
        make_folder(folder)
        files = [folder / name for name in made.files]
    for file, content in zip(files, made.files.values(), strict=True):
        write_atomically(file, content.encode() if isinstance(content, str) else content)
    answer = ExportAnswer.of(made, format=to, files=files)
    text = "\n".join([*map(str, files), export_text(made)])
    return Reply(text, answer, briefly(recorded.findings))


@app.command()
def example(
    name: Annotated[str | None, Argument(help="Which example; all are listed if left out.")] = None,
    folder: Annotated[Path | None, written("New folder; NAME if left out.")] = None,
) -> Reply:
    """Write an example with its data and the commands to type, or list the examples.

    Example: twin example hidden_effect
    """
    from identify.output.answers.machine import ExampleAnswer, ExamplesAnswer
    from twin.examples import EXAMPLES, write_example

    if name is None:
        width, summaries = max(map(len, EXAMPLES)), {n: e.summary for n, e in EXAMPLES.items()}
        lines = [f"{key:{width}s}  {summary}" for key, summary in summaries.items()]
        return Reply("\n".join(lines), ExamplesAnswer(examples=summaries))
    into = folder or Path(name)
    chosen, files = write_example(name, into)
    lines = [f"{into}: {', '.join(file.name for file in files)}"]
    lines += [f"data: {chosen.data}"] if chosen.data else []
    lines += ["now:", f"  cd {into}", *(f"  {command}" for command in chosen.commands)]
    answer = ExampleAnswer.of(chosen, folder=into, files=files)
    return Reply("\n".join(lines), answer)


Gain = Annotated[
    float | None,
    Option(
        metavar="TIMES",
        help="How many times larger than they are the differences to the measured motion are "
        "drawn; chosen so that they are seen if left out.",
    ),
]


@app.command()
def view(
    log: Annotated[Path, Argument(metavar="LOG", help="MCAP log.")],
    model: Annotated[
        str | None,
        Argument(metavar="MODEL", help="Machine model (.toml); the log alone if left out."),
    ] = None,
    html: Annotated[
        Path | None, Option(help="Page to write, which replays it in any browser.")
    ] = None,
    video: Annotated[Path | None, Option(help="MP4 to write, without a display.")] = None,
    rerun: Annotated[
        Path | None, Option(help="Recording (.rrd) to write, for the viewer of Rerun.")
    ] = None,
    speed: Annotated[float, Option(help="Speed of the replay; 1 is real time.")] = 1.0,
    gain: Gain = None,
    effects: Effects = None,
) -> Reply:
    """Show the machine as measured, as modelled and as commanded, with forces and what is left.

    In MuJoCo's viewer, unless a page, a video or a recording is asked for.

    Example: twin view test.mcap fitted.toml --html replay.html
    """
    for option, value in (("--speed", speed), ("--gain", gain)):
        if value is not None and not 0.0 < value < float("inf"):
            raise InputError(f"{option} {value:g}: must be above 0, without unit; 1 is as it was")
    machine = None if model is None else loaded(model, effects)[0]
    files = {"html": html, "video": video, "rerun": rerun}
    with progress_on_stderr() as progress, heard() as silent:
        progress("reading and replaying the log", 0, 1)
        from identify.view.replay import replay

        shown = replay(machine, Recordings([log])[str(log)], log.name)
        times = shown.gain if gain is None else gain
        _write(shown, times, speed, files, progress)
    if not any(files.values()):
        from identify.view.live import show

        show(shown, times, speed)
    return _said_of_view(shown, log, times, silent, files)


def _write(
    shown: Replay, gain: float, speed: float, files: Mapping[str, Path | None], progress: Progress
) -> None:
    """Write the files that are asked for; what each needs is loaded then."""
    if video := files["video"]:
        from identify.view.video import write_video

        write_video(video, shown, gain, speed, progress)
    if html := files["html"]:
        from identify.view.page import write_page

        write_page(html, shown, gain, speed)
    if rerun := files["rerun"]:
        from identify.view.rerun import write_recording

        write_recording(rerun, shown, gain, speed)


def _said_of_view(
    shown: Replay, log: Path, gain: float, silent: list[str], files: Mapping[str, Path | None]
) -> Reply:
    """What was written of a log, and how large differences are drawn in it."""
    from identify.output.answers.machine import ViewAnswer

    seconds = len(shown) / shown.rate
    answer = ViewAnswer.of(
        shown, log=log, **files, axes=list(shown.axes), duration=seconds, gain=gain,
        left_out=silent,
    )  # fmt: skip
    drawn = "at their true size" if gain == 1.0 else f"{gain:g} times as large"
    said = f"{seconds:.3g} s of {log}, differences drawn {drawn}"
    text = "\n".join(f"{path}: {said}" for path in files.values() if path)
    return Reply(text, answer, [*silent, *shown.notes])
