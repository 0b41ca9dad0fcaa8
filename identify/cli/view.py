"""The command that shows a log and a model as they move."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from identify.cli.progress import progress_on_stderr
from identify.cli.shared import (
    Effects,
    Json,
    Recordings,
    app,
    catalogue_with,
    left_out,
    machine_model,
    require_report,
    say,
)
from twin.errors import InputError
from twin.files import require_writable


@app.command()
def view(
    log: Annotated[Path, typer.Argument(metavar="LOG", help="MCAP log.")],
    model: Annotated[
        str | None,
        typer.Argument(metavar="MODEL", help="Machine model (.toml); the log alone if left out."),
    ] = None,
    html: Annotated[
        Path | None, typer.Option(help="Page to write, which replays it in any browser.")
    ] = None,
    video: Annotated[Path | None, typer.Option(help="MP4 to write, without a display.")] = None,
    speed: Annotated[float, typer.Option(help="Speed of the replay; 1 is real time.")] = 1.0,
    gain: Annotated[
        float | None,
        typer.Option(
            metavar="TIMES",
            help="How many times larger than they are the differences to the measured motion are "
            "drawn; chosen so that they are seen if left out.",
        ),
    ] = None,
    effects: Effects = None,
    as_json_: Json = False,
) -> None:
    """Show the machine as measured, as modelled and as commanded, with forces and what is left.

    In MuJoCo's viewer, unless a page or a video is asked for.

    Example: twin view test.mcap fitted.toml --html replay.html
    """
    from identify.output.answers.machine import ViewAnswer

    for option, value in (("--speed", speed), ("--gain", gain)):
        if value is not None and not 0.0 < value < float("inf"):
            raise InputError(f"{option} {value:g}: must be above 0, without unit; 1 is as it was")
    require_report(html)
    if video:
        require_writable(video)
    machine = None if model is None else machine_model(model, catalogue_with(effects))
    with progress_on_stderr() as progress, left_out() as silent:
        progress("reading and replaying the log", 0, 1)
        from identify.view.replay import replay

        shown = replay(machine, Recordings([log])[str(log)], log.name)
        times = shown.gain if gain is None else gain
        if video:
            from identify.view.video import write_video

            write_video(video, shown, times, speed, progress)
    if html:
        from identify.view.page import write_page

        write_page(html, shown, times, speed)
    written = {n: str(f) for n, f in (("html", html), ("video", video)) if f}
    if not written:
        from identify.view.live import show

        show(shown, times, speed)
    seconds = len(shown) / shown.rate
    answer = ViewAnswer(
        log=str(log), html=written.get("html"), video=written.get("video"), axes=list(shown.axes),
        duration=seconds, gain=times, notes=list(shown.notes), left_out=silent,
    )  # fmt: skip
    drawn = "at their true size" if times == 1.0 else f"{times:g} times as large"
    text = "\n".join(
        f"{path}: {seconds:.3g} s of {log}, differences drawn {drawn}" for path in written.values()
    )
    say(text, answer, as_json_, [*silent, *shown.notes])
