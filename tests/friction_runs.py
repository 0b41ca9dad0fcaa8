"""Frictions dragged along given paths, for the friction tests."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from axis_runs import effect
from effect_runs import CATALOGUE

from twin.core.walks import walk
from twin.laws.trials import Motion, forces
from twin.model.machine import AxisModel, Fitted, axis_table
from twin.signals import Array

# Table I of C. Canudas de Wit et al., IEEE TAC 40 (1995), as A. Manurung's reconstruction of that
# paper's simulations gives it (github.com/auralius/LuGre, demo2.m); the paper itself could not be
# opened. For every model that has the parameter.
PAPER = {
    "Fc": 1.0, "Fs": 1.5, "v0": 1e-3, "sigma0": 1e5, "sigma1": 1e5**0.5, "sigma2": 0.4
}  # fmt: skip
RATE = 10_000.0  # Hz


def friction(name: str, **values: float) -> Fitted:
    """That friction with the paper's values, or those given, where it has such a parameter."""
    known = {p.name: PAPER[p.name] for p in CATALOGUE[name].parameters if p.name in PAPER}
    return effect(name, **{**known, **values})


def along(fitted: Fitted, v: Array, dt: float) -> Array:
    """Friction on a measured velocity (n,) m/s, in the middle of each sample, (n,) N."""
    still = np.zeros_like(v)
    return -forces([fitted], Motion(dt, still, v, still))[fitted.effect.name]


def at_turns(fitted: Fitted, turns: Sequence[float], speed: float = 1e-4, leg: int = 500) -> Array:
    """Friction (n,) N at each of the turns: dragged from 0 m to one after the other, at one speed.

    Each leg takes ``leg`` samples; after it comes one sample at rest.
    """
    table = axis_table({"x": AxisModel(1.0, effects=(fitted,))})
    states, found = np.zeros(table.n_states), []
    for begin, end in zip((0.0, *turns), turns, strict=False):
        motion, rows = np.zeros((3, leg + 1)), np.zeros((1, leg + 1))
        motion[1, :leg] = np.sign(end - begin) * speed
        walk(
            table.entries, 0, 1, table.parameters, states, table.axes[0][2], motion,
            np.zeros_like(motion), abs(end - begin) / leg / speed, 1, rows,
        )  # fmt: skip
        found.append(-rows[0, -1])
    return np.array(found)


def time(duration: float) -> Array:
    """Sample instants, s."""
    return np.arange(round(duration * RATE)) / RATE


def travelled(t: Array | float) -> Array | float:
    """A path with inner loops: it turns before the friction has turned, m."""
    slow = 1e-3 / (2.0 * np.pi) * (1.0 - np.cos(2.0 * np.pi * t))
    return slow + 6e-4 / (6.6 * np.pi) * (1.0 - np.cos(6.6 * np.pi * t))
