"""The force of the cable slab from passes in both directions, spikes kept out.

Local polynomials with Gaussian weights (the thesis smooths with a Gaussian) through
-(F_pos + F_neg)/2, where no spike is. The smoothing is linear, so the scatter of the smoothed
pairs of passes gives the band of their mean.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.dataset.prepared_log import PreparedLog
from identify.estimation.intervals import CONFIDENCE
from identify.estimation.passes import Passes, passes, smoother
from identify.estimation.spikes import Pitch, Spike, find_spikes, pitch_of
from twin.model.machine import AxisModel

Array = NDArray[np.float64]

MARGIN = 0.25  # of a spike's width, that is kept out on either side of it


@dataclass(frozen=True, eq=False)
class CableForce:
    """What passes tell of the force of position.

    position (k,) m. force, band (k,) N: the cable's, and the half width of its 90 % band. with_all
    (k,) N: the same with the spikes left in. kept (k,): where no spike is. pitch: None where fewer
    than three spikes are found.
    """

    passes: Passes
    force: Array
    band: Array
    with_all: Array
    kept: NDArray[np.bool_]
    spikes: tuple[Spike, ...]
    pitch: Pitch | None

    @property
    def position(self) -> Array:
        """(k,) m."""
        return self.passes.position


def cable_force(axis: AxisModel, logs: Sequence[PreparedLog]) -> CableForce:
    """The force of the cable from logs of passes; only the mass of the axis is used.

    Raises InputError where there are fewer than two passes each way.
    """
    found = passes(axis, logs)
    spikes = find_spikes(found)
    kept = np.ones(len(found.position), dtype=bool)
    for spike in spikes:
        kept &= np.abs(found.position - spike.centre) > (0.5 + MARGIN) * spike.width
    ends = np.flatnonzero(kept)
    between = slice(ends[0], ends[-1] + 1)  # beyond a spike at the end nothing is known
    found, kept = found.part(between), kept[between]
    from scipy.special import stdtrit  # no fit needs it

    smoothed = found.alike @ smoother(found.position, kept).T
    count = len(smoothed)
    quantile = stdtrit(count - 1, 0.5 + CONFIDENCE / 2.0)
    everywhere = smoother(found.position, np.ones_like(kept))
    return CableForce(
        passes=found,
        force=smoothed.mean(axis=0),
        band=quantile * smoothed.std(axis=0, ddof=1) / np.sqrt(count),
        with_all=everywhere @ found.alike.mean(axis=0),
        kept=kept,
        spikes=spikes,
        pitch=pitch_of(spikes),
    )
