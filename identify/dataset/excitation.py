"""What the motions of one axis cover; effects derive start values and scans from it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.dataset.motion import Motion
from identify.dataset.spectral_lines import lines, ripples
from twin.effect import Excitation


def excitation(motions: Sequence[Motion], travel: tuple[float, float] | None) -> Excitation:
    """What the motions of one axis cover together; ``travel`` (m) of the axis where it is known."""
    position = np.concatenate(
        [m.position for m in motions] + ([np.array(travel)] if travel else [])
    )
    velocity = np.concatenate([m.velocity for m in motions])
    command = np.concatenate([m.command for m in motions])
    fast = 0.02 * np.abs(velocity).max()
    ahead, behind = command[velocity > fast], command[velocity < -fast]
    if len(ahead) and len(behind):
        gap = np.median(ahead) - np.median(behind)
    else:
        gap = 2.0 * np.median(np.abs(command))
    return Excitation(
        position_low=float(position.min()),
        position_high=float(position.max()),
        speed_max=float(np.abs(velocity).max()),
        dry_level=float(max(abs(gap) / 2.0, 1e-9)),
        duration=float(sum(len(m.time) * m.period for m in motions)),
        period=motions[0].period,
        force_max=float(np.abs(command).max()),
        lines=lines(motions),
        ripples=ripples(motions),
        resolution=max(m.resolution for m in motions),
    )
