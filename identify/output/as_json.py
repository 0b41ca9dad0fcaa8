"""Results as JSON objects: the documented ones, numbers in SI units beside their units.

Each function picks what is documented, by its documented name; ``plain`` makes the arrays, enums
and dataclasses inside known to JSON.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from identify.estimation.fit import Errors
from identify.estimation.intervals import Estimate
from identify.estimation.simulated_motion import MotionFit
from identify.experiment_design.discrimination import SimulatedExperiment
from identify.experiment_design.plan import Plan
from identify.output.machine import pick, plain
from identify.output.words.diagnosis import (
    Said,
    model_change_in_words,
    not_named_in_words,
    said_of,
    why_not,
)
from identify.output.words.findings import advice, together_in_words
from identify.output.words.fit import MOTION_OUTCOMES, OUTCOMES, no_interval_in_words
from identify.output.words.plan import gap_in_words, in_order, not_run_in_words
from identify.output.words.residual import loop_in_words, region_in_words
from identify.results.addition import Addition
from identify.results.results import Comparison, Diagnosis, FitResult, SimulationFit
from identify.selection.candidates import Candidate
from identify.selection.confounded import Refit
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.findings import Finding
from identify.selection.found_shape import FoundShape
from identify.validation.agreement import Agreement, AxisAgreement, Difference
from identify.validation.misfit_maps import AxisComparison, Region
from identify.validation.whiteness import Correlation, ResidualTests
from twin.experiments.file import parameters
from twin.experiments.kinds import kind_of
from twin.model.parameters import free_parameters, read
from twin.model.units import AxisUnits

Json = dict[str, Any]

# --- fits ------------------------------------------------------------------------------------


def fit_json(result: FitResult) -> Json:
    """Per axis: parameters with unit and 90 % interval, the outcome, errors by role of the logs."""
    axes = {}
    for axis, fit in result.fits.items():
        dataset = result.datasets[axis]
        axes[axis] = {
            "outcome": fit.axis.units.words(OUTCOMES[fit.ended]),
            "converged": fit.ended.name != "NOT_CONVERGED",
            **pick(fit, "at_bound", force_error="error", noise_floor="floor"),
            "holdout_force_error": result.holdout_error[axis],
            "test_force_error": result.test_error[axis],
            "unit": fit.axis.units.force,
            "left_out": result.left_out[axis],
            **pick(dataset, "force_noise", force_shift="channel_delay"),
            "force_shift_unit": "s",
            "beginnings_left_out": dataset.begun,
            "beginnings_left_out_unit": "s",
            "parameters": {e.label: estimate_json(e) for e in result.estimates[axis]},
            "refit": refit_json(result.refits[axis]),
        }
    return plain({"objective": "force", "axes": axes, "not_fitted": result.not_fitted})


def estimate_json(e: Estimate) -> Json:
    """A value with its unit and interval, or why it has none."""
    return {
        **pick(e, "value", "unit", "free"),
        "interval_90": None if e.low is None else [e.low, e.high],
        "interval_refused": e.reason and no_interval_in_words(e.reason),
    }


def refit_json(refit: Refit | None) -> Json | None:
    """What fitting changed of the given model."""
    change = {"parameter": "label", "same_force_as": "alike"}
    if refit is None:
        return None
    return {
        **pick(refit, force_error_as_given="given", force_error="refitted", force_unit="unit"),
        "changed": [
            pick(c, "before", "after", "unit", "force", "force_unit", **change)
            for c in refit.changes
        ],
    }


def simulation_fit_json(result: SimulationFit) -> Json:
    """Per axis: parameters, beginnings of the logs, position errors on both kinds of logs."""
    axes = {axis: _motion_fit(fit, result.holdout_error[axis]) for axis, fit in result.axes.items()}
    return plain({"objective": "simulation", "axes": axes, "not_fitted": result.force.not_fitted})


def _motion_fit(fit: MotionFit, held: tuple[float, float] | None) -> Json:
    units, where = fit.axis.units, free_parameters(fit.axis)
    values = zip(where, read(fit.axis, where), read(fit.begun, where), strict=True)
    before, after = held or (None, None)
    return {
        "outcome": MOTION_OUTCOMES[fit.outcome],
        "converged": fit.outcome.name != "NOT_CONVERGED",
        **pick(fit, position_error="error", position_error_of_force_fit="error_begun"),
        "holdout_position_error": after,
        "holdout_position_error_of_force_fit": before,
        "unit": units.position,
        "errors_of_starts": fit.starts,
        "parameters": {
            c.label: {"value": now, "force_fit": begun, "unit": units(c.parameter.unit)}
            for c, now, begun in values
        },
        "beginnings": {
            log.motion.name: {
                "time": begun.first * log.motion.sample_period,
                "time_unit": "s",
                **pick(begun, "position", "velocity"),
                "position_unit": units.position,
                "velocity_unit": units("m/s"),
            }
            for log, begun in zip(fit.logs, fit.beginnings, strict=True)
        },
    }


def agree_json(result: Agreement) -> Json:
    """By axis every compared parameter, and the effects that would make the difference."""
    axes = {axis: _agreement(found) for axis, found in result.axes.items()}
    return plain({"agree": result.agrees, "axes": axes, "not_compared": result.not_compared})


def _agreement(found: AxisAgreement) -> Json:
    return {
        "agree": not found.differing,
        "parameters": {d.label: _difference(d) for d in found.differences},
        "differing": [d.label for d in found.differing],
        **pick(found, "not_compared", "force", only_in_a="only_a", only_in_b="only_b"),
        **pick(found, error_over_noise_floor="above_floor", force_unit="unit"),
        "causes": [pick(c, "effect", "share", **{"or": "alike"}) for c in found.causes],
    }


def _difference(d: Difference) -> Json:
    told = pick(d, "a", "b", "standard_error", "unit", "limit", "differs")
    return {**told, "difference": d.b - d.a, "in_standard_errors": d.ratio}


# --- comparisons -----------------------------------------------------------------------------


def compare_json(result: Comparison) -> Json:
    """Per axis and log: force and position error with ratio to the noise floor, and regions."""
    return plain({"axes": {axis: _comparison(c) for axis, c in result.axes.items()}})


def _comparison(c: AxisComparison) -> Json:
    renamed = {"force_error": "rms", "noise_floor": "floor"}
    return {
        "logs": {name: _log(c, name) for name in c.force_error},
        **pick(c, noise_floor="floor", position_drift_of_noise="position_floor"),
        "regions": {
            m.coordinate: pick(m, "unit", "centre", "mean", "share", **renamed) for m in c.maps
        },
        "worst": [region_in_words(r) for r in c.worst],
        "residual_tests": _residual_tests(c.tests, c.units),
    }


def _log(c: AxisComparison, log: str) -> Json:
    """The errors of a log; that of the position is null of imposed motion."""
    force, position = c.force_error[log], c.position_error.get(log)
    return {
        "force_error": force,
        "force_unit": c.units.force,
        "force_ratio": force / c.floor,
        "position_error": position,
        "position_unit": c.units.position,
        "position_ratio": position and position / max(c.position_floor[log], 1e-300),
    }


def _residual_tests(t: ResidualTests, units: AxisUnits) -> Json:
    return {
        "tested": units.words("force residual"),
        "loop": t.loop.name.lower(),
        "reason": units.words(loop_in_words(t.loop)),
        **pick(t, "samples", passed="passes"),
        "histogram": {
            **pick(t, "edges", "density", normal_rms="floor", share_within_90="within"),
            "unit": units.force,
            "density_unit": units("1/N"),
        },
        "correlations": {c.signal: _correlation(c) for c in t.correlations},
    }


def _correlation(c: Correlation) -> Json:
    renamed = {"bound_90": "bound", "limit_all_99": "limit", "share_outside": "outside"}
    return {**pick(c, "lag", "value", "tested", passed="passes", **renamed), "lag_unit": "s"}


# --- plans and additions ---------------------------------------------------------------------


def plan_json(result: Plan) -> Json:
    """The chosen experiment, what it is expected to show, and those it was chosen from."""
    several = len(result.between) > 1
    return plain({
        **pick(result, "axis", "between", "decides", "excited_by", favoured_by_the_logs="favoured"),
        "refitted_on_logs": not result.supposed,
        "missing_motion": gap_in_words(result.gap),
        **_simulated(result.chosen, several),
        "ranking": [_simulated(t, several) for t in in_order(result)],
        "not_run": [not_run_in_words(n) for n in result.not_run],
    })  # fmt: skip


def _simulated(t: SimulatedExperiment, several: bool) -> Json:
    return {
        "experiment": {"kind": kind_of(t.experiment), **parameters(t.experiment)},
        **pick(t, "duration", expected_difference="difference", noise_floor="floor"),
        "duration_unit": "s",
        "unit": t.units.force,
        "delta_bic" if several else "information": t.gain,
    }


def add_json(result: Addition) -> Json:
    """Errors before and after, whether the effect is supported, and what it changed."""
    errors = (
        f"{role}_error_{when}"
        for role in ("fit", "holdout", "test")
        for when in ("before", "after")
    )
    before, after = result.position_error or (None, None)
    return plain({
        **pick(result.step, "action", "effect", "axis", "unit", *errors),
        "is_nonparametric": result.candidate.effect.is_nonparametric,
        **pick(result, "kept", "notes", position_error_on="position_log"),
        **pick(result.candidate, "part", why_not="refused"),
        "noise_floor": result.candidate.fit.floor,
        "position_error_before": before,
        "position_error_after": after,
        "position_error_in_mujoco": result.replayed,
        "position_unit": result.units.position,
        **_values(result.candidate),
    })  # fmt: skip


def _values(c: Candidate) -> Json:
    """The values of the effect of a candidate, and their units."""
    axis, name = c.fit.axis, c.effect.name
    return {"parameters": axis[name].values, "parameter_units": axis.parameter_units(name)}


# --- diagnoses -------------------------------------------------------------------------------


def diagnose_json(result: Diagnosis, data_faults: Sequence[str] = ()) -> Json:
    """The documented object for the axis that the answer is about, and the same by axis.

    data_faults: what the check of the logs found, one sentence each.
    """
    by_axis = {axis: _diagnosis(result, axis) for axis in result.axes}
    answer = by_axis[result.leading.dataset.axis]
    return plain({**answer, "data_faults": data_faults, "axes": by_axis})


def _diagnosis(result: Diagnosis, axis: str) -> Json:
    d, told, said = result.axes[axis], result.told[axis], said_of(result, axis)
    planned = result.next_experiments.get(axis)
    return {
        **_answer(d, said),
        "axis": axis,
        "remainder": _remainder(d, result.left_over.get(axis)),
        "force_error": d.base.error,
        "force_error_with_found": d.final.error,
        "noise_floor": told.floor,
        "noise_floors": {role.value: floor for role, floor in told.floors.items()},
        **_test_errors(told.tested),
        "parameters": {e.label: estimate_json(e) for e in told.after},
        "unit": d.base.axis.units.force,
        "force_shift": d.dataset.channel_delay,
        "force_shift_unit": "s",
        "refit": refit_json(result.refits.get(axis)),
        "not_tried": result.not_tried,
        "notes": said.notes,
        "next_experiment": planned and plan_json(planned),
        "next_experiment_refused": result.not_planned.get(axis),
    }


def _answer(d: AxisDiagnosis, said: Said) -> Json:
    """What is named, what was tried, and the way there."""
    units, repeat = d.base.axis.units, d.repeat
    return {
        "verdict": d.verdict.name.lower(),
        "explanation": said.verdict,
        "effect": d.best.effect.name if d.best else None,
        "ranking": [_candidate(c, d) for c in d.ranking],
        **pick(d, "ambiguous_with", missing="named", also_seen="small"),
        "steps": [_step(d, i) for i in range(len(d.steps))],
        "needed_together": together_in_words(d),
        "unexplained": d.unexplained
        and pick(d.unexplained, "share_of_error", "depends_on", "period", "unit"),
        "findings": [_finding(f) for f in d.findings],
        "repeats_not_general": repeat
        and {
            **pick(repeat, "period", "amplitude", "phase"),
            "period_unit": units.position,
            "unit": units.force,
            "phase_unit": "rad",
        },
    }


def _finding(f: Finding) -> Json:
    return {
        **pick(f, "effect", "kind", "explains", "confidence", "unit", "parameters"),
        **pick(f, "parameter_units", "together", "bend", indistinguishable_from="tied"),
        **pick(f, contradicted_by_test_logs="contradicted"),
        **_test_errors(f.tested),
        **pick(f.score, "part", "t", "control"),
        "shape": f.shape and _shape(f.shape),
    }


def _test_errors(errors: Errors) -> Json:
    """RMS errors before and after, and the role of the logs that they are of."""
    return pick(errors, test_error_before="before", test_error_after="after", test_error_on="on")


def _shape(s: FoundShape) -> Json:
    """The curve of a law as it is assumed and as it is found, by direction."""
    return {
        **pick(s, "over", "coordinate", "period", coordinate_unit="unit", unit="force_unit"),
        "lets_go_at_standstill": s.lets_go,
        "curves": {
            name: pick(c, "assumed", "found", band_90="band") for name, c in s.curves.items()
        },
    }


def _remainder(d: AxisDiagnosis, region: Region | None) -> Json | None:
    """What stands above the noise floor beside the findings."""
    left, fit = d.unexplained, d.with_named
    where = ("coordinate", "low", "high")
    renamed = {"coordinate_unit": "unit", "error": "rms", "unit": "force_unit"}
    if left is None:
        return None
    return {
        **pick(left, "depends_on", "share_of_error", "period", period_unit="unit"),
        **pick(fit, "error", over_noise_floor="ratio"),
        "unit": fit.axis.units.force,
        "where": region
        and pick(region, *where, over_noise_floor="ratio", share_of_error="share", **renamed),
        "advice": advice(d.findings),
    }


def _step(d: AxisDiagnosis, index: int) -> Json:
    step = d.steps[index]
    return {
        **_candidate(step.tried.candidate, d),
        "effect": step.change.name,
        "change": model_change_in_words(step.change),
        **pick(step, "dropped", "with_others"),
        "not_named": not_named_in_words(d, index),
    }


def _candidate(c: Candidate, d: AxisDiagnosis) -> Json:
    return {
        "effect": c.effect.name,
        "delta_bic": c.delta_bic if c.score else None,
        **pick(c.gain, holdout_error_before="before", holdout_error_after="after"),
        "unit": c.fit.axis.units.force,
        **pick(c, "supported", "part"),
        "why_not": why_not(d, c) or None,
        **_values(c),
    }
