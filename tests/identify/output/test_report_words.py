"""The words and numbers of the report: every verdict, names that are not meant well, units."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
from report_cases import Case, Outline, answers, cogging_case

from identify import workflow
from identify.estimation.residual_dependence import Dependence
from identify.output.numbers import Scale, capitalised, number, quantity, typeset
from identify.output.report.effects import equations
from identify.output.report.page import Heading
from identify.output.report.subject import Subject
from identify.output.words.diagnosis import verdict_in_words
from identify.results.results import Diagnosis, summary_of
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from twin.effects import Catalogue, load_catalogue


@pytest.fixture(scope="module")
def case() -> Case:
    return cogging_case()


# --- other conclusions ----------------------------------------------------------------------


def test_without_a_diagnosis(case: Case, tmp_path: Path) -> None:
    text = case.write(tmp_path / "c.html", diagnosis=None, history=(), additions=())
    assert re.findall(r'<section id="(\w+)"', text) == [
        "answer", "where", "time", "map", "regions", "parameters", "logs", "tests",
    ]  # fmt: skip
    ratio = number(case.diagnosis.comparison.axes["x"].ratio)
    assert f"Axis x: force error {ratio} times the noise floor" in text


def ambiguous(case: Case) -> AxisDiagnosis:
    """The diagnosis of the case, had drag explained as much."""
    (found,) = case.x.findings
    return replace(case.x, findings=(replace(found, tied=("quadratic_drag",)),))


def test_every_verdict_has_its_words(case: Case) -> None:
    structure = Dependence(0.63, "position", 0.027, "m", {"position": 0.63})
    tied = ambiguous(case)
    lost = replace(case.quiet, verdict=Verdict.UNEXPLAINED, unexplained=structure)
    done = case.quiet
    expected = {
        "Axis x: cogging or quadratic drag is missing": tied,
        "Axis x: something outside the catalogue is missing": lost,
        "Axis x: nothing is missing": done,
    }
    for headline, found in expected.items():
        (card,) = answers(case.subject(case.concluding(found)))
        assert card.headline == headline
        assert card.sentence.startswith(verdict_in_words(found))
        assert ("27.0 mm" in card.sentence) == (found is lost)
        assert ("63 %" in card.sentence) == (found is lost)


def test_only_named_effects_have_their_law_printed(case: Case) -> None:
    tied = ambiguous(case)
    blocks = equations(case.subject(case.concluding(tied)).views[0])
    assert [b.text for b in blocks if isinstance(b, Heading)] == [
        "Cogging on x", "Quadratic drag on x",
    ]  # fmt: skip
    assert equations(case.subject(case.concluding(case.quiet)).views[0]) == []


def test_the_axis_of_the_answer_comes_first(case: Case) -> None:
    compared = case.diagnosis.comparison
    both = replace(
        compared,
        model=replace(compared.model, axes=dict.fromkeys("ax", compared.model.axes["x"])),
        axes={"a": replace(compared.axes["x"], axis="a"), "x": compared.axes["x"]},
    )
    axes = {"a": case.quiet, "x": case.x}
    told = {axis: summary_of(d) for axis, d in axes.items()}
    diagnosis = Diagnosis(both.model, axes, both, told)
    cards = answers(Subject("Report", diagnosis, both, (), ()))
    assert [card.headline[:7] for card in cards] == ["Axis x:", "Axis a:"]


# --- names that are not meant well ----------------------------------------------------------


def test_hostile_names_are_text(case: Case, tmp_path: Path) -> None:
    evil = '<script>alert(\'$1\')</script> & "x" onerror="y"'
    own = replace(load_catalogue()["cogging"])
    own.__dict__["name"] = "a$b^<i>$&c"  # what no file may be called
    catalogue = Catalogue([own])
    model = replace(case.model, name=evil)
    logs = {evil: case.fit["run 1"]}
    diagnosis = workflow.diagnose(model, logs, case.held, catalogue=catalogue)
    step = replace(case.addition.step, effect=own.name, notes=(evil,))
    page = case.write(
        tmp_path / "evil.html", title=evil, diagnosis=diagnosis, comparison=diagnosis.comparison,
        history=[step], additions=(),
    )  # fmt: skip
    outline = Outline(page)
    assert "i" not in outline.tags
    assert outline.tags.count("script") == 3  # the page's own
    assert "onerror" not in {name for name, _ in outline.attributes}
    assert outline.text.count(evil) >= 5  # title twice, model, log, note
    assert f"Axis x: {own.name} is missing" in outline.text
    signals = json.loads(re.findall(r'id="signals">(.*?)</script>', page, re.DOTALL)[0])
    assert own.name in [one["label"] for one in signals[0]["signals"]]
    assert signals[0]["logs"][0]["title"] == f"{evil} (training)"


# --- numbers --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.02, "N", "20.0 mN"),
        (1.234, "N", "1.23 N"),
        (-3.3e-4, "s", "−330 µs"),
        (1e-9, "m", "1.00 nm"),
        (7.18e-4, "kg", "7.18×10⁻⁴ kg"),
        (0.018, "N s/m", "0.0180 N·s/m"),
        (12345.0, "N/m^2", "12345 N/m²"),
        (2.0, "1", "2.00"),
        (0.0, "m", "0 m"),
        (4e-17, "N s^2/m^2", "4.00×10⁻¹⁷ N·s²/m²"),
        (None, "N", "–"),
        (float("nan"), "N", "–"),
        (float("inf"), "N", "∞ N"),
    ],
)
def test_numbers_with_units(value: float | None, unit: str, text: str) -> None:
    assert typeset(quantity(value, unit)) == text


@pytest.mark.parametrize(
    ("said", "printed"),
    [
        ("open-loop: -0.5 +- 2e-05 m of 4 um", "Open-loop: −0.5 ± 2×10⁻⁵ m of 4 µm."),
        ("sigma0 is off (-3.6e+03 %)", "sigma0 is off (−3.6×10³ %)."),
        ("payload_mass would make 1-2 N.", "payload_mass would make 1-2 N."),
    ],
)
def test_a_sentence_of_the_terminal_is_typeset_on_a_page(said: str, printed: str) -> None:
    assert typeset(capitalised(said)) == printed


def test_an_interval_sets_the_digits_of_its_value() -> None:
    scale = Scale.of("m", [0.027])
    assert scale.within(0.02698, 0.02702, 0.02698, 0.027, 0.02702) == ["26.980", "27.000", "27.020"]
    assert Scale.of("N", [1.0]).within(-1.0, 1.0, -0.01) == ["0.0"]
    assert Scale.of("N", [1.0]).within(1.0, 1.0, 1.0) == ["1.00"]
    small = Scale.of("kg m^2", [4.768e-6]).within(4.740e-6, 4.795e-6, 4.740e-6, 4.768e-6)
    assert small == ["4.740e-06", "4.768e-06"]
