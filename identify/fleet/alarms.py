"""Alarms: which machine changed, in which parameter, when, and by how much.

What all machines of a kind do on a night is taken off before: it is the hall's, such as its
temperature, and is told once.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import groupby, pairwise

import numpy as np
from numpy.typing import NDArray

from identify.fleet.change_point import LevelChange, changes
from identify.fleet.nights import FORCE_ERROR, TO_DEVIATION, Panel, median
from identify.fleet.rates import level_of
from identify.results.fleet import Alarm, Scope
from twin.signals import Array

Nights = NDArray[np.intp]  # columns of a panel

DEAD = 0.01  # of a parameter, below which a change is nobody's concern
DEAD_ERROR = 0.25  # of the force error
# Of a parameter that the hall's temperature may have moved, as neither other machines nor the logs
# tell it: a year of 6 K at 1 % a kelvin, less what the scatter takes of it.
DEAD_UNTOLD = 0.05
LEAST_MACHINES = 5  # of which a median tells what all of them do
FIRST_NIGHTS = 15  # whose median a machine is compared with
LAST_NIGHTS = 5  # whose mean a machine has now
SMALL = 0.1  # of what is usual for the kind: a parameter below has no size of its own
LEAST_TREND = 10  # nights since a change that tell whether it goes on
APART = 2  # nights between bands of changes that are one all the same


@dataclass(frozen=True, eq=False)
class Relative:
    """A panel relative to each machine's own first nights, with what all have in common taken off.

    own (m, n): of each machine alone, 1; common (n,): of all; zeros where they are too few.
    deviations (m, n): 1. sizes (m,): in the panel's unit, what 1 is of each machine,
    from centres (m,). dead (m,): changes of each below which there is none, 1.
    """

    panel: Panel
    own: Array
    common: Array
    deviations: Array
    sizes: Array
    centres: Array
    dead: Array

    @property
    def is_shared(self) -> bool:
        """Whether there are enough machines for what they have in common."""
        return bool(np.any(self.common))


def alarms_of(panels: Iterable[Panel]) -> tuple[Alarm, ...]:
    """The alarms of all machines, by machine and night; those of the hall first."""
    shown = [relative(panel) for panel in panels]
    series = {kind: len(list(own)) for kind, own in groupby(shown, lambda r: r.panel.kind)}
    told = []
    for one in shown:
        level = level_of(series[one.panel.kind])
        told += [*_of_hall(one, level), *_of_machines(one, level)]
    told.sort(key=lambda a: (a.machine or "", a.model, a.axis, -a.strength))
    return tuple(
        alarm
        for _, own in groupby(told, lambda a: (a.machine, a.model, a.machine and a.axis))
        for alarm in together(list(own))
    )


def relative(panel: Panel) -> Relative:
    """Each machine relative to its own first nights."""
    values, deviations = panel.values, np.nan_to_num(panel.deviations)
    if panel.parameter == FORCE_ERROR:  # a ratio: what is missing multiplies it
        values, deviations = np.log(values), np.zeros_like(values)
        centres, sizes = _first(values), np.ones(len(values))
    else:
        centres = _first(values)
        sizes = np.maximum(np.abs(centres), SMALL * np.median(np.abs(centres)))
        sizes = np.where(sizes > 0.0, sizes, 1.0)
    own = (values - centres[:, None]) / sizes[:, None]
    common = _common(own)
    own = own - common
    dead = np.full(len(own), DEAD)
    if panel.parameter == FORCE_ERROR:
        dead[:] = DEAD_ERROR
    elif not np.any(common):
        dead[~np.isfinite(panel.temperatures).any(axis=1)] = DEAD_UNTOLD
        own = np.stack([_less_warmth(x, t) for x, t in zip(own, panel.temperatures, strict=True)])
    return Relative(panel, own, common, deviations / sizes[:, None], sizes, centres, dead)


def _first(values: Array) -> Array:
    """Of each machine (m, n) the median of the first nights that it has, (m,)."""
    known = np.cumsum(np.isfinite(values), axis=1)
    return median(np.where(known <= FIRST_NIGHTS, values, np.nan), axis=1)


def _common(own: Array) -> Array:
    """What all machines do (n,), the median of (m, n); between nights that few have, a line."""
    enough = np.isfinite(own).sum(axis=0) >= LEAST_MACHINES
    if not enough.any():
        return np.zeros(own.shape[1])
    nights = np.arange(own.shape[1])
    return np.interp(nights, nights[enough], median(own[:, enough], axis=0))


def _less_warmth(values: Array, temperatures: Array) -> Array:
    """A machine (n,) less what its own temperature (n,) K makes.

    By differences of neighbouring nights, which neither a step nor a trend takes part in; what
    chance alone would make of the slope is taken off it (W. James, C. Stein, 1961).
    """
    warmer, change = np.diff(temperatures), np.diff(values)
    known = np.isfinite(warmer) & np.isfinite(change)
    if known.sum() < FIRST_NIGHTS or not np.any(warmer[known]):
        return values
    warmer, change = warmer[known], change[known]
    slope = warmer @ change / (warmer @ warmer)
    chance = np.mean((change - slope * warmer) ** 2) / (warmer @ warmer)
    slope *= max(1.0 - chance / max(slope**2, 1e-300), 0.0)
    return np.asarray(values - slope * (temperatures - np.nanmedian(temperatures)))


# --- one series -----------------------------------------------------------------------------------


def _of_machines(shown: Relative, level: float) -> Iterator[Alarm]:
    for i, machine in enumerate(shown.panel.machines):
        known = np.flatnonzero(np.isfinite(shown.own[i]))
        values, variances = shown.own[i, known], shown.deviations[i, known] ** 2
        restore = _restored(shown, i)
        found = changes(values, variances, float(shown.dead[i]), level)
        for alarm in _chains(shown, values, found, known, restore):
            yield replace(alarm, machine=machine, scope=Scope.MACHINE)


def _of_hall(shown: Relative, level: float) -> Iterator[Alarm]:
    if not shown.is_shared:
        return
    typical = int(np.argsort(np.abs(shown.centres))[len(shown.centres) // 2])
    nights = np.arange(len(shown.common))
    found = changes(shown.common, np.zeros(len(nights)), float(shown.dead[typical]), level)
    yield from _chains(shown, shown.common, found, nights, _restored(shown, typical))


def _restored(shown: Relative, machine: int) -> Callable[[float], float]:
    """What turns a relative value of a machine into the panel's unit."""
    centre, size = float(shown.centres[machine]), float(shown.sizes[machine])
    if shown.panel.parameter == FORCE_ERROR:
        return lambda x: float(np.exp(centre + x))
    return lambda x: centre + size * x


