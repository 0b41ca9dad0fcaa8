"""The JSON objects: of every result as they were read, as the schema says.

`PYTHONPATH=tests python tests/identify/output/test_json.py` writes them anew, to be read first.
"""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import built_results as made
import numpy as np
import pytest
from built_fits import CATALOGUE, NOISE, built_fit
from jsonschema import Draft202012Validator, ValidationError
from report_cases import cogging_case
from strict_json import shipped, strict, told, valid

import identify
from identify.estimation.fit import Outcome
from identify.estimation.found_shape import FoundCurve, FoundShape, FreeExponent
from identify.output.answers import Answer, answer_of, plain
from identify.output.answers.machine import EffectAnswer, check_answer, laws_answer
from identify.output.as_json import FILE, json_of, schema_text
from identify.output.shown.report import sections
from identify.printed import Printed, text_of
from identify.results.grown import CorrectedBody
from identify.selection.diagnosis import Verdict
from identify.validation.agreement import Agreement
from twin.checks import CheckReport, Fault, LogFinding, Severity
from twin.checks.report import Place
from twin.curve import Coordinate
from twin.errors import InputError
from twin.laws import verdict

KEPT = Path(__file__).with_name("answers.json")


def of_another_shape():
    drawn = FoundCurve(*(np.array(v) for v in ([1.0, 1.5], [1.2, math.nan], [0.31, 0.43])))
    shape = FoundShape(
        Coordinate.SPEED, np.array([0.1, 0.2]), "m/s", None, True, "N", {"forwards": drawn}
    )
    bent = replace(made.FOUND[1], bend=FreeExponent("n", 2.0, 0.66, "1"), shape=shape)
    return made.diagnosed(made.diagnosis_of(findings=(bent,)))


def lost(**changes: object):
    verdict_ = made.diagnosis_of(Verdict.UNEXPLAINED, unexplained=made.STRUCTURE)
    return replace(made.diagnosed(verdict_), **changes)


def laws() -> Answer:
    held = verdict.LawOutcome("law 0", True, "")
    failed, untried = (
        verdict.LawOutcome("law 1", False, "off"),
        verdict.LawOutcome("law 2", None, "x"),
    )
    reports = verdict.LawReport("a", (held,)), verdict.LawReport("b", (failed, untried))
    assert laws_answer(reports[:1]).ok
    return laws_answer(reports)


def check() -> Answer:
    finding = LogFinding(
        Severity.ERROR, Fault.LAG, "y", "the what", Place(1.5, 2.0, 3), "the remedy"
    )
    mild = replace(finding, severity=Severity.WARNING, fault=Fault.SIGN, axis="x")
    assert check_answer({"a": CheckReport((mild,))}).ok
    return check_answer({"a": CheckReport((finding, mild)), "b": CheckReport(())})


ANSWERS: dict[str, Callable[[], object]] = {
    "fit": lambda: json_of(made.fit_result(), left_out=["run 3 says nothing"]),
    "fit of simulated motion": made.simulation_fit,
    "fit of simulated motion without other logs": lambda: made.simulation_fit(
        Outcome.NOT_CONVERGED, None
    ),
    "two fits": lambda: json_of(
        Agreement({"x": made.SAME, "y": made.OTHER}, ("z",)), a="m.toml", b="n.toml"
    ),
    "comparison": made.compared,
    "plan between two": lambda: json_of(
        made.plan_of("cogging", "wear", favoured_by_the_logs="wear"), file="e.toml"
    ),
    "plan for one model": lambda: made.plan_of(
        "the stage", ranking=(replace(made.TRIALS[0], difference=math.nan),), supposed=True
    ),
    "addition": made.addition,
    "addition that nothing proves": lambda: made.addition(False),
    "addition without selection log": lambda: replace(
        made.addition(), step=made.STEPS[2], candidate=made.candidate("wear", 0.5)
    ),
    "diagnosis": lambda: json_of(
        made.diagnosed(
            made.diagnosis_of(unexplained=made.STRUCTURE, repeat=made.REPEAT, also_seen=("wear",))
        ),
        data_faults=["run 1: a gap"], left_out=["held 1 stands still"],
    ),
    "diagnosis: a law of another shape": of_another_shape,
    "diagnosis: unexplained": lost,
    "diagnosis: no experiment, refused": lambda: lost(
        refits={}, next_experiments={}, not_planned={"x": "no travel"}
    ),
    "diagnosis: another body": lambda: replace(made.diagnosed(), bodies=(made.wrong_body(),)),
    "corrected body": lambda: CorrectedBody(
        replace(made.diagnosed().model, mjcf_name="b.xml"), made.diagnosed().model,
        (made.wrong_body(),),
    ),
    **{f"effect {n}": lambda n=n: EffectAnswer.of(CATALOGUE[n]) for n in ("lugre", NOISE.name)},
    "laws": laws,
    "check": check,
}  # fmt: skip


