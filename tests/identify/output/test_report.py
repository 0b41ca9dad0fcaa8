"""The report: one file that needs nothing else, says the verdict, and labels every axis."""

from __future__ import annotations

import os
import re
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure
from report_cases import (
    Case,
    Outline,
    cogging_case,
    figures,
    pictures_in,
    readable,
    without_drawing,
)

import identify.output.report
from identify.estimation.residual_dependence import Dependence
from identify.output.numbers import arrow, quantity, typeset
from identify.output.report.drawing import data_uri, drawing_style
from identify.output.report.residual import Panel, draw_residuals
from identify.output.words.diagnosis import verdict_in_words
from identify.selection.diagnosis import Verdict
from twin.errors import InputError

MOST_BYTES = 3_000_000
CATEGORIES = {"Effect added", "Coordinate"}  # axes of names, which have no unit


@pytest.fixture(scope="module")
def case() -> Case:
    return cogging_case()


@pytest.fixture(scope="module")
def page(case: Case, tmp_path_factory: pytest.TempPathFactory) -> str:
    return case.write(tmp_path_factory.mktemp("report") / "report.html")


# --- one file, complete ---------------------------------------------------------------------


def test_page_refers_to_nothing_outside(page: str) -> None:
    outline = Outline(page)
    links = [v or "" for k, v in outline.attributes if k in {"src", "href", "srcset", "data"}]
    assert links
    assert all(link.startswith(("#", "data:image/svg+xml;base64,")) for link in links)
    assert not {"script", "link", "iframe", "object"} & set(outline.tags)
    for text in [page, *pictures_in(page)]:
        bare = re.sub(r'xmlns(:\w+)?="[^"]*"', "", text)
        assert "http" not in bare
        assert "@import" not in bare
        assert re.findall(r"url\((?!['\"]?#)", bare) == []


def test_pictures_are_well_formed(page: str) -> None:
    drawn = pictures_in(page)
    assert len(drawn) == 6  # force, residual, maps, tests, candidates, growth
    for text in drawn:
        assert ElementTree.fromstring(text).tag.endswith("svg")


def test_page_is_small_and_reproducible(case: Case, page: str, tmp_path: Path) -> None:
    assert len(page) < MOST_BYTES
    assert case.write(tmp_path / "again.html") == page


def test_many_samples_stay_small() -> None:
    """A dense scatter is thinned and rasterised: as vectors this one would take some 100 MB."""
    rng = np.random.default_rng(0)
    shown = [Panel(rng.uniform(size=300_000), "Position", "m")] * 4
    means = {"mean": rng.standard_normal(300_000)}
    with drawing_style():
        assert len(data_uri(draw_residuals(shown, means, 1.0))) < MOST_BYTES / 3


def test_every_section_is_there(page: str) -> None:
    found = re.findall(r'<section id="(\w+)">', page)
    expected = [
        "answer", "force", "residual", "regions", "tests", "ranking", "growth", "equations",
        "parameters", "logs", "notes",
    ]  # fmt: skip
    assert found == expected
    assert re.findall(r'<a href="#(\w+)">', page) == expected


def test_page_says_the_verdict(case: Case, page: str) -> None:
    text = Outline(page).text
    best = case.x.best
    assert best is not None
    assert "Axis x: cogging is missing" in text
    assert verdict_in_words(case.x) in text
    assert "Next: twin add cogging MODEL LOG... -o better.toml" in text
    assert typeset(arrow(case.x.base.error, best.fit.error, "N")) in text
    final, floor = case.x.final, case.diagnosis.told["x"].floor
    assert typeset(arrow(case.x.base.error / floor, final.error / floor, "1")) in text
    assert best.effect.equation in text
    assert best.effect.fingerprint in text
    pitch = best.fit.axis["cogging"].values["p"]
    assert f"p = {quantity(pitch, 'm')}" in text.replace("\u00a0", " ")


def test_parameters_come_with_intervals_or_a_reason(case: Case, page: str) -> None:
    text = Outline(page).text
    # The model without cogging is wrong, so it has no intervals; with cogging there is one column.
    assert case.x.base.ratio > 3.0
    assert text.count("90 % interval") == 1
    assert "no interval: the force error" in text
    assert re.search(r"cogging\.p\s+–\s+[\d.]+ mm\s+[\d.]+ to [\d.]+", text)


def test_a_parameter_that_moved_is_noted(case: Case, page: str) -> None:
    assert case.addition.notes
    for note in case.addition.notes:
        assert note in Outline(page).text


# --- axes of the pictures -------------------------------------------------------------------


def unlabelled(figure: Figure) -> list[str]:
    """Axes of a figure that show numbers without saying what they are, in which unit."""
    wrong = []
    for axes in figure.axes:
        sides = ((axes.xaxis, "labelbottom"), (axes.yaxis, "labelleft"))
        for axis, side in sides:
            shown = axis.get_tick_params().get(side, True)
            text = axis.get_label_text()
            if shown and text not in CATEGORIES and not re.fullmatch(r"\S.* \(\S+\)", text):
                wrong.append(text)
    return wrong


def test_every_axis_has_quantity_and_unit_and_can_be_read(case: Case) -> None:
    unexplained = Dependence(0.7, "position", 0.025, "m", {"position": 0.7, "time": 0.1})
    other = replace(case.quiet, verdict=Verdict.UNEXPLAINED, unexplained=unexplained)
    for diagnosis in (case.diagnosis, case.concluding(other)):
        drawn = list(figures(case.subject(diagnosis)))
        assert len(drawn) >= 4
        assert [label for figure in drawn for label in unlabelled(figure)] == []
        for figure in drawn:
            readable(figure)


def test_an_axis_without_unit_is_caught() -> None:
    figure = Figure()
    axes = figure.subplots()
    axes.set_xlabel("Time")
    axes.set_ylabel("Force (N)")
    assert unlabelled(figure) == ["Time"]


# --- whole or not at all --------------------------------------------------------------------


def test_a_failure_leaves_the_old_report(
    case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "report.html"
    path.write_text("old")

    def broken(*_: object) -> None:
        raise OSError("no space left on the device")

    for target in ((os, "replace"), (identify.output.report, "whole_page")):
        with monkeypatch.context() as patch, without_drawing():
            patch.setattr(*target, broken)
            with pytest.raises((InputError, OSError), match="no space"):
                case.write(path)
        assert path.read_text() == "old"
        assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


def test_a_missing_folder_is_said(case: Case, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="its folder does not exist"):
        case.write(tmp_path / "nowhere" / "report.html")
