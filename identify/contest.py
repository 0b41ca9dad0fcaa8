"""Explanations against each other on an experiment that is only simulated.

What counts is the force that a rival cannot take over by moving its own parameters: the difference
between the two forces less its projection on the rival's Jacobian, over the logs that there are and
the new one together. Its evidence is that of the diagnosis (identify.evidence), in expectation.
W. G. Hunter, A. M. Reiner, "Designs for discriminating between two rival models", Technometrics 7
(1965), with the refit of the rival of A. C. Atkinson, V. V. Fedorov, Biometrika 62 (1975).
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from identify.evidence import evidence
from identify.fit import fit_axis, sticks
from identify.motion import motion_of
from identify.noise import noise_floor
from identify.residual import Windowed, jacobian, moving, residual
from identify.search import orthonormal
from identify.study import choose_window
from twin.errors import InputError
from twin.experiment import Experiment
from twin.experiments import simulate
from twin.log import Log
from twin.model import AxisModel, StageModel, coordinates
from twin.simulator import ReducedStage

Array = NDArray[np.float64]

SEED = 0  # of the random moves and the noise; `twin simulate` draws the same moves by default


@dataclass(frozen=True)
class Explanation:
    """One way to explain an axis: a name, and the axis with values that fit what is known."""

    name: str
    axis: AxisModel


@dataclass(frozen=True, eq=False)
class Trial:
    """An experiment as simulated.

    difference: N RMS on its motion that the rival that comes nearest cannot take over. floor: noise
    floor in N. delta_bic: evidence expected from all logs together. motion: the simulated log;
    where: squared difference (n_windows,) N^2 on it. duration: s.
    """

    experiment: Experiment
    duration: float
    difference: float
    floor: float
    delta_bic: float
    motion: Windowed
    where: Array


@dataclass(frozen=True, eq=False)
class Arena:
    """What the experiments are tried on.

    stage: all axes; name: the axis that is explained. logs: those there are, may be none. window:
    of the weak form in s, or None to take it from the noise of each trial.
    """

    stage: StageModel
    name: str
    explanations: tuple[Explanation, ...]
    logs: tuple[Windowed, ...] = ()
    window: float | None = None

    def record(self, truth: Explanation, experiment: Experiment) -> Windowed | None:
        """The log that the experiment would give if that were the truth; None where it says nothing.

        Measurement noise is that of the stage's hardware.
        """
        machine = self.stage.with_axis(self.name, truth.axis)
        try:
            log = simulate(machine, experiment, seed=SEED, stage=ReducedStage)
            return self._windowed(log)
        except InputError:
            return None

    def _windowed(self, log: Log) -> Windowed:
        motion = motion_of(log, self.name, "planned")
        return Windowed.of(motion, self.window or choose_window([motion]))


def contest(arena: Arena, experiments: Sequence[Experiment]) -> list[Trial]:
    """Every experiment tried, best first; those that the stage cannot run are left out."""
    first = arena.explanations[0]
    logs = [arena.record(first, e) for e in experiments]
    pairs = [(e, log) for e, log in zip(experiments, logs, strict=True) if log is not None]
    # The laws run outside Python's lock; the simulation above sets a callback of the process.
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        trials = list(pool.map(lambda pair: _trial(arena, *pair), pairs))
    return sorted(trials, key=lambda t: -t.delta_bic)


def _trial(arena: Arena, experiment: Experiment, new: Windowed) -> Trial:
    logs = (*arena.logs, new)
    axes = [e.axis for e in arena.explanations]
    kept = moving(logs, any(map(sticks, axes)))
    forces = [residual(axis, logs)[kept] for axis in axes]
    bases = [refit_basis(axis, logs, kept) for axis in axes]
    # On the new log only the first explanation, with which it was simulated, leaves noise.
    noise = unabsorbed(forces[0], bases[0])
    found = []
    for truth, rival in permutations(range(len(axes)), 2):
        left = unabsorbed(forces[rival] - forces[truth], bases[rival])
        added = len(coordinates(axes[rival])) - len(coordinates(axes[truth]))
        found.append((evidence(np.hypot(noise, left), noise, added).delta_bic, left))
    delta_bic, left = min(found, key=lambda pair: pair[0])
    where = np.zeros(len(kept))
    where[kept] = left**2
    where = where[-len(new) :]
    return Trial(
        experiment=experiment,
        duration=len(new.motion.time) * new.motion.period,
        difference=float(np.sqrt(where.mean())),
        floor=noise_floor(axes[0], [(new.motion, new.window)]),
        delta_bic=delta_bic,
        motion=new,
        where=where,
    )


def refit_basis(axis: AxisModel, logs: Sequence[Windowed], kept: NDArray[np.bool_]) -> Array:
    """Forces (n, r), orthonormal, that a refit of the axis can take over."""
    where = coordinates(axis)
    if not where:
        return np.zeros((int(kept.sum()), 0))
    return orthonormal(jacobian(axis, logs, where)[kept])


def unabsorbed(force: Array, basis: Array) -> Array:
    """The part of a force (n,) N that lies outside the span of the basis (n, r)."""
    return force - basis @ (basis.T @ force)


def refitted(arena: Arena, trial: Trial) -> Trial:
    """The trial with each explanation in turn as the truth and its rivals truly refitted.

    The linear step of `contest` is exact only for small differences; this is exact, and slower.
    """
    worst = trial
    for truth, rival in permutations(arena.explanations, 2):
        new = arena.record(truth, trial.experiment)
        if new is None:
            return replace(trial, delta_bic=0.0, difference=0.0)
        logs = (*arena.logs, new)
        fits = [fit_axis(e.axis, logs) for e in (truth, rival)]
        kept = fits[0].kept & fits[1].kept
        after, before = (residual(f.axis, logs)[kept] for f in fits)
        added = len(fits[1].scaling.where) - len(fits[0].scaling.where)
        gain = evidence(before, after, added).delta_bic
        if gain < worst.delta_bic or worst is trial:
            excess = (before**2 - after**2)[-int(kept[-len(new) :].sum()) :]
            difference = float(np.sqrt(max(excess.mean(), 0.0)))
            worst = replace(trial, delta_bic=gain, difference=difference)
    return worst
