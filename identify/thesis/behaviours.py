"""Motions that show one behaviour of friction each, and the logs of a machine that runs them."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from twin.core.control import Controller
from twin.experiments.follow import follow
from twin.experiments.kinds import Staircase
from twin.experiments.named import simulate
from twin.experiments.trajectory import Setpoint
from twin.log import Log
from twin.model.machine import MachineModel
from twin.signals import rate
from twin.simulator import FineSimulator

Array = NDArray[np.float64]

RATE = 1000.0  # Hz
SPEEDS, SPAN = (0.001, 0.003, 0.01, 0.03, 0.1), 0.02  # m/s, m, of the map
LOOP = 1e-3 * np.array([0.0, 1.0, -1.0, 0.4, -0.2, 0.4, 1.0])  # m, turns of a loop with one inside
LEG = 0.5  # s, between turns
PUSH, PUSHES = 0.42, (4.0, 1.0, 1.0, 0.5, 0.5)  # N, s: triangles of force through the break-away
SWING = 0.02, 0.015, (1.0, 5.0)  # m/s, m/s, Hz: mean speed, amplitude, frequencies
DRIFT = 0.15, 0.12, 8.0  # N, N, Hz: steady force, amplitude, frequency
DRIFT_TIME = 4.0  # s


def behaviours(model: MachineModel, rng: np.random.Generator) -> dict[str, Log]:
    """A log of the machine's only axis for each behaviour."""
    (name,) = model.axes
    seed = int(rng.integers(2**31))
    stairs = Staircase(name, speeds=SPEEDS, span=SPAN, dwell=0.05)
    away = {"break-away": _pushes(), "drift": _oscillation()}
    held = {"pre-sliding loops": turning(LOOP), "frictional lag": _swing()}
    closed = {key: _follow(model, _along(x), rng, None) for key, x in held.items()}
    opened = {key: _follow(model, _pushed(f), rng, {name: Controller()}) for key, f in away.items()}
    mapped = simulate(model, stairs, seed=seed, simulator=FineSimulator)
    return {"velocity map": mapped, **closed, **opened}


def drifting(model: MachineModel, rng: np.random.Generator, duration: float) -> Log:
    """A longer log of the steady force with a small oscillation alone."""
    (name,) = model.axes
    return _follow(model, _pushed(_oscillation(duration)), rng, {name: Controller()})


def _follow(
    model: MachineModel,
    setpoint: Setpoint,
    rng: np.random.Generator,
    controllers: Mapping[str, Controller] | None,
) -> Log:
    noise, current = rng.spawn(2)
    return follow(
        model, setpoint, (noise, current), name="behaviour", seed=0, simulator=FineSimulator,
        controllers=controllers,
    )  # fmt: skip


def _along(position: Array) -> Setpoint:
    """A setpoint along positions (n,) m."""
    velocity = rate(position, 1.0 / RATE)
    x, v, a = (c[:, None] for c in (position, velocity, rate(velocity, 1.0 / RATE)))
    return Setpoint(x, v, a, np.zeros_like(x), RATE)


def _pushed(force: Array) -> Setpoint:
    """A setpoint of force (n,) N alone."""
    still = np.zeros((len(force), 1))
    return Setpoint(still, still, still, force[:, None], RATE)


def seconds(duration: float) -> Array:
    return np.arange(round(duration * RATE)) / RATE


def turning(turns: Array) -> Array:
    """Positions (n,) m from turn to turn, at rest in each."""
    part = 0.5 - 0.5 * np.cos(np.pi * seconds(LEG) / LEG)
    return np.concatenate([a + (b - a) * part for a, b in pairwise(turns)])


def _swing() -> Array:
    """Positions (n,) m at a speed that swings without changing sign, after a gentle start."""
    mean, amplitude, frequencies = SWING
    parts = [mean * seconds(0.5) / 0.5]
    parts += [
        mean + amplitude * np.sin(2.0 * np.pi * hertz * seconds(2.0)) for hertz in frequencies
    ]
    return np.asarray(np.cumsum(np.concatenate(parts)) / RATE)


def _pushes() -> Array:
    """Triangles of force (n,) N, each faster than the last."""
    parts = []
    for period in PUSHES:
        phase = seconds(period) / period
        parts.append(PUSH * (1.0 - 4.0 * np.abs((phase + 0.25) % 1.0 - 0.5)))
    return np.concatenate(parts)


def _oscillation(duration: float = DRIFT_TIME) -> Array:
    """A steady force (n,) N with a small oscillation, both rising within a second."""
    steady, amplitude, hertz = DRIFT
    t = seconds(duration)
    return np.asarray(np.minimum(t, 1.0) * (steady + amplitude * np.sin(2.0 * np.pi * hertz * t)))
