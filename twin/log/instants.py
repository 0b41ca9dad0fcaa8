"""Times as messages show them: seconds, or date and time where they count since 1970."""

from __future__ import annotations

from datetime import UTC, datetime

EARLIEST, LATEST = 5e8, 5e9  # s since 1970, between which a time is that of a calendar


def is_calendar(seconds: float) -> bool:
    """Whether a time in s counts since 1970."""
    return EARLIEST < seconds < LATEST


def seconds(nanoseconds: float) -> str:
    """A time in ns for a message."""
    if is_calendar(nanoseconds * 1e-9):
        whole, rest = divmod(round(nanoseconds), 10**9)
        day = datetime.fromtimestamp(whole, UTC).strftime("%Y-%m-%d %H:%M:%S")
        fraction = f".{rest:09d}".rstrip("0").rstrip(".")
        return f"{day}{fraction} UTC"
    return f"{nanoseconds * 1e-9:.9f}".rstrip("0").rstrip(".") + " s"


def instant(time: float) -> str:
    """A time in s for a message, to the microsecond where it counts since 1970."""
    return seconds(round(time * 1e6) * 1000) if is_calendar(time) else f"{time:.9g} s"
