"""Memory that was freed: taken again by any thread, given back to the system."""

from __future__ import annotations

import ctypes
from contextlib import suppress

M_ARENA_MAX = -8  # malloc.h of glibc


def share() -> None:
    """Let the threads of a program take memory from one place, where the C library is glibc.

    It would keep what each of them has freed for that thread alone.
    """
    with suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).mallopt(M_ARENA_MAX, 1)


def give_back() -> None:
    """Give back what was freed, where the C library keeps it for itself, as glibc does.

    Behind a step that took much for a while: a process that goes on needs it only in part.
    """
    with suppress(OSError, AttributeError, TypeError):
        ctypes.CDLL(None).malloc_trim(0)
