"""How often alarms are false, and how soon a change is told, on nights that are drawn."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from datetime import date, timedelta

import numpy as np

from benchmarks.figures import Figure, Target
from benchmarks.fleet.detectors import detectors, of_panel
from benchmarks.fleet.nights import FIRST_DAY, drawn, with_change
from identify.fleet.alarms import alarms_of, relative
from identify.fleet.change_point import changes
from identify.fleet.nights import Panel
from identify.fleet.rates import LEVELS
from identify.results.fleet import Alarm

SEED, NIGHTS = 53, 100_000
YEARS = 1000  # nights of each machine
FLOORS = {  # machines, and whether their logs tell the temperature
    "20 machines in a hall": (20, 0.0), "a machine alone, its temperature logged": (1, 1.0),
    "a machine alone, no temperature": (1, 0.0),
}  # fmt: skip
CHANGED, DRAWS = 120, 40  # night of a change, and floors that are drawn


def figures() -> Iterator[Figure]:
    """False alarms, beside those of other detectors, and the nights until a change is told."""
    for name, (machines, thermometer) in FLOORS.items():
        told = sum(len(_of_machines(p)) for p in _floors(machines, thermometer))
        yield Figure(f"{name}: false alarms a machine in 1000 nights", 1000.0 * told / NIGHTS, "1",
                     Target(high=1.0), f"{told} in {NIGHTS} nights, with temperature")  # fmt: skip
    yield from _others()
    for share, within in ((0.1, 5), (0.03, 30)):
        nights = [*_delays(share)]
        late = float(np.mean([n is None or n > within for n in nights]))
        shown = sorted(n for n in nights if n is not None)
        note = f"nights until told: {shown[len(shown) // 2]} at the median, {shown[-1]} at most"
        yield Figure(f"{share:.0%} more Coulomb friction, not told within {within} nights", late,
                     "1", Target(high=0.0), f"{note}, {DRAWS} floors of 20")  # fmt: skip


def calibration(nights: int = 1_000_000) -> Iterator[Figure]:
    """False changes a series and night by level, of nights that differ by chance alone."""
    rng = np.random.default_rng(SEED)
    series = rng.standard_normal((nights // YEARS, YEARS))
    for level in LEVELS:
        told = sum(len(changes(x, np.zeros(YEARS), 0.0, level)) for x in series)
        yield Figure(f"false changes a series and night at level {level}", told / nights, "1",
                     note=f"{told} in {nights}")  # fmt: skip


def _floors(machines: int, thermometer: float) -> Iterator[list[Panel]]:
    rng = np.random.default_rng([SEED, machines, int(thermometer)])
    for _ in range(NIGHTS // YEARS // machines):
        yield [*drawn(machines, YEARS, rng, thermometer)]


def _of_machines(panels: Sequence[Panel]) -> list[Alarm]:
    return [alarm for alarm in alarms_of(panels) if alarm.machine]


def _others() -> Iterator[Figure]:
    """The same nights, each parameter by another detector."""
    known = detectors()
    told = dict.fromkeys(known, 0)
    floors, machines = 1, 20
    for panels, _ in zip(_floors(machines, 0.0), range(floors), strict=False):
        for own in (relative(panel).own for panel in panels):
            for name, detector in known.items():
                told[name] += len(of_panel(own, detector))
    nights = floors * machines * YEARS
    for name, count in told.items():
        yield Figure(f"the same by {name}", 1000.0 * count / nights, "1",
                     note=f"{count} in {nights} nights")  # fmt: skip


def _delays(share: float) -> Iterator[int | None]:
    """Nights from a change of the first machine's Coulomb friction until it is told; None: not."""
    rng = np.random.default_rng([SEED, int(1000 * share)])
    since = date(1970, 1, 1) + timedelta(days=int(FIRST_DAY) + CHANGED)
    change: Callable[[Panel], Panel] = lambda panel: with_change(panel, share, CHANGED)  # noqa: E731
    for _ in range(DRAWS):
        panels = [change(p) if p.parameter == "lugre.Fc" else p for p in drawn(20, 200, rng)]
        told = [
            (a.night - since).days + 1
            for a in _of_machines(panels)
            if a.machine == "stage-0000" and a.parameter == "lugre.Fc" and a.night >= since
        ]
        yield min(told, default=None)
