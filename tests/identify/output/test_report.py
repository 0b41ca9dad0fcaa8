"""The report, one file that needs nothing else; its words and numbers."""

from __future__ import annotations

import base64
import hashlib
import json
import os
import re
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from report_cases import Case, Outline

from identify import workflow
from identify.dataset.dataset import Role
from identify.estimation.fit import Outcome, finished
from identify.output.blocks import Chart
from identify.output.shown.explorer import coordinate_of_answer, explored, shown_of
from identify.output.shown.residual import regions
from identify.output.words.next_step import (
    Source,
    errors_of_step,
)
from identify.results.results import OnMachine
from identify.results.signals import Signals
from identify.workflow import frequency_response, on_machine
from twin.effects import Catalogue, load_catalogue
from twin.errors import InputError
from twin.logs import write_log
from twin.model.file import load_model, save_model
from twin.model.machine import Fitted, MachineModel

MOST_BYTES = 3_000_000


@pytest.fixture(scope="module")
def page(case: Case, tmp_path_factory: pytest.TempPathFactory) -> str:
    return case.write(tmp_path_factory.mktemp("report") / "report.html")


def test_page_refers_to_nothing_outside(page: str) -> None:
    outline = Outline(page)
    links = [v or "" for k, v in outline.attributes if k in {"src", "href", "srcset", "data"}]
    assert links
    assert all(link.startswith("#") for link in links)
    assert not {"link", "iframe", "object", "img"} & set(outline.tags)
    assert "default-src 'none'" in page  # a browser would refuse it as well
    written = re.sub(r"<script>.*?</script>", "", page, flags=re.DOTALL)  # uPlot names its home
    assert "http" not in re.sub(r"http-equiv", "", written)
    assert "@import" not in page
    assert "url(" not in page


def test_page_is_small_and_reproducible(case: Case, page: str, tmp_path: Path) -> None:
    assert len(page) < MOST_BYTES / 4
    assert case.write(tmp_path / "again.html") == page


def test_every_section_is_there(page: str) -> None:
    found = re.findall(r'<section id="(\w+)"', page)
    expected = [
        "answer", "where", "time", "map", "found", "regions", "ranking", "growth", "equations",
        "parameters", "logs", "tests", "notes",
    ]  # fmt: skip
    assert found == expected
    assert re.findall(r'<a href="#(\w+)">', page) == expected


@pytest.mark.slow
def test_what_feedforward_gains_is_known_where_something_was_found(case: Case) -> None:
    before, after = case.diagnosis.fitted, case.diagnosis.model
    worth = on_machine(after, case.held, before).worth
    assert worth is not None
    assert worth.axes["x"].gains["cogging"] > 0.0
    assert on_machine(after, case.held).worth is None  # nothing was found: nothing is gained


def test_what_the_logs_do_not_tell_is_left_out_of_a_page_with_the_reason(
    case: Case, tmp_path: Path
) -> None:
    """Logs without a setpoint tell no response."""
    free = {}
    for name, log in case.fit.items():
        x = log.axes["x"]
        columns = {k: v for k, v in x.columns.items() if not k.startswith("setpoint")}
        free[name] = replace(log, axes={"x": replace(x, columns=columns)})
    known = on_machine(case.diagnosis.model, free)
    text = Outline(case.write(tmp_path / "r.html", machine=known)).text
    assert "Left out is the frequency response: axis x: the log has no setpoint_position" in text


@pytest.mark.slow
def test_the_response_of_the_page_is_that_of_the_command_and_says_of_which_logs(
    case: Case, tmp_path: Path
) -> None:
    known = on_machine(case.diagnosis.model, case.fit).response
    told = frequency_response(case.fit, case.diagnosis.model)
    assert known is not None
    one, other = (r.axes["x"].measured.response for r in (known, told))
    np.testing.assert_array_equal(one.plant, other.plant)
    np.testing.assert_array_equal(one.band, other.band)
    page = case.write(tmp_path / "r.html", machine=OnMachine(response=known))
    assert f"from {' and '.join(case.fit)}, as twin frf tells it" in Outline(page).text


