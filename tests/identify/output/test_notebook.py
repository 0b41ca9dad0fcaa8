"""Results in a notebook: tables that hold what the text says, and pictures of the residual."""

from __future__ import annotations

import re

import built_results as made
import numpy as np
import pytest
from report_cases import Case, Outline, cogging_case

from identify import workflow
from identify.output.numbers import quantity, typeset
from twin.errors import InputError


@pytest.fixture(scope="module")
def case() -> Case:
    return cogging_case()


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
