"""Motions that show one behaviour of friction each, and what a friction does in them, in numbers.

The plus and minus of the thesis's Table 2.1, measured from the logs of a machine with that friction
alone.
"""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise

import numpy as np

from identify.dataset.motion import motion_of
from studies.curves.velocity_map import VelocityMap
from studies.thesis.shared import Array, Numbers, followed, seed_of
from twin.experiments.kinds import Staircase
from twin.experiments.trajectory import Setpoint
from twin.logs import Log
from twin.model.machine import MachineModel
from twin.signals import rate
from twin.simulation.loop import Controller
from twin.simulation.simulate import simulate
from twin.simulation.simulators import FineSimulator

RATE = 1000.0  # Hz
SPEEDS, SPAN = (0.001, 0.003, 0.01, 0.03, 0.1), 0.02  # m/s, m, of the map
LOOP = 1e-3 * np.array([0.0, 1.0, -1.0, 0.4, -0.2, 0.4, 1.0])  # m, turns of a loop with one inside
LEG = 0.5  # s, between turns
PUSH, PUSHES = 0.42, (4.0, 1.0, 1.0, 0.5, 0.5)  # N, s: triangles of force through the break-away
SWING = 0.02, 0.015, (1.0, 5.0)  # m/s, m/s, Hz: mean speed, amplitude, frequencies
DRIFT = 0.15, 0.12, 8.0  # N, N, Hz: steady force, amplitude, frequency
SHORT, LONG = 4.0, 20.0  # s of it; the last half of the longer tells a drift: bristles ring long
NEAR = 0.2  # of the amplitude of a swing, within which a speed counts as the mean one


def behaviours(model: MachineModel, rng: np.random.Generator) -> dict[str, Log]:
    """A log of the machine's only axis for each behaviour."""
    (name,) = model.axes
    stairs, seed = Staircase(name, speeds=SPEEDS, span=SPAN, dwell=0.05), seed_of(rng)
    closed = {"pre-sliding loops": turning(LOOP), "frictional lag": swing()}
    opened = {"break-away": pushes(), "drift": oscillation(SHORT)}
    free = {name: Controller()}
    return {
        "velocity map": simulate(model, stairs, seed=seed, simulator=FineSimulator),
        **{key: followed(model, along(x), rng) for key, x in closed.items()},
        **{key: followed(model, pushed(f), rng, free) for key, f in opened.items()},
    }


def characteristics(
    model: MachineModel, logs: Mapping[str, Log], rng: np.random.Generator
) -> Numbers:
    """Characteristics of the only effect of a machine's only axis, from logs of every behaviour.

    fall: by which the friction falls below that of the lowest speed. lag: by which it is higher
    where the speed rises than where it falls, at the same speed. slow_push, fast_push: largest
    friction under the slowest and the fastest. drift: creep under a steady force with a small
    oscillation, both together below the break-away.
    """
    ((name, axis),) = model.axes.items()
    (friction,) = axis.names
    truth = {key: log.truth[name] for key, log in logs.items()}
    found = VelocityMap.of(axis, motion_of(logs["velocity map"], name, "map")).towards(1.0).friction
    push = np.abs(truth["break-away"][friction])
    creep = followed(model, pushed(oscillation(LONG)), rng, {name: Controller()})
    moved = creep.truth[name]["position"]
    late = moved[len(moved) // 2 :]
    return {
        "fall": found[0] - found.min(), "unit": "N", "printed": None,
        "lag": lag(truth["frictional lag"]["velocity"], -truth["frictional lag"][friction]),
        "slow_push": push[: round(PUSHES[0] * RATE)].max(),
        "fast_push": push[-round(PUSHES[-1] * RATE) :].max(),
        "drift": np.polyfit(np.arange(len(late)) / RATE, late, 1)[0], "drift_unit": "m/s",
    }  # fmt: skip


def lag(velocity: Array, force: Array) -> float:
    """Over the fastest swing, at speeds near the mean one."""
    mean, amplitude, _ = SWING
    velocity, force = (column[-round(RATE) :] for column in (velocity, force))
    near = np.abs(velocity - mean) < NEAR * amplitude
    rising = np.diff(velocity, append=velocity[-1]) > 0.0
    return float(force[near & rising].mean() - force[near & ~rising].mean())


def along(position: Array) -> Setpoint:
    """A setpoint along positions (n,) m."""
    velocity = rate(position, 1.0 / RATE)
    x, v, a = (c[:, None] for c in (position, velocity, rate(velocity, 1.0 / RATE)))
    return Setpoint(x, v, a, np.zeros_like(x), RATE)


def pushed(force: Array) -> Setpoint:
    """A setpoint of force (n,) N alone."""
    still = np.zeros((len(force), 1))
    return Setpoint(still, still, still, force[:, None], RATE)


def _seconds(duration: float) -> Array:
    return np.arange(round(duration * RATE)) / RATE


def turning(turns: Array) -> Array:
    """Positions (n,) m from turn to turn, at rest in each."""
    part = 0.5 - 0.5 * np.cos(np.pi * _seconds(LEG) / LEG)
    return np.concatenate([a + (b - a) * part for a, b in pairwise(turns)])


def swing() -> Array:
    """Positions (n,) m at a speed that swings without changing sign, after a gentle start."""
    mean, amplitude, frequencies = SWING
    parts = [mean * _seconds(0.5) / 0.5]
    parts += [mean + amplitude * np.sin(2.0 * np.pi * f * _seconds(2.0)) for f in frequencies]
    return np.asarray(np.cumsum(np.concatenate(parts)) / RATE)


def pushes() -> Array:
    """Triangles of force (n,) N, each faster than the last."""
    phases = np.concatenate([_seconds(period) / period for period in PUSHES])
    return np.asarray(PUSH * (1.0 - 4.0 * np.abs((phases + 0.25) % 1.0 - 0.5)))


def oscillation(duration: float) -> Array:
    """A steady force (n,) N with a small oscillation, both rising within a second."""
    steady, amplitude, hertz = DRIFT
    t = _seconds(duration)
    return np.asarray(np.minimum(t, 1.0) * (steady + amplitude * np.sin(2.0 * np.pi * hertz * t)))
