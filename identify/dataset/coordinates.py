"""What a force may depend on, of each test function of a log, and what the motions cover."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache

import numpy as np

from identify.dataset.dataset import ENOUGH
from identify.dataset.motion import REST_SPEED, Motion
from identify.dataset.prepared_log import PreparedLog, last_direction
from identify.dataset.readings import FEWEST_CYCLES
from identify.dataset.spectrum import ScatteredSignal, find_lines, lines_in_time
from identify.rules import RULE
from twin.core.walks import CHANNEL_ROW
from twin.effect import CHANNELS, Excitation
from twin.excitation import Repeating
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
    if m.others[:CHANNEL_ROW].any():
        for name, row in zip(QUANTITIES, m.others[:CHANNEL_ROW], strict=True):
            out[f"{OTHER}{name}"] = mean(row)
    for name, row in zip(CHANNELS.values(), m.others[CHANNEL_ROW:], strict=False):
        if name in m.channels:
            out[name] = mean(row)
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


@dataclass(frozen=True, eq=False)
class Covered:
    """What the motions of one axis cover together, found where it is asked for.

    travel: m, of the axis where it is known.
    """

    motions: tuple[Motion, ...]
    travel: tuple[float, float] | None

    def __call__(self) -> Excitation:
        return self._found

    @cached_property
    def _found(self) -> Excitation:
        return excitation(self.motions, self.travel)


def excitation(motions: Sequence[Motion], travel: tuple[float, float] | None) -> Excitation:
    """What the motions of one axis cover together; ``travel`` (m) of the axis where it is known."""
    heard = [m.head(ENOUGH / len(motions)) for m in motions]  # what repeats does so in them too
    return replace(
        covered(tuple(motions), travel),
        repeats=Repeating(lines(heard)),
        ripples=(*motions[0].ripples, *ripples(heard)),  # the readings of all logs tell the same
    )


@lru_cache(maxsize=4)  # every fit of an axis with a knee asks for that of its logs
def covered(motions: tuple[Motion, ...], travel: tuple[float, float] | None = None) -> Excitation:
    """The same but for what repeats, which takes a while to find."""
    position = np.concatenate(
        [m.position for m in motions] + ([np.array(travel)] if travel else [])
    )
    velocity = np.concatenate([m.velocity for m in motions])
    command = np.concatenate([m.net for m in motions])
    speed = np.abs(velocity)
    # 0.02 of the fastest: slower, friction is not told from what else acts
    fast = 0.02 * speed.max()
    ahead, behind = command[velocity > fast], command[velocity < -fast]
    if len(ahead) and len(behind):
        gap = np.median(ahead) - np.median(behind)
    else:
        gap = 2.0 * np.median(np.abs(command))
    driven = np.abs(np.concatenate([m.command for m in motions]))
    force, slow = float(driven.max()), REST_SPEED * float(speed.max())
    lasting = [len(m.time) * m.period for m in motions]
    return Excitation(
        position_low=float(position.min()),
        position_high=float(position.max()),
        reached=(
            min(float(m.position.min()) for m in motions),
            max(float(m.position.max()) for m in motions),
        ),
        speed_max=float(speed.max()),
        speed_least=slow,
        dry_level=float(max(abs(gap) / 2.0, np.sqrt(np.finfo(float).eps) * force)),
        duration=float(sum(lasting)),
        longest=float(max(lasting)),
        period=motions[0].period,
        force_max=force,
        force_usual=float(np.median(driven[speed >= slow])),
        resolution=max(m.count for m in motions),
        shortest=max(_least_change(m) for m in motions),
        both_ways=_both_ways(np.concatenate([m.position for m in motions]), velocity, fast),
        temperature=_temperature(motions),
        fewest_cycles=RULE.fewest_cycles,
        other_joints=_other_joints(motions[0]),
    )


def _both_ways(position: Array, velocity: Array, fast: float) -> float:
    """Of the places that were passed, the part that was passed both ways; fast: m/s, that count."""
    places = 50  # along the track, as many as a smooth curve may tell apart
    edges = np.linspace(position.min(), position.max(), places + 1)
    ways = [np.histogram(position[way * velocity > fast], edges)[0] > 0 for way in (1.0, -1.0)]
    both, either = np.all(ways, axis=0).sum(), np.any(ways, axis=0).sum()
    return float(both / max(either, 1))


def _temperature(motions: Sequence[Motion]) -> float:
    """Mean of what the logs hold of it, K; that of a room where they do not."""
    row = CHANNEL_ROW + [*CHANNELS.values()].index("temperature")
    logged = [m.others[row] for m in motions if "temperature" in m.channels]
    return float(np.mean(np.concatenate(logged))) if logged else Excitation.temperature


def _least_change(motion: Motion) -> float:
    """Least change of position, m rms, that readings tell from their rounding and their noise."""
    return float(max(motion.resolution / np.sqrt(12.0), motion.position_noise))


def _other_joints(motion: Motion) -> tuple[float, ...]:
    """Numbers of the other joints of a mechanism."""
    if motion.bodies is None:
        return ()
    return tuple(float(j) for j in range(len(motion.bodies.readings)) if j != motion.bodies.index)


def lines(motions: Sequence[Motion]) -> tuple[float, ...]:
    """Frequencies (Hz) at which the force of logs repeats in time, the surest first.

    The force is the command less what acceleration, direction, speed and position explain.
    """
    return lines_in_time([(_rest(m), m.period) for m in motions])


def ripples(motions: Sequence[Motion]) -> tuple[float, ...]:
    """Periods (m) at which an error of the reading would repeat in position, strongest first.

    An error A sin(2 pi x/p) looks like a force m A (2 pi v/p)^2 sin(2 pi x/p), so the force weighed
    by v^2 has a line in position.
    """
    position = np.concatenate([m.position for m in motions])
    record = ScatteredSignal(position, np.concatenate([_rest(m) * m.velocity**2 for m in motions]))
    if record.span <= 0.0:
        return ()
    found = find_lines([record], FEWEST_CYCLES / record.span, np.inf)
    return tuple(line.period for line in found)


def _rest(motion: Motion) -> Array:
    """Force that a rough model leaves, (n,) N."""
    x, v = motion.position, motion.velocity
    rows = np.stack([motion.acceleration, np.sign(v), v, np.ones_like(x), x, x**2, x**3], axis=1)
    rows /= np.maximum(np.abs(rows).max(axis=0), np.finfo(float).tiny)
    solution = np.linalg.lstsq(rows, motion.net, rcond=None)[0]
    return np.asarray(motion.net - rows @ solution)
