"""The reproduced study as JSON: each number under its own name, in its own place."""

from __future__ import annotations

import json

import built_chapters as made
import numpy as np
import pytest

from identify.output.plain import plain
from identify.output.reproduction import reproduction_json, reproduction_text
from identify.thesis.chapter import Recovered
from identify.thesis.chapters import Reproduction

SECONDS = {name: 1.5 + i for i, name in enumerate(made.CHAPTERS)}
ALL = Reproduction(made.CHAPTERS, SECONDS, small=True)


@pytest.fixture(scope="module")
def told() -> dict:
    return json.loads(json.dumps(plain(reproduction_json(ALL))))


def of(r: Recovered) -> dict:
    """What JSON says of a parameter, by its definition."""
    off = np.asarray(r.values) / r.true - 1.0
    return {
        "true": r.true, "mean": pytest.approx(np.mean(r.values)), "printed": r.printed,
        "sd": pytest.approx(np.std(r.values, ddof=1) if len(r.values) > 1 else 0.0),
        "unit": r.unit, "error": pytest.approx(np.mean(off)),
        "rms_error": pytest.approx(np.sqrt(np.mean(off**2))),
    }  # fmt: skip


def test_the_study_says_how_long_each_chapter_took(told) -> None:
    assert told["seconds_by_chapter"] == SECONDS
    assert told["seconds"] == pytest.approx(sum(SECONDS.values()))
    assert told["small"] is True
    lines = reproduction_text(ALL).splitlines()
    heads = [line for line in lines if not line.startswith("  ")]
    assert heads == [f"{name} ({seconds:.0f} s)" for name, seconds in SECONDS.items()]


def test_models_in_json(told) -> None:
    found, r = told["chapters"]["models"], made.MODELS
    ratios = found["error_over_noise_floor"]
    for i, machine in enumerate(r.laws):
        for j, law in enumerate(r.laws):
            row = [None if np.isnan(x) else x for x in r.ratios[i, j]]
            assert list(ratios[machine][law].values()) == row
        assert found["by_law"][machine] == {
            "right_starts": r.right[i], "starts": 8, "fit_time": r.seconds[i],
            "step_time": r.step[i], "time_unit": "s", "loop_open_by": r.loops[machine].gap,
            "nested_loops_open_by": r.nested[machine].gap, "unit": "N", "printed": None,
        }  # fmt: skip


def test_the_simulation_study_in_json(told) -> None:
    found, r = told["chapters"]["simulation"], made.SIMULATION
    assert found["by_snr_db"] == {
        f"{snr:g}": {k: of(p) for k, p in by.items()} for snr, by in r.by_snr.items()
    }
    assert found["parameters"] == found["by_snr_db"]["60"]
    assert found["sensitivity"]["force_error"]["v0"] == r.sensitivity.force["v0"].tolist()
    assert found["map"]["velocity"] == r.map.velocity.tolist()
    assert found["map"]["friction"] == r.map.friction.tolist()


@pytest.mark.parametrize("result", [made.CABLE, made.CABLE_OF_LOGS])
def test_the_cable_in_json(result) -> None:
    found = reproduction_json(Reproduction({"cable": result}, {"cable": 1.0}, False))
    told, c = found["chapters"]["cable"], made.CABLE_FOUND
    for key, values in (("position", c.position), ("found", c.force), ("band_90", c.band),
                        ("with_spikes", c.with_all)):  # fmt: skip
        assert told[key] == values.tolist()
    assert told["spikes"][1] == {"centre": -0.0227, "width": 0.0019, "ahead": 0.023,
                                 "behind": -0.013}  # fmt: skip
    assert told["pitch"]["standard_error"] == 1.3e-5
    planted = result is made.CABLE
    assert told["repeats"] == (5 if planted else 3)
    assert told["true"] == (made.CABLE.planted.tolist() if planted else None)
    if planted:
        off = c.force - made.CABLE.planted
        assert told["largest_error"] == pytest.approx(np.abs(off).max())
        assert told["rms_error_with_spikes"] == pytest.approx(
            np.sqrt(np.mean((c.with_all - made.CABLE.planted) ** 2))
        )
        assert told["pitch"]["mean"] == pytest.approx(0.034 * 1.002)
    else:
        assert told["pitch"]["mean"] == 0.03407


