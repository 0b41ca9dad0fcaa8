"""Chapter "models": every friction of the catalogue fitted to the data of every other.

The thesis compares its frictions by plus and minus (Table 2.1); here each behaviour is measured. A
machine with each friction runs a velocity map, pre-sliding loops with inner loops, forces that rise
and fall at several rates through the break-away, a speed that swings without a reversal (frictional
lag), and a small oscillating force beside a steady one (drift). Every friction is fitted to those
logs together. The loops of its figures 2.6 and 2.7 are drawn from the laws.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from time import process_time

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset, datasets
from identify.dataset.noise_floor import floor_of
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit, error_on, fit_axis
from identify.estimation.prescribed_motion import force_along
from identify.thesis.behaviours import LEG, LOOP, RATE, behaviours, turning
from identify.thesis.chapter import Chapter
from identify.thesis.residuals import friction_of, frictions
from identify.thesis.traits import Traits, traits
from twin.effect import Effect, Excitation, Kind
from twin.effects import Catalogue
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.progress import Progress

Array = NDArray[np.float64]

FORCE_NOISE, READING_NOISE = 1e-3, 1e-9  # N, m
TEST_FUNCTION = 0.02  # s: pre-sliding is fast
NESTED = 1e-3 * np.array([0.0, 1.0, -1.0, 0.6, -0.4, 0.2, 0.0, 0.2, 0.6, 1.0])  # m, two inside
RANDOM = 3.0  # factor to either side of a start value, between which random starts are drawn
RIGHT = 1.2  # of the noise floor, up to which a fit ended right
STEPS = 100_000  # of a law, over which its cost is measured


@dataclass(frozen=True)
class Size:
    """laws: at most, in the order of the catalogue. starts: random ones of each law."""

    laws: int
    starts: int


FULL = Size(100, 8)
SMALL = Size(2, 1)


@dataclass(frozen=True, eq=False)
class Drawn:
    """Friction (n,) N along positions (n,) m, and by how much a loop inside stays open, N."""

    position: Array
    friction: Array
    gap: float


@dataclass(frozen=True, eq=False)
class ModelsResult:
    """The chapter's results for k laws and b behaviours.

    ratios (k, k, b): error over noise floor, by machine, fitted law and behaviour; not a number
    where the machine stands still. right (k,): share of random starts that end right on the law's
    own data. seconds (k,): of a fit, CPU time, the mean over the machines. step (k,): of a law, s.
    loops, nested: by law. traits (k): of each law, as in the thesis's Table 2.1.
    """

    laws: tuple[str, ...]
    behaviours: tuple[str, ...]
    ratios: Array
    right: Array
    seconds: Array
    step: Array
    starts: int
    loops: Mapping[str, Drawn]
    nested: Mapping[str, Drawn]
    traits: Sequence[Traits] = ()

    @property
    def overall(self) -> Array:
        """RMS of the ratios over the behaviours (k, k), by machine and fitted law."""
        return overall(self.ratios)

    @property
    def usual(self) -> Array:
        """Median over the other machines of the ratios of a law (k, b), by law and behaviour."""
        k = len(self.laws)
        others = [self.ratios[np.arange(k) != i, i] for i in range(k)]
        return np.array([[_median(column) for column in ratios.T] for ratios in others])

    @property
    def own(self) -> Array:
        """Overall ratio (k,) of each law on its own machine."""
        return np.diag(self.overall)


def _median(values: Array) -> float:
    """Of those that are numbers; not a number where none is."""
    known = values[np.isfinite(values)]
    return float(np.median(known)) if len(known) else float("nan")


def overall(ratios: Array) -> Array:
    """RMS of ratios (..., b) over the behaviours in which the machine moves."""
    return np.asarray(np.sqrt(np.nanmean(ratios**2, axis=-1)))


def run(
    models: Sequence[MachineModel],
    catalogue: Catalogue,
    size: Size,
    rng: np.random.Generator,
    progress: Progress,
) -> ModelsResult:
    """Plant each friction in the first axis of a machine, and fit every other to its logs."""
    (model,) = models
    name, axis = next(iter(model.axes.items()))
    laws = list(frictions(catalogue).values())[: size.laws]
    known = friction_of(axis).values
    machines = [replace(axis, effects=(_like(effect, known),)) for effect in laws]
    ratios, seconds, right, shown = [], [], [], []
    for i, machine in enumerate(machines):
        progress("frictions fitted to each other", i, len(laws))
        stage = _noisy(model, name, machine)
        logs = behaviours(stage, rng)
        shown.append(traits(stage, logs, rng))
        dataset = datasets(stage, logs, {}, TEST_FUNCTION)[name]
        row = [_timed(machine, effect, dataset) for effect in laws]
        fits = [fit for fit, _ in row]
        ratios.append([_by_log(fit, tuple(logs)) for fit in fits])
        seconds.append([spent for _, spent in row])
        right.append(_share_right(machine, laws[i], dataset, size.starts, rng))
    return ModelsResult(
        laws=tuple(effect.name for effect in laws),
        behaviours=tuple(logs),
        ratios=np.array(ratios),
        right=np.array(right),
        seconds=np.mean(seconds, axis=0),
        step=np.array([_cost(machine) for machine in machines]),
        starts=size.starts,
        loops={e.name: _drawn(m, LOOP) for e, m in zip(laws, machines, strict=True)},
        nested={e.name: _drawn(m, NESTED) for e, m in zip(laws, machines, strict=True)},
        traits=shown,
    )


def _like(effect: Effect, known: Mapping[str, float]) -> Fitted:
    """The effect with the values that are known of another friction, by the parameters' names.

    What is fixed is a shape of the law, whose name may mean another thing there.
    """
    free = [p.name for p in effect.parameters if not p.fixed]
    return Fitted.at_start(effect, {name: known[name] for name in free if name in known})


def _noisy(model: MachineModel, name: str, axis: AxisModel) -> MachineModel:
    hardware = replace(
        axis.hardware, encoder_noise=READING_NOISE, force_constant=1.0, current_noise=FORCE_NOISE
    )
    return MachineModel(model.name, {name: replace(axis, hardware=hardware)}, RATE)


def _begun(axis: AxisModel, effect: Effect, excitation: Excitation) -> AxisModel:
    """The axis with that friction at its start values, nothing else free."""
    fitted = Fitted.at_start(effect, effect.starts(excitation))
    return replace(axis, effects=(fitted,), mass_fixed=True)


def _timed(axis: AxisModel, effect: Effect, dataset: Dataset) -> tuple[Fit, float]:
    start = process_time()
    fit = fit_axis(_begun(axis, effect, dataset.excitation), dataset.fit)
    return fit, process_time() - start


def _by_log(fit: Fit, names: Sequence[str]) -> list[float]:
    """Error over noise floor on each log; not a number for one in which the axis stands still."""
    found = {
        log.motion.name: rms(error_on(fit.axis, [log])) / floor_of(fit.axis, [log])
        for log in fit.logs
    }
    return [found.get(name, float("nan")) for name in names]


def _share_right(
    axis: AxisModel, effect: Effect, dataset: Dataset, starts: int, rng: np.random.Generator
) -> float:
    """Share of random starts from which the law's own data are fitted to the noise floor."""
    begun = _begun(axis, effect, dataset.excitation)
    (fitted,) = begun.effects
    ended, names = [], [log.motion.name for log in dataset.fit]
    for _ in range(starts):
        values = dict(fitted.values)
        for p in effect.parameters:
            if p.name not in fitted.fixed and p.lower < p.upper:
                drawn = values[p.name] * RANDOM ** rng.uniform(-1.0, 1.0)
                least = values[p.at_least] if p.at_least else p.lower
                values[p.name] = float(np.clip(drawn, least, p.upper))
        start = replace(begun, effects=(replace(fitted, values=values),))
        ended.append(overall(np.array(_by_log(fit_axis(start, dataset.fit), names))) <= RIGHT)
    return float(np.mean(ended))


