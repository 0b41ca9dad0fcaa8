"""The words of lexicon.toml, by which recorders name their columns, by what they mean."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from enum import Enum, auto
from functools import cache
from pathlib import Path
from typing import Any, TypeVar


class Quantity(Enum):
    """What a column holds."""

    POSITION = auto()
    VELOCITY = auto()
    ACCELERATION = auto()
    FORCE = auto()
    CURRENT = auto()
    DRIVE = auto()  # what may stand for a force: a voltage, a duty cycle, the output of a loop
    PRESSURE = auto()
    TEMPERATURE = auto()
    OTHER = auto()  # no signal of an axis: an error, a limit, a time


CHANNELS = (Quantity.PRESSURE, Quantity.TEMPERATURE)  # beside the motion and its force


class SignalRole(Enum):
    """Whether a column was measured, asked for, or is only a part of a command."""

    MEASURED = auto()
    ASKED = auto()
    PART = auto()


Meaning = TypeVar("Meaning", Quantity, SignalRole)
_FILE = tomllib.loads(Path(__file__).with_name("lexicon.toml").read_text(encoding="utf-8"))


def _by(kind: type[Meaning], table: Mapping[str, Any]) -> dict[Meaning, Any]:
    """A table of the file by the quantities, or roles, that its keys name."""
    return {kind[name.upper()]: value for name, value in table.items()}


def _words(name: str) -> frozenset[str]:
    return frozenset(_FILE["words"][name].split())


QUANTITIES: dict[Quantity, str] = _by(Quantity, _FILE["quantities"])
QUANTITIES[Quantity.OTHER] += f" {_FILE['words']['errors']}"
HINTS: Mapping[Quantity, str] = _by(Quantity, _FILE["hints"])
ROLES: Mapping[SignalRole, str] = _by(SignalRole, _FILE["roles"])
SMOOTHED, EMPTY, TURNING = _words("smoothed"), _words("empty"), _words("turning")
COUNTING, RAW, ERRORS = _words("counting"), _words("raw"), _words("errors")
AHEAD = _words("ahead")
RATES: Mapping[str, Mapping[Quantity, Quantity]] = {
    word: {quantity: Quantity[rate.upper()] for quantity, rate in _by(Quantity, rates).items()}
    for word, rates in _FILE["rates"].items()
}
CODES: Mapping[str, str] = _FILE["codes"]
CUSTOMARY: Mapping[str, str] = _FILE["customary"]
UNITS: Mapping[Quantity, Mapping[str, str]] = _by(Quantity, _FILE["units"])


@cache
def words_of_other_scripts() -> frozenset[str]:
    """Those of several signs that are not Latin."""
    words = " ".join((*QUANTITIES.values(), *ROLES.values()))
    return frozenset(w for w in words.split() if len(w) > 1 and ord(w[0]) > 0x3FF)
