"""Machines for tests: stages with drawn values and a planted effect, and their logs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from identify.dataset.preparation import datasets
from identify.estimation.fit import fit_axis
from identify.experiment_design.planting import draw_effect, other_machine
from twin.effects import Catalogue
from twin.experiments.named import simulate
from twin.logs import Log
from twin.model.machine import Fitted, MachineModel
from twin.simulator import ReducedSimulator

DURATION = 12.0  # s of each log


@dataclass(frozen=True, eq=False)
class Machine:
    """A machine, the effect planted on its x axis, and its logs."""

    stage: MachineModel
    planted: Fitted | None
    logs: dict[str, Log]
    holdout: dict[str, Log]


def one_axis(stage: MachineModel) -> MachineModel:
    """The stage less its y axis, as a plain slide: quicker to analyse."""
    return MachineModel(stage.name, {"x": stage.axes["x"]}, stage.sample_rate)


def machine(
    stage: MachineModel,
    catalogue: Catalogue,
    effect: str | None,
    force: float,
    seed: int,
    duration: float = DURATION,
) -> Machine:
    """Draw a machine about the stage, plant an effect of that force (N RMS) on x, and log it."""
    rng = np.random.default_rng(seed)
    drawn = stage.with_axis("x", other_machine(stage.axes["x"], rng))
    planted = None
    if effect is not None:
        trial = simulate(
            drawn, "tracking", seed=seed, duration=duration, simulator=ReducedSimulator
        )
        dataset = datasets(drawn, {"trial": trial}, {})["x"]
        base = fit_axis(drawn.axes["x"], dataset.fit)
        planted = draw_effect(
            catalogue[effect], base.axis, dataset.fit, dataset.excitation, force, rng
        )
        drawn = drawn.with_axis("x", drawn.axes["x"].with_effect(planted))
    logs = {
        f"log {i}": simulate(drawn, "tracking", seed=100 * seed + i, duration=duration)
        for i in (1, 2, 3)
    }
    held = {"log 3": logs.pop("log 3")}
    return Machine(drawn, planted, logs, held)
