"""The reproduced study as a JSON object and as text: planted, found, band, printed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from identify.estimation.cable_force import CableForce
from identify.output.agreement import agree_json
from identify.output.reproduction_future import future_json, recovered_json
from identify.output.reproduction_of_logs import (
    DIRECTIONS,
    closed_loop_json,
    map_of_logs_json,
    track_of_logs_json,
    twin_of_logs_json,
)
from identify.output.words.reproduction import (
    cable_in_words,
    cable_of_logs_in_words,
    recovered_in_words,
    residuals_in_words,
    simulation_in_words,
    track_in_words,
)
from identify.output.words.thesis_dynamic import dynamic_in_words
from identify.output.words.thesis_future import future_in_words
from identify.output.words.thesis_maps import map_in_words, track_of_logs_in_words
from identify.output.words.thesis_models import models_in_words
from identify.output.words.thesis_twin import twin_in_words, twin_of_logs_in_words
from identify.thesis.cable import CableOfLogs, CableResult
from identify.thesis.chapters import Reproduction
from identify.thesis.dynamic import DynamicResult
from identify.thesis.future import FutureResult
from identify.thesis.maps_of_logs import MapOfLogs, TrackOfLogs
from identify.thesis.models import ModelsResult
from identify.thesis.printed import ROLLER_PITCH
from identify.thesis.residuals import ResidualResult
from identify.thesis.simulation import SimulationResult
from identify.thesis.track import Along, TrackResult
from identify.thesis.twin import TwinOfLogs, TwinResult


def reproduction_json(result: Reproduction) -> dict[str, Any]:
    """The documented object: every chapter that was run, and the seconds that it took."""
    return {
        "chapters": {name: JSON[type(found)](found) for name, found in result.chapters.items()},
        "small": result.small,
        "seconds": sum(result.seconds.values()),
        "seconds_by_chapter": dict(result.seconds),
        "left_out": dict(result.left_out),
    }


def reproduction_text(result: Reproduction) -> str:
    """The main numbers of each chapter."""
    lines = []
    for name, found in result.chapters.items():
        lines.append(f"{name} ({result.seconds[name]:.0f} s)")
        lines += [f"  {line}" for line in TEXT[type(found)](found)]
    lines += [f"{name}: left out, {why}" for name, why in result.left_out.items()]
    return "\n".join(lines)


def _models(result: ModelsResult) -> dict[str, Any]:
    return {
        "laws": list(result.laws),
        "behaviours": list(result.behaviours),
        "error_over_noise_floor": {
            machine: {
                law: dict(zip(result.behaviours, ratios.tolist(), strict=True))
                for law, ratios in zip(result.laws, rows, strict=True)
            }
            for machine, rows in zip(result.laws, result.ratios, strict=True)
        },
        "by_law": {
            law: {
                "right_starts": float(result.right[i]), "starts": result.starts,
                "fit_time": float(result.seconds[i]), "step_time": float(result.step[i]),
                "time_unit": "s", "loop_open_by": result.loops[law].gap,
                "nested_loops_open_by": result.nested[law].gap, "unit": "N", "printed": None,
            }
            for i, law in enumerate(result.laws)
        },
        "traits": {
            law: {
                "fall": t.fall, "lag": t.lag, "slow_push": t.slow, "fast_push": t.fast, "unit": "N",
                "drift": t.drift, "drift_unit": "m/s", "printed": None,
            }
            for law, t in zip(result.laws, result.traits, strict=False)
        },
    }  # fmt: skip


def _simulation(result: SimulationResult) -> dict[str, Any]:
    return {
        "snr_db": result.snr,
        "trials": result.trials,
        "parameters": {k: recovered_json(r) for k, r in result.parameters.items()},
        "by_snr_db": {
            f"{snr:g}": {k: recovered_json(r) for k, r in found.items()}
            for snr, found in result.by_snr.items()
        },
        "sensitivity": {
            "factors": result.sensitivity.factors.tolist(),
            "force_error": {k: f.tolist() for k, f in result.sensitivity.force.items()},
            "unit": "N",
        },
        "map": {
            "velocity": result.map.velocity.tolist(), "velocity_unit": "m/s",
            "friction": result.map.friction.tolist(), "friction_unit": "N",
        },
    }  # fmt: skip


def _cable(result: CableResult) -> dict[str, Any]:
    found = result.found
    return {
        "repeats": result.repeats,
        "pitch": result.pitch
        and {
            **recovered_json(result.pitch),
            "standard_error": found.pitch and found.pitch.standard_error,
        },
        **_of_passes(found),
        "true": result.planted.tolist(),
        "rms_error": result.rms_error,
        "largest_error": result.largest_error,
        "rms_error_with_spikes": result.rms_error_with_all,
        "within_band": result.within_band,
        "printed": None,
    }


def _cable_of_logs(result: CableOfLogs) -> dict[str, Any]:
    found = result.found
    pitch = found.pitch
    return {
        "repeats": len(found.passes.alike),
        "pitch": pitch and {
            "mean": pitch.value, "standard_error": pitch.standard_error, "unit": "m",
            "printed": ROLLER_PITCH,
        },
        **_of_passes(found),
        "true": None,
        "printed": None,
    }  # fmt: skip


def _of_passes(found: CableForce) -> dict[str, Any]:
    return {
        "spikes": [
            {"centre": s.centre, "width": s.width, "ahead": s.ahead, "behind": s.behind}
            for s in found.spikes
        ],
        "position": found.position.tolist(),
        "position_unit": "m",
        "found": found.force.tolist(),
        "band_90": found.band.tolist(),
        "with_spikes": found.with_all.tolist(),
        "unit": "N",
    }


def _track(result: TrackResult) -> dict[str, Any]:
    return {
        "position": result.places.tolist(),
        "position_unit": "m",
        **{
            way: {
                DIRECTIONS[d]: {k: _along(a) for k, a in found.items()} for d, found in by.items()
            }
            for way, by in (("map", result.maps), ("fit", result.fits))
        },
    }


def _along(a: Along) -> dict[str, Any]:
    return {
        "true": a.planted.tolist(), "found": a.found.tolist(), "half_width_90": a.half.tolist(),
        "within": a.within, "largest_error": a.largest_error, "unit": a.unit, "printed": None,
    }  # fmt: skip


def _dynamic(result: DynamicResult) -> dict[str, Any]:
    records = {"closed_loop": result.closed, "open_loop": result.opened}
    return {
        "position": result.places.tolist(),
        "position_unit": "m",
        "records": {
            name: {
                "friction_change": r.friction, "force_noise": r.noise, "unit": "N",
                "relative_half_width_90": dict(r.half_widths), "found_over_true": dict(r.found),
            }
            for name, r in records.items()
        },
        "simplex": {k: recovered_json(r) for k, r in result.simplex.items()},
        "parameters": {k: recovered_json(r) for k, r in result.fitted.items()},
        "seconds_at_a_place": dict(zip(("simplex", "fit"), result.seconds, strict=True)),
        "position_error": {
            part: dict(zip(("from_rest", "beginning_estimated"), e.T.tolist(), strict=True))
            for part, e in (("first_period", result.first_period), ("after", result.afterwards))
        },
        "unit": "m",
    }  # fmt: skip


def _residuals(result: ResidualResult) -> dict[str, Any]:
    tests = {"before": result.before, "after": result.after}
    return {
        "fitted": result.first,
        "planted": result.planted,
        "verdict": result.verdict.name.lower(),
        "named": list(result.named),
        "ranking": [
            {"effect": c.name, "delta_bic": c.delta_bic, "error_over_noise_floor": c.over_floor}
            for c in result.ranking
        ],
        "test_error_before": result.error_before,
        "test_error_after": result.error_after,
        "noise_floor": result.floor,
        "unit": "N",
        "white": {name: t.passes for name, t in tests.items()},
        "outside_90_bounds": {
            name: {c.signal: c.outside for c in t.correlations} for name, t in tests.items()
        },
        "parameters": {k: recovered_json(r) for k, r in result.values.items()},
    }


def _twin(result: TwinResult) -> dict[str, Any]:
    return {
        "alike": agree_json(result.alike),
        "changed": {**agree_json(result.changed), "added_mass": result.added, "unit": "kg"},
        "closed_loop_error": closed_loop_json(result.errors),
    }


JSON: Mapping[type, Callable[[Any], dict[str, Any]]] = {
    ModelsResult: _models,
    SimulationResult: _simulation,
    CableResult: _cable,
    CableOfLogs: _cable_of_logs,
    TrackResult: _track,
    MapOfLogs: map_of_logs_json,
    TrackOfLogs: track_of_logs_json,
    DynamicResult: _dynamic,
    ResidualResult: _residuals,
    FutureResult: future_json,
    TwinResult: _twin,
    TwinOfLogs: twin_of_logs_json,
}
TEXT: Mapping[type, Callable[[Any], list[str]]] = {
    ModelsResult: models_in_words,
    SimulationResult: lambda result: [
        *simulation_in_words(result),
        *(recovered_in_words(name, r) for name, r in result.parameters.items()),
    ],
    CableResult: cable_in_words,
    CableOfLogs: cable_of_logs_in_words,
    TrackResult: track_in_words,
    MapOfLogs: map_in_words,
    TrackOfLogs: track_of_logs_in_words,
    DynamicResult: dynamic_in_words,
    ResidualResult: residuals_in_words,
    FutureResult: future_in_words,
    TwinResult: twin_in_words,
    TwinOfLogs: twin_of_logs_in_words,
}
