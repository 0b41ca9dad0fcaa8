"""How well a simulated experiment discriminates between explanations.

The criterion is the force that a rival cannot reproduce by changing its own parameters: the
difference between the two forces less its projection on the rival's Jacobian, over the existing
logs and the new one together. The evidence is the expected value of that of a diagnosis.
W. G. Hunter, A. M. Reiner, "Designs for discriminating between two rival models", Technometrics 7
(1965), with the refit of the rival of A. C. Atkinson, V. V. Fedorov, Biometrika 62 (1975).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from identify.dataset.bodies import bodies_along
from identify.dataset.drive import parts_of
from identify.dataset.motion import SHORTEST_LOG, Motion, motion_of
from identify.dataset.prepared_log import PreparedLog, moving, sticks
from identify.dataset.test_function import LEAST_BLOCKS
from identify.dataset.time_scale import choose_test_function
from identify.estimation.evidence import effective_samples, evidence, rms
from identify.estimation.fit import fit_axis
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.least_squares import orthonormal, unabsorbed
from identify.experiment_design.candidate_experiments import NotRun
from twin.checks import moves
from twin.effect import Kind
from twin.errors import CannotRun
from twin.experiments.experiment import Experiment
from twin.logs import Log
from twin.model.machine import AxisModel, MachineModel
from twin.model.parameters import free_parameters, read
from twin.model.units import AxisUnits
from twin.parallel import Progress, Spread, silent, spread
from twin.signals import Array
from twin.simulation.simulate import outside_travel, simulate
from twin.simulation.simulators import quickest


@dataclass(frozen=True)
class Explanation:
    """One way to explain an axis: a name, and the axis with values fitted to the existing logs."""

    name: str
    axis: AxisModel


@dataclass(frozen=True, eq=False)
class SimulatedExperiment:
    """An experiment as simulated, and what it is expected to show.

    difference: N RMS on its motion that the nearest rival cannot reproduce; floor: N RMS of the
    noise of the machine's hardware. gain: evidence (difference of BIC) expected from all logs
    together. motion: the simulated log; where: squared difference (n_test_functions,) N^2 on it.
    duration: s. With a single explanation, gain is the information on its parameters (nats), where
    the contribution of each test function to it, and difference is not a number. not_run: set where
    the experiment cannot run if another explanation than the first is the truth.
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
        """The units of the axis that is explained."""
        return self.motion.motion.units


@dataclass(frozen=True, eq=False)
class Arena:
    """The machine, the explanations and the existing logs that experiments are simulated for.

    machine: all axes; name: the axis that is explained. logs: the existing ones, may be none.
    test_function: length in s; chosen from the noise of all logs, as in a diagnosis, where None.
    """

    machine: MachineModel
    name: str
    explanations: tuple[Explanation, ...]
    logs: tuple[PreparedLog, ...] = ()
    test_function: float | None = None

    @cached_property
    def known(self) -> list[Array]:
        """Of each explanation, residual and Jacobian (n, 1 + k) on the existing logs."""
        return [_answer(e.axis, self.logs) for e in self.explanations]

    def answers(self, logs: Sequence[PreparedLog]) -> list[Array]:
        """The same on ``logs_with`` a new one: that of the existing logs is computed once."""
        old, new = logs[:-1], logs[-1:]
        same = all(a is b for a, b in zip(old, self.logs, strict=True))
        known = self.known if same else [_answer(e.axis, old) for e in self.explanations]
        pairs = zip(known, self.explanations, strict=True)
        return [np.concatenate([own, _answer(e.axis, new)]) for own, e in pairs]

    def record(self, truth: Explanation, experiment: Experiment) -> Motion:
        """The log that the experiment would give if ``truth`` were true, with measurement noise.

        Raises CannotRun where an axis would leave its travel or exceed its force limit, where it
        hardly moves or not for long, and where it moves too slowly for the test function.
        """
        truth_machine = self.machine.with_axis(self.name, truth.axis)
        # of the random moves and the noise; `twin simulate` draws the same moves by default
        seed = 0
        log = simulate(truth_machine, experiment, seed=seed, simulator=quickest(self.machine))
        require_within_limits(truth_machine, log)
        if len(log) * log.period < SHORTEST_LOG or not moves(log, self.name):
            raise CannotRun(
                f"axis {self.name} hardly moves, or for less than {SHORTEST_LOG:g} s; give a "
                "longer duration (s)"
            )
        # The readings of a simulation err as the effects of the encoder make them, by nothing else.
        errs = bool(parts_of(truth.axis, Kind.SENSING).effects)
        axes = tuple(self.machine.axes)
        motion = motion_of(
            log, self.name, "planned", axes, ripples=None if errs else (),
            bodies=bodies_along(self.machine, log, "planned").get(self.name),
        )  # fmt: skip
        if self.test_function is not None and self.test_function < LEAST_BLOCKS * motion.period:
            raise CannotRun(
                f"axis {self.name} moves too slowly for a test function of {self.test_function:g} "
                f"s with the noise of its encoder; give at least {LEAST_BLOCKS * motion.period:g} s"
            )
        return motion

    def logs_with(self, new: Motion) -> tuple[PreparedLog, ...]:
        """The logs and the new one, with the test functions that a diagnosis would use."""
        length = self.test_function or choose_test_function(
            [*(log.motion for log in self.logs), new]
        )
        alike = all(np.isclose(log.test_function.length, length) for log in self.logs)
        old = self.logs if alike else (PreparedLog.of(log.motion, length) for log in self.logs)
        return (*old, PreparedLog.of(new, length))


