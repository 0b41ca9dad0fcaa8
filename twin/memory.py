"""Memory that was freed: taken again by any thread, given back to the system."""

from __future__ import annotations

import ctypes
from contextlib import suppress

M_TRIM_THRESHOLD, M_MMAP_THRESHOLD, M_ARENA_MAX = -1, -3, -8  # malloc.h of glibc
SMALLEST_MAPPED = 1 << 23  # bytes; a signal of a log is smaller, an array of several is not
MOST_KEPT = 1 << 25  # bytes at the end of that place


def share_one_arena() -> None:
    """Let the threads of a program take memory from one place, where the C library is glibc.

    It would keep what each of them has freed for that thread alone, and take the next signal from
    the system again, which clears that memory first.
    """
    with suppress(OSError, AttributeError, TypeError):
        libc = ctypes.CDLL(None)
        libc.mallopt(M_ARENA_MAX, 1)
        libc.mallopt(M_MMAP_THRESHOLD, SMALLEST_MAPPED)
        libc.mallopt(M_TRIM_THRESHOLD, MOST_KEPT)


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