def printed(name: str) -> dict[str, Any]:
    found = ANSWERS[name]()
    if isinstance(found, Answer):
        found = found.entries()
    return strict(found if isinstance(found, dict) else json_of(found))


def rounded(found: Any) -> Any:
    """The same with numbers of ten digits, less what each version's self-test tells anew."""
    if isinstance(found, dict):
        return {key: rounded(value) for key, value in found.items() if key != "confidence"}
    if isinstance(found, list):
        return [rounded(value) for value in found]
    return float(f"{found:.10g}") if isinstance(found, float) else found


@pytest.mark.parametrize("name", ANSWERS)
def test_an_object_is_as_it_was_read_and_as_the_schema_says(name: str) -> None:
    found = printed(name)
    assert rounded(found) == json.loads(KEPT.read_text(encoding="utf-8"))[name]
    valid(found)


@pytest.mark.parametrize("name", ANSWERS)
def test_an_answer_comes_back_from_its_file_as_it_was(name: str, tmp_path: Path) -> None:
    found, file = ANSWERS[name](), tmp_path / "answer.json"
    if isinstance(found, Printed):
        found.save(file)
        assert identify.load(file) == answer_of(found)
    else:
        file.write_text(json.dumps(printed(name)), encoding="utf-8")
    assert strict(identify.load(file).entries()) == printed(name)


@pytest.mark.parametrize("text", ["", "[]", "{}", '{"schema": "answers-1#/$defs/FitAnswer"}', None])
def test_what_is_no_answer_is_told_in_a_line(text: str | None, tmp_path: Path) -> None:
    file = tmp_path / "answer.json"
    if text is not None:
        file.write_text(text, encoding="utf-8")
    with pytest.raises(
        InputError, match=r"^\S*answer\.json: (is no answer|cannot be read)"
    ) as told:
        identify.load(file)
    assert "\n" not in str(told.value)


def test_plans_and_comparisons_of_fits_print_themselves() -> None:
    of_fits = Agreement({"x": made.SAME, "y": made.OTHER}, ("z",))
    for result in (made.plan_of("cogging", "wear"), of_fits):
        assert str(result) == text_of(result)
        assert len(repr(result)) < 80


def test_the_text_of_a_mujoco_file_is_told_where_a_body_is_another_alone() -> None:
    model = replace(made.MODEL, mjcf="<mujoco/>", mjcf_name="arm.xml")
    told = json_of(replace(made.diagnosed(), fitted=model, model=model))
    assert 'mujoco = "arm.xml"' in told["model"]
    assert told["mujoco"] is None


def test_what_is_no_number_or_no_law_is_told() -> None:
    c = replace(made.comparison_of(), position_drift_of_noise={"run 1": 0.0, "run 2": 0.0})
    found = told(made.Comparison(made.MODEL, {"x": c}))
    ratio = found["axes"]["x"]["logs"]["run 1"]["position_ratio"]
    assert ratio is None or ratio > 1e200
    assert EffectAnswer.of(CATALOGUE["learned_residual"]).is_nonparametric
    empty = built_fit(0.0, 1.0, residual=np.zeros(0))
    assert told(made.diagnosed(made.diagnosis_of(base=empty)))["force_error"] is None


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


# What runs compiled laws over logs, fits, or tells a noise floor.
COMPUTES = (
    "identify.estimation.force_balance", "identify.estimation.least_squares",
    "identify.estimation.intervals", "identify.dataset.noise_floor",
    "identify.validation.free_run", "identify.estimation.confounded", "twin.core",
)  # fmt: skip


@pytest.mark.slow
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


if __name__ == "__main__":
    text = json.dumps({n: rounded(printed(n)) for n in ANSWERS}, indent=1, ensure_ascii=False)
    KEPT.write_text(text + "\n", encoding="utf-8")