def test_the_track_in_json(told) -> None:
    found = told["chapters"]["track"]
    for way, by in (("map", made.TRACK.maps), ("fit", made.TRACK.fits)):
        for side, direction in (("forwards", 1.0), ("backwards", -1.0)):
            for name, a in by[direction].items():
                off = np.abs(a.found - a.planted)
                assert found[way][side][name] == {
                    "true": a.planted.tolist(), "found": a.found.tolist(),
                    "half_width_90": a.half.tolist(), "unit": made.UNITS[name], "printed": None,
                    "within": np.mean(off <= a.half),
                    "largest_error": pytest.approx((off / a.planted).max()),
                }  # fmt: skip
                assert found[way][side][name]["within"] == pytest.approx(0.6)


def test_the_dynamic_part_in_json(told) -> None:
    found, r = told["chapters"]["dynamic"], made.DYNAMIC
    for key, record in (("closed_loop", r.closed), ("open_loop", r.opened)):
        assert found["records"][key] == {
            "friction_change": record.friction, "force_noise": record.noise, "unit": "N",
            "relative_half_width_90": record.half_widths, "found_over_true": record.found,
        }  # fmt: skip
    assert found["simplex"] == {k: of(p) for k, p in r.simplex.items()}
    assert found["parameters"] == {k: of(p) for k, p in r.fitted.items()}
    assert found["seconds_at_a_place"] == {"simplex": 3.7, "fit": 0.19}
    assert found["position_error"] == {
        "first_period": {"from_rest": [5.1e-4, 4.7e-4], "beginning_estimated": [1.3e-8, 1.7e-8]},
        "after": {"from_rest": [3.1e-5, 3.7e-5], "beginning_estimated": [2.3e-9, 1.9e-9]},
    }


def test_residuals_and_future_work_in_json(told) -> None:
    found, r = told["chapters"]["residuals"], made.RESIDUALS
    assert (found["fitted"], found["planted"], found["named"]) == ("lugre", "gms", ["gms"])
    assert (found["test_error_before"], found["test_error_after"]) == (0.0431, 0.00219)
    assert found["noise_floor"] == 0.00207
    assert found["ranking"][2] == {
        "effect": "effect_2", "delta_bic": pytest.approx(100 / 3), "error_over_noise_floor": 3.13
    }  # fmt: skip
    for name, tests in (("before", r.before), ("after", r.after)):
        assert found["outside_90_bounds"][name] == {c.signal: c.outside for c in tests.correlations}
    future, f = told["chapters"]["future"], made.FUTURE
    assert (future["elements"]["planted"], future["elements"]["found"]) == (4, 4)
    assert future["elements"]["tried"][2] == {
        "elements": 6, "delta_bic": 871.0, "error_over_noise_floor": 1.11
    }  # fmt: skip
    assert future["residuals"][1] == {
        "model": "empirical_map", "parameters_added": 31, "holdout_error": 0.0279,
        "test_error": 0.0291,
    }  # fmt: skip
    slow = future["near_zero_speed"]
    assert [slow[k][0] for k in ("velocity", "true", "map", "found")] == [1e-4, 0.41, 0.23, 0.4105]
    for key, drift, seen in (("aging", f.aging.level, True), ("without", f.aging.steady, False)):
        run = future["long_run"][key]
        assert [run[k] for k in ("distance", "true", "found", "half_width_90")] == [
            x.tolist() for x in (drift.distance, drift.truth, drift.found, drift.half)
        ]
        assert (run["slope"], run["slope_standard_error"]) == drift.slope
        assert (run["slope_unit"], run["detected"]) == ("N/m", seen)


def test_the_twin_in_json(told) -> None:
    found = told["chapters"]["twin"]
    assert (found["alike"]["agree"], found["changed"]["agree"]) == (True, False)
    assert found["changed"]["added_mass"] == 0.153
    assert found["changed"]["axes"]["x"]["differing"] == ["p0", "p2"]
    assert found["closed_loop_error"]["velocity"] == {
        "found": 4.1e-3, "unit": "1", "published_emps": {"run": 2.29e-3, "pulses": 4.79e-3}
    }  # fmt: skip
