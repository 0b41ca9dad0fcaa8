"""What the logs of a drive can prove, asked of least squares that know its laws and values.

The force of what is hidden, as its true law makes it along the measured path, is one column beside
acceleration, friction, direction, speed and 1. Fitted to some logs and judged on others at several
lengths of the test functions, it is provable where at one of them it is. So is a log otherwise than
the same log that nothing spoils, where what the true laws leave of it is surely more.
"""

from __future__ import annotations

from collections.abc import Sequence

import numba
import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from benchmarks.second_simulator.drives import PRELOAD, TURN, Plant
from benchmarks.second_simulator.recordings import AXIS
from twin.logs import Log
from twin.signals import Array, local_parabola

LENGTHS = (0.02, 0.05, 0.1, 0.2)  # s
BLOCKS = 24
SURE, MATTERS = 5.0, 0.1  # t over blocks, and part of the squared error, of what is provable
TINY = 1e-300  # of nothing, no division by zero
MOMENT = 3.0  # times the largest error of a sound log, from which a moment is otherwise


def is_provable(plant: Plant, plain: Plant, fit: Sequence[Log], held: Sequence[Log]) -> bool:
    """Whether logs prove what a plant has beyond a plain one: by some, on others."""
    return any(_proved(plant, plain, fit, held, length) for length in LENGTHS)


def is_otherwise(plant: Plant, plain: Plant, fit: Sequence[Log], spoiled: Log, sound: Log) -> bool:
    """Whether a spoiled log shows what spoils it beside the same log without: by all sound ones."""
    return any(_differs(plant, plain, fit, spoiled, sound, length) for length in LENGTHS)


def _proved(
    plant: Plant, plain: Plant, fit: Sequence[Log], held: Sequence[Log], length: float
) -> bool:
    own, others = ([_columns(plant, plain, g, length) for g in logs] for logs in (fit, held))
    without, with_it = (  # what is hidden is the last column
        np.concatenate(_left(own, others, count)) for count in (-1, None)
    )
    return _is_larger(without, with_it)


def _differs(
    plant: Plant, plain: Plant, fit: Sequence[Log], spoiled: Log, sound: Log, length: float
) -> bool:
    every = [_columns(plant, plain, g, length) for g in (spoiled, sound, *fit)]
    there, usual, *others = _left(every[2:], every, None)
    if np.abs(there).max() > MOMENT * np.abs(usual).max() or _is_larger(there, usual):
        return True
    # One strength that this log alone asks for, beside what all sound ones do.
    gains = np.array(
        [left @ c[:, 1:] / np.sum(c[:, 1:] ** 2 + TINY, axis=0)
         for c, left in zip(every, (there, usual, *others), strict=True)]
    )  # fmt: skip
    away = np.abs(gains[0] - gains[1:].mean(axis=0)) > SURE * gains[1:].std(axis=0, ddof=1)
    return bool(away.any()) and _part(there, usual) > MATTERS


def _left(own: Sequence[Array], others: Sequence[Array], count: int | None) -> list[Array]:
    """What least squares by some logs leave of others, N by test functions."""
    rows = np.concatenate([c[:, 1:count] for c in own])
    size = np.linalg.norm(rows, axis=0) + TINY
    gains = np.linalg.lstsq(rows / size, np.concatenate([c[:, 0] for c in own]), rcond=1e-9)[0]
    return [c[:, 0] - c[:, 1:count] @ (gains / size) for c in others]


def _is_larger(one: Array, other: Array) -> bool:
    """Whether one residual (n,) N is surely larger than another, by blocks."""
    squares = np.array([[np.mean(b**2) for b in np.array_split(r, BLOCKS)] for r in (one, other)])
    gain = np.log((squares[0] + TINY) / (squares[1] + TINY))
    scatter = gain.std(ddof=1) / np.sqrt(BLOCKS)
    return bool(gain.mean() > SURE * scatter) and _part(one, other) > MATTERS


def _part(one: Array, other: Array) -> float:
    """Part of the squared residual that another one is less."""
    return 1.0 - float(np.mean(other**2) / np.mean(one**2))


def _columns(plant: Plant, plain: Plant, log: Log, length: float) -> Array:
    """Force, and what may explain it (n, k), by test functions; what is hidden is the last."""
    own, dt = log.axes[AXIS], 1.0 / log.sample_rate
    n = max(round(length / dt), 8)
    edges = (1.0 - (np.arange(n + 1) / n * 2.0 - 1.0) ** 2) ** 2
    weights = 0.5 * (edges[1:] + edges[:-1])
    slope = np.diff(edges) / dt / weights.sum()
    weights /= weights.sum()
    read, command = own.position, own.force
    path = local_parabola(read, 11)
    speed = np.gradient(path, dt)
    between = np.append(np.diff(read) / dt, 0.0)

    def mean(signal: Array, kernel: Array = weights) -> Array:
        return sliding_window_view(signal, n)[:: max(n // 4, 1)] @ kernel

    acceleration = -mean(between, slope)
    forces = [_force(p, path, speed, command, dt) for p in (plain, plant)]
    known = (forces[0], np.tanh(speed / (0.1 * plain.slip)), speed, np.ones(len(speed)))
    told = [mean(command), acceleration, *map(mean, known), mean(forces[1] - forces[0])]
    return np.stack(told, axis=1)


@numba.njit
def _force(p, path, speed, command, dt):  # pragma: no cover
    """Force (n,) N against the motion, and what the motor lacks of the command, along a path."""
    out = np.zeros(len(path))
    z, h, at, rate, given = 0.0, 0.0, path[0], 0.0, command[0]
    for i in range(len(path)):
        x, v = path[i], speed[i]
        g = p.friction + (p.static - p.friction) * np.exp(-((v / p.slip) ** 2))
        g *= 1.0 + p.modulation * np.sin(TURN * 0.37 * x / p.pitch)
        if v < 0.0:
            g *= 1.0 + p.asymmetry
        z += _way(z, v * dt, p.stiffness / g)
        slid = v - p.stiffness * abs(v) / g * z
        force = p.stiffness * z + 2.0 * PRELOAD * np.sqrt(p.stiffness * p.mass) * slid
        force += p.viscous * v + p.weight * np.sin(x) + p.spring * x
        force += p.cogging * np.sin(TURN * x / p.pitch + 0.3)
        force += p.second * np.sin(TURN * x / p.other + 1.1)
        if p.hysteresis > 0.0:
            soft = p.hysteresis / (0.05 * p.pitch)
            h += _way(h, v * dt, soft / p.hysteresis)
            force += soft * h
        if p.load > 0.0:
            for _ in range(20):
                pull = p.coupling * (x - at) + p.loss * (v - rate)
                rate += 0.05 * dt * pull / p.load
                at += 0.05 * dt * rate
            force += pull
        share = 1.0 - np.exp(-dt / p.lag) if p.lag > 0.0 else 1.0
        given += (command[i] - given) * share
        out[i] = force + command[i] - given * (1.0 + p.ripple * np.sin(TURN * x / p.pitch))
    return out


@numba.njit
def _way(state, moved, over):  # pragma: no cover
    """By how much the bend of a bristle (m) changes along a way; over: 1/m, of its length."""
    most = np.sign(moved) / over
    return (most - state) * (1.0 - np.exp(-abs(moved) * over))
