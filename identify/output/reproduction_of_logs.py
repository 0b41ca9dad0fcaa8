"""Chapters on logs of a real machine as JSON objects: found and band; nothing is planted."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from identify.output.agreement import agree_json
from identify.output.words.thesis_maps import UNITS
from identify.thesis.maps_of_logs import MapOfLogs, TrackOfLogs
from identify.thesis.printed import EMPS_CLOSED_LOOP
from identify.thesis.twin import TwinOfLogs

DIRECTIONS = {1.0: "forwards", -1.0: "backwards"}


def map_of_logs_json(result: MapOfLogs) -> dict[str, Any]:
    """The map, and by direction the parameters of the curve through it."""
    found = result.map
    return {
        "map": {
            "velocity": found.velocity.tolist(), "velocity_unit": result.units.velocity,
            "friction": found.friction.tolist(), "friction_unit": result.units("N"),
            "position": found.position.tolist(), "position_unit": result.units.position,
        },
        "parameters": {
            DIRECTIONS[way]: {
                n: {"true": None, "found": v, "half_width_90": curve.half[n],
                    "unit": result.units(UNITS[n]), "printed": None}
                for n, v in curve.values.items()
            }
            for way, curve in result.curves.items()
        },
        "mean": result.both,
    }  # fmt: skip


def track_of_logs_json(result: TrackOfLogs) -> dict[str, Any]:
    """A map for each place."""
    return {
        "position": result.places.tolist(),
        "position_unit": result.maps[0].units.position,
        "maps": [map_of_logs_json(m) for m in result.maps],
    }


def twin_of_logs_json(result: TwinOfLogs) -> dict[str, Any]:
    """By log, the agreement of the fits and the errors of the closed loop."""
    return {
        log: {"alike": agree_json(alike), "closed_loop_error": closed_loop_json(result.errors[log])}
        for log, alike in result.alike.items()
    }


def closed_loop_json(errors: Mapping[str, float]) -> dict[str, Any]:
    """Relative RMS errors by signal, beside those published for another machine."""
    return {
        signal: {
            "found": error, "published_emps": dict(
                zip(("run", "pulses"), EMPS_CLOSED_LOOP[signal], strict=True)
            ), "unit": "1",
        }
        for signal, error in errors.items()
    }  # fmt: skip
