"""Page, notebook, text, JSON and model file say the same: their numbers are read back."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import built_results as made
import numpy as np
import pytest
from built_results import Page
from report_cases import Case, Outline

from identify import workflow
from identify.estimation.fit import Outcome, finished
from identify.output.as_json import json_of
from identify.output.numbers import PREFIXES, capitalised, quantity, title_case, typeset
from identify.output.report import facts, sections
from identify.output.report.explorer import explored
from identify.output.report.page import page as whole
from identify.results.results import FitResult
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.model.file import load_model, save_model
from twin.model.machine import Fitted, MachineModel

UNITS = ("N", "m", "kg", "N·s/m")
QUANTITY = re.compile(r"(−?[\d.]+(?:×10\S+)?) ?(\S*)")
DIGITS = 0.006  # relative: a printed number has three


@pytest.fixture(scope="module")
def text(case: Case, tmp_path_factory: pytest.TempPathFactory) -> str:
    return case.write(tmp_path_factory.mktemp("one") / "report.html")


@pytest.fixture(scope="module")
def page(text: str) -> Page:
    return Page(text)


@pytest.fixture(scope="module")
def told(case: Case) -> dict:
    return json_of(case.diagnosis)


def si(cell: str) -> float:
    """A printed number with its unit, SI."""
    found = QUANTITY.match(cell)
    assert found, cell
    size = {f"{prefix}{unit}": size for size, prefix in PREFIXES for unit in UNITS}
    return float(found[1].replace("−", "-")) * size.get(found[2], 1.0)


def near(*expected: float) -> list:
    return [pytest.approx(value, rel=DIGITS) for value in expected]


def tiles(text: str) -> dict[str, str]:
    """The numbers in large type, by what they are."""
    found = re.findall(r"<b>(.*?)</b><strong>(.*?)</strong>", text)
    return dict(found)


def test_a_comparison(case: Case, tmp_path: Path) -> None:
    compared = case.diagnosis.comparison
    text = case.write(tmp_path / "c.html", diagnosis=None, history=(), additions=())
    own = json_of(compared)["axes"]["x"]
    rows = Page(text).table("logs")
    for name, one in own["logs"].items():
        cells = [si(cell) for cell in [*rows[name].values()][1:4]]
        assert cells == near(one["force_error"], one["force_ratio"], one["position_error"])
    every = np.sqrt(np.mean([one["force_error"] ** 2 for one in own["logs"].values()]))
    shown = tiles(text)
    assert si(shown["Force error"]) == pytest.approx(every, rel=DIGITS)
    ratio = every / own["noise_floor"]
    assert si(shown["Error over noise floor"]) == pytest.approx(ratio, rel=DIGITS)
    regions = Page(text).sections["regions"][0][1:]
    said = [capitalised(line.partition(":")[0]).removesuffix(".") for line in own["worst"]]
    assert [row[0] for row in regions] == [typeset(one) for one in said]
    differences = [float(row[-1].removesuffix(" %")) for row in regions]
    assert differences == sorted(differences, reverse=True)  # the worst first, as printed


def test_a_diagnosis(page: Page, text: str, told: dict) -> None:
    (finding,), rows = told["findings"], page.table("found")
    cells = [si(cell) for cell in [*rows["Cogging"].values()][:2]]
    assert cells == near(finding["test_error_before"], finding["test_error_after"])
    shares = [float(cell.removesuffix(" %")) for cell in [*rows["Cogging"].values()][2:]]
    asked = (finding[key] for key in ("explains", "part", "control", "confidence"))
    assert shares == [pytest.approx(100 * share, abs=0.5) for share in asked]
    for one in told["ranking"]:
        if one["delta_bic"] is not None:
            row = [*page.table("ranking")[title_case(one["effect"])].values()]
            errors = one["holdout_error_before"], one["holdout_error_after"]
            assert [si(cell) for cell in row[:3]] == near(one["delta_bic"], *errors)
            why = one["why_not"] or ""
            assert row[4] == why
            assert one["supported"] == (why == "" or why.startswith("not needed beside"))
    for name, one in told["parameters"].items():
        cells = page.table("parameters")[name]
        least = 0.05 * np.ptp(one["interval_90"] or [0.0])  # which has two digits
        near_it = pytest.approx(one["value"], rel=DIGITS, abs=least)
        assert si(cells["With cogging"]) == near_it, name
    floor = told["noise_floor"]
    before, after = tiles(text)["Error over noise floor"].split(" → ")
    ratios = told["force_error"] / floor, told["force_error_with_found"] / floor
    assert [si(before), si(after)] == near(*ratios)


def test_the_selection_error_is_one_number(page: Page, text: str, case: Case) -> None:
    assert case.x.dataset.channel_delay > 0.0
    before = tiles(text)["Force error, selection logs"].split(" → ")[0]
    row = page.table("ranking")["Cogging"]["Error before"]
    found = page.table("found")["Cogging"]["Error without it"]
    assert si(row) == si(found) == pytest.approx(case.x.chosen.before, rel=DIGITS)
    assert before in (row.split()[0], f"{si(row):.4f}")


def test_no_error_of_the_growth_is_below_the_floor_of_its_logs(page: Page) -> None:
    *steps, last = page.sections["growth"][0][1:]
    assert last[0] == "Noise floor of these logs"
    for step in steps:
        for after, floor in zip(step[2::2], last[2::2], strict=True):
            assert floor == "–" or si(after) >= (1 - DIGITS) * si(floor)


@pytest.fixture(scope="module")
def fit_of_case(case: Case) -> FitResult:
    return workflow.fit(case.model, case.fit, case.held)


def test_a_fit(fit_of_case: FitResult) -> None:
    own = json_of(fit_of_case)["axes"]["x"]
    lines = str(fit_of_case).splitlines()
    for shown in (fitted_table(fit_of_case), fitted_text(lines)):
        assert shown.keys() == own["parameters"].keys()
        for name, one in own["parameters"].items():
            assert si(shown[name]) == pytest.approx(one["value"], rel=DIGITS), name
    errors = [si(typeset(f"{v} {u}")) for v, u in re.findall(r"([\d.]+) (m?N)\b", lines[0])]
    assert errors == near(own["force_error"], own["holdout_force_error"], own["noise_floor"])


def fitted_table(result: FitResult) -> dict[str, str]:
    page = Page(f'<section id="all">{result._repr_html_()}</section>')
    return {name: row["Value"] for name, row in page.table("all").items()}


def fitted_text(lines: list[str]) -> dict[str, str]:
    rows = (line.split() for line in lines if re.match(r"  \S+ {2,}\S", line))
    return {name: typeset(" ".join(rest)) for name, *rest in rows}


def test_laws_parameters_and_curves_are_those_of_the_final_model(case: Case) -> None:
    x, drag = case.x, load_catalogue()["quadratic_drag"]
    final = x.final.axis.with_effect(Fitted.at_start(drag, {"c": 2.0}))
    fit = finished(final, x.base.axis, x.dataset.fit, Outcome.CONVERGED)
    both = (*x.findings, replace(x.findings[0], effect=drag.name))
    subject = case.subject(case.concluding(replace(x, final=fit, findings=both)))
    page = Page(whole(subject.title, facts(subject), sections(subject)))
    assert drag.equation in page.texts["equations"]
    values = page.table("parameters")["quadratic_drag.c"]
    assert si(values["With all that was found"]) == 2.0
    (signals,) = explored(subject)
    assert "effect quadratic_drag" in signals["effects"]
    left = subject.views[0].signals.after
    assert left is not None
    kept = np.isfinite(left[: len(fit.kept)])  # of the training log, the first
    np.testing.assert_allclose(left[: len(fit.kept)][kept], fit.residual, atol=1e-12)


def test_intervals_that_the_text_refuses_are_not_in_the_model_file(
    case: Case, fit_of_case: FitResult, tmp_path: Path
) -> None:
    assert "no interval: the force error" in str(fit_of_case)
    given = load_written(fit_of_case.model, tmp_path), load_written(case.addition.model, tmp_path)
    refused, kept = (set(model.intervals["x"].ends) for model in given)
    assert refused == set()
    assert {"mass", "cogging.p", "cogging.a1"} <= kept


def load_written(model: MachineModel, folder: Path) -> MachineModel:
    save_model(model, folder / "m.toml")
    return load_model(folder / "m.toml", load_catalogue())


def shown(result: object) -> str:
    """The visible text of what a notebook shows, in which nothing is run or loaded."""
    html = result._repr_html_()  # type: ignore[attr-defined]
    outline = Outline(html)
    assert not {"script", "style", "link", "img", "button"} & set(outline.tags)
    return re.sub(r"\s+", " ", outline.text)


def test_each_result_shows_what_its_text_says(case: Case) -> None:
    text = shown(case.diagnosis)
    assert "Axis x: cogging is missing" in text
    assert typeset(quantity(case.x.tested.before, "N")) in text
    assert "cogging.p" in text
    assert "run 1" in shown(case.diagnosis.comparison)
    log = case.fit["run 1"]
    assert f"xpositionm{log.axes['x'].position.min():.4g}" in shown(log)
    text = shown(workflow.fit(case.model, case.fit, case.held))
    assert "coulomb_viscous.Fc" in text
    assert "No interval: the force error" in text
    assert "5.23 to 5.47" in shown(made.fit_result())
    curves = replace(made.fit_result(), estimates=dict.fromkeys(made.fit_result().fits, ()))
    assert "5.23" not in shown(curves)  # of curves alone there is no table


def test_the_residual_is_drawn_over_the_coordinate_of_the_answer_or_any_other(case: Case) -> None:
    found = case.diagnosis
    (own,) = found.plot().axes
    assert own.get_xlabel().startswith("Cogging phase (")
    (place,) = found.residual.against("position", axis="x").axes
    assert (place.get_xlabel(), place.get_ylabel()) == ("Position (mm)", "Unexplained force (mN)")
    dots, means, *_ = place.lines
    errors = np.asarray(dots.get_ydata(), dtype=float)
    rms = np.sqrt(np.nanmean(errors**2))  # of all logs, mN
    assert 1e3 * min(found.summaries["x"].chosen.before, case.x.base.error) < rms < 80.0
    assert np.nanmax(np.abs(np.asarray(means.get_ydata(), dtype=float))) < np.nanmax(np.abs(errors))
    (alone,) = found.comparison.residual.against("time").axes
    assert len(alone.lines) == 2  # of one model
    for wrong in ({"coordinate": "phase"}, {"coordinate": "position", "axis": "y"}):
        with pytest.raises(InputError, match=r"known are time, |no axis 'y' in the result"):
            found.residual.against(**wrong)
