"""Checks of a user's own effect before it is used; each mistake is an error of one line.

Compiled code does not check array bounds, so the law first runs as plain Python on guarded arrays.
"""

from __future__ import annotations

import math
import random
import re
from collections.abc import Iterable, Iterator
from pathlib import Path

import twin.effect as slots
from twin.core.compiled import law_address
from twin.effect import (
    ACC,
    CHANNELS,
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
# The slots by which a log is asked for what they hold.
_SLOTS = {
    vars(slots)[name]: name for name in ("TIME", "U", "X_OTHER", "V_OTHER", "A_OTHER", *CHANNELS)
}
_SI = frozenset(("N", "m", "s", "kg", "K", "Pa", "A", "V", "Hz", "J", "W", "rad"))
SPEEDS = (0.0, 0.1, 1e-6, -1e-6, -0.1, 0.0)  # m/s, one sample each
PERIOD = 1e-4  # s


class Outside(Exception):
    """An index that an array does not have."""


class Guarded(list):
    """An array of doubles that refuses an index it does not have."""

    def __init__(self, name: str, values: list[float]) -> None:
        super().__init__(values)
        self.name, self.used = name, set[int]()

    def __getitem__(self, index):
        return super().__getitem__(self._inside(index))

    def __setitem__(self, index, value):
        super().__setitem__(self._inside(index), float(value))

    def _inside(self, index):
        if not 0 <= index < len(self):
            raise Outside(f"{self.name}[{index}]")
        self.used.add(index)
        return index


def require_sound(effect: Effect, path: Path) -> None:
    """Raise InputError, in one line, where the law of a user's file cannot work.

    At usual speeds it must give a finite number and some result; over a wide range of motion its
    indices must stay within their arrays.
    """
    require_units(effect, path)
    if effect.reads("print"):
        raise InputError(f"{path}: its law prints, at every sample; take that out")
    # The start value, or a small strength where the effect is absent at the start.
    values = [
        p.start if p.start or not p.strength else min(max(0.1, p.lower), p.upper)
        for p in effect.parameters
    ]
    p, s = Guarded("p", values), Guarded("s", [0.0] * len(effect.states))
    acted, used = False, set[int]()
    for k, sample in enumerate([*map(_at_speed, SPEEDS), *_anywhere()]):
        usual, io = k < len(SPEEDS), Guarded("io", sample)
        try:
            effect.law(p, s, io)
            if usual and not all(map(math.isfinite, [*io, *s])):
                raise ValueError("the result is not a finite number")
        except Outside as touched:
            words = outside_words(effect, str(touched))
            raise InputError(f"{path}: at x = {sample[X]:.3g} m {words}") from None
        except (ArithmeticError, ValueError) as error:
            if usual:
                raise InputError(
                    f"{path}: its law gives no finite number at v = {sample[V]:g} m/s ({error}); "
                    "it must for every speed, also 0: treat that case apart"
                ) from error
            s = Guarded("s", [0.0] * len(effect.states))  # of numbers beyond any machine
        except Exception as error:
            told = " ".join(f"{type(error).__name__}: {error}".split())
            raise InputError(
                f"{path}: its law fails at v = {sample[V]:g} m/s: {told}; use only numbers, "
                "math functions and the arrays p, s, io"
            ) from error
        acted, used = acted or sample != list(io), used | io.used
    require_named(effect, path, used)
    if not acted:
        raise InputError(
            f"{path}: its law writes no result; a {effect.kind.name.lower()} effect writes "
            f"{RESULT[effect.kind]}"
        )
    law_address(effect)


def require_units(effect: Effect, path: Path) -> None:
    """Raise InputError for a unit by which no value is in SI: it would be told beside it."""
    for p in effect.parameters:
        if unknown := [u for u in re.findall(r"[^\W\d_]+|%|°", p.unit) if u not in _SI]:
            raise InputError(
                f"{path}: the unit of {p.name} is '{p.unit}', with '{unknown[0]}', which is not "
                "of SI; give the value in N, m, s, kg, K, Pa, A, V; '1' for a ratio"
            )


def require_named(effect: Effect, path: Path, used: Iterable[int]) -> None:
    """Raise InputError where the law uses a slot of io by another name than that of twin.effect.

    By these it is known what an effect needs of a log: the other axis, pressure, the time.
    """
    for name in (_SLOTS[k] for k in used if k in _SLOTS):
        if not effect.reads(name):
            raise InputError(
                f"{path}: its law uses io[{vars(slots)[name]}] by another name; write io[{name}], "
                f"with `from twin.effect import {name}`"
            )


def _at_speed(speed: float) -> list[float]:
    """io as in a simulation."""
    io = [0.0] * IO_SIZE
    io[DT] = PERIOD
    io[X] = io[READING] = 0.0123
    io[V], io[HOLD] = speed, speed / PERIOD + 1.0
    for one in (MASS, MOVED, WHEN, U, DRY, STATIC, VISCOUS, NET, ACC):
        io[one] = 1.0
    return io


def _anywhere() -> Iterator[list[float]]:
    """io along motions of all sizes, both ways."""
    rng = random.Random(1)
    for k in range(1000):  # samples of any motion, for the indices alone
        size = 10.0 ** rng.uniform(-6.0, 1.0)
        io = [rng.choice((-1.0, 1.0)) * size * rng.random() for _ in range(IO_SIZE)]
        io[DT], io[MASS], io[MOVED], io[WHEN] = PERIOD, 1.0, 1.0, 1.0
        io[INDEX], io[TIME] = k, k * PERIOD
        yield io


def outside_words(effect: Effect, touched: str) -> str:
    """One sentence on a law that used ``touched``, such as "s[1]", which it does not have."""
    has = {
        "p": f"{len(effect.parameters)} parameters are declared; add a Parameter",
        "s": f"{len(effect.states)} states are declared; add a name to states=(...)",
        "io": f"it has {IO_SIZE} slots; use the names of twin.effect, such as io[X]",
    }
    return f"its law uses {touched}, but {has[touched.split('[')[0]]}"
