"""Smoothing of nonparametric effects: penalty rows that are appended to the residual of a fit."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from twin.curve import Part
from twin.model.machine import AxisModel
from twin.model.parameters import ParameterReference

Array = NDArray[np.float64]


def has_nonparametric(axis: AxisModel) -> bool:
    """Whether the axis has a nonparametric effect."""
    return any(f.effect.is_nonparametric for f in axis.effects)


def part_rows(part: Part, effect: str, where: Sequence[ParameterReference]) -> Array:
    """Rows (m, len(where)) of a part at unit stiffness; zero for what is not among ``where``."""
    index = {c.parameter.name: i for i, c in enumerate(where) if c.effect == effect}
    own = [index.get(name) for name in part.strengths]
    rows = part.rows(len(own))
    out = np.zeros((len(rows), len(where)))
    for column, at in zip(rows.T, own, strict=True):
        if at is not None:
            out[:, at] = column
    return out


def smoothing(axis: AxisModel, where: Sequence[ParameterReference], samples: int) -> Array:
    """Penalty rows (m, len(where)), N per unit, weighted for ``samples`` residuals in N."""
    rows = [
        np.sqrt(samples) * f.values[part.stiffness] * part_rows(part, f.effect.name, where)
        for f in axis.effects
        for part in f.effect.parts
    ]
    return np.vstack([np.zeros((0, len(where))), *rows])
