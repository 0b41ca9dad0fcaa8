"""A floor to try it on: machines drawn over ninety nights, some of which change, found again."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import timedelta
from functools import partial
from pathlib import Path

from identify.fleet.cause import with_causes
from identify.fleet.floor import STAGE, FloorPlan, Planted, nights_of, record_night
from identify.fleet.ingest import ingest
from identify.fleet.models import Models
from identify.fleet.nights import FORCE_ERROR
from identify.fleet.state import floor_of
from identify.fleet.store import Store
from identify.output.shown.fleet import write_fleet
from identify.results.fleet import Alarm, Floor, Told
from twin.engine import engine, outcomes
from twin.files import make_folder, write_atomically
from twin.parallel import Progress, silent

MACHINES, NIGHTS = 20, 90
LOGS, STORE, MODEL, PAGE = "logs", "store", "stage.toml", "fleet.html"


@dataclass(frozen=True, eq=False)
class FleetDemo:
    """What was planted, and what the alarms name."""

    floor: Floor
    planted: tuple[Told, ...]
    alarms: tuple[Told, ...]
    page: Path

    @property
    def found(self) -> tuple[Told, ...]:
        """What was planted and named, on its machine."""
        named = {(a.machine, a.what) for a in self.alarms}
        return tuple(p for p in self.planted if (p.machine, p.what) in named)

    @property
    def false_alarms(self) -> int:
        """Alarms of what was not planted."""
        planted = {(p.machine, p.what) for p in self.planted}
        return sum((a.machine, a.what) not in planted for a in self.alarms)

    @property
    def right(self) -> bool:
        """Whether all that was planted is named, and nothing else."""
        return len(self.found) == len(self.planted) and not self.false_alarms


def demo(
    folder: Path,
    seed: int,
    *,
    machines: int = MACHINES,
    nights: int = NIGHTS,
    workers: int | None = None,
    progress: Progress = silent,
) -> FleetDemo:
    """Draw a floor, ingest its logs, and tell what changed; writes logs, model, store and page.

    Raises InputError where the folder cannot be written.
    """
    logs, store, page = folder / LOGS, folder / STORE, folder / PAGE
    make_folder(logs)
    write_atomically(folder / MODEL, STAGE.read_bytes())
    plan, models = FloorPlan.of(), Models.at(STAGE)
    total = machines * nights
    with engine(workers=workers) as (executor, count):
        made = outcomes(executor, count, record_night, nights_of(logs, machines, nights, seed))
        for done, _ in enumerate(made, start=1):
            progress("simulating nights", done, total)
    ingest(logs, store, models, workers=workers, progress=progress)
    floor = with_causes(floor_of(Store.opened(store)), logs, models, progress)
    write_fleet(page, floor)
    planted = [p for p in plan.planted if p.machine <= machines and p.night < nights]
    return FleetDemo(
        floor,
        tuple(_planted(p, plan) for p in planted),
        tuple(t for alarm in floor.alarms for t in _named_by(alarm, floor.causes.get(alarm, ()))),
        page,
    )


def _planted(planted: Planted, plan: FloorPlan) -> Told:
    night = (plan.first_night + timedelta(days=planted.night - 1)).date()
    return Told(planted.name, planted.what, night)


def _named_by(alarm: Alarm, causes: Sequence[str]) -> list[Told]:
    """What an alarm names: the effect of its parameter, or what the diagnosis did."""
    own = alarm.parameter.partition(".")[0]
    made = partial(
        Told, machine=alarm.machine or "", night=alarm.changed, size=alarm.size, unit=alarm.unit
    )
    names = causes if alarm.parameter == FORCE_ERROR and causes else (own,)
    return [made(what=name) for name in names]
