"""What threads share because the whole process has only one of it: matrices, freed memory."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Callable, Iterator
from contextlib import (
    AbstractContextManager,
    ExitStack,
    contextmanager,
    nullcontext,
    suppress,
)
from threading import Lock
from typing import Any

VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def entered_once(
    context: Callable[[], AbstractContextManager[object]],
) -> Callable[[], AbstractContextManager[None]]:
    """The context, entered by the first of all that are within at once, and left by the last.

    Each restoring what it found would leave the process with what another had set meanwhile.
    """
    lock, entered, within = Lock(), ExitStack(), 0

    @contextmanager
    def counted() -> Iterator[None]:
        nonlocal within
        with lock:
            if within == 0:
                entered.enter_context(context())
            within += 1
        try:
            yield
        finally:
            with lock:
                within -= 1
                if within == 0:
                    entered.close()

    return counted


@contextmanager
def one_for_matrices() -> Iterator[None]:
    """One BLAS thread for what runs within, unless the environment says how many.

    The matrices of a fit are too small to share out, and BLAS threads that wait for work cost CPU
    time, and take it from the candidates that go side by side.
    """
    with nullcontext() if any(name in os.environ for name in VARIABLES) else _one_blas_thread():
        yield


@entered_once
@contextmanager
def _one_blas_thread() -> Iterator[None]:
    from threadpoolctl import ThreadpoolController

    libraries = ThreadpoolController().select(user_api="blas").lib_controllers
    before = [(library, library.num_threads) for library in libraries]
    for library in libraries:
        _set_threads(library, 1)
    try:
        yield
    finally:
        for library, count in before:
            _set_threads(library, count)


def _set_threads(library: Any, count: int) -> None:
    """threadpoolctl 3.8 heeds, without a word, only the first thread that set a count.

    Until that lets go: it does so here before and after, as the last call may end in another.
    """
    let_go = getattr(library, "clear_controlling_thread", lambda force: None)
    let_go(force=True)
    library.set_num_threads(count)
    let_go(force=True)


# --- memory that was freed ------------------------------------------------------------------------

SMALLEST_MAPPED = 1 << 23  # bytes; a signal of a log is smaller, an array of several is not


def share_one_arena() -> None:
    """Let the threads of a program take memory from one place, where the C library is glibc.

    It would keep what each of them has freed for that thread alone, and take the next signal from
    the system again, which clears that memory first.
    """
    m_trim_threshold, m_mmap_threshold, m_arena_max = -1, -3, -8  # malloc.h of glibc
    with suppress(OSError, AttributeError, TypeError):
        libc = ctypes.CDLL(None)
        libc.mallopt(m_arena_max, 1)
        libc.mallopt(m_mmap_threshold, SMALLEST_MAPPED)
        most_kept = 1 << 25  # bytes at the end of that place
        libc.mallopt(m_trim_threshold, most_kept)


def trim_memory() -> None:
    """Give back what was freed, where the C library keeps it for itself, as glibc does.

    Behind a step that took much for a while: a process that goes on needs it only in part.
    """
    with suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)


def trim_beside(size: int) -> None:
    """The same where an array of so many bytes is held, whose like does not fit into what is free.

    Behind work in threads, which leaves many times what one of them asks for at once.
    """
    if size >= SMALLEST_MAPPED:
        trim_memory()
