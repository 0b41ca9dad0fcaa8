"""The loop in Python: fit, compare, diagnose, add and plan, on a whole stage and its logs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np

from identify.alignment import fit_aligned
from identify.candidates import Candidate, score, try_effect
from identify.clocks import with_clocks
from identify.compare import AxisComparison, compare_axis, position_errors
from identify.describe import describe, in_words, physics_alone
from identify.diagnose import AxisDiagnosis, Verdict, diagnose_axis
from identify.fit import Fit, error_on, rms
from identify.freerun import free_run, rms_error
from identify.given import Refit, refit
from identify.plan import Plan, next_experiment, plan
from identify.ranking import COLLAPSE
from identify.study import Study, studies
from identify.uncertainty import Estimate, estimates, half_widths
from twin.effect import Effect
from twin.effects import Catalogue
from twin.errors import InputError
from twin.log import Log
from twin.model import HistoryStep, StageModel, read
from twin.simulator import MujocoStage

Logs = Mapping[str, Log]
Progress = Callable[[str, int, int], None]


def silent(what: str, done: int, total: int) -> None:
    """Progress that nobody watches."""


@dataclass(frozen=True, eq=False)
class FitResult:
    """A fitted stage: fits and estimates by axis, held-out force errors (N RMS) where given.

    given: the stage before the fit. catalogue: whose absent effects a parameter may stand in for.
    """

    model: StageModel
    studies: Mapping[str, Study]
    fits: Mapping[str, Fit]
    estimates: Mapping[str, tuple[Estimate, ...]]
    holdout_error: Mapping[str, float | None]
    given: StageModel
    catalogue: Catalogue

    @cached_property
    def refits(self) -> Mapping[str, Refit]:
        """What the fit changed of the model given, by axis."""
        return {a: refit(self.given.axes[a], f, self.catalogue) for a, f in self.fits.items()}


@dataclass(frozen=True, eq=False)
class Comparison:
    """A stage against logs, by axis."""

    model: StageModel
    axes: Mapping[str, AxisComparison]


@dataclass(frozen=True, eq=False)
class Diagnosis:
    """Diagnoses by axis; the answer is that of the axis with the strongest evidence.

    next_experiments: for an axis whose diagnosis is ambiguous, the experiment that decides.
    refits: what fitting the model as given changed, by axis.
    """

    model: StageModel
    axes: Mapping[str, AxisDiagnosis]
    comparison: Comparison
    next_experiments: Mapping[str, Plan] = field(default_factory=dict)
    refits: Mapping[str, Refit] = field(default_factory=dict)

    @property
    def leading(self) -> AxisDiagnosis:
        """The axis that the answer is about."""
        order = [Verdict.NOTHING_MISSING, Verdict.UNEXPLAINED, Verdict.AMBIGUOUS]
        order.append(Verdict.MISSING_EFFECT)

        def weight(d: AxisDiagnosis) -> tuple[bool, int, float]:
            bic = d.ranking[0].delta_bic if d.ranking else 0.0
            return d.best is not None, order.index(d.verdict), bic if d.best else d.base.ratio

        return max(self.axes.values(), key=weight)

    @property
    def effect(self) -> Effect | None:
        """The effect that is named, if any."""
        best = self.leading.best
        return best.effect if best else None


@dataclass(frozen=True, eq=False)
class Addition:
    """A stage with one effect more.

    step: errors before and after. kept: whether the effect earned its place on held-out data.
    position_error: free-running error before and after, m RMS. replayed: the same of the new model
    stepped by MuJoCo, m RMS.
    """

    model: StageModel
    step: HistoryStep
    candidate: Candidate
    kept: bool
    position_error: tuple[float, float]
    replayed: float
    notes: tuple[str, ...] = field(default=())


def fit(
    model: StageModel,
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
    do not fit the model.
    """
    found, given = studies(model, logs, holdout or {}, window), model
    fits: dict[str, Fit] = {}
    for i, (axis, study) in enumerate(list(found.items())):
        found[axis], fits[axis] = fit_aligned(model.axes[axis], study)
        progress("fitting", i + 1, len(found))
    for axis, result in fits.items():
        model = model.with_axis(axis, result.axis)
    held = {a: holdout_error(f, found[a]) for a, f in fits.items()}
    known = Catalogue([]) if catalogue is None else catalogue
    intervals = {a: estimates(f) for a, f in fits.items()}
    return FitResult(model, found, fits, intervals, held, given, known)


