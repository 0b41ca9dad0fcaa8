"""What a job says of its logs beside its result, a line each, to whoever listens to this job.

A log that says nothing is left out, a free run that cannot be made is not made. Whoever hears no
such lines gets them as warnings of the logger "identify", which writes them on standard error.
Jobs in other threads, tasks or contexts are not heard.
"""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

LOGGER = logging.getLogger("identify")

_HEARD: ContextVar[list[str] | None] = ContextVar("heard", default=None)


def tell(line: str) -> None:
    """Say a line to whoever listens."""
    lines = _HEARD.get()
    if lines is None:
        LOGGER.warning("%s", line)
    else:
        lines.append(line)


@contextmanager
def heard() -> Iterator[list[str]]:
    """The lines that the work within says, in their order."""
    lines: list[str] = []
    token = _HEARD.set(lines)
    try:
        yield lines
    finally:
        _HEARD.reset(token)
