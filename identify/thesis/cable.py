"""Chapter "cable": the force of the cable slab from passes at +-0.1 m/s over +-0.15 m.

The thesis averages 10 passes each way, -(F_pos + F_neg)/2, and smooths. Here the spikes of the
rollers are found first and kept out. The machine is simulated, so that what is found can be held
against what was planted; ``cable_force`` itself runs on any log of passes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.analysis.maps import cable_force as of_passes
from identify.dataset.dataset import datasets
from identify.estimation.cable_force import CableForce, cable_force
from identify.estimation.evidence import rms
from identify.thesis.chapter import Chapter, Recovered
from identify.thesis.printed import ROLLER_PITCH
from twin.effect import Effect, Kind
from twin.effects import Catalogue
from twin.experiments.kinds import Passes
from twin.experiments.named import simulate
from twin.log import Log
from twin.model.machine import AxisModel, MachineModel
from twin.progress import Progress
from twin.simulator import MujocoSimulator, ReducedSimulator

Array = NDArray[np.float64]

SPEED = 0.1  # m/s
SPAN = 0.3  # m
TEST_FUNCTION = 0.02  # s: half of a spike at that speed


@dataclass(frozen=True)
class Size:
    """repeats: passes each way."""

    repeats: int
    simulator: type[MujocoSimulator] | type[ReducedSimulator]


FULL = Size(10, MujocoSimulator)
SMALL = Size(3, ReducedSimulator)


@dataclass(frozen=True, eq=False)
class CableResult:
    """The chapter's results.

    planted (k,) N, at the positions of what was found. pitch: None where fewer than three spikes
    were found. repeats: passes each way. noise: of the measured force, N a sample.
    """

    found: CableForce
    planted: Array
    pitch: Recovered | None
    repeats: int
    noise: float

    @property
    def error(self) -> Array:
        """(k,) N, found less planted."""
        return self.found.force - self.planted

    @property
    def rms_error(self) -> float:
        """RMS of the error, N."""
        return rms(self.error)

    @property
    def largest_error(self) -> float:
        """N."""
        return float(np.abs(self.error).max())

    @property
    def rms_error_with_all(self) -> float:
        """RMS of the error with the spikes left in, as in the thesis, N."""
        return rms(self.found.with_all - self.planted)

    @property
    def within_band(self) -> float:
        """Share of positions where the band holds the planted force."""
        return float(np.mean(np.abs(self.error) <= self.found.band))


@dataclass(frozen=True, eq=False)
class CableOfLogs:
    """What passes of a real machine tell, of which nothing is known to be planted."""

    found: CableForce


def of_logs(model: MachineModel, logs: Mapping[str, Log]) -> CableOfLogs:
    """The chapter on logs of passes; raises InputError where they hold none."""
    return CableOfLogs(of_passes(model, logs, test_function=TEST_FUNCTION))


def run(
    models: Sequence[MachineModel],
    catalogue: Catalogue,
    size: Size,
    rng: np.random.Generator,
    progress: Progress,
) -> CableResult:
    """Run the passes on the first axis of a machine with a cable and rollers."""
    (model,) = models
    name, axis = next(iter(model.axes.items()))
    passing = Passes(name, span=SPAN, speed=SPEED, repeats=size.repeats)
    log = simulate(
        model, passing, seed=int(rng.integers(2**31)), simulator=size.simulator,
        progress=lambda done, total: progress("passes", done, total),
    )  # fmt: skip
    prepared = datasets(model, {"passes": log}, {}, TEST_FUNCTION)[name].fit
    found = cable_force(axis, prepared)
    h = axis.hardware
    return CableResult(
        found, _planted(axis, log, name, found.position), _pitch(axis, found), size.repeats,
        h.current_noise * h.force_constant,
    )  # fmt: skip


def of_position(effect: Effect) -> bool:
    """Whether it is a smooth force of position, without memory and not periodic."""
    return (
        effect.kind is Kind.FORCE and not effect.states
        and not any(p.period for p in effect.parameters)
    )  # fmt: skip


def _planted(axis: AxisModel, log: Log, name: str, position: Array) -> Array:
    """The force (k,) N that the machine's smooth forces of position had at these places."""
    truth = log.truth[name]
    force = np.sum([truth[f.effect.name] for f in axis.effects if of_position(f.effect)], axis=0)
    order = np.argsort(truth["position"])
    return np.interp(position, truth["position"][order], force[order])


def _pitch(axis: AxisModel, found: CableForce) -> Recovered | None:
    """The rollers' pitch, planted, found and printed."""
    planted = [f.values[p.name] for f in axis.effects for p in f.effect.parameters if p.period]
    if found.pitch is None or not planted:
        return None
    return Recovered(planted[0], np.array([found.pitch.value]), axis.units.position, ROLLER_PITCH)


CHAPTER = Chapter(("proton_xy",), FULL, SMALL, run, of_logs)
