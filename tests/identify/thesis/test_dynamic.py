"""Chapter "dynamic" in small: the beginning explains the misfit, and both parameters are found."""

from __future__ import annotations

import json

import pytest

import identify
from identify.output.plain import plain
from identify.output.reproduction import reproduction_json, reproduction_text


def test_dynamic_parameters_are_found_where_the_simplex_search_from_rest_is_misled() -> None:
    done = identify.reproduce(["dynamic"], small=True)
    chapter = json.loads(json.dumps(plain(reproduction_json(done))))["chapters"]["dynamic"]
    for name, p in chapter["parameters"].items():
        assert p["mean"] == pytest.approx(p["true"], rel=2e-3), name
    assert abs(chapter["simplex"]["sigma0"]["error"]) > 0.01
    records = chapter["records"]
    for name in chapter["parameters"]:
        shut, opened = (records[r]["relative_half_width_90"][name] for r in records)
        assert shut > 50.0 * opened
    assert records["closed_loop"]["friction_change"] < 0.2 * records["closed_loop"]["force_noise"]
    first = chapter["position_error"]["first_period"]
    assert first["beginning_estimated"][0] < 1e-3 * first["from_rest"][0]
    assert "simplex search" in reproduction_text(done)
