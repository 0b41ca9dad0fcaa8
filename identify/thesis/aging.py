"""A long run of a machine that warms and wears, and what repeated identification sees of it.

The run is cut into logs. On each the friction alone is fitted, as on a machine that is checked from
time to time; its level against the distance travelled shows the drift. The same run is then fitted
as one log with the effects that made the drift.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import datasets
from identify.estimation.fit import Fit, fit_axis
from identify.estimation.intervals import half_widths
from identify.thesis.chapter import Recovered
from identify.thesis.residuals import friction_of
from twin.effect import DRY, DT, IO_SIZE, Kind
from twin.experiments.named import simulate
from twin.log import AxisLog, Log
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.model.parameters import free_parameters
from twin.progress import Progress
from twin.simulator import FineSimulator

Array = NDArray[np.float64]

SURE = 3.0  # standard errors of a slope, from which there is a drift
PART = 10.0  # s, of each log
THINNED = 100  # samples, over which a state hardly changes
AT_ONCE = 1e-12  # s, of a step in which no state moves


@dataclass(frozen=True, eq=False)
class Drift:
    """One parameter of the friction by the distance travelled.

    distance (k,) m. found, half (k,): value and half width of its 90 % interval, in unit. truth
    (k,): the mean of the machine's own value over each log. slope: per m, with its standard error;
    over the second half of the run, where the machine is warm.
    """

    distance: Array
    found: Array
    half: Array
    truth: Array
    unit: str
    slope: tuple[float, float]

    @property
    def detected(self) -> bool:
        """Whether the slope is more than its scatter explains."""
        value, error = self.slope
        return abs(value) > SURE * error


@dataclass(frozen=True, eq=False)
class Aging:
    """level: the dry friction of the machine that ages; steady: of the same machine without.

    planted: parameters of the effects that made the drift, found on the whole run; ratio: error of
    that fit over the noise floor; half: half widths of their 90 % intervals, by the same names.
    """

    level: Drift
    steady: Drift
    planted: dict[str, Recovered]
    ratio: float
    half: Mapping[str, float] = field(default_factory=dict)


def aging(
    model: MachineModel, duration: float, rng: np.random.Generator, progress: Progress
) -> Aging:
    """Run the first axis of a machine for ``duration`` s, and identify it again and again."""
    name, axis = next(iter(model.axes.items()))
    young = replace(axis, effects=tuple(f for f in axis.effects if not _ages(f)))
    drifts = []
    for i, one in enumerate((axis, young)):
        progress("long run", i, 2)
        machine = MachineModel(model.name, {name: one}, model.sample_rate)
        seed = int(rng.integers(2**31))
        log = simulate(machine, "tracking", seed=seed, duration=duration, simulator=FineSimulator)
        drifts.append(_drift(machine, name, young, log))
        if one is axis:
            whole = _whole(machine, name, log)
    planted = {
        f"{f.effect.name}.{p}": Recovered(
            f.values[p], np.array([whole.axis[f.effect.name].values[p]]), f.effect.parameter(p).unit
        )
        for f in axis.effects
        if _ages(f)
        for p in f.values
    }
    where = (f"{c.effect}.{c.parameter.name}" for c in whole.scaling.where)
    half = dict(zip(where, half_widths(whole).tolist(), strict=True))
    kept = {label: half[label] for label in planted if label in half}
    return Aging(drifts[0], drifts[1], planted, whole.ratio, kept)


def _ages(fitted: Fitted) -> bool:
    """Whether it changes the friction by what happened before."""
    return fitted.effect.kind is Kind.MODIFIER and bool(fitted.effect.states)


def _whole(machine: MachineModel, name: str, log: Log) -> Fit:
    """The machine's effects fitted to the whole run, the aging from its start values."""
    axis = machine.axes[name]
    prepared = datasets(machine, {"run": log}, {})[name]
    effects = [
        Fitted.at_start(f.effect, f.effect.starts(prepared.excitation)) if _ages(f) else f
        for f in axis.effects
    ]
    return fit_axis(replace(axis, effects=tuple(effects)), prepared.fit)


def _drift(machine: MachineModel, name: str, young: AxisModel, log: Log) -> Drift:
    """The first dry level of the friction in each part of the run."""
    level = next(p for p in friction_of(young).effect.parameters if p.dry)
    travelled = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(log.truth[name]["position"])))])
    size = round(PART * log.sample_rate)
    rows = []
    for at in range(0, len(log) - size + 1, size):
        part = slice(at, at + size)
        columns = {k: log.axes[name].columns[k][part] for k in ("position", "force")}
        prepared = datasets(machine, {"part": Log(log.sample_rate, {name: AxisLog(columns)})}, {})[
            name
        ]
        fit = fit_axis(young, prepared.fit)
        index = [c.parameter.name for c in free_parameters(fit.axis)].index(level.name)
        found = friction_of(fit.axis).values[level.name]
        rows.append((
            travelled[part].mean(), found, half_widths(fit)[index],
            _true_level(machine.axes[name], log, name, part, level.name),
        ))  # fmt: skip
    distance, found, half, truth = np.array(rows).T
    late = slice(len(distance) // 2, None)
    weight = 1.0 / half[late]
    (slope, _), spread = np.polyfit(distance[late], found[late], 1, w=weight, cov=True)
    error = float(np.sqrt(spread[0, 0]))
    return Drift(distance, found, half, truth, level.unit, (float(slope), error))


def _true_level(axis: AxisModel, log: Log, name: str, part: slice, level: str) -> float:
    """Mean over a part of the run of the level that the machine's friction had."""
    factor = np.ones(part.stop - part.start)
    states = {k: v[part] for k, v in log.truth[name].items()}
    for f in axis.effects:
        if _ages(f):
            factor = factor * _factor(f, states)
    return float(np.mean(friction_of(axis).values[level] * factor))


def _factor(fitted: Fitted, truth: dict[str, Array]) -> Array:
    """What the law makes of a unit of dry friction at the states that were logged."""
    effect = fitted.effect
    logged = np.stack([truth[f"{effect.name}_{state}"] for state in effect.states], axis=1)
    values, out = np.array(fitted.vector()), np.ones(len(logged))
    for k in range(0, len(logged), THINNED):
        io = np.zeros(IO_SIZE)
        io[DRY], io[DT] = 1.0, AT_ONCE
        effect.law(values, logged[k].copy(), io)
        out[k : k + THINNED] = io[DRY]
    return out
