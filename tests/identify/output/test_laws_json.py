"""The JSON objects: every documented key with the number it names, and never NaN or infinity."""

from __future__ import annotations

import math
from dataclasses import replace

import built_results as made
import numpy as np
import pytest
from built_fits import CATALOGUE, NOISE
from strict_json import expected_refit, strict

from identify.dataset.floor import NoiseFloor
from identify.output.as_json import (
    add_json,
    compare_json,
    fit_json,
    plan_json,
)
from identify.output.machine import check_json, effect_json
from identify.output.words.fit import OUTCOMES, aliasing_in_words, no_interval_in_words
from identify.output.words.plan import gap_in_words
from identify.output.words.residual import loop_in_words, region_in_words
from twin.checks import CheckReport, Fault, Finding, Severity
from twin.model.units import LINEAR


def test_what_is_not_finite_is_null_at_any_depth():
    values = [math.nan, math.inf, -math.inf, np.float64("nan"), np.float32("inf")]
    found = strict({"a": values, "b": ({"c": values[1]}, 1.5), 3: [[np.nan]]})
    assert found == {"a": [None] * 5, "b": [{"c": None}, 1.5], "3": [[None]]}


def test_numbers_stay_what_they_are():
    given = {"f": np.float64(0.1), "i": np.int64(7), "t": np.bool_(True), "s": "x", "n": None}
    assert strict(given) == {"f": 0.1, "i": 7, "t": True, "s": "x", "n": None}
    assert strict({"big": 1e308, "small": -5e-324, "int": 10**20}) == {
        "big": 1e308, "small": -5e-324, "int": 10**20,
    }  # fmt: skip


def test_a_fit():
    result = made.fit_result()
    found = strict(fit_json(result))["axes"]
    for axis, fit in result.fits.items():
        told = found[axis]
        parameters, refit = told.pop("parameters"), told.pop("refit")
        assert told == {
            "outcome": OUTCOMES[fit.ended], "converged": True, "at_bound": [],
            "left_out": [], "force_noise": 0.0,
            "beginnings_left_out": {}, "beginnings_left_out_unit": "s",
            "force_error": pytest.approx(fit.error), "noise_floor": fit.floor, "unit": "N",
            "holdout_force_error": result.holdout_error[axis],
            "test_force_error": result.test_error[axis],
            "force_shift": result.datasets[axis].channel_delay, "force_shift_unit": "s",
        }  # fmt: skip
        assert parameters == {
            e.label: {
                "value": e.value, "unit": e.unit, "free": e.free,
                "interval_refused": e.reason and no_interval_in_words(e.reason),
                "interval_90": None if e.low is None else [e.low, e.high],
            }
            for e in result.estimates[axis]
        }  # fmt: skip
        assert refit == expected_refit(result.refits[axis])


def test_a_comparison():
    result = made.compared()
    found = strict(compare_json(result))["axes"]
    assert list(found) == list(result.axes)
    for axis, c in result.axes.items():
        told = found[axis]
        assert (told["noise_floor"], told["position_drift_of_noise"]) == (c.floor, c.position_floor)
        assert told["worst"] == [region_in_words(r) for r in c.worst]
        for name in ("run 1", "run 2"):
            force, position = c.force_error[name], c.position_error[name]
            assert told["logs"][name] == {
                "force_error": force, "force_unit": "N", "force_ratio": force / c.floor,
                "position_error": position, "position_unit": "m",
                "position_ratio": position / c.position_floor[name],
            }  # fmt: skip
        assert told["regions"] == {
            m.coordinate: {
                "unit": m.unit, "centre": list(m.centre), "force_error": list(m.rms),
                "mean": list(m.mean), "share": list(m.share), "noise_floor": list(m.floor),
            }
            for m in c.maps
        }  # fmt: skip
        tests = told["residual_tests"]
        assert tests == {
            "tested": "force residual", "loop": "open", "reason": loop_in_words(c.tests.loop),
            "samples": 387,
            "passed": all(t.passes for t in c.tests.correlations),
            "histogram": {
                "edges": list(c.tests.edges), "unit": "N", "density": list(c.tests.density),
                "density_unit": "1/N", "normal_rms": c.tests.floor,
                "share_within_90": c.tests.within,
            },
            "correlations": {
                t.signal: {
                    "lag": list(t.lag), "lag_unit": "s", "value": list(t.value),
                    "tested": t.tested.tolist(), "bound_90": t.bound, "limit_all_99": t.limit,
                    "share_outside": t.outside, "passed": t.passes,
                }
                for t in c.tests.correlations
            },
        }  # fmt: skip


def test_a_position_without_noise_has_a_finite_ratio_or_none():
    c = replace(made.comparison_of(), position_floor={"run 1": 0.0, "run 2": 0.0})
    result = made.Comparison(made.MODEL, {"x": c})
    ratio = strict(compare_json(result))["axes"]["x"]["logs"]["run 1"]["position_ratio"]
    assert ratio is None or ratio > 1e200


