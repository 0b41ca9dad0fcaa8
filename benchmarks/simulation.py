"""Steps per second: the stage in MuJoCo, a bare mj_step loop, and the reduced model.

All three run on one thread and are timed by its CPU time.
"""

from __future__ import annotations

from time import thread_time

import mujoco
import numba
import numpy as np

from benchmarks import fused
from benchmarks.figures import Figure, Target
from benchmarks.timing import Array, interleaved, ratio
from twin.core.compiled import call_at
from twin.core.native import Table
from twin.effects import load_catalogue
from twin.experiments.kinds import Tracking
from twin.experiments.trajectory import AnySetpoint
from twin.model.file import load_model
from twin.model.machine import MachineModel
from twin.mujoco.callback import native_address
from twin.simulation.simulators import MujocoSimulator, ReducedSimulator, run

TITLE = "Simulation: LuGre, cable and roller spikes on both axes, 10 kHz"
DURATION = 20.0  # s of random tracking
ROUNDS = 7

Stage = type[MujocoSimulator] | type[ReducedSimulator]


class FusedSimulator(ReducedSimulator):
    """The reduced model with its laws fused by hand; for models of exactly these effects."""

    def __init__(self, model: MachineModel, table: Table) -> None:
        super().__init__(model, table)
        self._constants = np.stack([fused.constants(a) for a in model.axes.values()])
        self._bristles = np.zeros((len(model.axes), 2))

    def run(self, first: int, shared: tuple, setpoints: Array, noise: Array, out: tuple) -> None:
        """See Stepper."""
        period, _, _, gains, controllers, _ = shared
        fused.stepped(
            self._constants, self._masses, period, self._motion, self._bristles, first, gains,
            controllers, setpoints, noise, *out,
        )  # fmt: skip


@numba.njit(cache=True)
def _bare_steps(step, model, data, n):
    for _ in range(n):
        call_at(step, (model, data))


class _Simulation:
    """Runs one setpoint in a stage; ``stepping`` collects the seconds within its steps."""

    def __init__(self, model: MachineModel, setpoint: AnySetpoint, stage: Stage) -> None:
        self.stepping: list[float] = []
        self._model, self._setpoint = model, setpoint
        self._stage = self._timed(stage)

    def __call__(self) -> None:
        self.stepping.append(0.0)
        run(self._model, self._setpoint, np.random.default_rng(2), simulator=self._stage)

    def _timed(self, stage: Stage) -> Stage:
        stepping = self.stepping

        class Timed(stage):  # type: ignore[misc, valid-type]
            def run(self, *arguments: object) -> None:
                begun = thread_time()
                super().run(*arguments)
                stepping[-1] += thread_time() - begun

        return Timed


def measure() -> list[Figure]:
    """Ratios of steps per second, of whole runs and of the stepping alone."""
    model = load_model("proton_xy", load_catalogue())
    setpoint = Tracking(DURATION).setpoint(model, np.random.default_rng(1))
    n = len(setpoint)
    bare_model = MujocoSimulator(model, model.table()).model
    bare_data = mujoco.MjData(bare_model)
    in_mujoco = _Simulation(model, setpoint, MujocoSimulator)
    in_reduced = _Simulation(model, setpoint, ReducedSimulator)
    by_hand = _Simulation(model, setpoint, FusedSimulator)
    bare, whole, reduced, _ = interleaved(
        [
            lambda: _bare_steps(
                native_address("mj_step"), bare_model._address, bare_data._address, n
            ),
            in_mujoco,
            in_reduced,
            by_hand,
        ],
        ROUNDS,
        thread_time,
    ).T
    steps, reduced_steps, hand_steps = (
        np.array(s.stepping[1:]) for s in (in_mujoco, in_reduced, by_hand)
    )
    rates = ", ".join(
        f"{name} {n / np.median(t) / 1e6:.2f}"
        for name, t in (("bare", bare), ("MuJoCo", steps), ("reduced", reduced_steps))
    )
    return [
        Figure(
            "a run in MuJoCo over a bare compiled mj_step loop of the same mjModel",
            ratio(bare, whole), "steps/s ratio", Target(low=0.92),
            "whole run: set-up, noise, control, effects, logging",
        ),
        Figure(
            "the same, its stepping alone", ratio(bare, steps), "steps/s ratio", Target(low=0.95),
            "above 1 as MuJoCo's own timers stand still in it",
        ),
        Figure(
            "reduced model over that bare loop, stepping the same setpoint",
            ratio(bare, reduced_steps), "steps/s ratio", Target(low=15.0),
            f"control, effects, logging; million steps/s: {rates}",
        ),
        Figure(
            "the same, over the same laws fused by hand in one function",
            ratio(hand_steps, reduced_steps), "steps/s ratio", Target(low=0.9),
            "same controller, integrator and log",
        ),
        Figure("the same, over the stage in MuJoCo", ratio(steps, reduced_steps), "steps/s ratio"),
        Figure(
            "the same, whole runs", ratio(whole, reduced), "steps/s ratio",
            note="both draw the encoder noise and make the arrays, which the ratio dilutes",
        ),
    ]  # fmt: skip
