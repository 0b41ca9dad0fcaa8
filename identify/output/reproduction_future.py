"""Chapter "future" of the reproduced study as a JSON object."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from identify.thesis.aging import Drift
from identify.thesis.chapter import Recovered
from identify.thesis.future import FutureResult
from identify.thesis.mixtures import Mixture


def recovered_json(r: Recovered) -> dict[str, Any]:
    """One parameter: planted, found, printed."""
    return {
        "true": r.true, "mean": r.mean, "sd": r.sd, "printed": r.printed, "unit": r.unit,
        "error": r.error, "rms_error": r.rms_error,
    }  # fmt: skip


def future_json(result: FutureResult) -> dict[str, Any]:
    """The chapter as the documented object."""
    slow, aging = result.slow, result.aging
    return {
        "elements": {
            "planted": result.planted, "found": result.chosen.count,
            "tried": [
                {"elements": e.count, "delta_bic": e.delta_bic, "error_over_noise_floor":
                 e.over_floor} for e in result.elements
            ],
        },
        "residuals": [
            {"model": b.name, "parameters_added": b.parameters, "holdout_error": b.held_out,
             "test_error": b.test} for b in result.beside
        ],
        "noise_floor": result.floor,
        "near_zero_speed": {
            "velocity": slow.speed.tolist(), "velocity_unit": "m/s", "true": slow.planted.tolist(),
            "map": slow.mapped.tolist(), "found": slow.fitted.tolist(), "printed": None,
        },
        "unit": "N",
        "long_run": {
            **{n: _drift(d) for n, d in (("aging", aging.level), ("without", aging.steady))},
            "parameters": {
                k: {**recovered_json(r), "half_width_90": aging.half.get(k)}
                for k, r in aging.planted.items()
            },
        },
        "mixtures": [_mixture(m, [e.count for e in result.elements]) for m in result.mixtures],
    }  # fmt: skip


def _mixture(found: Mixture, counts: Sequence[int]) -> dict[str, Any]:
    return {
        "machine": found.machine,
        "weight": {
            "true": found.planted, "found": found.weight, "half_width_90": found.half, "unit": "1",
            "printed": None,
        },
        "error_over_noise_floor": {
            **{t.name: t.over_floor for t in (*found.alone, found.both)},
            "elements": {
                str(n): t.over_floor for n, t in zip(counts, found.elements, strict=True)
            },
        },
    }  # fmt: skip


def _drift(drift: Drift) -> dict[str, Any]:
    slope, error = drift.slope
    return {
        "distance": drift.distance.tolist(), "distance_unit": "m", "true": drift.truth.tolist(),
        "found": drift.found.tolist(), "half_width_90": drift.half.tolist(), "unit": drift.unit,
        "slope": slope, "slope_standard_error": error, "slope_unit": f"{drift.unit}/m",
        "detected": drift.detected, "printed": None,
    }  # fmt: skip
