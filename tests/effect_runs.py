"""The catalogue that the tests share, and the stage with all of it."""

from __future__ import annotations

import numpy as np

from twin.effect import Excitation, Kind
from twin.effects import load_catalogue
from twin.excitation import Repeating
from twin.laws.trials import moderate
from twin.model.machine import Fitted, MachineModel

CATALOGUE = load_catalogue()
FRICTIONS = tuple(e for e in CATALOGUE.values() if e.kind is Kind.FRICTION)
LOG = Excitation(
    position_low=-0.13, position_high=0.21, speed_max=0.37, dry_level=0.83, duration=47.0,
    period=2.5e-4, force_max=11.0, repeats=Repeating((53.0, 17.0)), ripples=(3.1e-5, 1.7e-5),
    resolution=2.3e-7, other_joints=(1.0, 2.0), force_usual=2.9, speed_least=3.7e-4,
    shortest=1.1e-7,
)  # fmt: skip


def with_all(model: MachineModel, rng: np.random.Generator) -> MachineModel:
    """The stage with every effect of the catalogue on every axis, save that it keeps its friction.

    Each acts with about 0.1 N.
    """
    for name, axis in model.axes.items():
        for effect in CATALOGUE.values():
            if effect.kind is not Kind.FRICTION and not effect.channels:
                axis = axis.with_effect(Fitted.at_start(effect, moderate(effect, rng, 0.1)))
        model = model.with_axis(name, axis)
    return model