def expected_trial(t, gain):
    kinds = {"Passes": "passes", "Tracking": "tracking"}
    own = {"axis": "x", "span": 0.0831, "speed": 0.0127, "repeats": 7}
    experiment = own if type(t.experiment).__name__ == "Passes" else {"duration": 9.7}
    return {
        "experiment": {"kind": kinds[type(t.experiment).__name__], **experiment},
        "duration": t.duration, "duration_unit": "s", "expected_difference": t.difference,
        "noise_floor": t.floor, "unit": "N", gain: t.gain,
    }  # fmt: skip


@pytest.mark.parametrize("names", [("cogging", "wear"), ("the stage",)])
def test_a_plan(names):
    plan = made.plan_of(*names, favoured="wear", supposed=len(names) == 1)
    gain = "delta_bic" if len(names) > 1 else "information"
    assert strict(plan_json(plan)) == {
        "axis": "x", "between": list(names), "decides": True, "favoured_by_the_logs": "wear",
        "refitted_on_logs": len(names) > 1, "missing_motion": gap_in_words(plan.gap),
        "excited_by": {names[0]: "slow passes"}, "not_run": [],
        **expected_trial(plan.chosen, gain),
        "ranking": [expected_trial(t, gain) for t in plan.ranking],
    }  # fmt: skip


def test_the_information_of_one_model_has_no_difference():
    trial = replace(made.TRIALS[0], difference=float("nan"))
    found = strict(plan_json(made.plan_of("the stage", ranking=(trial,))))
    assert found["expected_difference"] is None
    assert found["information"] == 57.3


@pytest.mark.parametrize("kept", [True, False])
def test_an_addition(kept):
    a = made.addition(kept)
    s, c = a.step, a.candidate
    assert strict(add_json(a)) == {
        "action": "add", "effect": "cogging", "axis": "x", "is_nonparametric": False,
        "kept": kept, "part": c.part, "why_not": c.refused,
        "fit_error_before": s.fit_error_before, "fit_error_after": s.fit_error_after,
        "holdout_error_before": s.holdout_error_before,
        "holdout_error_after": s.holdout_error_after, "noise_floor": c.fit.floor,
        "test_error_before": s.test_error_before, "test_error_after": s.test_error_after,
        "unit": "N", "position_error_before": a.position_error[0],
        "position_error_after": a.position_error[1], "position_error_in_mujoco": a.replayed,
        "position_error_on": "run 1",
        "position_unit": "m", "parameters": dict(c.fit.axis[c.effect.name].values),
        "parameter_units": {p.name: p.unit for p in c.effect.parameters},
        "notes": list(a.notes),
    }  # fmt: skip
    unheld = replace(a, step=made.STEPS[2], candidate=made.candidate("wear", 0.5))
    found = strict(add_json(unheld))
    assert (found["holdout_error_before"], found["holdout_error_after"]) == (None, None)


@pytest.mark.parametrize("name", ["lugre", "learned_residual", NOISE.name])
def test_an_effect(name):
    e = CATALOGUE[name]
    found = strict(effect_json(e))
    parameters = found.pop("parameters")
    texts = ("name", "summary", "equation", "source", "fingerprint", "excited_by")
    assert found == {
        **{t: getattr(e, t) for t in texts}, "kind": e.kind.name.lower(),
        "is_nonparametric": name == "learned_residual", "states": list(e.states),
    }  # fmt: skip
    keys = ("name", "unit", "start", "lower", "upper", "meaning")
    assert parameters == [{k: getattr(p, k) for k in keys} for p in e.parameters]


def test_a_check():
    finding = Finding(Severity.ERROR, Fault.LAG, "y", "the what", "the where", "the remedy")
    mild = replace(finding, severity=Severity.WARNING, fault=Fault.SIGN, axis="x")
    reports = {"a": CheckReport((finding, mild)), "b": CheckReport(())}
    found = strict(check_json(reports))
    assert found["ok"] is False
    assert found["logs"]["b"] == []
    assert [list(f.values()) for f in found["logs"]["a"]] == [
        ["error", "lag", "y", "the what", "the where", "the remedy"],
        ["warning", "sign", "x", "the what", "the where", "the remedy"],
    ]
    assert list(found["logs"]["a"][0]) == [
        "severity", "fault", "axis", "what", "where", "remedy",
    ]  # fmt: skip
    assert strict(check_json({"a": CheckReport((mild,))}))["ok"] is True
    assert check_json({}) == {"ok": True, "logs": {}}


@pytest.mark.parametrize(("folded", "told"), [(0.038, True), (0.02, False), (0.0, False)])
def test_a_thinned_log_is_told_with_what_to_log_instead(folded: float, told: bool) -> None:
    noise = NoiseFloor(0.04, 0.03, 0.05, {"sensors": 0.01, "aliasing": folded})
    said = aliasing_in_words(noise, LINEAR)
    assert (said is not None) is told
    if said is not None:
        assert "38.0 mN of the noise floor of 40.0 mN" in said
        assert "log at the control rate, or the drive's averaged current" in said