def holdout_error(fitted: Fit, study: Study) -> float | None:
    """RMS force error on the held-out logs in N, or None where there are none."""
    return rms(error_on(fitted.axis, study.holdout)) if study.holdout else None


def compare(
    model: StageModel, logs: Logs, *, window: float | None = None, progress: Progress = silent
) -> Comparison:
    """Error numbers of a model as it stands, and where it fails. Raises InputError."""
    found = {a: with_clocks(model.axes[a], s) for a, s in studies(model, logs, {}, window).items()}
    errors = position_errors(_only(model, found), logs, partial(progress, "comparing"))
    axes = {a: compare_axis(model, study, logs, errors[a]) for a, study in found.items()}
    return Comparison(model, axes)


def _only(model: StageModel, axes: Mapping[str, object]) -> StageModel:
    """The model less the axes that do not move in the logs."""
    return replace(model, axes={a: m for a, m in model.axes.items() if a in axes})


def diagnose(
    model: StageModel,
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
    result = fit(
        physics_alone(model), logs, holdout, catalogue=catalogue, window=window, progress=progress
    )
    axes = {
        axis: diagnose_axis(
            fitted,
            result.studies[axis],
            catalogue,
            partial(progress, f"trying effects on {axis}"),
        )
        for axis, fitted in result.fits.items()
    }
    plans = {axis: next_experiment(found, result.model, window) for axis, found in axes.items()}
    return Diagnosis(
        result.model,
        axes,
        compare(result.model, logs, window=window, progress=progress),
        {axis: found for axis, found in plans.items() if found is not None},
        result.refits,
    )


def add(
    effect: Effect,
    model: StageModel,
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
    given, model = model, model if effect.is_description else physics_alone(model)
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
    attempt = describe if effect.is_description else try_effect
    tried = [attempt(before.fits[n], before.studies[n], effect) for n in open_axes]
    best = max(tried, key=lambda c: c.delta_bic)
    progress("adding", 1, 1)
    return _addition(best, before, logs, given)


def _addition(best: Candidate, before: FitResult, logs: Logs, given: StageModel) -> Addition:
    name = best.axis
    base, study = before.fits[name], before.studies[name]
    notes = moved_parameters(base, best.fit)
    if best.effect.is_description:
        notes = (in_words(best.fit.axis[best.effect.name]), *notes)
    gone = [n for n in given.axes[name].names if n not in before.model.axes[name].names]
    if gone:
        notes = (*notes, f"{', '.join(gone)} made way; add it again for what is left")
    step = HistoryStep(
        action="add",
        effect=best.effect.name,
        axis=name,
        fit_error_before=base.error,
        fit_error_after=best.fit.error,
        holdout_error_before=holdout_error(base, study),
        holdout_error_after=holdout_error(best.fit, study),
        notes=notes,
    )
    new = before.model.with_axis(name, best.fit.axis).with_history(step)
    first = next(iter(logs.values()))
    moving_old, moving_new = (_only(m, before.fits) for m in (before.model, new))
    return Addition(
        model=new,
        step=step,
        candidate=best,
        kept=best.supported,
        position_error=(
            rms_error(free_run(moving_old, first), name),
            rms_error(free_run(moving_new, first), name),
        ),
        replayed=rms_error(free_run(moving_new, first, MujocoStage), name),
        notes=notes,
    )


def moved_parameters(before: Fit, after: Fit) -> tuple[str, ...]:
    """Sentences on parameters that moved by more than their interval when the effect came."""
    shared = [c for c in before.scaling.where if c in after.scaling.where]
    old, new = read(before.axis, shared), read(after.axis, shared)
    index = [after.scaling.where.index(c) for c in shared]
    width = half_widths(after)[index]
    earlier = half_widths(before)[[before.scaling.where.index(c) for c in shared]]
    allowed = np.hypot(width, earlier)
    out = []
    for c, a, b, limit, first in zip(shared, old, new, allowed, earlier, strict=True):
        p = c.parameter
        # Its own new interval does not matter here: what stood in for the effect may be collinear.
        collapsed = p.strength and abs(b) < COLLAPSE * abs(a) and abs(a) > first
        if not collapsed and not abs(b - a) > limit:
            continue
        verb = "collapsed" if collapsed else "moved"
        tail = (
            "it stood in for the effect that was missing" if collapsed else "more than its interval"
        )
        out.append(f"{c.label} {verb} from {a:.4g} to {b:.4g} {p.unit}: {tail}")
    return tuple(out)


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
