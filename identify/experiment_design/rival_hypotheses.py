"""Explanations of an axis, from effects, models and logs: what a plan decides between."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Dataset, datasets
from identify.dataset.noise_floor import floor_of
from identify.estimation.fit import fit_axis
from identify.estimation.force_balance import residual
from identify.estimation.variable_projection import fit_thoroughly
from identify.estimation.variable_projection import starts as start_values
from identify.experiment_design.discrimination import Explanation
from identify.experiment_design.planting import strength_for
from identify.selection.candidates import try_effect
from twin.effect import Effect, Kind
from twin.errors import InputError
from twin.experiments.kinds import Tracking
from twin.experiments.named import simulate
from twin.log import Log
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.simulator import ReducedSimulator

Array = NDArray[np.float64]

STRENGTH = 10.0  # times the noise floor: force of an effect of which there are no data
TRIAL = 10.0  # s of simulated tracking on which such an effect is given that force

Rival = Effect | MachineModel


def trial_dataset(stage: MachineModel, axis: str) -> Dataset:
    """A dataset of simulated random moves of the model itself, where there are no logs."""
    log: Mapping[str, Log] = {
        "trial": simulate(stage, Tracking(TRIAL), seed=0, simulator=ReducedSimulator)
    }
    return datasets(stage, log, {})[axis]


def explained(
    rivals: Sequence[Rival], stage: MachineModel, dataset: Dataset, fitted: bool
) -> tuple[Explanation, ...]:
    """Each rival as an explanation of the dataset's axis.

    An effect is added to the stage's axis without the others; a model gives its axis. fitted: to
    refit them on the dataset's logs. Otherwise an effect takes start values, with strengths that
    give STRENGTH times the noise floor. Raises InputError where a model lacks the axis.
    """
    own = stage.axis(dataset.axis)
    names = {r.name for r in rivals if isinstance(r, Effect)}
    base = replace(own, effects=tuple(f for f in own.effects if f.effect.name not in names))
    fit = fit_thoroughly(base, dataset) if fitted else None
    out = []
    for rival in rivals:
        if isinstance(rival, MachineModel):
            axis = replace(rival.axis(dataset.axis), hardware=own.hardware)
            out.append(
                Explanation(rival.name, fit_thoroughly(axis, dataset).axis if fitted else axis)
            )
        elif fit is not None:
            out.append(Explanation(rival.name, try_effect(fit, dataset, rival).fit.axis))
        elif rival.name in own.names:
            out.append(Explanation(rival.name, base.with_effect(own[rival.name])))
        else:
            out.append(Explanation(rival.name, _supposed(rival, base, dataset)))
    return tuple(out)


def _supposed(effect: Effect, axis: AxisModel, dataset: Dataset) -> AxisModel:
    """The axis with the effect at start values and a force above the noise; a friction fitted."""
    if effect.kind is Kind.FRICTION:
        base = fit_axis(axis, dataset.fit)
        return fit_axis(
            axis.with_effect(start_values(base, dataset, effect)[0].fitted), dataset.fit
        ).axis
    floor = floor_of(axis, dataset.fit)
    without = residual(axis, dataset.fit)

    def added(fitted: Fitted) -> Array:
        return residual(axis.with_effect(fitted), dataset.fit) - without

    starts = effect.starts(dataset.excitation)
    return axis.with_effect(strength_for(effect, added, STRENGTH * floor, starts))


def differing_axis(rivals: Sequence[Rival], stage: MachineModel) -> str:
    """The first axis on which models among the rivals differ; the stage's first otherwise."""
    models = [r for r in rivals if isinstance(r, MachineModel)]
    for name in stage.axes:
        axes = [m.axis(name) for m in models]
        if any(a.effects != axes[0].effects or a.mass != axes[0].mass for a in axes[1:]):
            return name
    return next(iter(stage.axes))


def require_different(rivals: Sequence[Rival]) -> None:
    """Raise InputError where two rivals are one."""
    names = [r.name for r in rivals]
    if len(set(names)) < len(names):
        raise InputError(f"{names[0]} against itself: give two different explanations")
