"""What page, notebook and model file show is of one result, and told of its final model."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from report_cases import Case

from identify import workflow
from identify.estimation.fit import Outcome, finished
from identify.output.report.explorer import explored
from identify.output.words.next_step import errors_of_step
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.model.file import load_model, save_model
from twin.model.machine import Fitted, MachineModel


def test_the_selection_error_is_one_number(case: Case) -> None:
    (finding,), (cogging, *_) = case.x.findings, case.x.ranking
    assert case.x.dataset.channel_delay > 0.0
    assert case.x.chosen.before == pytest.approx(finding.tested.before)
    assert case.x.chosen.before == pytest.approx(cogging.gain.before, rel=1e-3)


def test_no_error_of_the_growth_is_below_the_floor_of_its_logs(case: Case) -> None:
    (step,), floors = case.addition.model.history, case.diagnosis.summaries["x"].floors
    for role, (_, after) in errors_of_step(step).items():
        assert after >= (1.0 - 1e-3) * floors[role]


def test_curves_are_those_of_the_final_model(case: Case) -> None:
    x, drag = case.x, load_catalogue()["quadratic_drag"]
    final = x.final.axis.with_effect(Fitted.at_start(drag, {"c": 2.0}))
    fit = finished(final, x.base.axis, x.dataset.fit, Outcome.CONVERGED)
    both = (*x.findings, replace(x.findings[0], effect=drag.name))
    subject = case.subject(case.concluding(replace(x, final=fit, findings=both)))
    (signals,) = explored(subject)
    assert "effect quadratic_drag" in signals["effects"]
    left = subject.views[0].signals.after
    assert left is not None
    kept = np.isfinite(left[: len(fit.kept)])  # of the training log, the first
    np.testing.assert_allclose(left[: len(fit.kept)][kept], fit.residual, atol=1e-12)


def test_intervals_that_the_text_refuses_are_not_in_the_model_file(
    case: Case, tmp_path: Path
) -> None:
    fitted = workflow.fit(case.model, case.fit, case.held)
    assert "no interval: the force error" in str(fitted)
    given = load_written(fitted.model, tmp_path), load_written(case.addition.model, tmp_path)
    refused, kept = (set(model.intervals["x"].ends) for model in given)
    assert refused == set()
    assert {"mass", "cogging.p", "cogging.a1"} <= kept


def load_written(model: MachineModel, folder: Path) -> MachineModel:
    save_model(model, folder / "m.toml")
    return load_model(folder / "m.toml", load_catalogue())


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
