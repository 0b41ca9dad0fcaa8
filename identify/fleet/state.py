"""How all machines of a store stand: alarms, what is off from its kind, bad logs, courses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import date

import numpy as np

from identify.fleet.alarms import LAST_NIGHTS, Relative, relative
from identify.fleet.kept_alarms import alarms
from identify.fleet.kind import off
from identify.fleet.nights import FORCE_ERROR, Panel, median, panels
from identify.fleet.store import Contents, Store
from identify.fleet.views import connected
from identify.results.fleet import Alarm, Course, Floor, MachineState, Off, Scope

DRAWN = 24  # machines whose courses are drawn: a page of more is no page

COUNTS = """
SELECT machine, any_value(model), count(DISTINCT key) FILTER (is_fit), max(night) FILTER (is_fit),
       count(DISTINCT key) FILTER (severity = 'error')
FROM (SELECT machine, model, key, night, true AS is_fit, NULL AS severity FROM fits
      UNION ALL SELECT machine, model, key, night, false, severity FROM findings)
WHERE machine IS NOT NULL GROUP BY machine ORDER BY machine
"""
RATIOS = f"""
SELECT machine, max(ratio) FROM (
  SELECT machine, axis, avg(error / floor) AS ratio FROM (
    SELECT machine, axis, error, floor,
           dense_rank() OVER (PARTITION BY machine, axis ORDER BY night DESC) AS back
    FROM (SELECT DISTINCT machine, axis, night, error, floor FROM fits))
  WHERE back <= {LAST_NIGHTS} GROUP BY machine, axis)
GROUP BY machine
"""


def floor_of(
    store: Store, causes: Mapping[Alarm, tuple[str, ...]] | None = None, drawn: int = DRAWN
) -> Floor:
    """All machines of a store. Raises InputError where it is none.

    causes: by alarm what a diagnosis named. drawn: for how many machines courses are made.
    """
    contents = store.contents()
    every = list(panels(contents))
    told = alarms(store, contents, every)
    states = _states(contents, told, tuple(off(every)))
    ranked = sorted(states, key=lambda s: (*(-x for x in s.attention), s.machine))
    shown = {state.machine for state in ranked[:drawn]}
    hall = tuple(a for a in told if a.scope is Scope.HALL)
    return Floor(
        store.root, tuple(ranked), hall, _courses(every, shown), causes or {}, contents.faults
    )


def _states(contents: Contents, told: Sequence[Alarm], apart: Sequence[Off]) -> list[MachineState]:
    with connected(contents) as base:
        counts = base.execute(COUNTS).fetchall()
        ratios = dict(base.execute(RATIOS).fetchall())
    return [
        MachineState(
            machine, model or "", nights, last if isinstance(last, date) else None, faulty,
            float(ratios.get(machine) or np.nan),
            tuple(a for a in told if a.machine == machine),
            tuple(o for o in apart if o.machine == machine),
        )
        for machine, model, nights, last, faulty in counts
    ]  # fmt: skip


def _courses(every: Sequence[Panel], shown: set[str]) -> dict[str, tuple[Course, ...]]:
    """The courses of some machines, the force error last."""
    found: dict[str, list[Course]] = {machine: [] for machine in sorted(shown)}
    for panel in sorted(every, key=lambda p: p.parameter == FORCE_ERROR):
        if not shown.isdisjoint(panel.machines):
            made = relative(panel)
            for i, machine in enumerate(panel.machines):
                if machine in shown:
                    found[machine].append(_course(made, i))
    return {machine: tuple(courses) for machine, courses in found.items()}


def _course(made: Relative, i: int) -> Course:
    panel = made.panel
    centre, size = made.centres[i], made.sizes[i]
    alone = centre + size * made.own[i]
    usual = median(panel.values, axis=0)
    return Course(
        axis=panel.axis, parameter=panel.parameter, unit=panel.unit, days=panel.days,
        distance=np.cumsum(np.nan_to_num(panel.distances[i])), values=panel.values[i],
        alone=np.exp(alone) if panel.parameter == FORCE_ERROR else alone,
        half=1.645 * panel.deviations[i], usual=usual,
    )  # fmt: skip
