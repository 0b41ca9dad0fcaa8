"""What bends the curve of a law: a parameter that a model holds by design, such as an exponent.

Set free, it is one number more where a free curve has ten, so that a far smaller difference shows.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

from identify.dataset.dataset import Dataset
from identify.estimation.fit import Fit, fit_axis
from identify.selection.scoring import Candidate, score
from twin.model.machine import Fitted

SAME = 0.1  # relative distance from its value by design at which a law is still itself


@dataclass(frozen=True)
class Bend:
    """A parameter of a law, held by design, with which its curve comes nearest to the one found.

    held, found: in ``unit``.
    """

    parameter: str
    held: float
    found: float
    unit: str

    @property
    def differs(self) -> bool:
        """Whether the law found is another than the one that is held."""
        return abs(self.found - self.held) > SAME * abs(self.held)


def bend_of(law: Fitted) -> Bend | None:
    """What bends a fitted law, where it was set free though the effect holds it by design."""
    for name in _bends(law):
        held = law.effect.parameter(name)
        if name not in law.fixed:
            return Bend(name, held.start, law.values[name], held.unit)
    return None


def held_bends(law: Fitted) -> tuple[str, ...]:
    """Names of the parameters that would bend the curves of a fitted law, and are held."""
    return tuple(name for name in _bends(law) if name in law.fixed)


def bent(fit: Fit, dataset: Dataset, law: Fitted, bend: str) -> Candidate:
    """The fit with what bends one of its laws free, and what speaks for that."""
    free = replace(law, fixed=law.fixed - {bend})
    return score(fit, fit_axis(fit.axis.with_effect(free), dataset.fit), dataset, law.effect)


def is_needed(with_bend: Candidate, fit: Fit) -> bool:
    """Whether the data ask for a bend: as for an effect, or beyond doubt if held-out logs agree.

    One more number of a law that is there cannot imitate much else, and blocks of the held-out logs
    differ by what is left of other laws.
    """
    agreed = with_bend.is_beyond_doubt and with_bend.plausible and with_bend.gain.falls
    return agreed or with_bend.is_added_to(fit)


def straight(fit: Fit, dataset: Dataset, law: Fitted, bend: Bend) -> Fit:
    """The fit with what bends one of its laws held again."""
    values = {**law.values, bend.parameter: bend.held}
    held = replace(law, values=values, fixed=law.fixed | {bend.parameter})
    return fit_axis(fit.axis.with_effect(held), dataset.fit)


def straightened(fit: Fit, dataset: Dataset, given: Collection[str]) -> Fit:
    """The fit without bends that are not needed any more beside the effects that came later.

    given: names of the effects that the model had before, whose bends are the user's.
    """
    for law in fit.axis.effects:
        if law.effect.name in given or (bend := bend_of(law)) is None:
            continue
        without = straight(fit, dataset, fit.axis[law.effect.name], bend)
        if not is_needed(score(without, fit, dataset, law.effect), without):
            fit = without
    return fit


def _bends(law: Fitted) -> tuple[str, ...]:
    return tuple(dict.fromkeys(c.bent_by for c in law.effect.curves if c.bent_by))
