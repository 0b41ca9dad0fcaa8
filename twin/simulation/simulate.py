"""Experiments run on the twin and logged, and how far its axes went in them."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from twin.errors import InputError
from twin.experiments.experiment import Experiment, OneAxis
from twin.experiments.file import format_experiment, setpoint_of
from twin.experiments.kinds import kind_of
from twin.experiments.named import DURATION, EXPERIMENTS, find_experiment
from twin.logs import Log
from twin.logs.log import joined
from twin.model.machine import MachineModel
from twin.numbers import require_seed
from twin.simulation.follow import follow_parts
from twin.simulation.loop import Controller
from twin.simulation.simulators import MujocoSimulator, Progress, Simulator


def _require_of_one_axis(name: str, model: MachineModel, axis: str) -> None:
    """Refuse an axis for an experiment that moves all."""
    if len(model.axes) > 1 and name in EXPERIMENTS and not EXPERIMENTS[name].of_one_axis:
        alone = ", ".join(n for n, one in EXPERIMENTS.items() if one.of_one_axis)
        raise InputError(
            f"axis {axis}: {name} moves all axes ({', '.join(model.axes)}); leave the axis out, or "
            f"take one of {alone}"
        )


def simulate(
    model: MachineModel | str | Path,
    experiment: str | Path | Experiment,
    *,
    seed: int = 0,
    duration: float | None = None,
    axis: str | None = None,
    simulator: Simulator = MujocoSimulator,
    progress: Progress | None = None,
) -> Log:
    """Run an experiment on the twin and return its log, with the truth topics.

    model: or the path of its file, or the name of one of the package. experiment: a name, or an
    experiment with its own parameters, or the path of its file. Of a named one: duration in s (20
    where None), kept by all but those whose moves take longer; axis, the one that moves where the
    experiment moves one, the first where None. The same seed gives the same log. simulator:
    MuJoCo's, or one of ``twin.simulation.simulators``, whose FineSimulator takes ten steps a
    sample; a friction of sigma2 seems to lighten the mass by sigma2 times half a step. Raises
    InputError for an unknown experiment or axis, and for a setpoint outside the travel.
    """
    from twin.experiments.file import SUFFIX, load_experiment  # which load what reads files
    from twin.model.file import as_model

    if isinstance(experiment, str) and experiment.endswith(SUFFIX):
        experiment = Path(experiment)
    if isinstance(experiment, Path):
        experiment = load_experiment(experiment)
    return joined(
        simulate_parts(
            as_model(model), experiment, seed=seed, duration=duration, axis=axis,
            simulator=simulator, progress=progress,
        )
    )  # fmt: skip


def simulate_parts(
    model: MachineModel,
    experiment: str | Experiment,
    *,
    seed: int = 0,
    duration: float | None = None,
    axis: str | None = None,
    simulator: Simulator = MujocoSimulator,
    progress: Progress | None = None,
) -> Iterator[Log]:
    """``simulate`` in parts of two seconds or so, to be recorded while the twin runs."""
    require_seed(seed)
    _, noise_rng, current_rng = np.random.default_rng(seed).spawn(3)
    if isinstance(experiment, str):
        name, attached = experiment, dict[str, bytes]()
        if axis is not None:
            _require_of_one_axis(name, model, axis)
        seconds = DURATION if duration is None else duration
        chosen = find_experiment(experiment, model, axis, seconds)
    else:
        if duration is not None or axis is not None:
            raise InputError("an experiment has its own duration and axis; leave them out")
        name, chosen = kind_of(experiment), experiment
        driven = experiment.axis if isinstance(experiment, OneAxis) else next(iter(model.axes))
        text = format_experiment(experiment, units=model.axis(driven).units)
        attached = {"experiment.toml": text.encode()}
    setpoint = setpoint_of(chosen, model, seed)
    controllers = None if chosen.closed_loop else {a: Controller() for a in model.axes}
    for part in follow_parts(
        model, setpoint, (noise_rng, current_rng), name=name, seed=seed, simulator=simulator,
        controllers=controllers, progress=progress,
    ):  # fmt: skip
        yield replace(part, attachments={**part.attachments, **attached})


class Reach:
    """How far each axis of a model went; ``take`` the parts of a log of the twin one by one."""

    def __init__(self, model: MachineModel) -> None:
        self._model = model
        self._farthest: dict[str, float] = {}

    def take(self, log: Log) -> Log:
        """Look at the next part, which is returned."""
        for name, axis in self._model.axes.items():
            if axis.hardware.travel is None:
                continue
            low, high = axis.hardware.travel
            position = np.append(log.truth[name]["position"], self._farthest.get(name, low))
            out = np.maximum(low - position, position - high)
            self._farthest[name] = float(position[np.argmax(out)])
        return log

    def warnings(self) -> tuple[str, ...]:
        """A sentence for each axis that left its travel."""
        said = []
        for name, farthest in self._farthest.items():
            units, hardware = self._model.axes[name].units, self._model.axes[name].hardware
            low, high = hardware.travel or (-math.inf, math.inf)
            if not low <= farthest <= high:
                said.append(
                    f"axis {name} went to {farthest:.6g} {units.position}, outside its travel of "
                    f"{low:g} to {high:g} {units.position}: the drive does not hold it; move more "
                    f"gently, or check force_limit ({hardware.force_limit:g} {units.force}), "
                    "bandwidth and the effects"
                )
        return tuple(said)


def outside_travel(model: MachineModel, log: Log) -> tuple[str, ...]:
    """A sentence for each axis of the model that left its travel in a log of the twin."""
    reach = Reach(model)
    reach.take(log)
    return reach.warnings()
