"""The JSON objects: every documented key with the number that it names, as the schema says."""

from __future__ import annotations

import json
import math
import sys
from dataclasses import replace

import built_results as made
import numpy as np
import pytest
from built_fits import CATALOGUE, NOISE, built_fit
from jsonschema import Draft202012Validator, ValidationError
from report_cases import cogging_case
from strict_json import shipped, strict, told, valid

from identify.estimation.fit import Outcome
from identify.output.answers.answer import plain
from identify.output.answers.machine import check_answer, effect_answer, laws_answer
from identify.output.as_json import FILE, json_of, schema_text
from identify.output.report import sections
from identify.output.words.diagnosis import SEVERAL, remarks_on
from identify.output.words.findings import advice
from identify.output.words.fit import MOTION_OUTCOMES, OUTCOMES, no_interval_in_words
from identify.output.words.plan import gap_in_words
from identify.output.words.residual import loop_in_words, region_in_words
from identify.selection.diagnosis import Verdict
from identify.selection.found_shape import Drawn, FoundShape
from identify.selection.free_exponent import FreeExponent
from identify.validation.agreement import Agreement
from twin.checks import CheckReport, Fault, Finding, Severity
from twin.curve import Coordinate
from twin.laws import verdict
from twin.model.parameters import free_parameters, read

# --- the schema ------------------------------------------------------------------------------


def test_the_schema_that_ships_is_that_of_the_code() -> None:
    text = FILE.read_text(encoding="utf-8")
    assert text == schema_text(), "run python -m identify.output.as_json"
    Draft202012Validator.check_schema(json.loads(text))


def test_a_key_more_or_less_is_no_answer() -> None:
    found = strict(json_of(made.fit_result()))
    for changed in ({**found, "more": 1}, {k: v for k, v in found.items() if k != "axes"}):
        with pytest.raises(ValidationError):
            valid(changed)
    assert {place["$ref"].rsplit("/", 1)[-1] for place in shipped()["anyOf"]} >= {
        "FitAnswer", "SimulationFitAnswer", "ComparisonAnswer", "DiagnosisAnswer",
        "AdditionAnswer", "PlanAnswer", "AgreementAnswer", "DemoAnswer", "ErrorAnswer",
    }  # fmt: skip


def test_what_is_no_number_is_null_and_numbers_stay_what_they_are() -> None:
    values = [math.nan, math.inf, -math.inf, np.float64("nan"), np.float32("inf")]
    found = strict(plain({"a": values, "b": ({"c": values[1]}, 1.5), 3: [[np.nan]]}))
    assert found == {"a": [None] * 5, "b": [{"c": None}, 1.5], "3": [[None]]}
    given = {"f": np.float64(0.1), "i": np.int64(7), "t": np.bool_(True), "s": "x", "n": None}
    assert strict(plain(given)) == {"f": 0.1, "i": 7, "t": True, "s": "x", "n": None}
    sizes = {"big": 1e308, "small": -5e-324, "int": 10**20}
    assert strict(plain(sizes)) == sizes


# --- fits and comparisons --------------------------------------------------------------------


def estimates(those) -> dict:
    return {
        e.label: {
            "value": e.value, "unit": e.unit, "free": e.free,
            "interval_refused": e.reason and no_interval_in_words(e.reason),
            "interval_90": None if e.low is None else [e.low, e.high],
        }
        for e in those
    }  # fmt: skip


def refit(changed) -> dict:
    return {
        "force_error_as_given": changed.given, "force_error": changed.refitted, "force_unit": "N",
        "changed": [
            {
                "parameter": c.label, "before": c.before, "after": c.after, "unit": c.unit,
                "force": c.force, "force_unit": "N", "same_force_as": list(c.alike),
            }
            for c in changed.changes
        ],
    }  # fmt: skip


def test_a_fit() -> None:
    result = made.fit_result()
    found = told(result, left_out=["run 3 says nothing"])
    assert (found["objective"], found["not_fitted"]) == ("force", [])
    assert found["left_out"] == ["run 3 says nothing"]
    for axis, fit in result.fits.items():
        assert found["axes"][axis] == {
            "outcome": OUTCOMES[fit.ended], "converged": True, "at_bound": [],
            "left_out": [], "force_noise": 0.0,
            "beginnings_left_out": {}, "beginnings_left_out_unit": "s",
            "force_error": pytest.approx(fit.error), "noise_floor": fit.floor, "unit": "N",
            "holdout_force_error": result.holdout_error[axis],
            "test_force_error": result.test_error[axis],
            "force_shift": result.datasets[axis].channel_delay, "force_shift_unit": "s",
            "parameters": estimates(result.estimates[axis]),
            "refit": refit(result.refits[axis]),
        }  # fmt: skip


