"""What a force may depend on: the coordinates of each test function of a log."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.dataset.prepared_log import PreparedLog, last_direction
from twin.signals import Array

QUANTITIES = ("position", "velocity", "acceleration")
OTHER = "other_axis_"


def beside(axis: str, quantity: str) -> str:
    """Name of a coordinate of one of several other axes."""
    return f"axis_{axis}_{quantity}"


def coordinates_of(log: PreparedLog) -> dict[str, Array]:
    """Coordinates of each test function (n,) in SI units by name.

    On a machine with more than two axes each other axis has coordinates of its own name.
    """
    m, mean = log.motion, log.test_function.mean
    velocity = mean(m.velocity)
    out = {
        "position": mean(m.position),
        "velocity": velocity,
        "direction": np.sign(velocity),
        "acceleration": log.acceleration,
        "time": log.time,
        "distance_since_reversal": mean(since_reversal(m.velocity, m.period)),
    }
    if m.others.any():
        for name, row in zip(QUANTITIES, m.others, strict=True):
            out[f"{OTHER}{name}"] = mean(row)
    for axis, other in m.beside.items():
        for name, row in zip(QUANTITIES, other.signals, strict=True):
            out[beside(axis, name)] = mean(row)
    return out


def since_reversal(velocity: Array, period: float) -> Array:
    """Distance (n,) m travelled since the last change of direction."""
    direction = last_direction(velocity)
    travelled = np.cumsum(np.abs(velocity)) * period
    turned = np.flatnonzero(np.diff(direction) != 0) + 1
    start = np.zeros(len(velocity))
    start[turned] = travelled[turned]
    return travelled - np.maximum.accumulate(start)


def gathered(logs: Sequence[PreparedLog]) -> dict[str, Array]:
    """Coordinates of all test functions of several logs in a row."""
    parts = [coordinates_of(log) for log in logs]
    common = [k for k in parts[0] if all(k in p for p in parts)]
    return {k: np.concatenate([p[k] for p in parts]) for k in common}