def test_the_footer_names_command_model_and_files_and_a_fault_comes_first(
    case: Case, tmp_path: Path
) -> None:
    write_log(case.fit["run 1"], tmp_path / "run 1")
    source = Source("twin diagnose drive.toml 'run 1'", "drive.toml", tmp_path)
    faults, doubts = ["run 1: error: a gap"], ["run 2: warning: the clock jitters"]
    page = case.write(tmp_path / "r.html", source=source, findings=[*faults, *doubts])
    text = Outline(page).text
    assert text.index("Axis x: cogging") < text.rindex("Notes") < text.index(doubts[0])
    assert text.index("Fault") < text.index("run 1: error: a gap") < text.index("Axis x: cogging")
    assert hashlib.sha256((tmp_path / "run 1").read_bytes()).hexdigest() in text
    assert "run 2, sha256given in memory, not as a file" in text
    assert "Commandtwin diagnose drive.toml 'run 1'" in text
    assert re.search(r"Nexttwin diagnose drive.toml 'run 1'.* --model better.toml", text)
    assert re.search(r"Model, sha256[0-9a-f]{64}", text)
    save_model(case.model, tmp_path / "drive.toml")
    text = Outline(case.write(tmp_path / "r.html", source=source)).text
    assert f"sha256{hashlib.sha256((tmp_path / 'drive.toml').read_bytes()).hexdigest()}" in text
    assert re.search(r"Date20\d\d-\d\d-\d\d", text)


@pytest.mark.parametrize(
    ("model", "written"),
    [("drive.toml", "better.toml"), ("better.toml", "better_2.toml"),
     ("out/better_2.toml", "better_3.toml")],
)  # fmt: skip
def test_the_next_command_does_not_write_over_its_model(model: str, written: str) -> None:
    command = Source(model=model).filled("twin add cogging MODEL LOG... -o better.toml", {})
    assert command.startswith(f"twin add cogging {model}")
    assert command.endswith(f" -o {written}")


def signals_in(page: str) -> list[dict[str, Any]]:
    found = re.search(r'id="signals">(.*?)</script>', page, re.DOTALL)
    assert found
    return list(json.loads(found[1]))


def decoded(one: dict[str, Any]) -> np.ndarray:
    """A signal as the page's script reads it, SI."""
    number = np.frombuffer(base64.b64decode(one["data"]), "<i2")
    value = one["middle"] + one["scale"] * np.sinh(number * one["step"])
    return np.where(number == -32768, np.nan, value)


def test_the_page_holds_the_forces_of_the_final_model(case: Case, page: str) -> None:
    (axis,) = signals_in(page)
    held = {one["name"]: decoded(one) for one in axis["signals"]}
    training = axis["logs"][0]["count"]
    final, base = case.x.final, case.x.base
    assert np.sqrt(np.nanmean(held["before"][:training] ** 2)) == pytest.approx(base.error, 1e-3)
    assert np.sqrt(np.nanmean(held["after"][:training] ** 2)) == pytest.approx(final.error, 1e-3)
    assert [name.removeprefix("effect ") for name in axis["effects"]] == list(final.axis.names)
    # What is to be explained is the sum of the effects and of what is left.
    whole = sum(held[name] for name in axis["effects"])
    left = held["to_explain"] - whole - held["after"]
    assert np.nanmax(np.abs(left)) < 1e-3 * np.abs(held["to_explain"]).max()
    assert axis["against"] == "cogging_phase"
    assert [log["title"] for log in axis["logs"]] == ["run 1 (training)", "run 2 (selection)"]
    floor = case.diagnosis.summaries["x"].floor
    before = next(one for one in axis["signals"] if one["name"] == "before")
    assert axis["floor"] == pytest.approx(floor / before["size"])
    assert axis["texts"]["band"].startswith("the noise floor of the training logs, ±")


def test_friction_of_one_direction_is_shown_over_speed(case: Case) -> None:
    """It is no curve of its own, and what is left beside it may depend on anything."""
    own = Fitted.at_start(load_catalogue()["asymmetric_friction"])
    final = replace(case.x.final, axis=case.x.final.axis.with_effect(own))
    finding = replace(case.x.findings[0], effect=own.effect.name)
    found = replace(case.x, final=final, findings=(finding,))
    (view,) = case.subject(case.concluding(found)).views
    assert coordinate_of_answer(view, ["position", "velocity"]) == "velocity"


