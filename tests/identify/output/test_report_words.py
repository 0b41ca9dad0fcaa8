"""The words and numbers of the report: every verdict, names that are not meant well, units."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import pytest
from report_cases import Case, Outline, cogging_case

from identify import workflow
from identify.output.numbers import Scale, capitalised, number, quantity, typeset
from twin.effects import Catalogue, load_catalogue


@pytest.fixture(scope="module")
def case() -> Case:
    return cogging_case()


def test_without_a_diagnosis(case: Case, tmp_path: Path) -> None:
    text = case.write(tmp_path / "c.html", diagnosis=None, history=(), additions=())
    assert re.findall(r'<section id="(\w+)"', text) == [
        "answer", "where", "time", "map", "regions", "parameters", "logs", "tests",
    ]  # fmt: skip
    ratio = number(case.diagnosis.comparison.axes["x"].ratio)
    assert f"Axis x: force error {ratio} times the noise floor" in text


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


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.02, "N", "20.0 mN"),
        (-3.3e-4, "s", "−330 µs"),
        (1e-9, "m", "1.00 nm"),
        (1.234e-3, "kg", "0.00123 kg"),
        (0.018, "N s/m", "0.0180 N·s/m"),
        (2.0, "1", "2.00"),
        (0.0, "m", "0 m"),
        (9.87e-4, "kg", "9.87×10⁻⁴ kg"),
        (-1.234e7, "N/m^2", "−1.23×10⁷ N/m²"),
        (1234567.0, "N/m^2", "1234567 N/m²"),
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


@pytest.mark.parametrize("unit", ["N", "kg"])
def test_a_scale_keeps_the_value(unit: str) -> None:
    for value in (3.21e-8, 4.9e-4, 5.1e-4, 0.49, 0.51, 23.0):
        scale = Scale.of(unit, [value, -value / 3.0])
        assert scale(value) * scale.size == pytest.approx(value)
        prefixed = {1.0: "", 1e-3: "m", 1e-6: "µ", 1e-9: "n"}[scale.size]
        assert scale.unit == prefixed + unit
        assert unit == "kg" or scale(value) >= 0.5
        assert unit == "kg" or scale.size == 1.0 or scale(value) < 500.0
    assert Scale.of(unit, []).size == 1.0


@pytest.mark.parametrize(
    ("unit", "ends", "values", "printed"),
    [
        ("m", (0.02698, 0.02702), (0.02698, 0.027, 0.02702), ["26.980", "27.000", "27.020"]),
        ("N", (-1.0, 1.0), (-0.01, 1.0), ["0.0", "1.0"]),
        ("N", (1.0, 1.0), (1.0,), ["1.00"]),
        ("kg m^2", (4.740e-6, 4.795e-6), (4.740e-6, 4.768e-6), ["4.740e-06", "4.768e-06"]),
    ],
)
def test_an_interval_has_two_digits_of_its_half_width(unit, ends, values, printed) -> None:
    assert Scale.of(unit, [values[-1]]).within(*ends, *values) == printed
