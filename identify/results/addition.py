"""A model with one effect more, and what that did to the errors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from identify.dataset.dataset import Dataset, Role, by_log
from identify.estimation.confounded import MovedParameter, moved_parameters
from identify.estimation.fit import Fit, error_if_any
from identify.estimation.intervals import estimates, intervals_to_keep
from identify.links import WrongBody
from identify.results import Printed
from identify.selection.candidates import Candidate
from identify.selection.changes import Reshaped
from identify.validation.free_run import errors_of_both
from twin.model.machine import HistoryStep, MachineModel
from twin.model.units import AxisUnits


@dataclass(frozen=True, eq=False, repr=False)
class Addition(Printed):
    """A model with one added effect.

    step: errors before and after. kept: whether training and selection logs prove the effect.
    position_error: free-running RMS error before and after; replayed: the same after, stepped by
    MuJoCo. Both in the units of the axis, None where the motion is imposed. position_log: the log
    that they are of. moved: parameters that the effect changed. set_aside: nonparametric effects
    that were removed from the model before. notes: what a reader should know beside the errors, one
    sentence each.
    """

    model: MachineModel
    step: HistoryStep
    candidate: Candidate
    kept: bool
    position_error: tuple[float, float] | None
    replayed: float | None
    moved: tuple[MovedParameter, ...] = ()
    set_aside: tuple[str, ...] = ()
    position_log: str | None = None
    notes: tuple[str, ...] = ()

    @property
    def reshaped(self) -> str | None:
        """The effect whose law was given another shape; None where an effect was added."""
        return self.step.effect if self.step.action == "shape" else None

    @property
    def told_on(self) -> Role:
        """The logs that tell most of it: those of the errors that were decided on least."""
        if self.step.test_error_after is not None:
            return Role.TEST
        return Role.TRAINING if self.step.holdout_error_after is None else Role.SELECTION

    def with_notes(self, kept: tuple[str, ...], notes: tuple[str, ...]) -> Addition:
        """The same with its notes; kept: those that go into the history of the model."""
        step = replace(self.step, notes=kept)
        model = replace(self.model, history=(*self.model.history[:-1], step))
        return replace(self, step=step, model=model, notes=notes)

    @property
    def units(self) -> AxisUnits:
        """Of the axis that the effect was added to."""
        return self.candidate.fit.axis.units


@dataclass(frozen=True, eq=False, repr=False)
class CorrectedBody(Printed):
    """A model whose MuJoCo file has the inertia of a body as the logs show it.

    given: the model before, fitted. body: what the logs show of it, with the errors of each joint.
    element: what was written. kept: as the logs prove it; else nothing is written.
    """

    model: MachineModel
    given: MachineModel
    body: WrongBody
    element: str
    kept: bool = True


def addition(
    best: Candidate,
    base: Fit,
    prepared: Mapping[str, Dataset],
    model: MachineModel,
    given: MachineModel,
    shape: Reshaped | None = None,
) -> Addition:
    """The candidate added to a fitted model; ``given``: the model before that was fitted.

    shape: that of a law of the model which the candidate is; None where it is a missing effect.
    """
    name = best.axis
    left = model.axes[name].names
    step = _step(best, base, prepared[name], shape)
    new = model.with_axis(name, best.fit.axis).with_history(step)
    new = new.with_intervals(name, intervals_to_keep(best.fit, estimates(best.fit)))
    moving, replayed = errors_of_both(model, new, name, prepared)
    return Addition(
        model=new,
        step=step,
        candidate=best,
        kept=best.supported,
        position_error=moving,
        replayed=replayed,
        moved=moved_parameters(base, best.fit),
        set_aside=tuple(n for n in given.axes[name].names if n not in left),
        position_log=None if moving is None else next(iter(by_log(prepared))),
    )


def _step(best: Candidate, base: Fit, dataset: Dataset, shape: Reshaped | None) -> HistoryStep:
    """What an addition did to the errors on the logs of each role."""
    return HistoryStep(
        action="shape" if shape else "add",
        effect=shape.name if shape else best.effect.name,
        axis=best.axis,
        fit_error_before=base.error,
        fit_error_after=best.fit.error,
        holdout_error_before=error_if_any(Role.SELECTION, base, dataset),
        holdout_error_after=error_if_any(Role.SELECTION, best.fit, dataset),
        test_error_before=error_if_any(Role.TEST, base, dataset),
        test_error_after=error_if_any(Role.TEST, best.fit, dataset),
        unit=best.fit.axis.units.force,
    )
