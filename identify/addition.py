"""What becomes of a machine model when a candidate is added to it."""

from __future__ import annotations

from collections.abc import Mapping

from identify.dataset.dataset import Dataset, by_log
from identify.estimation.fit import Fit, holdout_error
from identify.estimation.intervals import estimates, intervals_to_keep
from identify.output.results import Addition
from identify.output.words.selection import addition_notes
from identify.selection.candidates import Candidate
from identify.selection.confounded import moved_parameters
from identify.validation.free_run import free_run, rms_error
from twin.model.machine import HistoryStep, MachineModel
from twin.simulator import MujocoSimulator


def addition(
    best: Candidate,
    base: Fit,
    prepared: Mapping[str, Dataset],
    model: MachineModel,
    given: MachineModel,
    reshaped: str | None = None,
) -> Addition:
    """The candidate added to a fitted model; ``given``: the model before that was fitted.

    reshaped: the effect of the model whose law's shape the candidate is; None where it is missing.
    """
    name = best.axis
    moved = moved_parameters(base, best.fit)
    left = model.axes[name].names
    set_aside = tuple(n for n in given.axes[name].names if n not in left)
    step = HistoryStep(
        action="shape" if reshaped else "add",
        effect=reshaped or best.effect.name,
        axis=name,
        fit_error_before=base.error,
        fit_error_after=best.fit.error,
        holdout_error_before=holdout_error(base, prepared[name]),
        holdout_error_after=holdout_error(best.fit, prepared[name]),
        unit=best.fit.axis.units.force,
        notes=addition_notes(best, moved, set_aside, reshaped),
    )
    new = model.with_axis(name, best.fit.axis).with_history(step)
    new = new.with_intervals(name, intervals_to_keep(best.fit, estimates(best.fit)))
    moving, replayed = _position_errors(model, new, name, prepared)
    return Addition(
        model=new,
        step=step,
        candidate=best,
        kept=best.supported,
        position_error=moving,
        replayed=replayed,
        moved=moved,
        set_aside=set_aside,
    )


def _position_errors(
    before: MachineModel, after: MachineModel, axis: str, prepared: Mapping[str, Dataset]
) -> tuple[tuple[float, float] | None, float | None]:
    """Free-running position error (m RMS) on the first log: before and after, and in MuJoCo after.

    None where the motion is imposed.
    """
    if after.is_imposed:
        return None, None
    log = next(iter(by_log(prepared).values()))
    runs = (free_run(before, log), free_run(after, log), free_run(after, log, MujocoSimulator))
    was, now, replayed = (rms_error(run, axis) for run in runs)
    return (was, now), replayed
