"""Axes pushed by a given force without feedback, in both simulations."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from effect_runs import CATALOGUE

from twin.experiments.trajectory import Setpoint
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.signals import Array
from twin.simulation.loop import POSITION_COLUMN, VELOCITY_COLUMN, Controller
from twin.simulation.simulators import MujocoSimulator, ReducedSimulator, run

RATE = 5000.0  # Hz
Stepper = type[MujocoSimulator] | type[ReducedSimulator]
BOTH = (MujocoSimulator, ReducedSimulator)


def effect(name: str, **values: float) -> Fitted:
    return Fitted.at_start(CATALOGUE[name], values)


@dataclass(frozen=True, eq=False)
class Pushed:
    """x m, v m/s before each sample; rows and states by name, of that sample, (n,) each."""

    x: Array
    v: Array
    rows: Mapping[str, Array]
    states: Mapping[str, Array]

    def of(self, *names: str) -> Array:
        """Sum of the forces of those effects, N; zero for those that are not there."""
        return sum((self.rows[n] for n in names if n in self.rows), np.zeros(len(self.x)))


def pushed(
    mass: float,
    effects: Sequence[Fitted],
    force: Array,
    stage: Stepper = ReducedSimulator,
    start: float = 0.0,
    rate: float = RATE,
) -> Pushed:
    """An axis (kg) from rest at ``start`` m under a force (n,) N."""
    zero = np.zeros((len(force), 1))
    model = MachineModel("axis", {"x": AxisModel(mass, effects=tuple(effects))}, sample_rate=rate)
    done = run(
        model, Setpoint(zero + start, zero, zero, force[:, None], rate), np.random.default_rng(0),
        simulator=stage, controllers={"x": Controller()},
    )  # fmt: skip
    return Pushed(
        done.signals[:, 0, POSITION_COLUMN],
        done.signals[:, 0, VELOCITY_COLUMN],
        {name: done.forces[:, i] for i, (_, name) in enumerate(done.table.labels)},
        {name: done.states[:, i] for i, (_, name) in enumerate(done.state_names)},
    )


def shoves(n: int, size: float) -> Array:
    """Pushes of several sizes both ways with pauses: an axis breaks away, slides, stops, rests."""
    levels = np.array([0.4, 1.7, 0.0, 0.0, -0.3, -2.1, 0.6, 0.0, 2.4, -0.9, 0.0, 0.0])
    return size * np.repeat(levels, -(-n // len(levels)))[:n]
