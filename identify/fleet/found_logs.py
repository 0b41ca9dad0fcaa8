"""Which machine a log is of and when it began: told by its writer, or by its path."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import date, datetime, timedelta
from pathlib import Path

from twin.errors import InputError

MACHINE, AXIS, STARTED = "machine", "axis", "started"
PARTS = (MACHINE, AXIS, STARTED)
EVENING = timedelta(hours=12)  # a night has the date of its evening
STAMPS = ("%Y%m%d-%H%M%S", "%Y%m%d_%H%M%S", "%Y-%m-%d_%H-%M-%S")  # beside ISO 8601


@dataclass(frozen=True)
class Origin:
    """The machine of a log, when it began by its own clock, and which axis it is of (None: all)."""

    machine: str
    started: datetime
    axis: str | None = None

    @property
    def night(self) -> date:
        """The day of the evening before."""
        return (self.started - EVENING).date()


@dataclass(frozen=True)
class Pattern:
    """How paths below a folder tell of their logs, as "{machine}/{started}.mcap"."""

    text: str

    def __post_init__(self) -> None:
        names = re.findall(r"\{(\w*)\}", self.text)
        if unknown := [name for name in names if name not in PARTS]:
            raise InputError(
                f"--pattern {self.text}: {{{unknown[0]}}} is not known; give {{machine}}, {{axis}} "
                "and {started}, as in '{machine}/{started}.mcap'"
            )
        if len(names) != len(set(names)):
            raise InputError(f"--pattern {self.text}: a name is in it twice; give each once")

    def read(self, name: str) -> dict[str, str]:
        """What a path below the folder tells; nothing where it does not fit."""
        pieces = re.split(r"\{(\w+)\}", self.text)  # every second one is a name
        parts = (f"(?P<{p}>[^/]+?)" if i % 2 else re.escape(p) for i, p in enumerate(pieces))
        fits = re.fullmatch("".join(parts), name)
        return fits.groupdict() if fits else {}


def logs_below(folder: Path) -> Iterator[str]:
    """The paths of all logs below a folder, as they are called there. Raises InputError."""
    if not folder.is_dir():
        raise InputError(f"{folder}: is no folder; give the one that the logs lie in")
    yield from (p.relative_to(folder).as_posix() for p in sorted(folder.rglob("*.mcap")))


def origin_of(told: Mapping[str, str], by_path: Mapping[str, str]) -> Origin:
    """The origin of a log; what its writer told goes before its path. Raises InputError."""
    known = {**by_path, **{name: told[name] for name in PARTS if told.get(name)}}
    if lacking := [name for name in (MACHINE, STARTED) if name not in known]:
        raise InputError(
            f"does not tell its {' and '.join(lacking)}; write them into the metadata of the log, "
            "or give --pattern"
        )
    return Origin(known[MACHINE], instant(known[STARTED]), known.get(AXIS))


def instant(text: str) -> datetime:
    """A time of the day as it is written in logs and names of files. Raises InputError.

    A zone is left out: a night is one by the clock on the wall.
    """
    try:
        return datetime.fromisoformat(text).replace(tzinfo=None)
    except ValueError:
        pass
    for stamp in STAMPS:
        try:
            return datetime.strptime(text, stamp)
        except ValueError:
            continue
    raise InputError(f"started {text!r}: is no time; give it as 2026-03-14T02:30:00")
