"""What an unexplained residual depends on: the coordinate that accounts for most of it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.evidence import effective_samples
from identify.fit import Fit
from identify.residual import Windowed
from identify.study import Study

Array = NDArray[np.float64]

BINS = 24


@dataclass(frozen=True)
class Structure:
    """Part of the squared error above the floor that one coordinate accounts for.

    share_of_error: 0..1 of the squared force error. period: in ``unit``, or None. error: N.
    """

    share_of_error: float
    depends_on: str
    period: float | None
    unit: str
    shares: Mapping[str, float]


UNITS = {
    "position": "m",
    "velocity": "m/s",
    "direction": "1",
    "acceleration": "m/s^2",
    "time": "s",
    "distance_since_reversal": "m",
    "other_axis_position": "m",
    "other_axis_velocity": "m/s",
    "other_axis_acceleration": "m/s^2",
}


def coordinates_of(log: Windowed) -> dict[str, Array]:
    """Coordinates of each window (n_windows,) in SI units, by the names of UNITS."""
    m = log.motion
    velocity = log.window.mean(m.velocity)
    out = {
        "position": log.window.mean(m.position),
        "velocity": velocity,
        "direction": np.sign(velocity),
        "acceleration": log.acceleration,
        "time": log.time,
        "distance_since_reversal": log.window.mean(since_reversal(m.velocity, m.period)),
    }
    if m.others.any():
        for name, row in zip(("position", "velocity", "acceleration"), m.others, strict=True):
            out[f"other_axis_{name}"] = log.window.mean(row)
    return out


def since_reversal(velocity: Array, period: float) -> Array:
    """Distance (n,) m travelled since the last change of direction."""
    fast = np.abs(velocity) > 1e-3 * np.abs(velocity).max()
    direction = np.sign(np.where(fast, velocity, 0.0))
    index = np.maximum.accumulate(np.where(direction != 0, np.arange(len(direction)), 0))
    direction = direction[index]
    travelled = np.cumsum(np.abs(velocity)) * period
    turned = np.flatnonzero(np.diff(direction) != 0) + 1
    start = np.zeros(len(velocity))
    start[turned] = travelled[turned]
    return travelled - np.maximum.accumulate(start)


def gathered(logs: Sequence[Windowed]) -> dict[str, Array]:
    """Coordinates of all windows of several logs in a row."""
    parts = [coordinates_of(log) for log in logs]
    common = [k for k in parts[0] if all(k in p for p in parts)]
    return {k: np.concatenate([p[k] for p in parts]) for k in common}


def share(residual: Array, coordinate: Array) -> float:
    """Part of the residual's square that its mean over bins of the coordinate explains, 0..1.

    Adjusted for what as many bins explain of noise with the same effective sample size.
    """
    levels = np.unique(np.quantile(coordinate, np.linspace(0.0, 1.0, BINS + 1)))
    if len(levels) < 2:
        return 0.0
    index = np.clip(np.searchsorted(levels, coordinate, side="right") - 1, 0, len(levels) - 2)
    count = np.maximum(np.bincount(index, minlength=len(levels) - 1), 1)
    mean = np.bincount(index, residual, len(levels) - 1) / count
    explained = float(np.sum(mean[index] * residual) / np.sum(residual**2))
    n = effective_samples(residual - mean[index])
    k = (count > 0).sum()
    return max(1.0 - (1.0 - explained) * n / max(n - k, 1.0), 0.0) if n > k else 0.0


def find_structure(base: Fit, study: Study) -> Structure:
    """The coordinate on which the residual of a fit depends most, and its period if it has one."""
    where = {k: v[base.kept] for k, v in gathered(study.fit).items()}
    shares = {name: share(base.residual, values) for name, values in where.items()}
    for name, other in _with_direction(where, base.residual).items():
        shares[name] = other
    name = max(shares, key=lambda k: shares[k])
    found = period(base.residual, where[name]) if name in ("position", "time") else None
    return Structure(shares[name], name, found, UNITS[name], shares)


def _with_direction(where: Mapping[str, Array], residual: Array) -> dict[str, float]:
    """Shares of coordinates whose effect has the other sign backwards (friction-like)."""
    direction = where["direction"]
    flipped = residual * direction
    return {
        name: max(share(residual, where[name]), share(flipped, where[name]))
        for name in ("position", "distance_since_reversal")
    }


def period(residual: Array, coordinate: Array) -> float | None:
    """Period (unit of the coordinate) of the strongest line in the residual, if one stands out."""
    span = float(np.ptp(coordinate))
    cycles = np.arange(2.0, min(len(residual) / 4.0, 400.0), 0.25)
    phase = 2j * np.pi * np.outer(cycles, (coordinate - coordinate.min()) / span)
    power = np.abs(np.exp(phase) @ residual) ** 2 / (len(residual) * np.sum(residual**2) / 2.0)
    best = int(np.argmax(power))
    return float(span / cycles[best]) if power[best] > 0.2 else None
