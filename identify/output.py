"""Results as JSON objects (the documented ones) and as text for a terminal."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

from identify.candidates import Candidate
from identify.compare import AxisComparison
from identify.uncertainty import Estimate
from identify.workflow import Addition, Comparison, Diagnosis, FitResult
from twin.effect import Effect


def plain(value: Any) -> Any:
    """The same with NumPy numbers as numbers and what is not finite as null."""
    if isinstance(value, Mapping):
        return {str(k): plain(v) for k, v in value.items()}
    if isinstance(value, list | tuple):
        return [plain(v) for v in value]
    if hasattr(value, "item"):
        value = value.item()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def fit_json(result: FitResult) -> dict[str, Any]:
    """Per axis: parameters with unit and 90 % interval, the outcome, fit and held-out errors."""
    return {
        "axes": {
            axis: {
                "outcome": fit.outcome.value,
                "converged": fit.outcome.name == "CONVERGED",
                "force_error": fit.error,
                "holdout_force_error": result.holdout_error[axis],
                "noise_floor": fit.floor,
                "unit": "N",
                "parameters": {e.label: _estimate(e) for e in result.estimates[axis]},
            }
            for axis, fit in result.fits.items()
        }
    }


def _estimate(e: Estimate) -> dict[str, Any]:
    interval = None if e.low is None else [e.low, e.high]
    return {
        "value": e.value, "unit": e.unit, "interval_90": interval, "free": e.free,
        "interval_refused": e.reason,
    }  # fmt: skip


def compare_json(result: Comparison) -> dict[str, Any]:
    """Per axis and log: force and position error with ratio to the noise floor, and regions."""
    return {"axes": {axis: _axis_comparison(c) for axis, c in result.axes.items()}}


def _axis_comparison(c: AxisComparison) -> dict[str, Any]:
    return {
        "logs": {
            name: {
                "force_error": error,
                "force_unit": "N",
                "force_ratio": error / c.floor,
                "position_error": c.position_error[name],
                "position_unit": "m",
                "position_ratio": c.position_error[name] / max(c.position_floor, 1e-300),
            }
            for name, error in c.force_error.items()
        },
        "noise_floor": c.floor,
        "position_noise": c.position_floor,
        "regions": {
            m.coordinate: {
                "unit": m.unit, "centre": m.centre.tolist(), "force_error": m.rms.tolist(),
                "mean": m.mean.tolist(), "share": m.share.tolist(),
            }
            for m in c.maps
        },
        "worst": [r.in_words() for r in c.worst],
    }  # fmt: skip


def diagnose_json(result: Diagnosis) -> dict[str, Any]:
    """The documented object for the axis that the answer is about, and the same by axis."""
    leading = result.leading
    by_axis = {axis: _axis_diagnosis(result, axis) for axis in result.axes}
    return {**by_axis[leading.study.axis], "axes": by_axis}


def _axis_diagnosis(result: Diagnosis, axis: str) -> dict[str, Any]:
    d = result.axes[axis]
    structure = d.unexplained
    return {
        "verdict": d.verdict.name.lower(),
        "explanation": d.verdict.value,
        "axis": axis,
        "effect": d.best.effect.name if d.best else None,
        "ranking": [_candidate(c) for c in d.ranking],
        "ambiguous_with": list(d.ambiguous_with),
        "unexplained": structure
        and {
            "share_of_error": structure.share_of_error,
            "depends_on": structure.depends_on,
            "period": structure.period,
            "unit": structure.unit,
        },
        "force_error": d.base.error,
        "noise_floor": d.base.floor,
        "unit": "N",
        "next_experiment": None,
    }


def _candidate(c: Candidate) -> dict[str, Any]:
    return {
        "effect": c.effect.name,
        "delta_bic": c.delta_bic,
        "holdout_error_before": c.gain.before,
        "holdout_error_after": c.gain.after,
        "unit": "N",
        "supported": c.supported,
        "parameters": dict(c.fit.axis[c.effect.name].values),
    }


def add_json(result: Addition) -> dict[str, Any]:
    """Errors before and after, whether the effect earned its place, and what moved."""
    step = result.step
    return {
        "effect": step.effect,
        "axis": step.axis,
        "kept": result.kept,
        "fit_error_before": step.fit_error_before,
        "fit_error_after": step.fit_error_after,
        "holdout_error_before": step.holdout_error_before,
        "holdout_error_after": step.holdout_error_after,
        "noise_floor": result.candidate.fit.floor,
        "unit": "N",
        "position_error_before": result.position_error[0],
        "position_error_after": result.position_error[1],
        "position_error_in_mujoco": result.replayed,
        "position_unit": "m",
        "parameters": dict(result.candidate.fit.axis[step.effect].values),
        "notes": list(result.notes),
    }


def effect_json(effect: Effect) -> dict[str, Any]:
    """Everything the catalogue knows of one effect."""
    return {
        "name": effect.name,
        "kind": effect.kind.name.lower(),
        "summary": effect.summary,
        "equation": effect.equation,
        "source": effect.source,
        "states": list(effect.states),
        "fingerprint": effect.fingerprint,
        "excited_by": effect.excited_by,
        "parameters": [
            {
                "name": p.name, "unit": p.unit, "start": p.start, "lower": p.lower,
                "upper": p.upper, "meaning": p.meaning,
            }
            for p in effect.parameters
        ],
    }  # fmt: skip


def fit_text(result: FitResult) -> str:
    """Parameters of each axis, one a line."""
    lines = []
    for axis, fit in result.fits.items():
        held = result.holdout_error[axis]
        tail = "" if held is None else f", held out {held:.4g} N"
        lines.append(
            f"axis {axis}: force error {fit.error:.4g} N{tail}, noise floor {fit.floor:.4g} N "
            f"(ratio {fit.ratio:.2f})"
        )
        lines.append(f"  {fit.outcome.value}")
        for e in result.estimates[axis]:
            lines.append(f"  {e.label:34s} {_with_interval(e)}")
    return "\n".join(lines)


def _with_interval(e: Estimate) -> str:
    text = f"{e.value:12.6g} {e.unit:10s}"
    if not e.free:
        return text + " fixed"
    if e.low is None:
        return text + f" {e.reason}"
    return text + f" 90 % in [{e.low:.6g}, {e.high:.6g}]"


def compare_text(result: Comparison) -> str:
    """Errors by log, and the three worst regions of each axis."""
    lines = []
    for axis, c in result.axes.items():
        for name, error in c.force_error.items():
            lines.append(
                f"axis {axis}, {name}: force error {error:.4g} N ({error / c.floor:.1f} x noise "
                f"floor), free-running position error {c.position_error[name]:.3g} m"
            )
        lines += [f"  worst: {region.in_words()}" for region in c.worst]
        if not c.worst:
            lines.append("  nowhere does the error stand above the noise")
    return "\n".join(lines)


def diagnose_text(result: Diagnosis) -> str:
    """The answer for each axis with the ranking's head."""
    lines = []
    for axis, d in result.axes.items():
        named = f" {d.best.effect.name}." if d.best else ""
        lines.append(f"axis {axis}: {d.verdict.value}{named}")
        lines.append(
            f"  force error {d.base.error:.4g} N, noise floor {d.base.floor:.4g} N "
            f"(ratio {d.base.ratio:.2f})"
        )
        if d.ambiguous_with:
            lines.append(f"  cannot be told apart from: {', '.join(d.ambiguous_with)}")
        if d.unexplained:
            s = d.unexplained
            again = f", period {s.period:.4g} {s.unit}" if s.period else ""
            lines.append(
                f"  {100 * s.share_of_error:.0f} % of the squared error depends on "
                f"{s.depends_on.replace('_', ' ')}{again}"
            )
        lines += [_ranking_line(c) for c in d.ranking[:4]]
    return "\n".join(lines)


