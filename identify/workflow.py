"""The loop in Python: fit, compare, diagnose, add and plan, on a whole stage and its logs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

import numpy as np

from identify.dataset.dataset import Dataset, by_log, datasets
from identify.dataset.prepared_log import moving, sticks
from identify.estimation.channel_delay import aligned, fit_aligned
from identify.estimation.fit import Fit, error_on, rms
from identify.estimation.force_balance import residual
from identify.estimation.intervals import estimates
from identify.experiment_design.plan import next_experiment, plan
from identify.output.results import Addition, Comparison, Diagnosis, FitResult
from identify.output.words.selection import addition_notes
from identify.selection.candidates import Candidate, score, try_effect, usable
from identify.selection.confounded import moved_parameters
from identify.selection.forward_selection import diagnose_axis
from identify.selection.nonparametric import describe, physics_alone
from identify.validation.free_run import free_run, rms_error
from identify.validation.misfit_maps import compare_axis, position_errors
from twin.effect import Effect
from twin.effects import Catalogue
from twin.errors import InputError
from twin.log import Log
from twin.model.machine import AxisModel, HistoryStep, MachineModel
from twin.simulator import MujocoSimulator

Logs = Mapping[str, Log]
Progress = Callable[[str, int, int], None]


def silent(what: str, done: int, total: int) -> None:
    """Progress that nobody watches."""


def fit(
    model: MachineModel,
    logs: Logs,
    holdout: Logs | None = None,
    *,
    catalogue: Catalogue | None = None,
    window: float | None = None,
    progress: Progress = silent,
) -> FitResult:
    """Identify the free parameters of a model's effects.

    logs, holdout: by name. catalogue: its absent effects are told where a parameter stands in for
    them. window: of the weak form in s; from the noise where None. Raises InputError for logs that
    do not fit the model, and where they leave nothing to fit: an axis that comes to rest in every
    window, a force that is not a number.
    """
    found, given = datasets(model, logs, holdout or {}, window), model
    fits: dict[str, Fit] = {}
    for i, (axis, dataset) in enumerate(list(found.items())):
        require_residual(model.axes[axis], dataset)
        found[axis], fits[axis] = fit_aligned(model.axes[axis], dataset)
        require_residual(fits[axis].axis, found[axis])
        progress("fitting", i + 1, len(found))
    for axis, result in fits.items():
        model = model.with_axis(axis, result.axis)
    held = {a: holdout_error(f, found[a]) for a, f in fits.items()}
    known = Catalogue([]) if catalogue is None else usable(catalogue, given)
    intervals = {a: estimates(f) for a, f in fits.items()}
    return FitResult(model, found, fits, intervals, held, given, known)


def require_residual(axis: AxisModel, dataset: Dataset) -> None:
    """Raise InputError where the logs leave nothing to judge the axis by, or no number at all."""
    kept = moving(dataset.fit, sticks(axis))
    names = ", ".join(log.motion.name for log in dataset.fit)
    if not kept.any():
        raise InputError(
            f"axis {dataset.axis} comes to rest within every window of {dataset.window:g} s of "
            f"{names}, where its friction may be any force; give a log in which it moves for "
            "longer at a time, or a shorter --window (s)"
        )
    with np.errstate(all="ignore"):
        bad = np.count_nonzero(~np.isfinite(residual(axis, dataset.fit)[kept]))
    if bad:
        raise InputError(
            f"axis {dataset.axis}: the force of the model is not a finite number in {bad} of "
            f"{np.count_nonzero(kept)} windows of {names}; check the values of its effects, or "
            "leave them to their start values"
        )


def holdout_error(fitted: Fit, dataset: Dataset) -> float | None:
    """RMS force error on the held-out logs in N, or None where there are none."""
    return rms(error_on(fitted.axis, dataset.holdout)) if dataset.holdout else None


def compare(
    model: MachineModel, logs: Logs, *, window: float | None = None, progress: Progress = silent
) -> Comparison:
    """Error numbers of a model as it stands, and where it fails. Raises InputError."""
    found = datasets(model, logs, {}, window)
    for axis, dataset in found.items():
        require_residual(model.axes[axis], dataset)
    found = {axis: aligned(model.axes[axis], dataset) for axis, dataset in found.items()}
    return _compared(model, found, progress)


def _compared(model: MachineModel, found: Mapping[str, Dataset], progress: Progress) -> Comparison:
    """The same on logs that are prepared already."""
    errors, floors = position_errors(model, found, partial(progress, "comparing"))
    axes = {a: compare_axis(model, dataset, errors[a], floors[a]) for a, dataset in found.items()}
    return Comparison(model, axes)


def diagnose(
    model: MachineModel,
    logs: Logs,
    holdout: Logs | None = None,
    *,
    catalogue: Catalogue,
    window: float | None = None,
    progress: Progress = silent,
) -> Diagnosis:
    """Fit the model, then find which effect of the catalogue it lacks. Raises InputError.

    Descriptions that the model holds are set aside: what they describe is to be explained.
    """
    known = usable(catalogue, model)
    result = fit(
        physics_alone(model), logs, holdout, catalogue=catalogue, window=window, progress=progress
    )
    axes = {
        axis: diagnose_axis(
            fitted,
            result.datasets[axis],
            known,
            partial(progress, f"trying effects on {axis}"),
        )
        for axis, fitted in result.fits.items()
    }
    plans = {axis: next_experiment(found, result.model, window) for axis, found in axes.items()}
    return Diagnosis(
        result.model,
        axes,
        _compared(result.model, result.datasets, progress),
        {axis: found for axis, found in plans.items() if found is not None},
        result.refits,
        tuple(name for name in catalogue if name not in known),
    )


def add(
    effect: Effect,
    model: MachineModel,
    logs: Logs,
    holdout: Logs | None = None,
    *,
    axis: str | None = None,
    window: float | None = None,
    progress: Progress = silent,
) -> Addition:
    """Add an effect to the axis that it helps most (or the one given), refit, record the errors.

    Descriptions that the model holds make way for a physical effect. Raises InputError where the
    axis has the effect already.
    """
    model.require_usable(effect, axis or next(iter(model.axes)))
    given, model = model, model if effect.is_nonparametric else physics_alone(model)
    before = fit(model, logs, holdout, window=window, progress=progress)
    names = [axis] if axis else list(before.fits)
    for name in names:
        model.axis(name)
        if name not in before.fits:
            raise InputError(f"axis {name} does not move in the logs; give a log in which it does")
    open_axes = [n for n in names if effect.name not in model.axes[n].names]
    if not open_axes:
        raise InputError(
            f"axis {', '.join(names)} has the effect '{effect.name}' already; `twin fit` refits it"
        )
    attempt = describe if effect.is_nonparametric else try_effect
    tried = [attempt(before.fits[n], before.datasets[n], effect) for n in open_axes]
    best = max(tried, key=lambda c: c.delta_bic)
    progress("adding", 1, 1)
    return _addition(best, before, given)


def _addition(best: Candidate, before: FitResult, given: MachineModel) -> Addition:
    name = best.axis
    base, dataset = before.fits[name], before.datasets[name]
    moved = moved_parameters(base, best.fit)
    left = before.model.axes[name].names
    set_aside = tuple(n for n in given.axes[name].names if n not in left)
    step = HistoryStep(
        action="add",
        effect=best.effect.name,
        axis=name,
        fit_error_before=base.error,
        fit_error_after=best.fit.error,
        holdout_error_before=holdout_error(base, dataset),
        holdout_error_after=holdout_error(best.fit, dataset),
        unit=best.fit.axis.units.force,
        notes=addition_notes(best, moved, set_aside),
    )
    new = before.model.with_axis(name, best.fit.axis).with_history(step)
    first = next(iter(by_log(before.datasets).values()))
    return Addition(
        model=new,
        step=step,
        candidate=best,
        kept=best.supported,
        position_error=(
            rms_error(free_run(before.model, first), name),
            rms_error(free_run(new, first), name),
        ),
        replayed=rms_error(free_run(new, first, MujocoSimulator), name),
        moved=moved,
        set_aside=set_aside,
    )


__all__ = [
    "Addition",
    "Comparison",
    "Diagnosis",
    "FitResult",
    "add",
    "compare",
    "diagnose",
    "fit",
    "plan",
    "score",
]
