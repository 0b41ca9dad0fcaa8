"""The stage, as most tests of the analysis have it."""

from __future__ import annotations

from twin.effects import load_catalogue
from twin.logs import Log
from twin.model.file import load_model
from twin.model.machine import MachineModel
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator

CATALOGUE = load_catalogue()
PROTON = load_model("proton_xy", CATALOGUE)


def one_axis(stage: MachineModel) -> MachineModel:
    """The stage less its y axis, as a plain slide: quicker to analyse."""
    return MachineModel(stage.name, {"x": stage.axes["x"]}, stage.sample_rate)


STAGE = one_axis(PROTON)


def tracked(machine: MachineModel, seed: int, duration: float, run: str = "tracking") -> Log:
    """A log of the machine along that experiment, of the reduced model."""
    return simulate(machine, run, seed=seed, duration=duration, simulator=ReducedSimulator)
