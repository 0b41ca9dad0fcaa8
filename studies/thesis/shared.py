"""What the chapters share: their machines and logs, and how a result is told."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from identify.dataset.dataset import Dataset
from identify.dataset.preparation import datasets
from identify.estimation.errors import error_on
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit
from identify.output.blocks import Block
from twin.effect import Effect, Kind
from twin.effects import load_catalogue
from twin.experiments.experiment import Experiment
from twin.experiments.trajectory import Setpoint
from twin.logs import Log
from twin.logs.log import joined
from twin.model.file import load_model
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.simulation.follow import follow_parts
from twin.simulation.loop import Controller
from twin.simulation.simulate import simulate
from twin.simulation.simulators import FineSimulator

Array = NDArray[np.float64]
Numbers = dict[str, Any]

CATALOGUE = load_catalogue()
MACHINES = Path(__file__).parent / "machines"
SIDES = {1.0: "forwards", -1.0: "backwards"}
PLACES, FIRST, APART = 9, -0.136, 34e-3  # along the track: of the thesis; m, m


class Found(NamedTuple):
    """What a chapter found: the object of --json, its main numbers in sentences, its pictures."""

    numbers: Numbers
    words: Sequence[str]
    pictures: Sequence[Block]


class Chapter(Protocol):
    """A module that is a chapter: the title of its section, and a run, in small or whole."""

    @property
    def TITLE(self) -> str: ...

    def run(self, small: bool, rng: np.random.Generator) -> Found: ...


def recovered(true: float, values: ArrayLike, unit: str, printed: float | None = None) -> Numbers:
    """One parameter: planted, found (trials,) and printed in the thesis (None if it is not).

    error: mean less planted, over planted; rms_error, largest_error: of one trial, over planted.
    """
    found = np.asarray(values, dtype=float)
    sd = float(np.std(found, ddof=1)) if len(found) > 1 else 0.0
    return {
        "true": true, "mean": float(np.mean(found)), "sd": sd, "printed": printed, "unit": unit,
        "error": float(np.mean(found)) / true - 1.0, "rms_error": rms(found / true - 1.0),
        "largest_error": float(np.abs(found / true - 1.0).max()),
    }  # fmt: skip


def machine(name: str) -> tuple[MachineModel, str, AxisModel]:
    """A machine of the study or of the package, the name of its first axis, and that axis."""
    own = MACHINES / f"{name}.toml"
    model = load_model(own if own.exists() else name, CATALOGUE)
    return model, *next(iter(model.axes.items()))


def friction_of(axis: AxisModel) -> Fitted:
    """The friction of an axis that has one."""
    return next(f for f in axis.effects if f.effect.kind is Kind.FRICTION)


def frictions() -> list[Effect]:
    """Those of the catalogue."""
    return [effect for effect in CATALOGUE.values() if effect.kind is Kind.FRICTION]


def of_position(axis: AxisModel) -> tuple[Fitted, ...]:
    """The smooth forces of position of an axis, without memory and not periodic."""
    forces = (f for f in axis.effects if f.effect.kind is Kind.FORCE and not f.effect.states)
    return tuple(f for f in forces if not any(p.period for p in f.effect.parameters))


def begun(axis: AxisModel, dataset: Dataset, effect: Effect) -> AxisModel:
    """The axis with that effect, in place of its own, at the start values for a dataset."""
    return axis.with_effect(Fitted.at_start(effect, effect.starts(dataset.excitation)))


def with_hardware(axis: AxisModel, **hardware: Any) -> AxisModel:
    """The axis with other hardware by name."""
    return replace(axis, hardware=replace(axis.hardware, **hardware))


def places(count: int) -> Array:
    """So many of the thesis's places along the track, from the first on, (count,) m."""
    return np.array([FIRST + APART * (PLACES // count) * i for i in range(count)])


def seed_of(rng: np.random.Generator) -> int:
    """A seed for one simulation."""
    return int(rng.integers(2**31))


def recorded(
    model: MachineModel, experiment: str | Experiment, rng: np.random.Generator,
    duration: float | None = None,
) -> Log:  # fmt: skip
    """A log of an experiment on a machine that is stepped ten times finer than its samples."""
    seed = seed_of(rng)
    return simulate(model, experiment, seed=seed, duration=duration, simulator=FineSimulator)


def followed(
    model: MachineModel, setpoint: Setpoint, rng: np.random.Generator,
    controllers: Mapping[str, Controller] | None = None,
) -> Log:  # fmt: skip
    """The same of a setpoint. controllers: the model's own where None."""
    noise, current = rng.spawn(2)
    return joined(
        follow_parts(
            model, setpoint, (noise, current), name="setpoint", seed=0, simulator=FineSimulator,
            controllers=controllers,
        )
    )  # fmt: skip


def four_logs(
    machine: MachineModel, duration: float, rng: np.random.Generator, model: MachineModel
) -> tuple[Dataset, Dataset]:
    """Logs of a machine's first axis, prepared for a model of it.

    Two to fit and one held out; and one on which nothing is decided.
    """
    logs = {f"log {i}": recorded(machine, "tracking", rng, duration) for i in range(1, 5)}
    test, held = ({name: logs.pop(name)} for name in ("log 4", "log 3"))
    name = next(iter(model.axes))
    dataset = datasets(model, logs, held)[name]
    return dataset, datasets(model, test, {}, dataset.test_function_length)[name]


def over_floor(fit: Fit, test: Dataset) -> float:
    """Error of a fit on another log, over the noise floor."""
    return rms(error_on(fit.axis, test.training)) / fit.floor