def _cost(axis: AxisModel) -> float:
    """CPU time of a step of the axis' friction, s."""
    velocity = 0.01 * np.sin(2.0 * np.pi * np.arange(STEPS) / RATE)
    position = np.cumsum(velocity) / RATE
    start = process_time()
    force_along(axis, position, velocity, 1.0 / RATE, Kind.FRICTION)
    return (process_time() - start) / STEPS


def _drawn(axis: AxisModel, turns: Array) -> Drawn:
    """Friction along positions from turn to turn.

    The gap is that between the two passes of the last turn that is visited again.
    """
    position = turning(turns)
    velocity = np.diff(position, append=position[-1]) * RATE
    friction = -force_along(axis, position, velocity, 1.0 / RATE, Kind.FRICTION)
    ends = {float(turn): k * round(LEG * RATE) - 1 for k, turn in enumerate(turns) if k}
    again = [
        (k * round(LEG * RATE) - 1, ends[float(turn)])
        for k, turn in enumerate(turns[:-1])
        if k and ends[float(turn)] != k * round(LEG * RATE) - 1 and abs(turn) < np.max(turns)
    ]
    gap = max(abs(float(friction[a] - friction[b])) for a, b in again)
    return Drawn(position, friction, gap)


CHAPTER = Chapter(("thesis_simulation",), FULL, SMALL, run)
