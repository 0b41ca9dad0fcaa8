"""Memory that was freed: taken again by any thread, given back to the system."""

from __future__ import annotations

import ctypes
from contextlib import suppress

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
