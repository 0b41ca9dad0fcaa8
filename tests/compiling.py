"""All that the suite compiles, in parts of about the same time, for tests/conftest.py."""

import numpy as np

from twin.core.compiled import law_address
from twin.core.walks import walk, walk_sensing
from twin.effects import load_catalogue
from twin.model.machine import AxisModel, Hardware, MachineModel, axis_table
from twin.simulation.simulate import simulate
from twin.simulation.simulators import MujocoSimulator, ReducedSimulator

HARDWARE = Hardware(travel=(-0.1, 0.1), velocity=0.2, acceleration=2.0, jerk=100.0)
BARE = MachineModel("bare", {"x": AxisModel(1.0, HARDWARE)}, sample_rate=1000.0)


def laws() -> None:
    """The law of every effect."""
    for effect in load_catalogue().values():
        law_address(effect)


def reduced() -> None:
    """The loop of the reduced model."""
    simulate(BARE, "moves", duration=0.1, simulator=ReducedSimulator)


def measured() -> None:
    """The laws along a measured motion, as a fit and as a free run call them."""
    table, motion = axis_table(BARE.axes), np.zeros((3, 2))
    first, last, state, _, _ = table.axes[0]
    for more in ((1.0, 0.0), (1.0,)):
        walk(
            table.entries, first, last, table.parameters, np.zeros(table.n_states), state, motion,
            motion, 1e-3, 0, np.zeros((0, 2)), *more,
        )  # fmt: skip
    walk_sensing(
        table.entries, first, last, table.parameters, np.zeros(table.n_states), motion, 1e-3,
        np.zeros(2),
    )  # fmt: skip


def mujoco() -> None:
    """The loop in MuJoCo and its callback."""
    simulate(BARE, "moves", duration=0.1, simulator=MujocoSimulator)


PARTS = (laws, reduced, measured, mujoco)
