"""Chapter "future": what the thesis leaves to future work, as far as the twin can tell.

The number of elements of a friction with memory is chosen by the data. Nonparametric forces beside
LuGre are judged against physics on a log on which nothing was decided. Friction near zero speed is
read from moves that end before the bristles settle, and from the whole law. A long run warms and
wears the machine (identify.thesis.aging). Mixtures of two frictions are fitted to that machine, and
to one whose friction is a mixture (identify.thesis.mixtures).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset, datasets
from identify.dataset.motion import motion_of
from identify.estimation.evidence import evidence, rms
from identify.estimation.fit import Fit, error_on, fit_axis
from identify.estimation.velocity_map import velocity_map
from identify.selection.nonparametric import fit_nonparametric
from identify.thesis.aging import Aging, aging
from identify.thesis.chapter import Chapter
from identify.thesis.mixed_friction import mixed
from identify.thesis.mixtures import EQUAL, Mixture, mixture
from identify.thesis.residuals import friction_of
from identify.thesis.track import steady_friction
from twin.effect import ELEMENTS
from twin.effects import Catalogue
from twin.experiments.kinds import Staircase
from twin.experiments.named import simulate
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.progress import Progress
from twin.simulator import FineSimulator

Array = NDArray[np.float64]

RATE = 1000.0  # Hz
ELEMENT_COST = 1  # parameters that an element counts as
SLOW_SPAN = 0.01  # m, of the moves near zero speed


@dataclass(frozen=True)
class Size:
    """duration: s of each log. elements: tried. slow: speeds, m/s. plateau, run: s."""

    duration: float
    elements: Sequence[int]
    slow: Sequence[float]
    plateau: float
    run: float


FULL = Size(
    20.0, tuple(range(1, 9)), (1e-5, 3e-5, 1e-4, 3e-4, 1e-3), plateau=60.0, run=600.0
)  # fmt: skip
SMALL = Size(6.0, (1, 4), (3e-4, 1e-3), plateau=5.0, run=60.0)


@dataclass(frozen=True)
class Elements:
    """One number of elements: evidence over the first that was tried, test error over the floor."""

    count: int
    delta_bic: float
    over_floor: float


@dataclass(frozen=True)
class Beside:
    """What was added to, or put in place of, the first friction, and the errors with it, N RMS."""

    name: str
    parameters: int
    held_out: float
    test: float


@dataclass(frozen=True, eq=False)
class Slow:
    """Friction (k,) N at speeds (k,) m/s: planted, by the map, and by the whole law fitted."""

    speed: Array
    planted: Array
    mapped: Array
    fitted: Array


@dataclass(frozen=True, eq=False)
class FutureResult:
    """The chapter's results. planted: elements of the machine. floor: N, of the test log.

    mixtures: on the machine with elements, and on one whose friction is a mixture.
    """

    elements: Sequence[Elements]
    planted: int
    beside: Sequence[Beside]
    floor: float
    slow: Slow
    aging: Aging
    mixtures: Sequence[Mixture] = ()

    @property
    def chosen(self) -> Elements:
        """The number with the largest evidence."""
        return max(self.elements, key=lambda e: e.delta_bic)


def run(
    models: Sequence[MachineModel],
    catalogue: Catalogue,
    size: Size,
    rng: np.random.Generator,
    progress: Progress,
) -> FutureResult:
    """Models: with a friction of elements; the first friction; for slow moves; one that ages."""
    memory, stage, slow, old = models
    memory = replace(memory, sample_rate=RATE)
    name, axis = next(iter(memory.axes.items()))
    dataset, test = _recorded(memory, name, size, rng, progress)
    counted = _elements(axis, dataset, size, progress)
    elements, physics = _compared(size.elements, counted, test)
    first = friction_of(next(iter(stage.axes.values())))
    base = fit_axis(axis.with_effect(first), dataset.fit)
    tried = [(first.effect.name, base, 0)]
    for effect in (e for e in catalogue.values() if e.is_nonparametric):
        progress("data-driven residuals", len(tried), 3)
        fit = fit_nonparametric(base, dataset, effect).fit
        tried.append((effect.name, fit, len(fit.scaling.where) - len(base.scaling.where)))
    tried.append((friction_of(axis).effect.name, physics, 0))
    return FutureResult(
        elements=elements,
        planted=int(friction_of(axis).values[ELEMENTS]),
        beside=[
            Beside(n, more, rms(error_on(f.axis, dataset.holdout)), rms(error_on(f.axis, test.fit)))
            for n, f, more in tried
        ],
        floor=physics.floor,
        slow=_slow(slow, size, rng, progress),
        aging=aging(old, size.run, rng, progress),
        mixtures=[
            mixture(axis, dataset, test, counted),
            _of_a_mixture(memory, name, first, size, rng, progress),
        ],
    )


def _recorded(
    machine: MachineModel, name: str, size: Size, rng: np.random.Generator, progress: Progress
) -> tuple[Dataset, Dataset]:
    """Two logs to fit and one held out; and one on which nothing is decided."""
    logs = {}
    for i in range(4):
        progress("logs of the machine", i, 4)
        logs[f"log {i + 1}"] = simulate(
            machine, "tracking", seed=int(rng.integers(2**31)), duration=size.duration,
            simulator=FineSimulator,
        )  # fmt: skip
    apart = {"log 4": logs.pop("log 4")}
    held = {"log 3": logs.pop("log 3")}
    dataset = datasets(machine, logs, held)[name]
    return dataset, datasets(machine, apart, {}, dataset.test_function_length)[name]


def _elements(axis: AxisModel, dataset: Dataset, size: Size, progress: Progress) -> list[Fit]:
    """A fit with each number of elements."""
    effect, fits = friction_of(axis).effect, []
    for i, count in enumerate(size.elements):
        progress("numbers of elements", i, len(size.elements))
        start = {**effect.starts(dataset.excitation), ELEMENTS: float(count)}
        known = {p.name for p in effect.of_size(count).parameters} if effect.of_size else set()
        own = {k: v for k, v in start.items() if k in known}
        fits.append(fit_axis(axis.with_effect(Fitted.at_start(effect, own)), dataset.fit))
    return fits


def _compared(
    counts: Sequence[int], fits: Sequence[Fit], test: Dataset
) -> tuple[list[Elements], Fit]:
    """Each number of elements, and the fit with the one that the evidence chooses."""
    first = fits[0]
    found = [
        Elements(
            count,
            evidence(first.residual, fit.residual, ELEMENT_COST * (count - counts[0])).delta_bic,
            rms(error_on(fit.axis, test.fit)) / fit.floor,
        )
        for count, fit in zip(counts, fits, strict=True)
    ]
    best = max(range(len(found)), key=lambda i: found[i].delta_bic)
    return found, fits[best]


def _of_a_mixture(
    machine: MachineModel,
    name: str,
    other: Fitted,
    size: Size,
    rng: np.random.Generator,
    progress: Progress,
) -> Mixture:
    """The machine with its friction and another in equal parts."""
    axis = machine.axes[name]
    own = friction_of(axis)
    made = axis.with_effect(mixed(own.values, other.values, EQUAL))
    dataset, test = _recorded(machine.with_axis(name, made), name, size, rng, progress)
    counted = _elements(axis, dataset, size, progress)
    progress("mixtures", 1, 2)
    return mixture(made, dataset, test, counted)


def _slow(model: MachineModel, size: Size, rng: np.random.Generator, progress: Progress) -> Slow:
    """Friction at speeds near zero on the first axis."""
    model = replace(model, sample_rate=RATE)
    name, axis = next(iter(model.axes.items()))
    maps, logs = [], {}
    for i, speed in enumerate(size.slow):
        progress("near zero speed", i, len(size.slow))
        moves = Staircase(name, speeds=(speed,), span=SLOW_SPAN, longest_plateau=size.plateau)
        log = simulate(model, moves, seed=int(rng.integers(2**31)), simulator=FineSimulator)
        motion = motion_of(log, name, f"{speed:g} m/s", ripples=())  # a simulated reading has none
        found = velocity_map(axis, motion).towards(1.0)
        maps.append(float(found.friction.mean()))
        logs[f"{speed:g} m/s"] = log
    prepared = datasets(model, logs, {})[name]
    effect = friction_of(axis).effect
    begun = Fitted.at_start(effect, effect.starts(prepared.excitation))
    fit = fit_axis(axis.with_effect(begun), prepared.fit)
    planted, fitted = (
        np.array([steady_friction(a, 0.0, v) for v in size.slow]) for a in (axis, fit.axis)
    )
    return Slow(np.array(size.slow), planted, np.array(maps), fitted)


CHAPTER = Chapter(
    ("thesis_memory", "proton_xy", "thesis_simulation", "thesis_aging"), FULL, SMALL, run
)
