"""Whether a free curve, found later, can make the force of a law before it, or has emptied it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from identify.estimation.evidence import rms
from identify.estimation.force_balance import averaged_force
from identify.estimation.least_squares import unabsorbed
from identify.rules import RULE
from identify.selection.acceptance import Judged
from identify.selection.changes import Change, Reshaped
from twin.curve import Coordinate
from twin.effect import Effect


def is_held(change: Change, last: Change, without: Judged, fit: Judged) -> bool:
    """Whether the last change is a free curve that tells nothing against one before it.

    Without that change the curve can make its force all the same, over what its law depends on. A
    law that depends on more, as on another joint, is not shown to be it where the curve does.
    """
    if not isinstance(last, Reshaped) or not _shows(last.shape.curve.over, change.effect):
        return False
    own = np.concatenate(change.columns(without, fit)[0](without.dataset.training))[
        without.fit.kept
    ]
    return bool(np.sum(unabsorbed(own, without.fit.basis) ** 2) < RULE.least_fall * np.sum(own**2))


def has_collapsed(change: Change, accepted: Judged, fit: Judged) -> bool:
    """Whether little is left of a law, of what it had as it was accepted: it stood for others."""

    def size(one: Judged) -> float:
        laws = tuple(f for f in one.fit.axis.effects if f.effect.name == change.name)
        return rms(averaged_force(replace(one.fit.axis, effects=laws), fit.fit.logs))

    return size(fit) < RULE.collapse * size(accepted)


def _shows(over: Coordinate, law: Effect) -> bool:
    """Whether a curve over that coordinate shows all that a law depends on."""
    elsewhere = law.of_joints or law.reads_other_axis or law.channels or law.reads("TIME")
    return not elsewhere and (over is Coordinate.POSITION or not law.reads("X"))
