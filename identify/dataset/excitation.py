"""What the motions of one axis cover; effects derive start values and scans from it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.dataset.motion import Motion
from identify.dataset.spectral_lines import find_lines, lines_in_time
from identify.dataset.spectrum import FINEST_CYCLES, Record
from twin.effect import Excitation
from twin.signals import Array

FEWEST_CYCLES = 20  # over the travel, of an error of the reading
MOST_RIPPLES = 8
LEAST_DRY = 1e-9  # of the largest command, that a dry level is at least
LISTENED = 40.0  # s of all logs together, that lines are sought in before there is a model


def excitation(motions: Sequence[Motion], travel: tuple[float, float] | None) -> Excitation:
    """What the motions of one axis cover together; ``travel`` (m) of the axis where it is known."""
    position = np.concatenate(
        [m.position for m in motions] + ([np.array(travel)] if travel else [])
    )
    velocity = np.concatenate([m.velocity for m in motions])
    command = np.concatenate([m.net for m in motions])
    fast = 0.02 * np.abs(velocity).max()
    ahead, behind = command[velocity > fast], command[velocity < -fast]
    if len(ahead) and len(behind):
        gap = np.median(ahead) - np.median(behind)
    else:
        gap = 2.0 * np.median(np.abs(command))
    heard, force = _heads(motions), float(np.abs(command).max())
    return Excitation(
        position_low=float(position.min()),
        position_high=float(position.max()),
        speed_max=float(np.abs(velocity).max()),
        dry_level=float(max(abs(gap) / 2.0, LEAST_DRY * force)),
        duration=float(sum(len(m.time) * m.period for m in motions)),
        period=motions[0].period,
        force_max=force,
        lines=lines(heard),
        ripples=(*motions[0].ripples, *ripples(heard)),  # the readings of all logs tell the same
        resolution=max(m.resolution for m in motions),
        other_joints=_other_joints(motions[0]),
    )


def _other_joints(motion: Motion) -> tuple[float, ...]:
    """Numbers of the other joints of a mechanism."""
    if motion.bodies is None:
        return ()
    return tuple(float(j) for j in range(len(motion.bodies.speeds)) if j != motion.bodies.index)


def _heads(motions: Sequence[Motion]) -> list[Motion]:
    """The beginnings of motions, long enough together to show what repeats."""
    return [m.head(LISTENED / len(motions)) for m in motions]


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
    record = Record(position, np.concatenate([_rest(m) * m.velocity**2 for m in motions]))
    if record.span <= 0.0:
        return ()
    lowest, highest = FEWEST_CYCLES / record.span, FINEST_CYCLES / record.span
    found = find_lines([record], lowest, highest, most=MOST_RIPPLES)
    return tuple(line.period for line in found)


def _rest(motion: Motion) -> Array:
    """Force that a rough model leaves, (n,) N."""
    x, v = motion.position, motion.velocity
    rows = np.stack([motion.acceleration, np.sign(v), v, np.ones_like(x), x, x**2, x**3], axis=1)
    rows /= np.maximum(np.abs(rows).max(axis=0), 1e-300)
    solution = np.linalg.lstsq(rows, motion.net, rcond=None)[0]
    return np.asarray(motion.net - rows @ solution)
