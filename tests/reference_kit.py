"""What the references of tests/references.py are written with: columns of a motion, a register."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Values = Mapping[str, float]
Results = dict[int, Array]


@dataclass(frozen=True, eq=False)
class Columns:
    """What a law is told, sample by sample, (n,) each, in SI units; dt, when: one number each.

    The names are those of the slots of io in lower case.
    """

    dt: float
    when: float
    mass: float
    moved: float
    time: Array
    x: Array
    v: Array
    u: Array
    x_other: Array
    v_other: Array
    a_other: Array
    friction: Array
    dry: Array
    static: Array
    viscous: Array
    hold: Array
    reading: Array
    net: Array
    acc: Array
    load: Array
    speeds: Array
    pressure: Array
    pressure_2: Array
    temperature: Array

    def __len__(self) -> int:
        return len(self.x)


@dataclass(frozen=True)
class Reference:
    """equation: the printed text it was written from; results: the function."""

    equation: str
    results: Callable[[Values, Columns], Results]


REFERENCES: dict[str, Reference] = {}


def written_from(equation: str) -> Callable:
    """Register a function under its own name as the reference of the effect of that name."""

    def register(function: Callable[[Values, Columns], Results]) -> Callable:
        REFERENCES[function.__name__] = Reference(equation, function)
        return function

    return register


def numbered(p: Values, key: str) -> Array:
    """The values key1, key2, ... or key_1, key_2, ... in order."""
    names = [n for n in p if n.rstrip("0123456789") in (key, f"{key}_") and n[-1].isdigit()]
    return np.array([p[n] for n in sorted(names, key=lambda n: int(n.lstrip(f"{key}_")))])


def fourier(p: Values, place: Array) -> Array:
    """sum_k a_k sin(2 pi k place) + b_k cos(2 pi k place)."""
    a, b = numbered(p, "a"), numbered(p, "b")
    k = np.arange(1, len(a) + 1)
    return np.real(np.exp(2j * np.pi * np.outer(place, k)) @ (b - 1j * a))


def followed(q: Columns, reach: float) -> Array:
    """z of dz/dt = (v - |v| z)/reach at the wanted instant, held speeds, from 0.

    Over a sample z moves to the direction by the part 1 - exp(-path/reach); the law takes the
    wanted instant's share of that.
    """
    z, seen = 0.0, np.empty(len(q))
    for k, v in enumerate(q.v):
        end = np.sign(v) + (z - np.sign(v)) * np.exp(-abs(v) * q.dt / reach)
        seen[k], z = z + q.when * (end - z), end
    return seen
