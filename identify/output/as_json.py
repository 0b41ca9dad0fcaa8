"""Results as JSON objects: the documented ones, numbers in SI units."""

from __future__ import annotations

from typing import Any

from identify.estimation.intervals import Estimate
from identify.experiment_design.discrimination import SimulatedExperiment
from identify.experiment_design.plan import Plan
from identify.output.words.estimation import no_interval_in_words, outcome_in_words
from identify.output.words.experiment_design import gap_in_words, in_order, not_run_in_words
from identify.output.words.validation import loop_in_words, region_in_words
from identify.results.addition import Addition
from identify.results.results import Comparison, FitResult
from identify.selection.candidates import Candidate
from identify.selection.confounded import Refit
from identify.validation.misfit_maps import AxisComparison
from identify.validation.whiteness import ResidualTests
from twin.experiments.file import parameters
from twin.experiments.kinds import kind_of
from twin.model.units import AxisUnits


def fit_json(result: FitResult) -> dict[str, Any]:
    """Per axis: parameters with unit and 90 % interval, the outcome, fit and held-out errors."""
    return {
        "objective": "force",
        "axes": {
            axis: {
                "outcome": fit.axis.units.words(outcome_in_words(fit.ended)),
                "converged": fit.ended.name != "NOT_CONVERGED",
                "at_bound": list(fit.at_bound),
                "force_error": fit.error,
                "holdout_force_error": result.holdout_error[axis],
                "test_force_error": result.test_error[axis],
                "noise_floor": fit.floor,
                "unit": fit.axis.units.force,
                "force_shift": result.datasets[axis].channel_delay,
                "force_shift_unit": "s",
                "left_out": list(result.left_out[axis]),
                "force_noise": result.datasets[axis].force_noise,
                "beginnings_left_out": dict(result.datasets[axis].begun),
                "beginnings_left_out_unit": "s",
                "parameters": {e.label: estimate_json(e) for e in result.estimates[axis]},
                "refit": refit_json(result.refits[axis]),
            }
            for axis, fit in result.fits.items()
        },
        "not_fitted": list(result.not_fitted),
    }


def estimate_json(e: Estimate) -> dict[str, Any]:
    """A value with its unit and interval, or why it has none."""
    interval = None if e.low is None else [e.low, e.high]
    return {
        "value": e.value, "unit": e.unit, "interval_90": interval, "free": e.free,
        "interval_refused": e.reason and no_interval_in_words(e.reason),
    }  # fmt: skip


def refit_json(changed: Refit | None) -> dict[str, Any] | None:
    if changed is None:
        return None
    return {
        "force_error_as_given": changed.given,
        "force_error": changed.refitted,
        "force_unit": changed.unit,
        "changed": [
            {
                "parameter": c.label, "before": c.before, "after": c.after, "unit": c.unit,
                "force": c.force, "force_unit": c.force_unit, "same_force_as": list(c.alike),
            }
            for c in changed.changes
        ],
    }  # fmt: skip


def compare_json(result: Comparison) -> dict[str, Any]:
    """Per axis and log: force and position error with ratio to the noise floor, and regions."""
    return {"axes": {axis: _axis_comparison(c) for axis, c in result.axes.items()}}


def _position_error(c: AxisComparison, log: str) -> dict[str, Any]:
    """The position error of a log; null of imposed motion."""
    error = c.position_error.get(log)
    return {
        "position_error": error,
        "position_unit": c.units.position,
        "position_ratio": error and error / max(c.position_floor[log], 1e-300),
    }


def _axis_comparison(c: AxisComparison) -> dict[str, Any]:
    return {
        "logs": {
            name: {
                "force_error": error,
                "force_unit": c.units.force,
                "force_ratio": error / c.floor,
                **_position_error(c, name),
            }
            for name, error in c.force_error.items()
        },
        "noise_floor": c.floor,
        "position_drift_of_noise": dict(c.position_floor),
        "regions": {
            m.coordinate: {
                "unit": m.unit, "centre": m.centre.tolist(), "force_error": m.rms.tolist(),
                "mean": m.mean.tolist(), "share": m.share.tolist(),
                "noise_floor": m.floor.tolist(),
            }
            for m in c.maps
        },
        "worst": [region_in_words(r) for r in c.worst],
        "residual_tests": _residual_tests(c.tests, c.units),
    }  # fmt: skip


def _residual_tests(t: ResidualTests, units: AxisUnits) -> dict[str, Any]:
    return {
        "tested": units.words("force residual"),
        "loop": t.loop.name.lower(),
        "reason": units.words(loop_in_words(t.loop)),
        "samples": t.samples,
        "passed": t.passes,
        "histogram": {
            "edges": t.edges.tolist(), "unit": units.force, "density": t.density.tolist(),
            "density_unit": units("1/N"), "normal_rms": t.floor, "share_within_90": t.within,
        },
        "correlations": {
            c.signal: {
                "lag": c.lag.tolist(), "lag_unit": "s", "value": c.value.tolist(),
                "tested": c.tested.tolist(), "bound_90": c.bound, "limit_all_99": c.limit,
                "share_outside": c.outside, "passed": c.passes,
            }
            for c in t.correlations
        },
    }  # fmt: skip


def plan_json(result: Plan) -> dict[str, Any]:
    """The chosen experiment, what it is expected to show, and those it was chosen from."""
    several = len(result.between) > 1
    return {
        "axis": result.axis,
        "between": list(result.between),
        "decides": result.decides,
        "favoured_by_the_logs": result.favoured,
        "refitted_on_logs": not result.supposed,
        "missing_motion": gap_in_words(result.gap),
        "excited_by": dict(result.excited_by),
        **_simulated(result.chosen, several),
        "ranking": [_simulated(t, several) for t in in_order(result)],
        "not_run": [not_run_in_words(n) for n in result.not_run],
    }


def _simulated(t: SimulatedExperiment, several: bool) -> dict[str, Any]:
    return {
        "experiment": {"kind": kind_of(t.experiment), **parameters(t.experiment)},
        "duration": t.duration,
        "duration_unit": "s",
        "expected_difference": t.difference,
        "noise_floor": t.floor,
        "unit": t.units.force,
        "delta_bic" if several else "information": t.gain,
    }


def parameters_json(c: Candidate) -> dict[str, Any]:
    """The values of the effect of a candidate, and their units."""
    axis = c.fit.axis
    return {
        "parameters": dict(axis[c.effect.name].values),
        "parameter_units": axis.parameter_units(c.effect.name),
    }


def add_json(result: Addition) -> dict[str, Any]:
    """Errors before and after, whether the effect is supported, and what it changed."""
    step, (before, after) = result.step, result.position_error or (None, None)
    return {
        "action": step.action,
        "effect": step.effect,
        "axis": step.axis,
        "is_nonparametric": result.candidate.effect.is_nonparametric,
        "kept": result.kept,
        "part": result.candidate.part,
        "why_not": result.candidate.refused,
        "fit_error_before": step.fit_error_before,
        "fit_error_after": step.fit_error_after,
        "holdout_error_before": step.holdout_error_before,
        "holdout_error_after": step.holdout_error_after,
        "test_error_before": step.test_error_before,
        "test_error_after": step.test_error_after,
        "noise_floor": result.candidate.fit.floor,
        "unit": step.unit,
        "position_error_before": before,
        "position_error_after": after,
        "position_error_in_mujoco": result.replayed,
        "position_error_on": result.position_log,
        "position_unit": result.units.position,
        **parameters_json(result.candidate),
        "notes": list(result.notes),
    }
