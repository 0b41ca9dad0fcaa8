"""Explanations against each other on an experiment that is only simulated.

What counts is the force that a rival cannot take over by moving its own parameters: the difference
between the two forces less its projection on the rival's Jacobian, over the logs that there are and
the new one together. Its evidence is that of the diagnosis, in expectation.
W. G. Hunter, A. M. Reiner, "Designs for discriminating between two rival models", Technometrics 7
(1965), with the refit of the rival of A. C. Atkinson, V. V. Fedorov, Biometrika 62 (1975).
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import choose_window
from identify.dataset.motion import SHORTEST_LOG, Motion, motion_of
from identify.dataset.prepared_log import PreparedLog, moving, sticks
from identify.dataset.test_function import LEAST_BLOCKS
from identify.estimation.evidence import effective_samples, evidence
from identify.estimation.fit import fit_axis, rms
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.subspace import orthonormal, unabsorbed
from identify.experiment_design.candidate_experiments import NotRun
from twin.errors import CannotRun
from twin.experiments.experiment import Experiment
from twin.experiments.named import outside_travel, simulate
from twin.log import Log
from twin.log.check import moves
from twin.model.machine import AxisModel, MachineModel, free_parameters, read
from twin.model.units import AxisUnits
from twin.simulator import ReducedSimulator

Array = NDArray[np.float64]
Progress = Callable[[str, int, int], None]

SEED = 0  # of the random moves and the noise; `twin simulate` draws the same moves by default


@dataclass(frozen=True)
class Explanation:
    """One way to explain an axis: a name, and the axis with values that fit what is known."""

    name: str
    axis: AxisModel


@dataclass(frozen=True, eq=False)
class Trial:
    """An experiment as simulated.

    difference: N RMS on its motion that the rival that comes nearest cannot take over, and floor:
    N RMS that the noise of the stage's hardware leaves there. gain: evidence (difference of BIC)
    expected from all logs together. motion: the simulated log; where: squared difference
    (n_windows,) N^2 on it. duration: s. Of a single model, gain is the information on its
    parameters (nats), where what each window adds to it, and difference not a number. not_run: why
    it cannot run where another explanation than the first is the truth, if so.
    """

    experiment: Experiment
    duration: float
    difference: float
    floor: float
    gain: float
    motion: PreparedLog
    where: Array
    not_run: NotRun | None = None

    @property
    def units(self) -> AxisUnits:
        """Of the axis that is explained."""
        return self.motion.motion.units


@dataclass(frozen=True, eq=False)
class Arena:
    """What the experiments are tried on.

    stage: all axes; name: the axis that is explained. logs: those there are, may be none. window:
    of the weak form in s; chosen from the noise of all logs, as a diagnosis does, where None.
    """

    stage: MachineModel
    name: str
    explanations: tuple[Explanation, ...]
    logs: tuple[PreparedLog, ...] = ()
    window: float | None = None

    def record(self, truth: Explanation, experiment: Experiment) -> Motion:
        """The log that the experiment would give if that were the truth; CannotRun where it cannot.

        It cannot where an axis would leave its travel or ask for more than its force limit, where
        it hardly moves or not for long, and where it moves too slowly for the window. Measurement
        noise is that of the stage's hardware.
        """
        machine = self.stage.with_axis(self.name, truth.axis)
        log = simulate(machine, experiment, seed=SEED, simulator=ReducedSimulator)
        require_within_limits(machine, log)
        if len(log) * log.period < SHORTEST_LOG or not moves(log, self.name):
            raise CannotRun(
                f"axis {self.name} hardly moves, or for less than {SHORTEST_LOG:g} s; give a "
                "longer --duration (s)"
            )
        motion = motion_of(log, self.name, "planned", tuple(self.stage.axes))
        if self.window is not None and self.window < LEAST_BLOCKS * motion.period:
            raise CannotRun(
                f"axis {self.name} moves too slowly for a window of {self.window:g} s beside the "
                f"noise of its encoder; give at least {LEAST_BLOCKS * motion.period:g} s"
            )
        return motion

    def logs_with(self, new: Motion) -> tuple[PreparedLog, ...]:
        """The logs and the new one, all with the windows that a diagnosis would use."""
        length = self.window or choose_window([*(log.motion for log in self.logs), new])
        old = (
            log if np.isclose(log.window.length, length) else PreparedLog.of(log.motion, length)
            for log in self.logs
        )
        return (*old, PreparedLog.of(new, length))


def require_within_limits(stage: MachineModel, log: Log) -> None:
    """Raise CannotRun unless a simulated log keeps to travel and force limit of every axis."""
    for why in outside_travel(stage, log):
        raise CannotRun(why)
    for name, axis in stage.axes.items():
        if np.abs(log.axes[name].force).max() >= axis.hardware.force_limit:
            raise CannotRun(
                f"axis {name} asks for its force_limit of {axis.hardware.force_limit:g} N; move "
                "more gently, or check the limit"
            )


def favoured(arena: Arena) -> tuple[str, float]:
    """The explanation that the logs favour, and their evidence for it over the nearest rival.

    Zero evidence where there are no logs or no rivals.
    """
    axes = [e.axis for e in arena.explanations]
    if not arena.logs or len(axes) < 2:
        return arena.explanations[0].name, 0.0
    kept = moving(arena.logs, any(map(sticks, axes)))
    left = {e.name: residual(e.axis, arena.logs)[kept] for e in arena.explanations}
    best, second = sorted(left, key=lambda name: rms(left[name]))[:2]
    return best, evidence(left[second], left[best], 0).delta_bic


def contest(
    arena: Arena, experiments: Sequence[Experiment], progress: Progress | None = None
) -> tuple[list[Trial], tuple[NotRun, ...]]:
    """Every experiment tried, best first; and why the stage cannot run the others."""
    tried = _discriminating if len(arena.explanations) > 1 else _informative
    trials, not_run = [], []
    # The laws run outside Python's lock; the simulation sets a callback of the whole process.
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for i, experiment in enumerate(experiments):
            try:
                new = arena.record(arena.explanations[0], experiment)
            except CannotRun as why:
                units = arena.stage.axes[arena.name].units
                not_run.append(NotRun(experiment, str(why), units))
            else:
                trials.append(pool.submit(tried, arena, experiment, new))
            if progress:
                progress("trying experiments", i + 1, len(experiments))
    return sorted((t.result() for t in trials), key=lambda t: -t.gain), tuple(not_run)


def _discriminating(arena: Arena, experiment: Experiment, motion: Motion) -> Trial:
    """The evidence that the rival that comes nearest leaves behind, whichever is the truth."""
    logs = arena.logs_with(motion)
    new = logs[-1]
    axes = [e.axis for e in arena.explanations]
    kept = moving(logs, any(map(sticks, axes)))
    forces = [residual(axis, logs)[kept] for axis in axes]
    bases = [refit_basis(axis, logs, kept) for axis in axes]
    # On the new log only the first explanation, with which it was simulated, leaves noise.
    noise = unabsorbed(forces[0], bases[0])
    found = []
    for truth, rival in permutations(range(len(axes)), 2):
        left = unabsorbed(forces[rival] - forces[truth], bases[rival])
        added = len(free_parameters(axes[truth])) - len(free_parameters(axes[rival]))
        found.append((evidence(np.hypot(noise, left), noise, added).delta_bic, left))
    gain, left = min(found, key=lambda pair: pair[0])
    where = _spread(left**2, kept)[-len(new) :]
    quiet = _spread(noise**2, kept)[-len(new) :]
    return _trial(experiment, new, gain, where, float(np.sqrt(where.mean())), quiet)


def _informative(arena: Arena, experiment: Experiment, motion: Motion) -> Trial:
    """The information on the one model's parameters, in nats beside a prior of 100 % on each.

    Half the log determinant of the information matrix (D-optimal design; A. C. Atkinson,
    A. N. Donev, Optimum Experimental Designs, 1992).
    """
    axis = arena.explanations[0].axis
    where = free_parameters(axis)
    logs = arena.logs_with(motion)
    new = logs[-1]
    kept = moving(logs, sticks(axis))
    noise = residual(axis, logs)[kept]
    prior = np.maximum(np.abs(read(axis, where)), [abs(c.parameter.start) for c in where])
    tau = len(noise) / effective_samples(noise)
    columns = jacobian(axis, logs, where)[kept] * prior / (rms(noise) * np.sqrt(tau))
    information = np.eye(len(where)) + columns.T @ columns
    leverage = np.sum(columns * np.linalg.solve(information, columns.T).T, axis=1)
    gain = 0.5 * float(np.linalg.slogdet(information)[1])
    seen = _spread(leverage, kept)[-len(new) :]
    return _trial(experiment, new, gain, seen, float("nan"), _spread(noise**2, kept)[-len(new) :])


def _trial(
    experiment: Experiment,
    new: PreparedLog,
    gain: float,
    where: Array,
    difference: float,
    quiet: Array,
) -> Trial:
    duration = len(new.motion.time) * new.motion.period
    floor = float(np.sqrt(quiet.mean()))
    return Trial(experiment, duration, difference, floor, gain, new, where)


def _spread(values: Array, kept: NDArray[np.bool_]) -> Array:
    """Values of the windows that were kept, zero in the others."""
    out = np.zeros(len(kept))
    out[kept] = values
    return out


def refit_basis(axis: AxisModel, logs: Sequence[PreparedLog], kept: NDArray[np.bool_]) -> Array:
    """Forces (n, r), orthonormal, that a refit of the axis can take over."""
    where = free_parameters(axis)
    if not where:
        return np.zeros((int(kept.sum()), 0))
    return orthonormal(jacobian(axis, logs, where)[kept])


def refitted(arena: Arena, trial: Trial) -> Trial:
    """The trial with each explanation in turn as the truth and its rivals truly refitted.

    The linear step of `contest` is exact only for small differences; this is exact, and slower. Of
    a single model, the trial as it is.
    """
    found = []
    for truth, rival in permutations(arena.explanations, 2):
        try:
            motion = arena.record(truth, trial.experiment)
        except CannotRun as why:
            cannot = NotRun(trial.experiment, str(why), trial.units, truth.name)
            return replace(trial, gain=0.0, difference=0.0, not_run=cannot)
        logs = arena.logs_with(motion)
        fits = [fit_axis(e.axis, logs) for e in (truth, rival)]
        kept = fits[0].kept & fits[1].kept
        after, before = (residual(f.axis, logs)[kept] for f in fits)
        added = len(fits[0].scaling.where) - len(fits[1].scaling.where)
        excess = _spread(before**2 - after**2, kept)[-len(logs[-1]) :].mean()
        difference = float(np.sqrt(max(excess, 0.0)))
        found.append((evidence(before, after, added).delta_bic, difference))
    if not found:
        return trial
    gain, difference = min(found)
    return replace(trial, gain=gain, difference=difference)
