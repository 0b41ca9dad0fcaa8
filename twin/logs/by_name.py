"""Logs by name, of whatever a caller has: a log, a file, several of either, or a dict of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

from twin.errors import InputError
from twin.logs.decode import read_log
from twin.logs.log import Log

OneLog = Log | str | Path
GivenLogs = OneLog | Sequence[OneLog] | Mapping[str, OneLog]
WANTED = "give a Log, the path of one, a list of them or a dict with a name for each"


class LogsByName(Mapping[str, Log]):
    """Logs by name; a file is read each time that it is asked for, so that nobody holds it."""

    def __init__(self, given: Mapping[str, OneLog]) -> None:
        self._given = given

    def __getitem__(self, name: str) -> Log:
        found = self._given[name]
        return found if isinstance(found, Log) else read_log(found)

    def __iter__(self) -> Iterator[str]:
        return iter(self._given)

    def __len__(self) -> int:
        return len(self._given)


def logs_by_name(given: GivenLogs | None, role: str = "log") -> Mapping[str, Log]:
    """The logs by name: of a file its path, of a log without one its role and number.

    Raises InputError for what is no log, and for a file that is given twice.
    """
    if given is None:
        return {}
    if isinstance(given, Mapping):
        if type(given) is dict:  # another mapping may read a file for each of its values
            for name, log in given.items():
                _require_log(log, f"{role} {name!r}")
        return LogsByName(given)
    logs = [given] if isinstance(given, Log | str | Path) else given
    if not isinstance(logs, Sequence):
        raise InputError(f"{role}: a {type(given).__name__} is no log; {WANTED}")
    named: dict[str, OneLog] = {}
    for number, log in enumerate(logs, start=1):
        _require_log(log, role)
        name = f"{role} {number}" if isinstance(log, Log) else str(log)
        if name in named:
            raise InputError(f"{role}: {name} is given twice; give each log once")
        named[name] = log
    return LogsByName(named)


def _require_log(log: object, what: str) -> None:
    if not isinstance(log, Log | str | Path):
        raise InputError(f"{what}: a {type(log).__name__} is no log; {WANTED}")
