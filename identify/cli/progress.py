"""What a command is doing and how long that still takes, on standard error.

On a terminal it is a bar; elsewhere lines, the first after some seconds, so that a short command
says nothing. How many steps a search takes nobody knows before, so the time is that of the part
under way, never of the whole.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, replace
from threading import Event, Thread
from time import monotonic
from typing import TYPE_CHECKING, TextIO

from twin.progress import Progress, silent

if TYPE_CHECKING:
    from rich.table import Table

FIRST, EVERY = 5.0, 10.0  # s until the first line, and from one to the next


@dataclass(frozen=True)
class Part:
    """Part of a command's work. first: how much of it was done when it began, at ``begun`` (s)."""

    what: str
    done: int
    total: int
    first: int
    begun: float

    def left(self, now: float) -> float | None:
        """s until it ends, where the rest goes as fast as what was done; None where that is none.

        What is under way is not counted, so the time grows where it takes longer than the others.
        """
        if self.done <= self.first or self.done >= self.total:
            return None
        return (now - self.begun) / (self.done - self.first) * (self.total - self.done)

    def words(self, now: float) -> str:
        """What is done, how much of it, and how long that still takes."""
        words, left = self.what, self.left(now)
        if self.total > 1000:  # above it a part is told as a percentage
            words += f": {100 * self.done // self.total} %"
        elif self.total > 1:
            words += f": {self.done} of {self.total}"
        return words if left is None else f"{words}, about {roughly(left)} left of this part"


def roughly(seconds: float) -> str:
    """A time as roughly as it is known."""
    if seconds < 100.0:
        return f"{max(round(seconds), 1)} s"
    minutes = round(seconds / 60.0)
    return f"{minutes} min" if minutes < 100 else f"{minutes / 60.0:.1f} h"


class Shown:
    """Where a command is: called as a `Progress`, from any thread."""

    def __init__(self) -> None:
        self.begun = monotonic()
        self.part = Part("starting", 0, 0, 0, self.begun)

    def __call__(self, what: str, done: int, total: int) -> None:
        same = what == self.part.what and total == self.part.total and done > self.part.done
        now = monotonic()
        self.part = replace(self.part, done=done) if same else Part(what, done, total, done, now)

    def __str__(self) -> str:
        now = monotonic()
        return f"{self.part.words(now)} ({roughly(now - self.begun)} so far)"


@contextmanager
def progress_on_stderr(first: float = FIRST, every: float = EVERY) -> Iterator[Progress]:
    """Progress on standard error: a bar on a terminal, else lines; first, every: s between them."""
    if sys.stderr is None:  # closed by who started the command
        yield silent
        return
    shown = Shown()
    with _bar(shown) if sys.stderr.isatty() else _lines(shown, sys.stderr, first, every):
        yield shown


@contextmanager
def _lines(shown: Shown, stream: TextIO, first: float, every: float) -> Iterator[None]:
    """Lines from a thread of their own: they come too while a long piece of work says nothing."""
    ended = Event()

    def tell() -> None:
        wait = first
        with suppress(OSError, ValueError):  # nobody reads them any more
            while not ended.wait(wait):
                stream.write(f"twin: {shown}\n")
                stream.flush()
                wait = every

    teller = Thread(target=tell, name="progress", daemon=True)
    teller.start()
    try:
        yield
    finally:
        ended.set()
        teller.join()


@contextmanager
def _bar(shown: Shown) -> Iterator[None]:
    from rich.console import Console
    from rich.live import Live
    from rich.progress_bar import ProgressBar
    from rich.table import Table

    def drawn() -> Table:
        part, row = shown.part, Table.grid(padding=(0, 1))
        counted = part.total > 1  # what is not only shows that it goes on
        width = 30  # of the bar, characters
        bar = ProgressBar(part.total if counted else None, part.done, width, pulse=not counted)
        row.add_row(bar, str(shown))
        return row

    with Live(get_renderable=drawn, console=Console(stderr=True), transient=True):
        yield
