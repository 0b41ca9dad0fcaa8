"""A user's effect file tried in a process of its own, where it can neither hang nor end this one.

Loading such a file runs its code. What it does there is told in one line: an endless loop, an exit,
a crash, or a mistake that twin.core.user_effect finds.
"""

from __future__ import annotations

import faulthandler
import multiprocessing
import os
import signal
import sys
from collections.abc import Callable
from multiprocessing.connection import Connection
from pathlib import Path
from typing import Any

from twin.errors import InputError

SECONDS = 30.0  # for loading, trying and compiling one file

Load = Callable[[Path], object]


def try_file(path: Path, load: Load) -> None:
    """Raise InputError where ``load(path)`` does, and where it does not come to an end.

    load: a function of a module, as the other process looks it up by name.
    """
    # A fork starts at once, with all that is imported; elsewhere it is not safe.
    context: Any = multiprocessing.get_context("fork" if sys.platform == "linux" else "spawn")
    answers, questions = context.Pipe(duplex=False)
    process = context.Process(target=_attempt, args=(path, load, questions), daemon=True)
    process.start()
    questions.close()
    try:
        answer = answers.recv() if answers.poll(SECONDS) else None
    except EOFError:  # it ended without a word
        process.join()
        raise InputError(f"{path}: {_ended(process.exitcode)}") from None
    finally:
        process.kill()
        process.join()
        answers.close()
    if answer is None:
        raise InputError(
            f"{path}: was not loaded and tried within {SECONDS:g} s; look for a loop without an end"
        )
    if answer:
        raise InputError(answer)


def _attempt(path: Path, load: Load, questions: Connection) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)
    faulthandler.disable()
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (1, 2):  # the file is loaded again, and then what it prints is seen
        os.dup2(nowhere, stream)
    try:
        load(path)
    except InputError as error:
        questions.send(str(error))
    else:
        questions.send("")


def _ended(code: int | None) -> str:
    if code is not None and code < 0:
        return f"crashed while it was loaded and tried ({signal.Signals(-code).name})"
    return "ended the program while it was loaded and tried; remove the exit"
