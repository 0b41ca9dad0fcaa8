"""A floor of simulated machines whose values differ, scatter from night to night, and change."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime, timedelta
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from twin.effects import load_catalogue
from twin.logs import write_log
from twin.model.file import load_model
from twin.model.machine import Fitted, MachineModel
from twin.model.parameters import all_parameters, read, write
from twin.signals import Array
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator

HERE = Path(__file__).parent
STAGE, FLOOR = HERE / "demo_stage.toml", HERE / "demo_floor.toml"


def named(machine: int) -> str:
    """What the machine of a number is called."""
    return f"stage-{machine:02d}"


@dataclass(frozen=True)
class Scatter:
    """How a parameter differs: between machines, from night to night, each 1 RMS; 1/K of warmth."""

    spread: float
    scatter: float
    warmth: float


@dataclass(frozen=True)
class Planted:
    """A change of one machine from a night on: of a parameter, or an effect that it has from then.

    grows: relative change a night, over so many nights; values: of the effect.
    """

    machine: int
    what: str
    night: int
    parameter: str | None = None
    grows: float = 0.0
    nights: float = math.inf
    values: Mapping[str, float] = field(default_factory=dict)

    @property
    def name(self) -> str:
        """What its machine is called."""
        return named(self.machine)

    def factor(self, night: int) -> float:
        """What the parameter is multiplied by on a night."""
        return 1.0 + self.grows * min(max(night - self.night + 1, 0), self.nights)


@dataclass(frozen=True)
class FloorPlan:
    """What happens on a floor of machines of one kind."""

    first_night: datetime
    duration: float
    hall: Mapping[str, Any]
    parameters: Mapping[str, Scatter]
    planted: Sequence[Planted]

    @classmethod
    def of(cls, path: Path = FLOOR) -> FloorPlan:
        """That of a file."""
        given = tomllib.loads(path.read_text(encoding="utf-8-sig"))
        return cls(
            datetime.fromisoformat(given["first_night"]), given["duration"], given["hall"],
            {name: Scatter(**own) for name, own in given["parameters"].items()},
            tuple(Planted(**own) for own in given["planted"]),
        )  # fmt: skip


@dataclass(frozen=True)
class Night:
    """A log to be made: of a machine, by its number, on a night. warmer: K than the mean."""

    folder: Path
    machine: int
    night: int
    warmer: float
    seed: int

    @property
    def name(self) -> str:
        """What the machine is called."""
        return named(self.machine)


def nights_of(folder: Path, machines: int, nights: int, seed: int) -> Iterator[Night]:
    """The logs of a floor, night by night."""
    warmer = temperatures(FloorPlan.of().hall, nights, np.random.default_rng([seed, 0]))
    for night in range(nights):
        for machine in range(1, machines + 1):
            yield Night(folder, machine, night, float(warmer[night]), seed)


def temperatures(hall: Mapping[str, Any], nights: int, rng: np.random.Generator) -> Array:
    """How much warmer than its mean the hall is, (nights,) K."""
    kept = math.exp(-1.0 / hall["memory"])
    out, now = np.zeros(nights), 0.0
    for i, drawn in enumerate(rng.standard_normal(nights)):
        now = kept * now + math.sqrt(1.0 - kept**2) * drawn
        out[i] = hall["weather"] * now
    for change in hall["changed"]:
        out[change["night"] :] += change["by"]
    return out


def record_night(night: Night) -> None:
    """Run a machine as it is on a night, and write its log."""
    floor = FloorPlan.of()
    log = simulate(
        _as_it_is(night, floor), "tracking", seed=night.seed + 1000 * night.machine + night.night,
        duration=floor.duration, simulator=ReducedSimulator,
    )  # fmt: skip
    started = floor.first_night + timedelta(days=night.night)
    told = {"machine": night.name, "started": started.isoformat()}
    path = night.folder / night.name / f"{started:%Y%m%d}.mcap"
    path.parent.mkdir(parents=True, exist_ok=True)
    write_log(replace(log, truth={}, attachments={}, metadata={**log.metadata, **told}), path)


@lru_cache(maxsize=1)
def _stage() -> MachineModel:
    return load_model(STAGE)


def _as_it_is(night: Night, floor: FloorPlan) -> MachineModel:
    """The machine with the values of a night."""
    model = _stage()
    (name, axis), *_ = model.axes.items()
    own = np.random.default_rng([night.seed, 1, night.machine])
    tonight = np.random.default_rng([night.seed, 2, night.machine, night.night])
    changes = [p for p in floor.planted if p.machine == night.machine and night.night >= p.night]
    where = [c for c in all_parameters(axis) if c.label in floor.parameters]
    values = read(axis, where)
    for i, c in enumerate(where):
        of = floor.parameters[c.label]
        values[i] *= 1.0 + of.spread * own.standard_normal()
        values[i] *= 1.0 + of.warmth * night.warmer + of.scatter * tonight.standard_normal()
        for change in changes:
            if c.label == f"{change.what}.{change.parameter}":
                values[i] *= change.factor(night.night)
    axis = write(axis, where, values)
    for change in changes:
        if change.parameter is None:
            effect = load_catalogue()[change.what]
            axis = axis.with_effect(Fitted.at_start(effect, change.values))
    return model.with_axis(name, axis)
