"""Work in an isolated process, where it can neither hang nor end this one.

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


def isolated(
    work: Callable[..., T], *arguments: Any, seconds: float, memory: int | None = None
) -> T:
    """What ``work`` returns, from another process.

    work: a function of a module, as the other process looks it up by name. memory: bytes that it
    may take beside what the program has, where the system can tell. Raises InputError where it
    does, and NoAnswer where it does not come to an end, fails, crashes, or ends the process.
    """
    # A fork starts at once, with all that is imported; elsewhere it is not safe.
    context: Any = multiprocessing.get_context("fork" if sys.platform == "linux" else "spawn")
    ours, theirs = context.Pipe(duplex=False)
    process = context.Process(target=_attempt, args=(work, arguments, theirs, memory), daemon=True)
    process.start()
    theirs.close()
    try:
        if not ours.poll(seconds):
            raise NoAnswer(
                f"does not come to an end within {seconds:g} s; look for a loop without an end"
            )
        error, result = ours.recv()
    except EOFError:  # it ended without a word
        process.join()
        raise NoAnswer(_ending(process.exitcode)) from None
    finally:
        process.kill()
        process.join()
        ours.close()
    if error is not None:
        raise error
    return result


def _attempt(
    work: Callable[..., Any], arguments: tuple, answer: Connection, memory: int | None
) -> None:
    """Send (None, result), or (error, None); an exit sends nothing."""
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_DFL)
    faulthandler.disable()
    nowhere = os.open(os.devnull, os.O_RDWR)
    for stream in (1, 2):  # what is printed here is printed again, or nobody's concern
        os.dup2(nowhere, stream)
    try:
        if memory is not None and sys.platform == "linux":
            import resource

            with open("/proc/self/statm") as pages:
                held = int(pages.read().split()[0]) * resource.getpagesize()
            resource.setrlimit(resource.RLIMIT_AS, (held + memory, resource.RLIM_INFINITY))
        answer.send((None, work(*arguments)))
    except InputError as error:
        answer.send((InputError(str(error)), None))
    except MemoryError:
        words = "takes more memory than a file of its size may; export it again"
        answer.send((InputError(words), None))
    except Exception as error:
        reason = " ".join(f"{type(error).__name__}: {error}".split())
        words = f"failed while it was loaded ({reason}); if the file is sound, report this"
        answer.send((NoAnswer(words), None))


def _ending(code: int | None) -> str:
    """Why a process ended without an answer."""
    if code is not None and code < 0:
        return f"crashed while it was loaded ({signal.Signals(-code).name})"
    return "ended the program while it was loaded; remove the exit"
