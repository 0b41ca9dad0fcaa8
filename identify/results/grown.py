"""What `twin add` and `twin remove` make: a model with one effect more or less, or another body."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from identify.dataset.dataset import Dataset, Role, by_log
from identify.dataset.prepared_log import moving, sticks
from identify.estimation.confounded import MovedParameter, moved_parameters
from identify.estimation.evidence import rms
from identify.estimation.fit import Fit
from identify.estimation.force_balance import residual
from identify.estimation.intervals import estimates, intervals_to_keep
from identify.mechanism.bodies import WrongBody
from identify.printed import Printed
from identify.results.results import FitResult, step_errors
from identify.selection.acceptance import Judged, score
from identify.selection.candidates import Candidate
from identify.selection.changes import Reshaped
from identify.validation.free_run import errors_of_both
from twin.model.machine import HistoryStep, MachineModel
from twin.model.units import AxisUnits


@dataclass(frozen=True, eq=False, repr=False)
class Addition(Printed):
    """A model with one added effect.

    step: errors before and after. kept: whether training and selection logs prove the effect.
    position_error: free-running RMS error before and after; position_error_in_mujoco: the same
    after, stepped by MuJoCo. Both in the units of the axis, None where the motion is imposed.
    position_error_on: the log that they are of. moved: parameters that the effect changed.
    set_aside: nonparametric effects that were removed from the model before. in_motion: RMS force
    error on the training logs before and after where both models tell of them, if one says nothing
    of rests. notes: what a reader should know beside the errors, one sentence each.
    """

    model: MachineModel
    step: HistoryStep
    candidate: Candidate
    kept: bool
    position_error: tuple[float, float] | None
    position_error_in_mujoco: float | None
    moved: tuple[MovedParameter, ...] = ()
    set_aside: tuple[str, ...] = ()
    position_error_on: str | None = None
    in_motion: tuple[float, float] | None = None
    notes: tuple[str, ...] = ()

    @property
    def reshaped(self) -> str | None:
        """The effect whose law was given another shape; None where an effect was added."""
        return self.step.effect if self.step.action == "shape" else None

    @property
    def reported_on(self) -> Role:
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
class AllAdded(Printed):
    """A model with all that an answer found, fitted together.

    given: the model before, fitted. steps: by axis what was added and its errors without and with
    all of it. kept: whether the logs prefer it on every axis that it changed.
    """

    model: MachineModel
    given: FitResult
    steps: tuple[HistoryStep, ...]
    kept: bool


@dataclass(frozen=True, eq=False, repr=False)
class Removal(Printed):
    """A model less one effect, fitted. step: its errors with the effect and without. needed:
    whether the logs ask for the effect beside the others.
    """

    model: MachineModel
    step: HistoryStep
    needed: bool


def removal(effect: str, model: MachineModel, having: Fit, less: Fit, dataset: Dataset) -> Removal:
    """The fit of an axis less an effect in a fitted model; having: the fit with it."""
    name = dataset.axis
    step = HistoryStep("remove", effect, name, **step_errors(having, less, dataset))
    made = model.with_axis(name, dataset.kept_in(less.axis)).with_history(step)
    needed = score(Judged(less, dataset), Judged(having, dataset)).accepted
    return Removal(
        made.with_intervals(name, intervals_to_keep(less, estimates(less))), step, needed
    )


@dataclass(frozen=True, eq=False, repr=False)
class CorrectedBody(Printed):
    """A model whose MuJoCo file has the inertia of bodies as the logs show it.

    given: the model before, fitted. bodies: what the logs show of them, the one that explains most
    first, with the errors of each joint. kept: as the logs prove them; else nothing is written.
    """

    model: MachineModel
    given: MachineModel
    bodies: tuple[WrongBody, ...]
    kept: bool = True

    @property
    def body(self) -> WrongBody:
        """That which explains most."""
        return self.bodies[0]

    @property
    def element(self) -> str:
        """What was written into it."""
        return self.body.written


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
    new = model.with_axis(name, prepared[name].kept_in(best.fit.axis)).with_history(step)
    new = new.with_intervals(name, intervals_to_keep(best.fit, estimates(best.fit)))
    running, replayed = errors_of_both(model, new, name, prepared)
    return Addition(
        model=new,
        step=step,
        candidate=best,
        kept=best.supported,
        position_error=running,
        position_error_in_mujoco=replayed,
        moved=moved_parameters(base, best.fit),
        set_aside=tuple(n for n in given.axes[name].names if n not in left),
        position_error_on=None if running is None else next(iter(by_log(prepared))),
        in_motion=_in_motion(base, best.fit),
    )


def _in_motion(before: Fit, after: Fit) -> tuple[float, float] | None:
    """Their RMS force errors on what both tell of the training logs; None where each tells all."""
    if sticks(before.axis) == sticks(after.axis):
        return None
    some = moving([*before.logs], sticks=True)
    first, last = (rms(residual(fit.axis, before.logs)[some]) for fit in (before, after))
    return first, last


def _step(best: Candidate, base: Fit, dataset: Dataset, shape: Reshaped | None) -> HistoryStep:
    """What an addition did to the errors on the logs of each role."""
    return HistoryStep(
        action="shape" if shape else "add",
        effect=shape.name if shape else best.effect.name,
        axis=best.axis,
        **step_errors(base, best.fit, dataset),
    )


def step_of_body(body: str, axis: str, before: FitResult, after: FitResult) -> HistoryStep:
    """The step of a body that was corrected, with the errors of an axis without and with all."""
    return HistoryStep(
        "body", body, axis, unit=after.fits[axis].axis.units.force,
        fit_error_before=before.fits[axis].error, fit_error_after=after.fits[axis].error,
        holdout_error_before=before.holdout_error[axis],
        holdout_error_after=after.holdout_error[axis],
        test_error_before=before.test_error[axis], test_error_after=after.test_error[axis],
    )  # fmt: skip
