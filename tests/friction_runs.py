"""Frictions dragged along given paths, and masses that they hold, for the friction tests."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from effect_runs import CATALOGUE
from scipy.optimize import brentq

from twin.core.control import Controller
from twin.core.loop import POSITION_COLUMN, VELOCITY_COLUMN
from twin.core.walks import walk
from twin.experiments.trajectory import Setpoint
from twin.laws.trials import Array
from twin.model.machine import AxisModel, Fitted, MachineModel, axis_table
from twin.simulator import MujocoSimulator, ReducedSimulator, run

# Table I of C. Canudas de Wit et al., IEEE TAC 40 (1995), as A. Manurung's reconstruction of that
# paper's simulations gives it (github.com/auralius/LuGre, demo2.m); the paper itself could not be
# opened. For every model that has the parameter.
PAPER = {
    "Fc": 1.0, "Fs": 1.5, "v0": 1e-3, "sigma0": 1e5, "sigma1": 1e5**0.5, "sigma2": 0.4
}  # fmt: skip
RATE = 10_000.0  # Hz
STATIC = ("coulomb_viscous", "stribeck")
MEMORY = ("leuven", "modified_leuven", "gms")  # those that remember more than one reversal
FORGETFUL = ("dahl", "lugre")
STRIBECK = ("lugre", *MEMORY)  # pre-sliding and a Stribeck curve
ALL = (*STATIC, *FORGETFUL, *MEMORY)


def friction(name: str, **values: float) -> Fitted:
    """That friction with the paper's values, or those given, where it has such a parameter."""
    effect = CATALOGUE[name]
    known = {p.name: v for p in effect.parameters if (v := PAPER.get(p.name)) is not None}
    return Fitted.at_start(effect, {**known, **values})


def level(v: Array | float, Fc: float = 1.0, Fs: float = 1.5, v0: float = 1e-3) -> Array | float:
    """The Stribeck curve g(v), N, for exponent 2."""
    return Fc + (Fs - Fc) * np.exp(-((v / v0) ** 2))


def along(fitted: Fitted, v: Array, dt: float) -> Array:
    """Friction on a measured velocity (n,) m/s, in the middle of each sample, (n,) N."""
    table = axis_table({"x": AxisModel(1.0, effects=(fitted,))})
    rows = np.zeros((1, len(v)))
    motion = np.stack([np.cumsum(v) * dt, v, np.zeros_like(v)])
    walk(
        table.entries, 0, 1, table.parameters, np.zeros(table.n_states), table.axes[0][2], motion,
        np.zeros_like(motion), dt, 0, rows, 1.0, 0.0,
    )  # fmt: skip
    return -rows[0]


def dragged(
    fitted: Fitted, turns: Sequence[float], speed: float = 1e-4, leg: int = 500
) -> tuple[Array, Array]:
    """Path (n,) m and friction (n,) N: from 0 m to each of the turns in turn, at one speed.

    Each leg takes ``leg`` samples; after it comes one sample at rest, at index (leg + 1) k - 1,
    which has the force at the turn itself.
    """
    x, force = [], []
    table = axis_table({"x": AxisModel(1.0, effects=(fitted,))})
    states = np.zeros(table.n_states)
    for begin, end in zip((0.0, *turns), turns, strict=False):
        dt = abs(end - begin) / leg / speed
        middle = begin + (end - begin) * (np.arange(leg) + 0.5) / leg
        motion = np.zeros((3, leg + 1))
        motion[1, :leg] = np.sign(end - begin) * speed
        rows = np.zeros((1, leg + 1))
        walk(
            table.entries, 0, 1, table.parameters, states, table.axes[0][2], motion,
            np.zeros_like(motion), dt, 1, rows, 1.0, 0.0,
        )  # fmt: skip
        x += [*middle, end]
        force += list(-rows[0])
    return np.array(x), np.array(force)


def at_turns(fitted: Fitted, turns: Sequence[float], **how: float) -> Array:
    """Friction at each of the turns of that path, N."""
    leg = int(how.get("leg", 500))
    return dragged(fitted, turns, speed=how.get("speed", 1e-4), leg=leg)[1][leg :: leg + 1]


def pushed(
    effects: Sequence[Fitted],
    force: Array,
    mass: float = 1.0,
    simulator: type[MujocoSimulator] | type[ReducedSimulator] = ReducedSimulator,
) -> tuple[Array, Array, Array]:
    """Position m, velocity m/s of a mass (kg) under a force (n,) N from rest, and its friction N.

    The friction is the first of the effects.
    """
    still = np.zeros((len(force), 1))
    model = MachineModel("mass", {"x": AxisModel(mass, effects=tuple(effects))}, sample_rate=RATE)
    done = run(
        model, Setpoint(still, still, still, force[:, None], RATE), np.random.default_rng(0),
        simulator=simulator, controllers={"x": Controller()},
    )  # fmt: skip
    row = [effect for _, effect in done.table.labels].index(effects[0].effect.name)
    motion = done.signals[:, 0]
    return motion[:, POSITION_COLUMN], motion[:, VELOCITY_COLUMN], -done.forces[:, row]


def time(duration: float) -> Array:
    """Sample instants, s."""
    return np.arange(round(duration * RATE)) / RATE


ELEMENTS = {"elements": 5, "spread": 40.0}


def shares_and_springs(count: int, spread: float, total: float) -> tuple[Array, Array]:
    """a_i and k_i (N/m) as the model's documentation defines them."""
    springs = spread ** (-np.arange(count) / max(count - 1, 1))
    return np.full(count, 1.0 / count), total * springs / springs.sum()


def wavy(t: Array | float) -> Array | float:
    """A velocity with inner loops: it turns before the friction has turned, m/s."""
    return 1e-3 * np.sin(2.0 * np.pi * t) + 6e-4 * np.sin(6.6 * np.pi * t)


def travelled(t: Array | float) -> Array | float:
    """Its integral from t = 0, m."""
    slow = 1e-3 / (2.0 * np.pi) * (1.0 - np.cos(2.0 * np.pi * t))
    return slow + 6e-4 / (6.6 * np.pi) * (1.0 - np.cos(6.6 * np.pi * t))


def reversals(duration: float) -> list[float]:
    """Instants at which the wavy velocity passes zero, s."""
    grid = np.linspace(1e-6, duration, 4000)
    signs = np.flatnonzero(np.diff(np.sign(wavy(grid))))
    return [brentq(wavy, grid[i], grid[i + 1], xtol=1e-15) for i in signs]


def rms(a: Array) -> float:
    return float(np.sqrt(np.mean(a**2)))


def error_of(fitted: Fitted, wanted: Callable[[Array], Array], dt: float) -> float:
    """RMS error of the friction on the wavy velocity over 1 s, N; samples are held about t."""
    t = dt * (np.arange(round(1.0 / dt)) + 0.5)
    return rms(along(fitted, wavy(t), dt) - wanted(t))