def test_a_fit_of_simulated_motion() -> None:
    result = made.simulation_fit()
    found = told(result)
    assert (found["objective"], found["not_fitted"]) == ("simulation", ["z"])
    assert found["objectives_disagree"] == []
    x, fit = found["axes"]["x"], result.axes["x"]
    where = free_parameters(fit.axis)
    values = zip(where, read(fit.axis, where), read(fit.begun, where), strict=True)
    begun = {"time_unit": "s", "position_unit": "m", "velocity_unit": "m/s"}
    assert x == {
        "outcome": MOTION_OUTCOMES[fit.outcome], "converged": True, "unit": "m",
        "position_error": pytest.approx(12.5**0.5 * 1e-3), "position_error_of_force_fit": 8.5e-3,
        "holdout_position_error": 4.3e-3, "holdout_position_error_of_force_fit": 6.1e-3,
        "errors_of_starts": [7.1e-3, 5.3e-3, 9.7e-3],
        "parameters": {
            c.label: {"value": now, "force_fit": before, "unit": c.parameter.unit}
            for c, now, before in values
        },
        "beginnings": {
            "one": {"time": pytest.approx(3e-3), "position": 0.011, "velocity": -0.21, **begun},
            "two": {"time": pytest.approx(5e-3), "position": 0.013, "velocity": 0.23, **begun},
        },
    }  # fmt: skip
    bare = told(made.simulation_fit(Outcome.NOT_CONVERGED, None))["axes"]["x"]
    assert not bare["converged"]
    assert bare["holdout_position_error"] is bare["holdout_position_error_of_force_fit"] is None


def test_two_fits() -> None:
    result = Agreement({"x": made.SAME, "y": made.OTHER}, ("z",))
    found = told(result, a="m.toml", b="n.toml")
    assert (found["a"], found["b"]) == ("m.toml", "n.toml")
    assert (found["agree"], found["not_compared"]) == (False, ["z"])
    x, y = found["axes"]["x"], found["axes"]["y"]
    assert (x["agree"], y["agree"]) == (True, False)
    assert y["differing"] == ["p0", "p2"]  # the surest first
    for axis, own in ((x, made.SAME), (y, made.OTHER)):
        for d in own.differences:
            assert axis["parameters"][d.label] == {
                "a": d.a, "b": d.b, "difference": pytest.approx(d.ratio * d.standard_error),
                "standard_error": d.standard_error, "unit": d.unit, "limit": d.limit,
                "in_standard_errors": pytest.approx((d.b - d.a) / d.standard_error),
                "differs": abs(d.ratio) > 3.1,
            }  # fmt: skip
    assert (y["only_in_a"], y["only_in_b"]) == (["wear"], ["gms", "cogging"])
    assert (y["not_compared"], y["error_over_noise_floor"]) == (["p7"], [7.3, 1.9])
    assert (y["force"], y["force_unit"]) == (0.0139, "N")
    assert y["causes"] == [
        {"effect": "payload_mass", "share": 0.61, "or": ["constant_force"]},
        {"effect": "wear", "share": 0.23, "or": []},
    ]


