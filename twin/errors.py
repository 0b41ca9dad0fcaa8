"""Errors that a user may cause; the command line prints them as a single line."""

import difflib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager


class InputError(ValueError):
    """Input that cannot be used.

    The message is one line: what was given (with its unit), what is allowed, what to try.
    """


class CannotRun(InputError):
    """A motion that cannot be run on this machine: beyond its limits, or unstable on it.

    Code that chooses among motions may leave such a motion out and report it; any other error must
    not be caught.
    """


class Unwritten(InputError):
    """A file that could not be written, though its name and folder were good: a disk is full."""


def near(key: str, known: Iterable[str], cutoff: float = 0.6) -> str:
    """A question about the nearest known name, or nothing."""
    found = difflib.get_close_matches(key, list(known), n=1, cutoff=cutoff)
    return f"did you mean '{found[0]}'? " if found else ""


@contextmanager
def at(place: str) -> Iterator[None]:
    """Prefix the message of an InputError with where it happened, and keep it one line."""
    try:
        yield
    except InputError as error:
        raise type(error)(" ".join(f"{place}: {error}".splitlines())) from error
