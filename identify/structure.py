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

BINS = (24, 96, 384)  # numbers of bins along a coordinate
PROMINENT = 0.2  # share of the residual's square from which a line is a period
LEAST_SHARE = 0.1  # of the residual's square, below which a dependence says nothing
NEAR = 0.8  # part of the share of time from which another coordinate is preferred
LEFT_OVER = 0.5  # part of a dependence that an explanation may leave


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
    """Part of the residual's square that its means over bins of the coordinate explain, 0..1.

    The finest of several widths is taken that the data carry, each adjusted for what as many bins
    explain of noise with the same effective sample size.
    """
    widths = [bins for bins in BINS if bins == BINS[0] or len(residual) > 5 * bins]
    return max(_share(residual, coordinate, bins) for bins in widths)


def _foremost(shares: Mapping[str, float]) -> str:
    """The coordinate with the largest share; time only where no other comes near it.

    Within one run of a program of moves, any coordinate is a function of time.
    """
    name = max(shares, key=lambda k: shares[k])
    rest = {k: s for k, s in shares.items() if k != "time"}
    other = max(rest, key=lambda k: rest[k])
    return other if name == "time" and rest[other] > NEAR * shares[name] else name


def _share(residual: Array, coordinate: Array, bins: int) -> float:
    levels = np.unique(np.quantile(coordinate, np.linspace(0.0, 1.0, bins + 1)))
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
    shares, lines = _shares(base.residual, _where(base, study))
    name = _foremost(shares)
    return Structure(shares[name], name, lines.get(name), UNITS[name], shares)


def explains(before: Fit, after: Fit, study: Study) -> bool:
    """Whether a larger model took away what the residual of the smaller depended on most.

    What is left must be smaller along that coordinate, and depend on another more.
    """
    shares, _ = _shares(before.residual, _where(before, study))
    left, _ = _shares(after.residual, _where(after, study))
    name = _foremost(shares)
    was = before.error * np.sqrt(shares[name])
    smaller = after.error * np.sqrt(left[name]) < LEFT_OVER * was
    return bool(shares[name] > LEAST_SHARE and smaller and _foremost(left) != name)


def dependences(force: Array, fit: Fit, study: Study) -> dict[str, float]:
    """Share of a force's square (n,) N, on the windows of a fit, by each coordinate: 0..1."""
    return _shares(force, _where(fit, study))[0]


def _where(fit: Fit, study: Study) -> dict[str, Array]:
    return {k: v[fit.kept] for k, v in gathered(study.fit).items()}


def _shares(
    residual: Array, where: Mapping[str, Array]
) -> tuple[dict[str, float], dict[str, float]]:
    """Share of each coordinate, and the periods of those in which the residual repeats."""
    shares = {name: share(residual, values) for name, values in where.items()}
    for name in where.keys() - {"direction", "velocity"}:
        # Friction has the other sign backwards.
        backwards = share(residual * where["direction"], where[name])
        shares[name] = max(shares[name], backwards)
    periods = {}
    restarts = np.flatnonzero(np.diff(where["time"]) < 0.0) + 1
    for name, runs in (("position", []), ("time", restarts)):
        found = line(residual, where[name], runs)
        if found is not None:
            periods[name], strength = found
            shares[name] = max(shares[name], strength)
    return shares, periods


def line(
    residual: Array, coordinate: Array, runs: Sequence[int] | NDArray[np.int64] = ()
) -> tuple[float, float] | None:
    """Period (unit of the coordinate) and share of the strongest line, if one stands out.

    runs: where further runs begin, between which the line keeps its period but not its phase.
    """
    span = float(np.ptp(coordinate))
    if span == 0.0:
        return None
    place = (coordinate - coordinate.min()) / span * (GRID - 1)
    cells = np.split(np.rint(place).astype(int), runs)
    power = np.zeros(2 * GRID + 1)  # in quarters of a cycle over the span
    for cell, part in zip(cells, np.split(residual, runs), strict=True):
        power += np.abs(np.fft.rfft(np.bincount(cell, part, GRID), 4 * GRID)) ** 2 / len(part)
    power /= np.sum(residual**2) / 2.0
    last = int(4 * min(len(residual) / 4.0, GRID / 8.0))
    best = FEWEST + int(np.argmax(power[FEWEST:last]))
    strength = float(min(power[best], 1.0))
    period = span * GRID / (GRID - 1) / best * 4.0
    return (period, strength) if strength > PROMINENT else None


GRID = 8192  # cells along a coordinate
FEWEST = 8  # quarters of a cycle over the span, below which a repetition is not one
