"""The step between an encoder's readings, from the distances between them."""

from __future__ import annotations

import numpy as np

from twin.signals import Array

GAP = 8.0  # ratio of differences between readings that only a resolution leaves empty
WHOLE = 0.15  # of a step, RMS, by which such differences may miss whole steps


def step_of(apart: Array, fewest: int) -> float:
    """Step of which rising distances (n,) m are near whole multiples, or 0."""
    if len(apart) < 2 or fewest < 1:
        return 0.0
    widest = int(np.argmax(apart[1:] / apart[:-1]))
    step = apart[widest + 1]
    if step < GAP * apart[widest] or not fewest <= len(apart) - widest:
        return 0.0
    for reach in (1.5, 4.5, 16.5):
        near = apart[widest + 1 :][apart[widest + 1 :] < reach * step]
        counts = np.rint(near / step)
        step = float(near @ counts / (counts @ counts))
    return step if np.std(near / step - counts) < WHOLE else 0.0