def test_a_comparison() -> None:
    result = made.compared()
    for axis, found in told(result)["axes"].items():
        c = result.axes[axis]
        assert (found["noise_floor"], found["position_drift_of_noise"]) == (
            c.floor, c.position_floor,
        )  # fmt: skip
        assert found["worst"] == [region_in_words(r) for r in c.worst]
        for name in ("run 1", "run 2"):
            force, position = c.force_error[name], c.position_error[name]
            assert found["logs"][name] == {
                "force_error": force, "force_unit": "N", "force_ratio": force / c.floor,
                "position_error": position, "position_unit": "m",
                "position_ratio": position / c.position_floor[name],
            }  # fmt: skip
        assert found["regions"] == {
            m.coordinate: {
                "unit": m.unit, "centre": list(m.centre), "force_error": list(m.rms),
                "mean": list(m.mean), "share": list(m.share), "noise_floor": list(m.floor),
            }
            for m in c.maps
        }  # fmt: skip
        assert found["residual_tests"] == {
            "tested": "force residual", "loop": "open", "reason": loop_in_words(c.tests.loop),
            "samples": 387, "passed": all(t.passes for t in c.tests.correlations),
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


def test_a_position_without_noise_has_a_finite_ratio_or_none() -> None:
    c = replace(made.comparison_of(), position_floor={"run 1": 0.0, "run 2": 0.0})
    found = told(made.Comparison(made.MODEL, {"x": c}))
    ratio = found["axes"]["x"]["logs"]["run 1"]["position_ratio"]
    assert ratio is None or ratio > 1e200


# --- plans and additions ---------------------------------------------------------------------


def experiment(t, several: bool) -> dict:
    if type(t.experiment).__name__ == "Passes":
        own = {"kind": "passes", "axis": "x", "span": 0.0831, "speed": 0.0127, "repeats": 7}
    else:
        own = {"kind": "tracking", "duration": 9.7}
    return {
        "experiment": own, "duration": t.duration, "duration_unit": "s", "unit": "N",
        "expected_difference": t.difference, "noise_floor": t.floor,
        "delta_bic": t.gain if several else None, "information": None if several else t.gain,
    }  # fmt: skip


@pytest.mark.parametrize("names", [("cogging", "wear"), ("the stage",)])
def test_a_plan(names) -> None:
    several = len(names) > 1
    plan = made.plan_of(*names, favoured="wear", supposed=not several)
    assert told(plan, file="e.toml") == {
        "axis": "x", "between": list(names), "decides": True, "favoured_by_the_logs": "wear",
        "refitted_on_logs": several, "missing_motion": gap_in_words(plan.gap),
        "excited_by": {names[0]: "slow passes"}, "not_run": [], "file": "e.toml",
        "setpoints": None, **experiment(plan.chosen, several),
        "ranking": [experiment(t, several) for t in plan.ranking],
    }  # fmt: skip


def test_the_information_of_one_model_has_no_difference() -> None:
    trial = replace(made.TRIALS[0], difference=math.nan)
    found = told(made.plan_of("the stage", ranking=(trial,)))
    assert (found["expected_difference"], found["information"]) == (None, 57.3)


def values(c) -> dict:
    return {
        "effect": c.effect.name, "parameters": dict(c.fit.axis[c.effect.name].values),
        "parameter_units": {p.name: p.unit for p in c.effect.parameters},
    }  # fmt: skip


@pytest.mark.parametrize("kept", [True, False])
def test_an_addition(kept: bool) -> None:
    a = made.addition(kept)
    s, c = a.step, a.candidate
    roles = [f"{r}_error_{w}" for r in ("fit", "holdout", "test") for w in ("before", "after")]
    assert told(a) == {
        **values(c), **{name: getattr(s, name) for name in roles},
        "action": "add", "effect": "cogging", "axis": "x", "is_nonparametric": False, "unit": "N",
        "kept": kept, "part": c.part, "why_not": c.refused, "noise_floor": c.fit.floor,
        "position_error_before": a.position_error[0], "position_error_after": a.position_error[1],
        "position_error_in_mujoco": a.replayed, "position_error_on": "run 1",
        "position_unit": "m", "notes": list(a.notes), "left_out": [],
    }  # fmt: skip
    unheld = told(replace(a, step=made.STEPS[2], candidate=made.candidate("wear", 0.5)))
    assert (unheld["holdout_error_before"], unheld["holdout_error_after"]) == (None, None)


# --- diagnoses -------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def missing():
    """A diagnosis that names effects: its leading axis, and the whole."""
    x = made.diagnosis_of(unexplained=made.STRUCTURE, repeat=made.REPEAT, small=("wear",))
    return x, made.diagnosed(x)


def test_a_diagnosis_is_that_of_its_leading_axis(missing) -> None:
    found = told(missing[1], data_faults=["run 1: a gap"], left_out=["held 1 stands still"])
    axes = found.pop("axes")
    assert list(axes) == ["y", "x"]
    assert found.pop("data_faults") == ["run 1: a gap"]
    assert found.pop("left_out") == ["held 1 stands still"]
    assert found == axes["x"]


def candidate(c) -> dict:
    return {
        **values(c), "delta_bic": c.delta_bic, "holdout_error_before": c.gain.before,
        "holdout_error_after": c.gain.after, "unit": "N", "supported": c.supported,
        "part": c.part, "why_not": c.refused,
    }  # fmt: skip


def finding(f) -> dict:
    return {
        "effect": f.effect, "kind": "missing", "explains": f.explains,
        "indistinguishable_from": list(f.tied), "test_error_before": f.tested.before,
        "test_error_after": f.tested.after, "test_error_on": "selection", "unit": "N",
        "parameters": f.parameters, "parameter_units": f.parameter_units,
        "part": f.score.part, "t": f.score.t, "control": f.score.control, "together": [],
        "contradicted_by_test_logs": False, "shape": None, "bend": None,
        "confidence": f.confidence,
    }  # fmt: skip


def test_an_axis_where_effects_are_missing(missing) -> None:
    x, result = missing
    error = {"error": pytest.approx(3.19), "over_noise_floor": pytest.approx(3.19 / 2.03)}
    depends = {"depends_on": "other_axis_position", "share_of_error": 0.631, "period": 0.0273}
    steps = ((made.BEST, []), (made.LATER, ["wear"]))
    planned = json_of(result.next_experiments["x"])
    assert told(result)["axes"]["x"] == {
        "verdict": "missing_effects", "explanation": SEVERAL, "axis": "x",
        "effect": "cogging", "ranking": [candidate(c) for c in x.ranking],
        "ambiguous_with": ["quadratic_drag"], "missing": ["cogging", "lugre"],
        "steps": [
            {
                **candidate(c), "change": c.effect.name, "dropped": dropped,
                "with_others": False, "not_named": None,
            }
            for c, dropped in steps
        ],
        "findings": [finding(f) for f in made.FOUND],
        "needed_together": [], "also_seen": ["wear"], "unexplained": {**depends, "unit": "m"},
        "remainder": {
            **error, **depends, "unit": "N", "period_unit": "m", "advice": advice(),
            "where": {
                "coordinate": "speed", "low": 0.0137, "high": 0.0291, "coordinate_unit": "m/s",
                "error": 4.71, "unit": "N", "over_noise_floor": 2.32, "share_of_error": 0.417,
            },
        },
        "force_error": pytest.approx(8.37), "noise_floor": 2.03, "unit": "N",
        "force_error_with_found": pytest.approx(3.19),
        "noise_floors": {"training": 2.03, "selection": 2.17},
        "parameters": estimates(made.estimates(0.0)),
        "test_error_before": 7.81, "test_error_after": 2.39, "test_error_on": "selection",
        "force_shift": 0.000217, "force_shift_unit": "s",
        "repeats_not_general": {
            "period": 0.00253, "period_unit": "m", "amplitude": {"run 1": 1.07, "run 2": 0.93},
            "unit": "N", "phase": {"run 1": 0.31, "run 2": 2.13}, "phase_unit": "rad",
        },
        "refit": refit(result.refits["x"]), "not_tried": [],
        "notes": list(remarks_on(result, "x")),
        "next_experiment": strict(planned), "next_experiment_refused": None,
    }  # fmt: skip


def test_a_law_of_another_shape_is_told_with_its_bend_and_its_curve_with_the_band() -> None:
    drawn = Drawn(*(np.array(v) for v in ([1.0, 1.5], [1.2, math.nan], [0.31, 0.43])))
    shape = FoundShape(
        Coordinate.SPEED, np.array([0.1, 0.2]), "m/s", None, True, "N", {"forwards": drawn}
    )
    bent = replace(made.FOUND[1], bend=FreeExponent("n", 2.0, 0.66, "1"), shape=shape)
    (found,) = told(made.diagnosed(made.diagnosis_of(findings=(bent,))))["findings"]
    assert found["bend"] == {"parameter": "n", "held": 2.0, "found": 0.66, "unit": "1"}
    assert found["shape"] == {
        "over": "speed", "coordinate": [0.1, 0.2], "coordinate_unit": "m/s", "period": None,
        "unit": "N", "lets_go_at_standstill": True,
        "curves": {
            "forwards": {"assumed": [1.0, 1.5], "found": [1.2, None], "band_90": [0.31, 0.43]},
        },
    }  # fmt: skip


def test_an_axis_where_nothing_is_missing(missing) -> None:
    quiet = told(missing[1])["axes"]["y"]
    assert quiet["verdict"] == "nothing_missing"
    assert quiet["missing"] == quiet["findings"] == quiet["steps"] == []
    none = ("effect", "remainder", "unexplained", "next_experiment", "repeats_not_general")
    assert [quiet[name] for name in none] == [None] * 5
    assert quiet["force_shift"] == 0.0
    assert quiet["refit"] == refit(missing[1].refits["y"])


def test_where_nothing_explains_the_remainder_is_of_the_model_as_it_was_given() -> None:
    lost = made.diagnosis_of(Verdict.UNEXPLAINED, unexplained=made.STRUCTURE)
    left = told(made.diagnosed(lost))["remainder"]
    assert left["error"] == pytest.approx(8.37)
    assert left["over_noise_floor"] == pytest.approx(8.37 / 2.11)


def test_no_refit_no_experiment_and_an_experiment_refused(missing) -> None:
    bare = replace(missing[1], refits={}, next_experiments={})
    assert told(bare)["refit"] is told(bare)["next_experiment"] is None
    refused = told(replace(bare, not_planned={"x": "no travel"}))
    assert refused["next_experiment_refused"] == "no travel"
    assert any("is proposed: no travel" in note for note in refused["notes"])
    assert refused["axes"]["y"]["next_experiment_refused"] is None


def test_a_residual_of_nothing_is_null_in_a_diagnosis() -> None:
    empty = built_fit(0.0, 1.0, residual=np.zeros(0))
    assert told(made.diagnosed(made.diagnosis_of(base=empty)))["force_error"] is None


# What runs compiled laws over logs, fits, or tells a noise floor.
COMPUTES = (
    "identify.estimation.force_balance", "identify.estimation.fit_problem",
    "identify.estimation.intervals", "identify.dataset.noise_floor",
    "identify.validation.free_run", "identify.estimation.confounded", "twin.core",
)  # fmt: skip


def test_writing_what_was_diagnosed_runs_no_law_and_no_fit() -> None:
    """Whatever is told has been computed before: a slow report would be a hidden computation."""
    case, ran = cogging_case(), set()

    def watch(frame, event, _):
        module, name = frame.f_globals.get("__name__", ""), frame.f_code.co_name
        if event == "call" and module.startswith(COMPUTES) and not name.startswith("__"):
            ran.add(f"{module}.{name}")

    sys.setprofile(watch)
    try:
        json_of(case.diagnosis), str(case.diagnosis), json_of(case.addition)
        subject = case.subject(case.diagnosis)
        sections(subject)
    finally:
        sys.setprofile(None)
    assert ran == set()


# --- the catalogue, its laws, checks ---------------------------------------------------------


@pytest.mark.parametrize("name", ["lugre", "learned_residual", NOISE.name])
def test_an_effect(name: str) -> None:
    e = CATALOGUE[name]
    texts = ("name", "summary", "equation", "source", "fingerprint", "excited_by")
    keys = ("name", "unit", "start", "lower", "upper", "meaning")
    assert valid(strict(effect_answer(e).entries())) == {
        **{t: getattr(e, t) for t in texts}, "kind": e.kind.name.lower(),
        "is_nonparametric": name == "learned_residual", "states": list(e.states),
        "parameters": [{k: getattr(p, k) for k in keys} for p in e.parameters],
    }  # fmt: skip


def test_laws() -> None:
    held = verdict.Outcome("law 0", True, "")
    failed, untried = verdict.Outcome("law 1", False, "off"), verdict.Outcome("law 2", None, "x")
    reports = [verdict.LawReport("a", (held,)), verdict.LawReport("b", (failed, untried))]
    assert laws_answer(reports[:1]).ok
    assert valid(strict(laws_answer(reports).entries())) == {
        "ok": False,
        "effects": {
            "a": [{"law": "law 0", "holds": True, "fault": None}],
            "b": [
                {"law": "law 1", "holds": False, "fault": "off"},
                {"law": "law 2", "holds": None, "fault": "x"},
            ],
        },
    }


def test_a_check() -> None:
    finding = Finding(Severity.ERROR, Fault.LAG, "y", "the what", "the where", "the remedy")
    mild = replace(finding, severity=Severity.WARNING, fault=Fault.SIGN, axis="x")
    own = {"what": "the what", "where": "the where", "remedy": "the remedy"}
    reports = {"a": CheckReport((finding, mild)), "b": CheckReport(())}
    assert valid(strict(check_answer(reports).entries())) == {
        "ok": False,
        "logs": {
            "a": [
                {"severity": "error", "fault": "lag", "axis": "y", **own},
                {"severity": "warning", "fault": "sign", "axis": "x", **own},
            ],
            "b": [],
        },
    }
    assert check_answer({"a": CheckReport((mild,))}).ok
