"""A diagnosis as plain data for JSON, in SI units."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

from identify.estimation.errors import Errors
from identify.output.as_json import estimate_json, parameters_json, plan_json, refit_json
from identify.output.remarks import remarks_on
from identify.output.words.findings import advice, together_in_words
from identify.output.words.selection import verdict_in_words
from identify.output.words.steps import change_in_words, not_named_in_words, why_not
from identify.results.results import Diagnosis
from identify.selection.candidates import Candidate
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.findings import Finding
from identify.selection.found_shape import FoundShape
from identify.selection.search import Step
from identify.validation.misfit_maps import Region


def diagnose_json(result: Diagnosis, data_faults: Sequence[str] = ()) -> dict[str, Any]:
    """The documented object for the axis that the answer is about, and the same by axis.

    data_faults: what the check of the logs found, one sentence each.
    """
    leading = result.leading
    by_axis = {axis: _axis_diagnosis(result, axis) for axis in result.axes}
    answer = by_axis[leading.dataset.axis]
    return {**answer, "data_faults": list(data_faults), "axes": by_axis}


def _axis_diagnosis(result: Diagnosis, axis: str) -> dict[str, Any]:
    d, told = result.axes[axis], result.told[axis]
    units = d.base.axis.units
    dependence = d.unexplained
    following = result.next_experiments.get(axis)
    return {
        "verdict": d.verdict.name.lower(),
        "explanation": units.words(verdict_in_words(d)),
        "axis": axis,
        "effect": d.best.effect.name if d.best else None,
        "ranking": [_candidate(c, d) for c in d.ranking],
        "ambiguous_with": list(d.ambiguous_with),
        "missing": list(d.named),
        "steps": [
            {**_step(s, d), "not_named": not_named_in_words(d, i)} for i, s in enumerate(d.steps)
        ],
        "needed_together": together_in_words(d),
        "also_seen": list(d.small),
        "unexplained": dependence
        and {
            "share_of_error": dependence.share_of_error,
            "depends_on": dependence.depends_on,
            "period": dependence.period,
            "unit": dependence.unit,
        },
        "findings": [_finding(f) for f in d.findings],
        "remainder": _remainder(d, result.left_over.get(axis)),
        "force_error": d.base.error,
        "force_error_with_found": d.final.error,
        "noise_floor": told.floor,
        "noise_floors": {role.value: floor for role, floor in told.floors.items()},
        **_test_errors(told.tested),
        "parameters": {e.label: estimate_json(e) for e in told.after},
        "unit": units.force,
        "force_shift": d.dataset.channel_delay,
        "force_shift_unit": "s",
        "repeats_not_general": d.repeat
        and {
            "period": d.repeat.period,
            "period_unit": units.position,
            "amplitude": dict(d.repeat.amplitude),
            "unit": units.force,
            "phase": dict(d.repeat.phase),
            "phase_unit": "rad",
        },
        "refit": refit_json(result.refits.get(axis)),
        "not_tried": list(result.not_tried),
        "notes": list(remarks_on(result, axis)),
        "next_experiment": following and plan_json(following),
        "next_experiment_refused": result.not_planned.get(axis),
    }


def _finding(f: Finding) -> dict[str, Any]:
    return {
        "effect": f.effect,
        "kind": f.kind.value,
        "explains": f.explains,
        "confidence": f.confidence,
        "indistinguishable_from": list(f.tied),
        **_test_errors(f.tested),
        "unit": f.unit,
        "parameters": f.parameters,
        "parameter_units": f.parameter_units,
        "part": f.score.part,
        "t": f.score.t,
        "control": f.score.control,
        "together": list(f.together),
        "contradicted_by_test_logs": f.contradicted,
        "shape": f.shape and _shape(f.shape),
        "bend": f.bend and asdict(f.bend),
    }


def _test_errors(errors: Errors) -> dict[str, Any]:
    """RMS errors before and after, and the role of the logs that they are of."""
    return {
        "test_error_before": errors.before,
        "test_error_after": errors.after,
        "test_error_on": errors.on.value,
    }


def _shape(s: FoundShape) -> dict[str, Any]:
    """The curve of a law as it is assumed and as it is found, by direction."""
    return {
        "over": s.over.value,
        "coordinate": s.coordinate.tolist(),
        "coordinate_unit": s.unit,
        "period": s.period,
        "lets_go_at_standstill": s.lets_go,
        "unit": s.force_unit,
        "curves": {
            name: {
                "assumed": c.assumed.tolist(), "found": c.found.tolist(),
                "band_90": c.band.tolist(),
            }
            for name, c in s.curves.items()
        },
    }  # fmt: skip


def _remainder(d: AxisDiagnosis, region: Region | None) -> dict[str, Any] | None:
    """What stands above the noise floor beside the findings."""
    left = d.unexplained
    if left is None:
        return None
    fit = d.with_named
    return {
        "error": fit.error,
        "over_noise_floor": fit.ratio,
        "unit": fit.axis.units.force,
        "depends_on": left.depends_on,
        "share_of_error": left.share_of_error,
        "period": left.period,
        "period_unit": left.unit,
        "where": region
        and {
            "coordinate": region.coordinate,
            "low": region.low,
            "high": region.high,
            "coordinate_unit": region.unit,
            "error": region.rms,
            "unit": region.force_unit,
            "over_noise_floor": region.ratio,
            "share_of_error": region.share,
        },
        "advice": advice(d.findings),
    }


def _step(s: Step, d: AxisDiagnosis) -> dict[str, Any]:
    return {
        **_candidate(s.tried.candidate, d),
        "effect": s.change.name,
        "change": change_in_words(s.change),
        "dropped": list(s.dropped),
        "with_others": s.with_others,
    }


def _candidate(c: Candidate, d: AxisDiagnosis) -> dict[str, Any]:
    return {
        "effect": c.effect.name,
        "delta_bic": c.delta_bic if c.score else None,
        "holdout_error_before": c.gain.before,
        "holdout_error_after": c.gain.after,
        "unit": c.fit.axis.units.force,
        "supported": c.supported,
        "part": c.part,
        "why_not": why_not(d, c) or None,
        **parameters_json(c),
    }
