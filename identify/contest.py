"""Explanations against each other on an experiment that is only simulated.

What counts is the force that a rival cannot take over by moving its own parameters: the difference
between the two forces less its projection on the rival's Jacobian, over the logs that there are and
the new one together. Its evidence is that of the diagnosis (identify.evidence), in expectation.
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

from identify.evidence import effective_samples, evidence
from identify.fit import fit_axis, rms
from identify.motion import Motion, motion_of
from identify.residual import Windowed, jacobian, moving, residual, sticks
from identify.study import choose_window
from identify.subspace import orthonormal, unabsorbed
from identify.weak import LEAST_BLOCKS
from twin.errors import InputError
from twin.experiment import Experiment
from twin.experiments import outside_travel, simulate
from twin.log import Log
from twin.model import AxisModel, StageModel, coordinates, read
from twin.simulator import ReducedStage

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
    parameters (nats), where what each window adds to it, and difference not a number.
    """

    experiment: Experiment
    duration: float
    difference: float
    floor: float
    gain: float
    motion: Windowed
    where: Array


@dataclass(frozen=True, eq=False)
class Arena:
    """What the experiments are tried on.

    stage: all axes; name: the axis that is explained. logs: those there are, may be none. window:
    of the weak form in s; chosen from the noise of all logs, as a diagnosis does, where None.
    """

    stage: StageModel
    name: str
    explanations: tuple[Explanation, ...]
    logs: tuple[Windowed, ...] = ()
    window: float | None = None

    def record(self, truth: Explanation, experiment: Experiment) -> Motion | None:
        """The log that the experiment would give if that were the truth; None where it cannot run.

        It cannot where the axis would leave its travel or ask for more than its force limit, and
        where it moves too slowly for the window.
        Measurement noise is that of the stage's hardware.
        """
        machine = self.stage.with_axis(self.name, truth.axis)
        try:
            log = simulate(machine, experiment, seed=SEED, stage=ReducedStage)
            motion = motion_of(log, self.name, "planned")
        except InputError:
            return None
        slow = self.window is not None and self.window < LEAST_BLOCKS * motion.period
        return None if slow or not within_limits(machine, log) else motion

    def logs_with(self, new: Motion) -> tuple[Windowed, ...]:
        """The logs and the new one, all with the windows that a diagnosis would use."""
        length = self.window or choose_window([*(log.motion for log in self.logs), new])
        old = (
            log if np.isclose(log.window.length, length) else Windowed.of(log.motion, length)
            for log in self.logs
        )
        return (*old, Windowed.of(new, length))


def within_limits(stage: StageModel, log: Log) -> bool:
    """Whether a simulated log keeps to the travel and the force limit of every axis."""
    strained = any(
        np.abs(log.axes[name].force).max() >= axis.hardware.force_limit
        for name, axis in stage.axes.items()
    )
    return not strained and not outside_travel(stage, log)


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
) -> list[Trial]:
    """Every experiment tried, best first; those that the stage cannot run are left out."""
    tried = _discriminating if len(arena.explanations) > 1 else _informative
    trials = []
    # The laws run outside Python's lock; the simulation sets a callback of the whole process.
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for i, experiment in enumerate(experiments):
            new = arena.record(arena.explanations[0], experiment)
            if new is not None:
                trials.append(pool.submit(tried, arena, experiment, new))
            if progress:
                progress("trying experiments", i + 1, len(experiments))
    return sorted((t.result() for t in trials), key=lambda t: -t.gain)


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
        added = len(coordinates(axes[truth])) - len(coordinates(axes[rival]))
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
    where = coordinates(axis)
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
    new: Windowed,
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


def refit_basis(axis: AxisModel, logs: Sequence[Windowed], kept: NDArray[np.bool_]) -> Array:
    """Forces (n, r), orthonormal, that a refit of the axis can take over."""
    where = coordinates(axis)
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
        motion = arena.record(truth, trial.experiment)
        if motion is None:
            return replace(trial, gain=0.0, difference=0.0)
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