def require_within_limits(machine: MachineModel, log: Log) -> None:
    """Raise CannotRun where a simulated log leaves the travel or reaches the force limit."""
    for why in outside_travel(machine, log):
        raise CannotRun(why)
    for name, axis in machine.axes.items():
        if np.abs(log.axes[name].force).max() >= axis.hardware.force_limit:
            raise CannotRun(
                f"axis {name} reaches its force_limit of {axis.hardware.force_limit:g} "
                f"{axis.units.force}; move more gently, or check the limit"
            )


def favoured(arena: Arena) -> tuple[str, float]:
    """The explanation that the logs favour, and the evidence for it over the nearest rival.

    The evidence is zero without logs or without rivals.
    """
    axes = [e.axis for e in arena.explanations]
    if not arena.logs or len(axes) < 2:
        return arena.explanations[0].name, 0.0
    kept = moving(arena.logs, any(map(sticks, axes)))
    left = {e.name: residual(e.axis, arena.logs)[kept] for e in arena.explanations}
    best, second = sorted(left, key=lambda name: rms(left[name]))[:2]
    return best, evidence(left[second], left[best], 0).delta_bic


def contest(
    arena: Arena,
    experiments: Sequence[Experiment],
    progress: Progress = silent,
    over: Spread = spread,
) -> tuple[list[SimulatedExperiment], tuple[NotRun, ...]]:
    """Every experiment simulated and judged, best first; and those that the machine cannot run."""
    _ = arena.known  # computed once, and sent along with the arena
    judged = over(partial(_judged, arena), experiments, partial(progress, "trying experiments"))
    ranked = sorted(
        (j for j in judged if isinstance(j, SimulatedExperiment)), key=lambda t: -t.gain
    )
    return ranked, tuple(j for j in judged if isinstance(j, NotRun))


def _judged(arena: Arena, experiment: Experiment) -> SimulatedExperiment | NotRun:
    judge = _discriminating if len(arena.explanations) > 1 else _informative
    try:
        motion = arena.record(arena.explanations[0], experiment)
    except CannotRun as why:
        return NotRun(experiment, str(why), arena.machine.axes[arena.name].units)
    return judge(arena, experiment, motion)


def _discriminating(arena: Arena, experiment: Experiment, motion: Motion) -> SimulatedExperiment:
    """The evidence against the nearest rival, for the explanation that makes it smallest."""
    logs = arena.logs_with(motion)
    axes = [e.axis for e in arena.explanations]
    kept = moving(logs, any(map(sticks, axes)))
    answers = [answer[kept] for answer in arena.answers(logs)]
    forces, bases = [a[:, 0] for a in answers], [orthonormal(a[:, 1:]) for a in answers]
    # The new log was simulated with the first explanation: only its residual there is noise.
    noise = unabsorbed(forces[0], bases[0])
    found = []
    for truth, rival in permutations(range(len(axes)), 2):
        left = unabsorbed(forces[rival] - forces[truth], bases[rival])
        added = len(free_parameters(axes[truth])) - len(free_parameters(axes[rival]))
        found.append((evidence(np.hypot(noise, left), noise, added).delta_bic, left))
    gain, left = min(found, key=lambda pair: pair[0])
    where, quiet = (_on_last(values**2, kept, logs) for values in (left, noise))
    return _simulated(experiment, logs[-1], gain, where, float(np.sqrt(where.mean())), quiet)