def _ranking_line(c: Candidate) -> str:
    return (
        f"  {c.effect.name:28s} evidence {c.delta_bic:10.1f}   held-out error "
        f"{c.gain.before:.4g} -> {c.gain.after:.4g} N{'' if c.supported else '   not supported'}"
    )


def add_text(result: Addition) -> str:
    """What adding the effect did."""
    s = result.step
    lines = [
        f"added {s.effect} to axis {s.axis}",
        f"  force error on the fit logs   {s.fit_error_before:.4g} -> {s.fit_error_after:.4g} N",
    ]
    if s.holdout_error_before is not None and s.holdout_error_after is not None:
        lines.append(
            "  force error held out          "
            f"{s.holdout_error_before:.4g} -> {s.holdout_error_after:.4g} N"
        )
    before, after = result.position_error
    lines.append(
        f"  free-running position error   {before:.3g} -> {after:.3g} m "
        f"(MuJoCo: {result.replayed:.3g} m)"
    )
    lines += [f"  {note}" for note in result.notes]
    if not result.kept:
        lines.append("  the data do not support this effect: it does not help held out")
    return "\n".join(lines)


def effects_text(effects: list[Effect]) -> str:
    """One line an effect."""
    width = max(len(e.name) for e in effects)
    return "\n".join(f"{e.name:{width}s}  {e.kind.name.lower():9s}  {e.summary}" for e in effects)


def effect_text(effect: Effect) -> str:
    """One effect in full."""
    rows = [
        f"  {p.name:14s} {p.start:>10.4g} {p.unit:10s} [{p.lower:g}, {p.upper:g}]  {p.meaning}"
        for p in effect.parameters
    ]
    return "\n".join(
        [
            f"{effect.name} ({effect.kind.name.lower()}): {effect.summary}",
            f"equation     {effect.equation}",
            f"source       {effect.source}",
            f"fingerprint  {effect.fingerprint}",
            f"excited by   {effect.excited_by}",
            "parameters   start value, unit, bounds, meaning",
            *rows,
        ]
    )
