"""Explanations of an axis, from effects, models and logs: what a plan decides between."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.candidates import try_effect
from identify.contest import Explanation
from identify.fit import fit_axis
from identify.noise import floor_of
from identify.planting import strength_for
from identify.residual import residual
from identify.search import fit_thoroughly
from identify.search import starts as start_values
from identify.study import Study, studies
from twin.effect import Effect, Kind
from twin.errors import InputError
from twin.experiment_kinds import Tracking
from twin.experiments import simulate
from twin.log import Log
from twin.model import AxisModel, Fitted, StageModel
from twin.simulator import ReducedStage

Array = NDArray[np.float64]

STRENGTH = 10.0  # times the noise floor: force of an effect of which there are no data
TRIAL = 10.0  # s of simulated tracking on which such an effect is given that force

Rival = Effect | StageModel


def trial_study(stage: StageModel, axis: str) -> Study:
    """A study of simulated random moves of the model itself, where there are no logs."""
    log: Mapping[str, Log] = {"trial": simulate(stage, Tracking(TRIAL), seed=0, stage=ReducedStage)}
    return studies(stage, log, {})[axis]


def explained(
    rivals: Sequence[Rival], stage: StageModel, study: Study, fitted: bool
) -> tuple[Explanation, ...]:
    """Each rival as an explanation of the study's axis.

    An effect is added to the stage's axis without the others; a model gives its axis. fitted: to
    refit them on the study's logs. Otherwise an effect takes start values, with strengths that give
    STRENGTH times the noise floor. Raises InputError where a model lacks the axis.
    """
    own = stage.axis(study.axis)
    names = {r.name for r in rivals if isinstance(r, Effect)}
    base = replace(own, effects=tuple(f for f in own.effects if f.effect.name not in names))
    fit = fit_thoroughly(base, study) if fitted else None
    out = []
    for rival in rivals:
        if isinstance(rival, StageModel):
            axis = replace(rival.axis(study.axis), hardware=own.hardware)
            out.append(
                Explanation(rival.name, fit_thoroughly(axis, study).axis if fitted else axis)
            )
        elif fit is not None:
            out.append(Explanation(rival.name, try_effect(fit, study, rival).fit.axis))
        elif rival.name in own.names:
            out.append(Explanation(rival.name, base.with_effect(own[rival.name])))
        else:
            out.append(Explanation(rival.name, _supposed(rival, base, study)))
    return tuple(out)


def _supposed(effect: Effect, axis: AxisModel, study: Study) -> AxisModel:
    """The axis with the effect at start values and a force above the noise; a friction fitted."""
    if effect.kind is Kind.FRICTION:
        base = fit_axis(axis, study.fit)
        return fit_axis(
            axis.with_effect(start_values(base, study, effect)[0].fitted), study.fit
        ).axis
    floor = floor_of(axis, study.fit)
    without = residual(axis, study.fit)

    def added(fitted: Fitted) -> Array:
        return residual(axis.with_effect(fitted), study.fit) - without

    starts = effect.starts(study.excitation)
    return axis.with_effect(strength_for(effect, added, STRENGTH * floor, starts))


def differing_axis(rivals: Sequence[Rival], stage: StageModel) -> str:
    """The first axis on which models among the rivals differ; the stage's first otherwise."""
    models = [r for r in rivals if isinstance(r, StageModel)]
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