def _informative(arena: Arena, experiment: Experiment, motion: Motion) -> SimulatedExperiment:
    """The information on the model's parameters, in nats relative to a prior of 100 % on each.

    Half the log determinant of the information matrix (D-optimal design; A. C. Atkinson,
    A. N. Donev, Optimum Experimental Designs, 1992).
    """
    axis = arena.explanations[0].axis
    where = free_parameters(axis)
    logs = arena.logs_with(motion)
    kept = moving(logs, sticks(axis))
    noise = residual(axis, logs)[kept]
    prior = np.maximum(np.abs(read(axis, where)), [abs(c.parameter.start) for c in where])
    tau = len(noise) / effective_samples(noise)
    columns = jacobian(axis, logs, where, kept) * prior / (rms(noise) * np.sqrt(tau))
    information = np.eye(len(where)) + columns.T @ columns
    leverage = np.sum(columns * np.linalg.solve(information, columns.T).T, axis=1)
    gain = 0.5 * float(np.linalg.slogdet(information)[1])
    seen, quiet = (_on_last(values, kept, logs) for values in (leverage, noise**2))
    return _simulated(experiment, logs[-1], gain, seen, np.nan, quiet)


def _simulated(
    experiment: Experiment, new: PreparedLog, gain: float, where: Array, difference: float,
    quiet: Array,
) -> SimulatedExperiment:  # fmt: skip
    duration = len(new.motion.time) * new.motion.period
    floor = float(np.sqrt(quiet.mean()))
    return SimulatedExperiment(experiment, duration, difference, floor, gain, new, where)


def _on_last(values: Array, kept: NDArray[np.bool_], logs: Sequence[PreparedLog]) -> Array:
    """Values of the test functions that were kept, zero in the others: those of the last log."""
    out = np.zeros(len(kept))
    out[kept] = values
    return out[-len(logs[-1]) :]


def _answer(axis: AxisModel, logs: Sequence[PreparedLog]) -> Array:
    """Residual and Jacobian (n, 1 + k) of an axis on logs."""
    where = free_parameters(axis)
    if not logs:
        return np.zeros((0, 1 + len(where)))
    return np.column_stack([residual(axis, logs), jacobian(axis, logs, where)])


def refitted(
    arena: Arena, simulated: SimulatedExperiment, over: Spread = spread
) -> SimulatedExperiment:
    """The simulated experiment judged by full refits, each explanation in turn being the truth.

    The linear step of `contest` is exact only for small differences; this is exact, and slower.
    With a single explanation the simulated experiment is returned unchanged.
    """
    if len(arena.explanations) < 2:
        return simulated
    judged = over(partial(_if_true, arena, simulated), arena.explanations)
    for cannot in judged:
        if isinstance(cannot, NotRun):
            return replace(simulated, gain=0.0, difference=0.0, not_run=cannot)
    gain, difference = min(j for j in judged if not isinstance(j, NotRun))
    return replace(simulated, gain=gain, difference=difference)


def _if_true(
    arena: Arena, simulated: SimulatedExperiment, truth: Explanation
) -> tuple[float, float] | NotRun:
    try:
        motion = arena.record(truth, simulated.experiment)
    except CannotRun as why:
        return NotRun(simulated.experiment, str(why), simulated.units, truth.name)
    return _beside_rivals(arena, truth, arena.logs_with(motion))


def _beside_rivals(
    arena: Arena, truth: Explanation, logs: tuple[PreparedLog, ...]
) -> tuple[float, float]:
    """Evidence against the nearest rival of a truth, and its difference (N RMS) on the new log."""
    own, found = fit_axis(truth.axis, logs), []
    for rival in (e for e in arena.explanations if e.name != truth.name):
        fit = fit_axis(rival.axis, logs)
        kept = own.kept & fit.kept
        after, before = (residual(f.axis, logs)[kept] for f in (own, fit))
        excess = _on_last(before**2 - after**2, kept, logs).mean()
        added = len(own.scaling.where) - len(fit.scaling.where)
        difference = float(np.sqrt(max(excess, 0.0)))
        found.append((evidence(before, after, added).delta_bic, difference))
    return min(found)
