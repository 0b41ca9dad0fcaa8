"""What a diagnosis tries on an axis, and why it does not try the rest of the catalogue."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from identify.dataset.dataset import Dataset
from identify.dataset.preparation import is_informative, require_informative, telling
from identify.dataset.prepared_log import sticks
from identify.estimation.force_balance import require_residual
from twin.core.walks import CHANNEL_ROW
from twin.effect import Effect
from twin.effects import Catalogue
from twin.errors import InputError, at
from twin.logs import LINEAR_UNITS
from twin.model.machine import AxisModel, Fitted, Hindrance, MachineModel
from twin.model.parameters import free_parameters


@dataclass(frozen=True)
class RestsTooOften:
    """A friction that sticks: the axis comes to rest within nearly every test function."""


NotTried = Hindrance | RestsTooOften


def fitted_count(axis: AxisModel) -> int:
    """How many parameters a fit of the axis determines from the logs alone.

    Those of a nonparametric effect are smoothed, and so determined by their neighbours as well.
    """
    curves = {f.effect.name for f in axis.effects if f.effect.is_nonparametric}
    return sum(c.effect not in curves for c in free_parameters(axis))


def telling_beside(axis: AxisModel, dataset: Dataset, tried: Iterable[Effect] = ()) -> Dataset:
    """The dataset less the logs that say nothing of an axis, or of it with an effect to be tried.

    Raises InputError where the logs do not tell the parameters of the axis.
    """
    held = any(e.sticks and _shows(axis, dataset, e) for e in tried)
    return telling(dataset, held or sticks(axis), fitted_count(axis))


def offered(axis: AxisModel, dataset: Dataset, catalogue: Catalogue) -> Catalogue:
    """The effects of a catalogue that the logs can tell anything of."""
    return Catalogue([e for e in catalogue.values() if _shows(axis, dataset, e)])


def require_shown(effect: Effect, axes: Mapping[str, tuple[AxisModel, Dataset]]) -> list[str]:
    """Those of some axes of which the logs tell all parameters with the effect.

    Raises InputError where there is none.
    """
    for name, (_, dataset) in axes.items():
        if not is_logged(effect, dataset):
            field = effect.channels[0]
            raise InputError(
                f"axis {name}: {effect.name} reads the {field}, which not all logs hold; import "
                f"it, as {field} ({LINEAR_UNITS[field]}) of the axis"
            )
    own = {n: axis.with_effect(Fitted.at_start(effect)) for n, (axis, _) in axes.items()}
    asked = {n: (axes[n][1], sticks(axis), fitted_count(axis)) for n, axis in own.items()}
    if not (shown := [n for n, each in asked.items() if is_informative(*each)]):
        require_informative(*next(iter(asked.values())))
    for name in shown:
        with at(f"with {effect.name}"):
            require_residual(own[name], axes[name][1])
    return shown


def _shows(axis: AxisModel, dataset: Dataset, effect: Effect) -> bool:
    """Whether the logs tell more numbers of the axis with the effect than it has without."""
    if not is_logged(effect, dataset) or _is_fitted(axis, effect):
        return False
    if not effect.sticks or sticks(axis):
        return True
    return is_informative(dataset, True, fitted_count(axis))


def _is_fitted(axis: AxisModel, effect: Effect) -> bool:
    """Whether an effect is mass more or less of an axis whose mass is fitted already.

    Beside a body on a spring it would tell the masses of both sides, which is no payload.
    """
    return effect.added_mass is not None and not axis.mass_fixed


def is_logged(effect: Effect, dataset: Dataset) -> bool:
    """Whether all logs hold what the law reads beside the motion, of several the first.

    Of a force between two axes one log at least has to hold the other axis.
    """
    motions = [log.motion for log in dataset.logs]
    if effect.is_between_axes and not any(m.others[:CHANNEL_ROW].any() for m in motions):
        return False
    return all(field in m.channels for field in effect.channels[:1] for m in motions)


def not_tried(
    model: MachineModel, dataset: Dataset, catalogue: Mapping[str, Effect]
) -> dict[str, NotTried]:
    """By name, the effects that the axis of a dataset lacks and that could not be tried on it.

    An effect that another one of the catalogue stands for on such an axis is none of them.
    """
    axis, found = model.axes[dataset.axis], dict[str, NotTried]()
    for name, effect in catalogue.items():
        alone = len(model.axes) == 1 and not model.can_use(effect)  # there is no other axis
        if name in axis.names or effect.is_nonparametric or alone:
            continue
        if (why := model.hindrance(effect, dataset.axis)) is not None:
            found[name] = why
        elif (
            is_logged(effect, dataset)
            and axis.can_have(effect)
            and not _is_fitted(axis, effect)
            and not _shows(axis, dataset, effect)
        ):
            found[name] = RestsTooOften()
    return found
