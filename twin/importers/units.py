"""Units of the quantities of an axis, each in SI, and those that only a scale brings to SI."""

from __future__ import annotations

import difflib
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from typing import Any

from twin.errors import InputError

_TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0, "h": 3600.0, "day": 86400.0}
_LENGTH = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 0.0254}
_ANGLE = {
    "rad": 1.0,
    "mrad": 1e-3,
    "urad": 1e-6,
    "deg": math.radians(1.0),
    "°": math.radians(1.0),
    "arcmin": math.radians(1.0 / 60.0),
    "arcsec": math.radians(1.0 / 3600.0),
    "rev": 2.0 * math.pi,
}
_PREFIXES = {"": 1.0, "k": 1e3, "m": 1e-3, "u": 1e-6}


def _per(units: Mapping[str, float], power: int) -> dict[str, float]:
    """``units`` divided by a time to some power: mm/s, um/ms^2."""
    suffix = "" if power == 1 else f"^{power}"
    return {
        f"{unit}/{time}{suffix}": size / seconds**power
        for time, seconds in _TIME.items()
        for unit, size in units.items()
    }


def _prefixed(unit: str) -> dict[str, float]:
    return {prefix + unit: size for prefix, size in _PREFIXES.items()}


# SI unit -> units of the same quantity, each in SI
_QUANTITIES: Mapping[str, Mapping[str, float]] = {
    "s": _TIME,
    "m": _LENGTH,
    "m/s": _per(_LENGTH, 1),
    "m/s^2": {**_per(_LENGTH, 2), "g": 9.80665},
    "rad": _ANGLE,
    "rad/s": {**_per(_ANGLE, 1), "rpm": 2.0 * math.pi / 60.0},
    "rad/s^2": _per(_ANGLE, 2),
    "A": _prefixed("A"),
    "N": _prefixed("N"),
    "Pa": {**_prefixed("Pa"), "MPa": 1e6, "hPa": 1e2, "bar": 1e5, "mbar": 1e2, "psi": 6894.757},
    "K": {"K": 1.0, "degC": 1.0, "°C": 1.0},
    "N m": {**_prefixed("Nm"), "mNmm": 1e-6, "Nmm": 1e-3, "Ncm": 1e-2},
}
QUANTITIES = tuple(_QUANTITIES)  # by their SI units
CELSIUS, ICE = ("degC", "°C"), 273.15  # K, their zero
# what only a scale turns into a physical quantity
COUNTS = ("count", "counts", "cts", "cnt", "increment", "increments", "inc", "incs", "digit",
           "digits", "pulses", "ticks", "steps", "LSB")  # fmt: skip
_RAW = ("V", "mV", *COUNTS, "%", "1")
_WORD = re.compile(r"^[A-Za-z][A-Za-z0-9_*/^· -]{0,30}$")
_SEVERAL = re.compile(r"^(\d*\.?\d+(?:[eE][-+]?\d+)?) ?(?=[A-Za-zµμ°])")  # 0.1 um, 100ns
_WEIGHT = re.compile(r"\b(lb|oz|kg)s?\b")  # of which a force is as large
_SPELLINGS = str.maketrans({"µ": "u", "μ": "u", "²": "^2", "·": "", "*": "", " ": ""})


@dataclass(frozen=True)
class Unit:
    """One of the unit in SI, and the SI unit; ``si`` is None where the map must give a scale."""

    size: float
    si: str | None
    zero: float = 0.0
    """Its zero in SI: of degC."""


def find_unit(text: str, *allowed: str) -> Unit:
    """The unit ``text`` of quantities with the SI units ``allowed``; InputError suggests one.

    It may be so many of a unit: "0.1 um".
    """
    if several := _SEVERAL.match(text.strip()):
        one = find_unit(text.strip()[several.end() :], *allowed)
        return replace(one, size=float(several[1]) * one.size)
    plain = text.translate(_SPELLINGS)
    if plain.endswith(("/s2", "/ms2")):
        plain = plain[:-1] + "^2"
    for si in allowed:
        if plain in _QUANTITIES[si]:
            return Unit(_QUANTITIES[si][plain], si, ICE if plain in CELSIUS else 0.0)
    if plain in _RAW:
        return Unit(1.0, None)
    counted, _, time = plain.partition("/")
    if counted in COUNTS and time in _TIME:  # counts/ms
        return Unit(1.0 / _TIME[time], None)
    for si in allowed:
        if (size := _size_by_library(text.strip(), si)) is not None:
            return Unit(size, si)
    known = [unit for si in allowed for unit in _QUANTITIES[si]]
    by_lower = {unit.lower(): unit for unit in reversed(known)}
    near = difflib.get_close_matches(plain.lower(), by_lower, n=1, cutoff=0.55)
    hint = f"did you mean '{by_lower[near[0]]}'? " if near else ""
    raise InputError(
        f"unit '{text}' is not known here; {hint}give a unit of {' or '.join(allowed)} "
        f"({', '.join(known[:6])}, ...), or V or counts with a scale"
    )


def is_usual_unit(text: str) -> bool:
    """Whether it is one of the usual units of any quantity, or raw: no rarer one is looked for."""
    plain = text.translate(_SPELLINGS)
    return plain in _RAW or any(plain in units for units in _QUANTITIES.values())


def is_unit(text: str | None, *kinds: str) -> bool:
    """Whether it is a unit of one of these quantities (SI units)."""
    try:
        return text is not None and find_unit(text, *kinds).si is not None
    except InputError:
        return False


def raw_unit(text: str | None) -> str | None:
    """The unit of no quantity in a text: the counts of "counts/s"; None where there is none."""
    plain = (text or "").partition("/")[0]
    return plain if plain in _RAW else None


def _size_by_library(text: str, si: str) -> float | None:
    """One of a rarer unit, such as kip or lbf in, in SI; None where it is of another quantity."""
    if "rad" in si or not _WORD.search(text):  # angles have no dimension there: anything would do
        return None
    if si.startswith("N"):
        text = _WEIGHT.sub(r"\1f", text)
    product = re.sub(r"[· ]+|(?<=[A-Za-z])-(?=[A-Za-z])", "*", text)  # in-lbf
    try:
        return float(_registry()(product).to(si.replace(" ", "*")).magnitude)
    except Exception:  # whatever a parser of any text may raise: then it is no unit
        return None


@cache
def _registry() -> Any:
    import pint  # takes a second to load, for the few who need it

    return pint.UnitRegistry()
