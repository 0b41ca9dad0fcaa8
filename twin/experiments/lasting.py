"""An experiment that lasts as long as was asked: repeats that fit, rests that fill the time."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from twin.errors import CannotRun
from twin.experiments.experiment import Experiment, OneAxis
from twin.experiments.kinds import Rests, Staircase, Steps
from twin.model.machine import MachineModel
from twin.numbers import neat

LEAST_DWELL = 0.02  # s, to which rests are shortened where the moves need the time
MOST_HALVINGS = 10  # of the plateaus of a staircase
ALLOWED = 0.05  # part of what was asked by which the length may be off

Kind = TypeVar("Kind", bound=Experiment)
Length = Callable[[Experiment], float]


def lasting(draft: Kind, model: MachineModel, seconds: float) -> Kind:
    """The experiment, filling that time (s); as it is where it cannot run, or takes longer.

    Where its moves alone take longer it is as short as it can be.
    """

    def length(experiment: Experiment) -> float:
        return experiment.setpoint(model, np.random.default_rng(0)).duration

    other = draft.other if isinstance(draft, OneAxis) else 0.0
    given: Any = draft
    alone = replace(given, other=0.0) if other else given
    try:
        found = _filled(_fitted(alone, seconds, length), seconds, length)
    except CannotRun:
        return draft
    return replace(found, other=other) if other else found


def missed(asked: float, lasts: float) -> str | None:
    """A sentence where an experiment does not last what was asked (both s)."""
    if abs(lasts - asked) <= ALLOWED * asked:
        return None
    why = "it has no rests to be filled with"
    if lasts > asked:
        why = "its moves take that long within the limits of the machine"
    return f"the experiment lasts {lasts:.3g} s, not {asked:.3g} s as asked: {why}"


def _fitted(draft: Any, seconds: float, length: Length) -> Any:
    """With as many repeats, or as long plateaus, as take no longer than that."""
    if hasattr(draft, "repeats"):
        once, twice = (length(replace(draft, repeats=n)) for n in (1, 2))
        more = math.floor((seconds - once) / (twice - once) * (1.0 + 1e-9))
        return replace(draft, repeats=1 + max(more, 0))
    if isinstance(draft, Steps):
        while length(draft) > seconds and len(draft.efforts) > 1:
            draft = replace(draft, efforts=draft.efforts[:-1])
    if isinstance(draft, Staircase):
        for _ in range(MOST_HALVINGS):
            if length(draft) <= seconds:
                break
            draft = replace(draft, longest_plateau=neat(0.5 * draft.longest_plateau))
    return draft


def _filled(draft: Any, seconds: float, length: Length) -> Any:
    """With its rests longer, or shorter, by what is left of the time."""
    now = length(draft)
    if isinstance(draft, Rests):
        longer = length(replace(draft, rests=tuple(2.0 * rest for rest in draft.rests))) - now
        factor = max(1.0 + (seconds - now) / longer, 0.05)
        return replace(draft, rests=tuple(neat(factor * rest) for rest in draft.rests))
    if not hasattr(draft, "dwell") or hasattr(draft, "duration"):
        return draft
    longer = length(replace(draft, dwell=draft.dwell + 1.0)) - now  # s for each s of rest
    dwell = draft.dwell + (seconds - now) / longer
    return replace(draft, dwell=neat(max(dwell, min(LEAST_DWELL, draft.dwell or LEAST_DWELL))))