def test_the_place_of_another_axis_is_first_where_an_effect_reads_it(case: Case) -> None:
    """Else the other axis moves with this one, and its place says little."""
    (view,) = case.subject(case.concluding(case.quiet)).views
    other, own = (replace(view.axis.worst[0], coordinate=c) for c in ("other_axis_speed", "speed"))
    shown = replace(view, axis=SimpleNamespace(worst=(other, own)))
    assert coordinate_of_answer(shown, ["other_axis_speed", "speed"]) == "speed"
    coupling = Fitted.at_start(load_catalogue()["axis_coupling"])
    final = replace(case.x.final, axis=case.x.final.axis.with_effect(coupling))
    finding = replace(case.x.findings[0], effect="axis_coupling")
    found = replace(case.x, final=final, findings=(finding,))
    assert coordinate_of_answer(replace(shown, found=found), ["other_axis_speed"]) == (
        "other_axis_speed"
    )


def test_the_last_band_of_frequency_is_as_wide_as_it_is(case: Case) -> None:
    (chart,) = (
        block
        for block in regions(case.subject(case.diagnosis).views[0])
        if isinstance(block, Chart)
    )
    assert all(line.values[-1] == line.values[-2] for line in chart.lines)


def test_a_result_writes_its_page(case: Case, tmp_path: Path) -> None:
    for kind, result in (("lacks", case.diagnosis), ("against", case.diagnosis.comparison)):
        result.report(tmp_path / "page.html")
        written = (tmp_path / "page.html").read_text(encoding="utf-8")
        assert f"<title>{case.model.name}: " in written
        assert kind in Outline(written).text
    with pytest.raises(InputError, match="its folder does not exist"):
        case.diagnosis.report(tmp_path / "none" / "page.html")


def test_a_comparison_alone_has_one_residual(case: Case, tmp_path: Path) -> None:
    (axis,) = signals_in(
        case.write(tmp_path / "c.html", result=case.diagnosis.comparison, additions=())
    )
    assert axis["residuals"] == ["before"]
    assert axis["texts"]["model_before"] == "model"
    assert axis["texts"]["band"].startswith("the noise floor, ±")
    assert [log["title"] for log in axis["logs"]] == ["run 1"]


def test_of_many_samples_no_extreme_is_lost() -> None:
    rng, count = np.random.default_rng(0), 200_000
    before, after, force = rng.standard_normal((3, count))
    before[[17, 123_457]] = 1e3, -1e3
    after[:5000] = np.nan  # at rest
    signals = Signals((), (), np.arange(count), {}, {}, force, before, after, {})
    index, every = shown_of(signals, 20_000)
    assert len(index) <= 20_000
    assert np.array_equal(index, np.unique(index))
    assert {17, 123_457, int(np.argmax(force)), int(np.nanargmin(after))} <= set(index.tolist())
    assert set(range(0, count, every)) <= set(index.tolist())
    for part in np.array_split(np.arange(count), 50)[2:]:
        kept = index[(index >= part[0] + every) & (index < part[-1] - every)]
        inner = before[part[0] + 2 * every : part[-1] - 2 * every]
        assert np.nanmax(before[kept]) >= np.nanmax(inner)
    assert shown_of(signals, count)[1] == 1


def test_a_failure_leaves_the_old_report(
    case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "report.html"
    path.write_text("old")

    def broken(*_: object) -> None:
        raise OSError("no space left on the device")

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", broken)
        with pytest.raises((InputError, OSError), match="no space"):
            case.write(path)
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["report.html"]
    with pytest.raises(InputError, match="its folder does not exist"):
        case.write(tmp_path / "nowhere" / "report.html")


def test_the_selection_error_is_one_number(case: Case) -> None:
    (finding,), (cogging, *_) = case.x.findings, case.x.ranking
    assert case.x.dataset.channel_delay > 0.0
    assert case.x.chosen.before == pytest.approx(finding.tested.before)
    assert case.x.chosen.before == pytest.approx(cogging.gain.before, rel=1e-3)
    (step,) = case.addition.model.history
    assert errors_of_step(step)[Role.SELECTION] == pytest.approx(
        (case.x.chosen.before, case.x.chosen.after), rel=1e-2
    )


def test_no_error_of_the_growth_is_below_the_floor_of_its_logs(case: Case) -> None:
    (step,), floors = case.addition.model.history, case.diagnosis.summaries["x"].floors
    for role, (_, after) in errors_of_step(step).items():
        assert after >= (1.0 - 1e-3) * floors[role]


def test_curves_are_those_of_the_final_model(case: Case) -> None:
    x, drag = case.x, load_catalogue()["quadratic_drag"]
    final = x.final.axis.with_effect(Fitted.at_start(drag, {"c": 2.0}))
    fit = finished(final, x.base.axis, x.dataset.training, Outcome.CONVERGED)
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
        tmp_path / "evil.html", title=evil, result=diagnosis,
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
