"""The reproduced study as a JSON object and as text: planted, found, band, printed."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

from identify.output.agreement import agree_json
from identify.output.words.reproduction import (
    cable_in_words,
    recovered_in_words,
    residuals_in_words,
    simulation_in_words,
    track_in_words,
    twin_in_words,
)
from identify.thesis.cable import CableStudy
from identify.thesis.chapter import Recovered
from identify.thesis.residuals import ResidualStudy
from identify.thesis.simulation import SimulationStudy
from identify.thesis.study import Reproduction
from identify.thesis.track import Along, TrackStudy
from identify.thesis.twin import TwinStudy


def reproduction_json(result: Reproduction) -> dict[str, Any]:
    """The documented object: every chapter that was run, and the seconds that it took."""
    return {
        "chapters": {name: JSON[name](found) for name, found in result.chapters.items()},
        "small": result.small,
        "seconds": sum(result.seconds.values()),
        "seconds_by_chapter": dict(result.seconds),
    }


def reproduction_text(result: Reproduction) -> str:
    """The main numbers of each chapter."""
    lines = []
    for name, found in result.chapters.items():
        lines.append(f"{name} ({result.seconds[name]:.0f} s)")
        lines += [f"  {line}" for line in TEXT[name](found)]
    return "\n".join(lines)


def _recovered(r: Recovered) -> dict[str, Any]:
    return {
        "true": r.true, "mean": r.mean, "sd": r.sd, "printed": r.printed, "unit": r.unit,
        "error": r.error, "rms_error": r.rms_error,
    }  # fmt: skip


def _simulation(study: SimulationStudy) -> dict[str, Any]:
    return {
        "snr_db": study.snr,
        "trials": study.trials,
        "parameters": {k: _recovered(r) for k, r in study.parameters.items()},
        "by_snr_db": {
            f"{snr:g}": {k: _recovered(r) for k, r in found.items()}
            for snr, found in study.by_snr.items()
        },
        "sensitivity": {
            "factors": study.sensitivity.factors.tolist(),
            "force_error": {k: f.tolist() for k, f in study.sensitivity.force.items()},
            "unit": "N",
        },
        "map": {
            "velocity": study.map.velocity.tolist(), "velocity_unit": "m/s",
            "friction": study.map.friction.tolist(), "friction_unit": "N",
        },
    }  # fmt: skip


def _cable(study: CableStudy) -> dict[str, Any]:
    found = study.found
    return {
        "repeats": study.repeats,
        "pitch": study.pitch
        and {
            **_recovered(study.pitch),
            "standard_error": found.pitch and found.pitch.standard_error,
        },
        "spikes": [
            {"centre": s.centre, "width": s.width, "ahead": s.ahead, "behind": s.behind}
            for s in found.spikes
        ],
        "position": found.position.tolist(),
        "position_unit": "m",
        "true": study.planted.tolist(),
        "found": found.force.tolist(),
        "band_90": found.band.tolist(),
        "with_spikes": found.with_all.tolist(),
        "unit": "N",
        "rms_error": study.rms_error,
        "largest_error": study.largest_error,
        "rms_error_with_spikes": study.rms_error_with_all,
        "within_band": study.within_band,
        "printed": None,
    }


def _track(study: TrackStudy) -> dict[str, Any]:
    return {
        "position": study.places.tolist(),
        "position_unit": "m",
        **{
            way: {
                DIRECTIONS[d]: {k: _along(a) for k, a in found.items()} for d, found in by.items()
            }
            for way, by in (("map", study.maps), ("fit", study.fits))
        },
    }


DIRECTIONS = {1.0: "forwards", -1.0: "backwards"}


def _along(a: Along) -> dict[str, Any]:
    return {
        "true": a.planted.tolist(), "found": a.found.tolist(), "half_width_90": a.half.tolist(),
        "within": a.within, "largest_error": a.largest_error, "unit": a.unit, "printed": None,
    }  # fmt: skip


def _residuals(study: ResidualStudy) -> dict[str, Any]:
    tests = {"before": study.before, "after": study.after}
    return {
        "fitted": study.first,
        "planted": study.planted,
        "verdict": study.verdict.name.lower(),
        "named": list(study.named),
        "ranking": [
            {"effect": c.name, "delta_bic": c.delta_bic, "error_over_noise_floor": c.over_floor}
            for c in study.ranking
        ],
        "test_error_before": study.error_before,
        "test_error_after": study.error_after,
        "noise_floor": study.floor,
        "unit": "N",
        "white": {name: t.passes for name, t in tests.items()},
        "outside_90_bounds": {
            name: {c.signal: c.outside for c in t.correlations} for name, t in tests.items()
        },
        "parameters": {k: _recovered(r) for k, r in study.values.items()},
    }


def _twin(study: TwinStudy) -> dict[str, Any]:
    return {
        "alike": agree_json(study.alike),
        "changed": {**agree_json(study.changed), "added_mass": study.added, "unit": "kg"},
        "closed_loop_error": {k: {"found": v, "unit": "1"} for k, v in study.errors.items()},
    }


JSON: Mapping[str, Callable[[Any], dict[str, Any]]] = {
    "simulation": _simulation,
    "cable": _cable,
    "track": _track,
    "residuals": _residuals,
    "twin": _twin,
}
TEXT: Mapping[str, Callable[[Any], list[str]]] = {
    "simulation": lambda study: [
        *simulation_in_words(study),
        *(recovered_in_words(name, r) for name, r in study.parameters.items()),
    ],
    "cable": cable_in_words,
    "track": track_in_words,
    "residuals": residuals_in_words,
    "twin": twin_in_words,
}
