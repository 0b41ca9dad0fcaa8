"""Work in a process of its own, where it can neither hang nor end this one.

For what is not ours: a user's effect file, whose code is run, and libraries that a damaged file may
crash.
"""

from __future__ import annotations

import faulthandler
import multiprocessing
import os
import signal
import sys
from collections.abc import Callable
from multiprocessing.connection import Connection
from typing import Any, TypeVar

from twin.errors import InputError

T = TypeVar("T")


class NoAnswer(InputError):
    """The work hung, failed, crashed or ended its process."""


def apart(work: Callable[..., T], *arguments: Any, seconds: float, memory: int | None = None) -> T:
    """What ``work`` returns, from another process.

    work: a function of a module, as the other process looks it up by name. memory: bytes that it
    may take beside what the program has, where the system can tell. Raises InputError where it
    does, and NoAnswer where it does not come to an end, fails, crashes, or ends the process.
    """
    # A fork starts at once, with all that is imported; elsewhere it is not safe.
    context: Any = multiprocessing.get_context("fork" if sys.platform == "linux" else "spawn")
    answers, questions = context.Pipe(duplex=False)
    process = context.Process(
        target=_attempt, args=(work, arguments, questions, memory), daemon=True
    )
    process.start()
    questions.close()
    try:
        if not answers.poll(seconds):
            raise NoAnswer(
                f"does not come to an end within {seconds:g} s; look for a loop without an end"
            )
        error, result = answers.recv()
    except EOFError:  # it ended without a word
        process.join()
        raise NoAnswer(_ended(process.exitcode)) from None
    finally:
        process.kill()
        process.join()
        answers.close()
    if error is not None:
        raise error
    return result


def _attempt(
    work: Callable[..., Any], arguments: tuple, questions: Connection, memory: int | None
) -> None:
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)
    faulthandler.disable()
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (1, 2):  # what is printed here is printed again, or nobody's concern
        os.dup2(nowhere, stream)
    if memory is not None:
        _limit(memory)
    try:
        questions.send((None, work(*arguments)))
        return
    except Exception as error:  # an exit is none
        told = _told(error)
    questions.send((told, None))


def _told(error: Exception) -> InputError:
    """What is raised in this process for an error in the other."""
    if isinstance(error, InputError):
        return InputError(str(error))
    if isinstance(error, MemoryError):
        return InputError("takes more memory than a file of its size may; export it again")
    reason = " ".join(f"{type(error).__name__}: {error}".split())
    return NoAnswer(f"failed while it was loaded ({reason}); if the file is sound, report this")


def _limit(memory: int) -> None:
    """Let this process take so many bytes more than it has, on Linux."""
    if sys.platform == "linux":
        import resource

        with open("/proc/self/statm") as stream:
            held = int(stream.read().split()[0]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_AS, (held + memory, resource.RLIM_INFINITY))


def _ended(code: int | None) -> str:
    if code is not None and code < 0:
        return f"crashed while it was loaded ({signal.Signals(-code).name})"
    return "ended the program while it was loaded; remove the exit"
