"""`twin watch`: the model beside a machine that runs."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from typer import Argument, Option

from identify.cli.command import Reply
from identify.cli.shared import MEASURED, Effects, app, loaded
from twin.errors import InputError

if TYPE_CHECKING:
    from identify.fleet.live_diagnosis import Background
    from identify.fleet.served import Served
    from identify.fleet.watch import Watcher, Window, WindowSource
    from identify.results.fleet import LiveAlarm, LiveAxis, LiveCause

ADDRESSES = ("ws://", "wss://")
Show = Callable[["Window"], None]


@app.command()
def watch(
    log: Annotated[
        str,
        Argument(
            metavar="LOG", help="MCAP log, also one being written; or ws://HOST:PORT of a machine."
        ),
    ],
    model: Annotated[str, Argument(metavar="MODEL", help="Machine model (.toml), fitted.")],
    patience: Annotated[
        float, Option(min=0.0, help="After so many s without anything new it ends.")
    ] = 10.0,
    serve: Annotated[
        int | None,
        Option(
            metavar="PORT",
            min=0,
            max=65535,
            help="Serve residual, parameters and alarms at ws://127.0.0.1:PORT, for Foxglove; 0: "
            "at any port that is free.",
        ),
    ] = None,
    effects: Effects = None,
) -> Reply:
    """Follow a machine that runs, and tell when the force error of its model changes.

    Slow parameters are followed too, and after an alarm the last minutes are diagnosed in the
    background. It ends when the writer has closed the log, with exit code 1 where there was an
    alarm.

    Example: twin watch run.mcap.unfinished fitted.toml
    """  # fmt: skip
    from identify.fleet.live_diagnosis import background
    from identify.fleet.served import serving
    from identify.fleet.watch import Watcher
    from identify.output.answers.fleet import WatchAnswer
    from identify.output.words.fleet import live_in_words

    own, _ = loaded(model, effects)
    source, run = _source(log), _Run(Watcher(own))
    with ExitStack() as open_now:
        open_now.callback(source.close)
        show = open_now.enter_context(_shown(log))
        behind = open_now.enter_context(background(own, effects or ()))
        served = None if serve is None else open_now.enter_context(serving(serve))
        if served:
            _say(f"serves at {served.address}")
        run.until_the_end(source, patience, (show, behind, served))
    text = f"{log}: {run.watcher.windows} windows, {len(run.alarms)} alarms"
    lines = [text, *map(live_in_words, run.alarms), *run.in_the_end()]
    answer = WatchAnswer.of(
        log=log, windows=run.watcher.windows, ended=source.ended, alarms=run.alarms,
        causes=run.causes, parameters={n: list(a.parameters) for n, a in run.axes.items()},
        told=source.told,
    )  # fmt: skip
    return Reply("\n".join(lines), answer, source.told, fine=not run.alarms)


@dataclass
class _Run:
    """What was seen of a machine until now; axes: by name, as each was when it last moved."""

    watcher: Watcher
    alarms: list[LiveAlarm] = field(default_factory=list)
    causes: list[LiveCause] = field(default_factory=list)
    axes: dict[str, LiveAxis] = field(default_factory=dict)

    def until_the_end(
        self, source: WindowSource, patience: float, to: tuple[Show, Background, Served | None]
    ) -> None:
        """Follow it, and tell what it says to the terminal, the diagnosis and the clients."""
        from identify.fleet.watch import watch as run
        from identify.output.words.fleet import live_in_words

        show, behind, served = to
        for window in run(source, self.watcher, patience=patience):
            self.axes.update({axis.axis: axis for axis in window.axes})
            for alarm in window.alarms:
                self.alarms.append(alarm)
                _say(live_in_words(alarm))
            show(window)
            behind.take(window)
            if served:
                served.tell(window)
            self._say_causes(behind.ended(), served)
        self._say_causes(behind.rest(), served)

    def _say_causes(self, causes: Iterator[LiveCause], served: Served | None) -> None:
        from identify.output.words.fleet import cause_in_words

        for cause in causes:
            self.causes.append(cause)
            _say(cause_in_words(cause))
            if served:
                served.tell_cause(cause, self.watcher.then)

    def in_the_end(self) -> Iterator[str]:
        """The causes, what was never as its model, and the parameters as they are in the end."""
        from identify.output.words.fleet import (
            cause_in_words,
            parameter_in_words,
            unlike_in_words,
        )

        yield from map(cause_in_words, self.causes)
        yield from (unlike_in_words(name, *both) for name, both in self.watcher.unlike.items())
        for name, axis in self.axes.items():
            for one in axis.parameters:
                yield f"  {one.name} of axis {name}: {parameter_in_words(one)}"


def _source(log: str) -> WindowSource:
    """The file or the server that is followed. Raises InputError where there is none."""
    if log.startswith(ADDRESSES):
        from twin.logs.live import LiveTopics

        return LiveTopics(log, MEASURED)
    from twin.logs.follow import Follower

    path = Path(log)
    if not path.is_file():
        raise InputError(
            f"{log}: is no file; give the log that is being written, or the address of a machine "
            "as ws://host:8765"
        )
    return Follower(path, MEASURED)


def _say(line: str) -> None:
    print(f"twin: {line}", file=sys.stderr, flush=True)


@contextmanager
def _shown(log: str) -> Iterator[Show]:
    """A table on the terminal, where there is one, that each window makes new."""
    if sys.stderr is None or not sys.stderr.isatty():
        yield lambda window: None
        return
    from rich.console import Console
    from rich.live import Live

    from identify.output.live import table_of

    axes: dict[str, LiveAxis] = {}
    with Live(console=Console(stderr=True), auto_refresh=False) as live:

        def show(window: Window) -> None:
            axes.update({axis.axis: axis for axis in window.axes})
            live.update(table_of(log, window.end, axes.values()), refresh=True)

        yield show