def _chains(
    shown: Relative, values: Array, found: Sequence[LevelChange], nights: Nights,
    restore: Callable[[float], float],
) -> Iterator[Alarm]:  # fmt: skip
    """The alarms of a series; changes the same way, one behind the other, are one that grows."""
    edges = [0, *(c.first for c in found), len(values)]
    means = [float(np.mean(values[a:b])) for a, b in pairwise(edges)]
    ups = [after > before for before, after in pairwise(means)]
    start = 0
    for _, own in groupby(ups):
        stop = start + len(list(own))
        yield _alarm(shown, values, edges[start : stop + 2], found[start:stop], nights, restore)
        start = stop


def _alarm(
    shown: Relative, values: Array, edges: Sequence[int], chain: Sequence[LevelChange],
    nights: Nights, restore: Callable[[float], float],
) -> Alarm:  # fmt: skip
    panel, first = shown.panel, chain[0]
    before, after = values[edges[0] : edges[1]], values[edges[-2] : edges[-1]][-LAST_NIGHTS:]
    low, high = restore(float(np.mean(before))), restore(float(np.mean(after)))
    scatter = np.var(before, ddof=1)  # of nights: those after a change are few
    half = np.sqrt(scatter * (1.0 / len(before) + 1.0 / len(after))) / TO_DEVIATION
    scale = abs(restore(float(np.mean(after) + half)) - high)
    return Alarm(
        machine=None, axis=panel.axis, model=panel.kind, parameter=panel.parameter,
        unit=panel.unit, night=panel.night(nights[first.told]),
        changed=panel.night(nights[first.first]), earliest=panel.night(nights[first.earliest]),
        latest=panel.night(nights[first.latest]), before=low, after=high, size=high - low,
        half_width=scale, strength=max(c.strength for c in chain), scope=Scope.HALL,
        trend=_trend(values[edges[1] : edges[-1]], restore),
    )  # fmt: skip


def _trend(values: Array, restore: Callable[[float], float]) -> float | None:
    """How fast nights (n,) go on changing, by a line; None where that may be chance."""
    if len(values) < LEAST_TREND:
        return None
    nights = np.arange(len(values)) - 0.5 * (len(values) - 1)
    slope = float(nights @ values / (nights @ nights))
    left = values - values.mean() - slope * nights
    beyond = 4.0  # standard deviations
    if abs(slope) < beyond * np.sqrt(left @ left / (len(left) - 2) / (nights @ nights)):
        return None
    last = float(values[-LAST_NIGHTS:].mean())
    return restore(last + slope) - restore(last)


# --- one change -----------------------------------------------------------------------------------


def together(alarms: Sequence[Alarm]) -> list[Alarm]:
    """One alarm of each change: parameters of an axis whose bands meet, led by the strongest.

    Since the force error rose the model is wrong, and its parameters take over what it lacks.
    """
    leading: list[Alarm] = []
    for alarm in sorted(alarms, key=lambda a: (not _is_wrong(a), -a.strength)):
        at = next((i for i, lead in enumerate(leading) if _meet(lead, alarm)), None)
        if at is None:
            leading.append(alarm)
        elif alarm.parameter != leading[at].parameter:
            others = dict.fromkeys((*leading[at].others, alarm.parameter))
            leading[at] = replace(leading[at], others=tuple(others))
    return sorted(leading, key=lambda a: a.night)


def _is_wrong(alarm: Alarm) -> bool:
    return alarm.parameter == FORCE_ERROR and alarm.size > 0.0


def _meet(lead: Alarm, other: Alarm) -> bool:
    if _is_wrong(lead) and other.latest >= lead.earliest:
        return True
    gap = max(lead.earliest, other.earliest) - min(lead.latest, other.latest)
    return gap.days <= APART
