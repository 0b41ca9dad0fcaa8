"""Why the force error of a machine grew: the diagnosis of the nights after its alarm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from identify.fleet.models import Models
from identify.fleet.nights import FORCE_ERROR
from identify.fleet.store import Contents, Store
from identify.fleet.views import connected
from identify.results.fleet import Alarm, Floor
from identify.workflow import diagnose
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.parallel import Progress, silent, within
from twin.telling import heard, tell

LOGS = 3  # of the last nights: one to fit, one to choose, one to test
LAST = """
SELECT DISTINCT log, started FROM fits
WHERE machine = $1 AND axis = $2 AND night >= $3 ORDER BY started DESC, log LIMIT $4
"""


def with_causes(floor: Floor, folder: Path, models: Models, progress: Progress = silent) -> Floor:
    """The floor with what a diagnosis names of each alarm of the force error.

    folder: that was ingested. A diagnosis that cannot be made is told, and none is named.
    """
    contents = Store.opened(floor.store).contents()
    asked = [a for a in floor.alarms if a.parameter == FORCE_ERROR and a.size > 0.0]
    causes: dict[Alarm, tuple[str, ...]] = dict(floor.causes)
    for i, alarm in enumerate(asked):
        progress("diagnosing the nights after alarms", i, len(asked))
        logs = [folder / name for name in nights_after(alarm, contents)]
        try:
            causes[alarm] = cause_of(alarm, logs, models, within(progress, str(alarm.machine)))
        except InputError as error:
            tell(f"{alarm.machine}: is not diagnosed: {error}")
    return replace(floor, causes=causes)


def nights_after(alarm: Alarm, contents: Contents) -> list[str]:
    """The last logs of a machine since it changed, as they are called below their folder."""
    with connected(contents) as base:
        rows = base.execute(LAST, [alarm.machine, alarm.axis, alarm.latest, LOGS]).fetchall()
    return [log for log, _ in rows]


def cause_of(
    alarm: Alarm, logs: Sequence[Path], models: Models, progress: Progress = silent
) -> tuple[str, ...]:
    """The effects that a diagnosis of these logs names on the axis of an alarm.

    Raises InputError where they cannot be diagnosed.
    """
    if len(logs) < LOGS:
        raise InputError(f"has {len(logs)} logs since {alarm.latest}; {LOGS} are needed")
    training, *others = ({str(path): path} for path in logs)
    model = models.of(alarm.machine or "").model
    with heard():
        found = diagnose(
            model, training, *others, catalogue=load_catalogue(models.effects), progress=progress
        )
    told: Mapping = found.axes
    return tuple(told[alarm.axis].named) if alarm.axis in told else ()
