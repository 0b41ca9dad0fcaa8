"""Checks of a user's own effect before it is used; each mistake is an error of one line.

Compiled code does not check array bounds, so the law first runs as plain Python on guarded arrays.
"""

from __future__ import annotations

import math
import random
from pathlib import Path

from twin.core.compiled import law_address
from twin.effect import (
    ACC,
    DRY,
    DT,
    HOLD,
    INDEX,
    IO_SIZE,
    MASS,
    MOVED,
    NET,
    READING,
    STATIC,
    TIME,
    VISCOUS,
    WHEN,
    Effect,
    Kind,
    U,
    V,
    X,
)
from twin.errors import InputError

RESULT = {
    Kind.SENSING: "io[READING]",
    Kind.ACTUATION: "io[U]",
    Kind.FORCE: "io[OUT]",
    Kind.MODIFIER: "io[DRY], io[STATIC] or io[VISCOUS]",
    Kind.FRICTION: "io[OUT]",
    Kind.STRUCTURE: "io[OUT]",
}
SPEEDS = (0.0, 0.1, 1e-6, -1e-6, -0.1, 0.0)  # m/s, one sample each
PERIOD = 1e-4  # s
MOTIONS = 1000  # samples of any motion, for the indices alone


class Outside(Exception):
    """An index that an array does not have."""


class Guarded(list):
    """An array of doubles that refuses an index it does not have."""

    def __init__(self, name: str, values: list[float]) -> None:
        super().__init__(values)
        self.name = name

    def __getitem__(self, index):
        return super().__getitem__(self._inside(index))

    def __setitem__(self, index, value):
        super().__setitem__(self._inside(index), float(value))

    def _inside(self, index):
        if not 0 <= index < len(self):
            raise Outside(f"{self.name}[{index}]")
        return index


def require_sound(effect: Effect, path: Path) -> None:
    """Raise InputError, in one line, where the law of a user's file cannot work."""
    values = [_tried(p.start, p.lower, p.upper, p.strength) for p in effect.parameters]
    p, s = Guarded("p", values), Guarded("s", [0.0] * len(effect.states))
    acted = False
    for speed in SPEEDS:
        io = Guarded("io", _sample(speed))
        before = list(io)
        try:
            effect.law(p, s, io)
        except Outside as touched:
            raise InputError(f"{path}: {outside_words(effect, str(touched))}") from None
        except (ArithmeticError, ValueError) as error:
            raise InputError(f"{path}: {_not_finite(speed, str(error))}") from error
        except Exception as error:
            raise InputError(
                f"{path}: its law fails at v = {speed:g} m/s: {_told(error)}; use only numbers, "
                "math functions and the arrays p, s, io"
            ) from error
        if not all(map(math.isfinite, [*io, *s])):
            raise InputError(f"{path}: {_not_finite(speed, 'the result is not a finite number')}")
        acted = acted or before != list(io)
    if not acted:
        raise InputError(
            f"{path}: its law writes no result; a {effect.kind.name.lower()} effect writes "
            f"{RESULT[effect.kind]}"
        )
    _require_indices(effect, values, path)
    law_address(effect)


def _require_indices(effect: Effect, values: list[float], path: Path) -> None:
    """Raise InputError where an index leaves its array anywhere in a wide range of motion."""
    rng = random.Random(1)
    p, s = Guarded("p", values), Guarded("s", [0.0] * len(effect.states))
    for k in range(MOTIONS):
        size = 10.0 ** rng.uniform(-6.0, 1.0)
        io = Guarded("io", [rng.choice((-1.0, 1.0)) * size * rng.random() for _ in range(IO_SIZE)])
        io[DT], io[MASS], io[MOVED], io[WHEN] = PERIOD, 1.0, 1.0, 1.0
        io[INDEX], io[TIME] = k, k * PERIOD
        try:
            effect.law(p, s, io)
        except Outside as touched:
            words = outside_words(effect, str(touched))
            raise InputError(f"{path}: at x = {io[X]:.3g} m {words}") from None
        except (ArithmeticError, ValueError):  # of numbers beyond any machine
            s = Guarded("s", [0.0] * len(effect.states))


def _told(error: Exception) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())


def _tried(start: float, lower: float, upper: float, strength: bool) -> float:
    """The start value, or a small strength where the effect is absent at the start."""
    return start if start or not strength else min(max(0.1, lower), upper)


def _sample(speed: float) -> list[float]:
    io = [0.0] * IO_SIZE
    io[DT], io[MASS], io[MOVED], io[WHEN] = PERIOD, 1.0, 1.0, 1.0
    io[X], io[V], io[U] = 0.0123, speed, 1.0
    io[READING] = io[X]
    io[DRY] = io[STATIC] = io[VISCOUS] = 1.0
    io[HOLD] = speed / PERIOD + 1.0
    io[NET] = io[ACC] = 1.0
    return io


def outside_words(effect: Effect, touched: str) -> str:
    """One sentence on a law that used ``touched``, such as "s[1]", which it does not have."""
    has = {
        "p": f"{len(effect.parameters)} parameters are declared; add a Parameter",
        "s": f"{len(effect.states)} states are declared; add a name to states=(...)",
        "io": f"it has {IO_SIZE} slots; use the names of twin.effect, such as io[X]",
    }
    return f"its law uses {touched}, but {has[touched.split('[')[0]]}"


def _not_finite(speed: float, reason: str) -> str:
    return (
        f"its law gives no finite number at v = {speed:g} m/s ({reason}); it must for every speed, "
        "also 0: treat that case apart"
    )
