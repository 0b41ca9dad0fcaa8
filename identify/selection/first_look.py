"""A first answer: what the beginning of a log makes most likely, before all logs are read.

Of each effect one linear step beside a fit of the first seconds of one log. It proves nothing, and
the diagnosis may end otherwise: no other log has judged it, and nothing was refitted.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from identify.dataset.preparation import datasets
from identify.estimation.fit import fit_axis
from identify.estimation.variable_projection import absent_effects
from identify.rules import RULE
from identify.selection.acceptance import Judged
from identify.selection.changes import Added
from identify.selection.controls import ControlTest
from identify.selection.nonparametric import physics_alone
from twin.effects import Catalogue, load_catalogue
from twin.logs import read_log
from twin.model.machine import MachineModel
from twin.parallel import parallel, spread

BEGINNING = 8.0  # s of a log: some moves, read and searched in a second
ALIKE = 0.9  # of what the most promising effect takes, from which another is as likely


@dataclass(frozen=True)
class Likely:
    """What the beginning of a log says of an axis.

    effects: the most likely ones, the best first; none where the error is at its noise floor, or
    none takes enough. part: of the squared error above the floor that the best takes. ratio: of the
    error to its noise floor.
    """

    axis: str
    effects: tuple[str, ...]
    part: float
    ratio: float


@parallel()
def first_look(
    model: MachineModel, log: str | Path, *, catalogue: Catalogue | None = None
) -> tuple[Likely, ...]:
    """What the first 8 s of a log make most likely on each axis that moves there.

    Of a mechanism nothing, as its joints are decided together. Raises InputError where these
    seconds tell no fit.
    """
    known = load_catalogue() if catalogue is None else catalogue
    model = physics_alone(model)
    if model.joints:
        return ()
    begun = read_log(log, truth=False, stop=BEGINNING)
    out = []
    for axis, dataset in datasets(model, {str(log): begun}, {}).items():
        judged = Judged(fit_axis(model.axes[axis], dataset.training), dataset)
        promises = {} if judged.fit.at_floor else _promises(judged, known)
        best = max(promises.values(), default=0.0)
        level = max(ALIKE * best, RULE.least_part)
        likely = sorted((n for n in promises if promises[n] >= level), key=lambda n: -promises[n])
        out.append(Likely(axis, tuple(likely), best, judged.fit.ratio))
    return tuple(out)


def _promises(judged: Judged, known: Catalogue) -> dict[str, float]:
    """By effect that the axis lacks, the part that one linear step takes."""
    test = ControlTest.beside(judged)
    lacking = [e for e in absent_effects(judged.fit.axis, known) if not e.is_noise]
    screened = spread(lambda e: Added(e).screen(judged, test), lacking)
    return {k.change.name: min(k.promise, 1.0) for k in screened}
