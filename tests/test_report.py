"""The report: one file that needs nothing else, says the verdict, and labels every axis."""

from __future__ import annotations

import base64
import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, replace
from html.parser import HTMLParser
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.figure import Figure

import identify.report
from identify import workflow
from identify.diagnose import AxisDiagnosis, Verdict
from identify.report import residuals, sections, write_report
from identify.report.blocks import Answer, Heading, Picture, Section
from identify.report.drawing import binned_mean, data_uri, drawing_style
from identify.report.overlay import representative
from identify.report.subject import LogForces, Subject
from identify.report.units import Scale, number, quantity
from identify.structure import Structure
from identify.workflow import Addition, Diagnosis
from twin.effects import Catalogue, load_catalogue
from twin.errors import InputError
from twin.experiments import simulate
from twin.log import Log
from twin.model import AxisModel, Fitted, Hardware, StageModel
from twin.simulator import ReducedStage

MOST_BYTES = 3_000_000
CATEGORIES = {"Effect added", "Coordinate"}  # axes of names, which have no unit

HARDWARE = Hardware(
    travel=(-0.1, 0.1), encoder_noise=1e-9, current_noise=1e-3, force_constant=10.0, velocity=0.2,
    acceleration=2.0, jerk=100.0,
)  # fmt: skip


@dataclass(frozen=True)
class Case:
    """A drive with cogging that its model lacks: the model, its logs and what was found."""

    model: StageModel
    fit: dict[str, Log]
    held: dict[str, Log]
    diagnosis: Diagnosis
    addition: Addition

    @property
    def x(self) -> AxisDiagnosis:
        return self.diagnosis.axes["x"]

    def subject(self, diagnosis: Diagnosis | None) -> Subject:
        history = self.addition.model.history
        return Subject("Report", diagnosis, self.diagnosis.comparison, history, [self.addition])

    def concluding(self, x: AxisDiagnosis) -> Diagnosis:
        """The same diagnosis with another conclusion."""
        return Diagnosis(self.diagnosis.model, {"x": x}, self.diagnosis.comparison)

    def write(self, path: Path, **changes: object) -> str:
        arguments = {
            "title": "Report",
            "diagnosis": self.diagnosis,
            "comparison": self.diagnosis.comparison,
            "history": self.addition.model.history,
            "additions": [self.addition],
        }
        write_report(path, **(arguments | changes))  # type: ignore[arg-type]
        return path.read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def case() -> Case:
    catalogue = load_catalogue()
    effects = [("coulomb_viscous", {"Fc": 0.3, "Fs": 0.3, "sigma2": 0.5}), ("constant_force", {})]
    axis = AxisModel(
        5.0, HARDWARE, tuple(Fitted.at_start(catalogue[n], values) for n, values in effects)
    )
    model = StageModel("drive", {"x": axis}, 2000.0)
    hidden = Fitted.at_start(catalogue["cogging"], {"p": 0.025, "a1": 0.1})
    truth = model.with_axis("x", axis.with_effect(hidden))
    first, second = (
        simulate(truth, "tracking", seed=seed, duration=6.0, stage=ReducedStage) for seed in (1, 2)
    )
    fit, held = {"run 1": first}, {"run 2": second}
    few = Catalogue([catalogue["cogging"], catalogue["quadratic_drag"]])
    return Case(
        model, fit, held,
        workflow.diagnose(model, fit, held, catalogue=few),
        workflow.add(catalogue["cogging"], model, fit, held),
    )  # fmt: skip


@pytest.fixture(scope="module")
def page(case: Case, tmp_path_factory: pytest.TempPathFactory) -> str:
    return case.write(tmp_path_factory.mktemp("report") / "report.html")


def pictures_in(page: str) -> list[str]:
    """SVG texts of the pictures of a page."""
    found = re.findall(r'src="data:image/svg\+xml;base64,([^"]+)"', page)
    return [base64.b64decode(text).decode() for text in found]


class Outline(HTMLParser):
    """Tags, attributes and visible text of a page."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.text = ""
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs

    def handle_data(self, data: str) -> None:
        self.text += data


def made(subject: Subject) -> dict[str, Section]:
    with drawing_style():
        return {section.anchor: section for section in sections(subject)}


def figures(subject: Subject) -> Iterator[Figure]:
    for section in made(subject).values():
        for block in section.blocks:
            if isinstance(block, Picture):
                yield block.figure


def answers(subject: Subject) -> list[Answer]:
    return [b for b in made(subject)["answer"].blocks if isinstance(b, Answer)]


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
    assert len(drawn) == 4  # force, residual, candidates, growth
    for text in drawn:
        assert ElementTree.fromstring(text).tag.endswith("svg")


def test_page_is_small_and_reproducible(case: Case, page: str, tmp_path: Path) -> None:
    assert len(page) < MOST_BYTES
    assert case.write(tmp_path / "again.html") == page


def test_many_samples_stay_small() -> None:
    """A dense scatter is thinned and rasterised: as vectors this one would take some 100 MB."""
    rng = np.random.default_rng(0)
    left = residuals._Left(rng.standard_normal(300_000), None, "", 1.0)
    views = [residuals.View(rng.uniform(size=300_000), "Position", "m")] * 4
    with drawing_style():
        assert len(data_uri(residuals._figure(views, left))) < MOST_BYTES / 3


def test_every_section_is_there(page: str) -> None:
    found = re.findall(r'<section id="(\w+)">', page)
    expected = [
        "answer", "force", "residual", "regions", "ranking", "growth", "equations", "parameters",
        "logs", "notes",
    ]  # fmt: skip
    assert found == expected
    assert re.findall(r'<a href="#(\w+)">', page) == expected


def test_page_says_the_verdict(case: Case, page: str) -> None:
    text = Outline(page).text
    best = case.x.best
    assert best is not None
    assert "Axis x: cogging is missing" in text
    assert Verdict.MISSING_EFFECT.value in text
    assert "Runner-up: quadratic drag" in text
    scale = Scale.of("N", [case.x.base.error])
    before = number(case.x.base.error / scale.size)
    assert f"{before} → {scale.text(best.fit.error)}" in text
    assert f"{number(case.x.base.ratio)} → {number(best.fit.ratio)}" in text
    assert best.effect.equation in text
    assert best.effect.fingerprint in text
    pitch = best.fit.axis["cogging"].values["p"]
    assert f"p = {quantity(pitch, 'm')}" in text.replace("\u00a0", " ")


def test_parameters_come_with_intervals_or_a_reason(case: Case, page: str) -> None:
    text = Outline(page).text
    # The model without cogging is wrong, so it has no intervals; with cogging there is one column.
    assert case.x.base.ratio > 3.0
    assert text.count("90 % interval") == 1
    assert "no intervals, because the force error" in text
    assert re.search(r"cogging\.p\s+–\s+[\d.]+ mm\s+[\d.]+ … [\d.]+", text)


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


def test_every_axis_has_quantity_and_unit(case: Case) -> None:
    unexplained = Structure(0.7, "position", 0.025, "m", {"position": 0.7, "time": 0.1})
    other = replace(case.x, verdict=Verdict.UNEXPLAINED, unexplained=unexplained)
    for diagnosis in (case.diagnosis, case.concluding(other)):
        drawn = list(figures(case.subject(diagnosis)))
        assert len(drawn) >= 4
        assert [label for figure in drawn for label in unlabelled(figure)] == []


def test_an_axis_without_unit_is_caught() -> None:
    figure = Figure()
    axes = figure.subplots()
    axes.set_xlabel("Time")
    axes.set_ylabel("Force (N)")
    assert unlabelled(figure) == ["Time"]


# --- other conclusions ----------------------------------------------------------------------


def test_without_a_diagnosis(case: Case, tmp_path: Path) -> None:
    text = case.write(tmp_path / "c.html", diagnosis=None, history=(), additions=())
    assert re.findall(r'<section id="(\w+)">', text) == [
        "answer", "force", "residual", "regions", "parameters", "logs",
    ]  # fmt: skip
    ratio = number(case.diagnosis.comparison.axes["x"].ratio)
    assert f"Axis x: force error {ratio} times the noise floor" in text


def test_an_addition_is_the_answer_where_nothing_was_diagnosed(case: Case) -> None:
    first, *_ = answers(case.subject(None))
    assert first.headline == "Axis x: cogging added"
    values = " ".join(tile.value for tile in first.tiles)
    assert quantity(case.addition.position_error[1], "m") in values


def test_every_verdict_has_its_words(case: Case) -> None:
    structure = Structure(0.63, "position", 0.027, "m", {"position": 0.63})
    tied = replace(case.x, verdict=Verdict.AMBIGUOUS, ambiguous_with=("quadratic_drag",))
    lost = replace(case.x, verdict=Verdict.UNEXPLAINED, unexplained=structure)
    done = replace(case.x, verdict=Verdict.NOTHING_MISSING)
    expected = {
        "Axis x: cogging or quadratic drag is missing": tied,
        "Axis x: something outside the catalogue is missing": lost,
        "Axis x: nothing is missing": done,
    }
    for headline, found in expected.items():
        (card,) = answers(case.subject(case.concluding(found)))
        assert card.headline == headline
        assert card.sentence.startswith(found.verdict.value)
        assert ("27.0 mm" in card.sentence) == (found is lost)
        assert ("63 %" in card.sentence) == (found is lost)


def test_only_named_effects_have_their_law_printed(case: Case) -> None:
    tied = replace(case.x, verdict=Verdict.AMBIGUOUS, ambiguous_with=("quadratic_drag",))
    blocks = made(case.subject(case.concluding(tied)))["equations"].blocks
    assert [b.text for b in blocks if isinstance(b, Heading)] == [
        "Cogging on x", "Quadratic drag on x",
    ]  # fmt: skip
    done = replace(case.x, verdict=Verdict.NOTHING_MISSING)
    assert "equations" not in made(case.subject(case.concluding(done)))


def test_the_axis_of_the_answer_comes_first(case: Case) -> None:
    compared = case.diagnosis.comparison
    quiet = replace(case.x, verdict=Verdict.NOTHING_MISSING)
    both = replace(
        compared,
        model=replace(compared.model, axes=dict.fromkeys("ax", compared.model.axes["x"])),
        axes={"a": replace(compared.axes["x"], axis="a"), "x": compared.axes["x"]},
    )
    diagnosis = Diagnosis(both.model, {"a": quiet, "x": case.x}, both)
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
    assert not {"script", "i"} & set(outline.tags)
    assert "onerror" not in {name for name, _ in outline.attributes}
    assert outline.text.count(evil) >= 5  # title twice, model, log, note
    assert f"Axis x: {own.name} is missing" in outline.text
    names = ["".join(ElementTree.fromstring(picture).itertext()) for picture in pictures_in(page)]
    assert any(own.name in name for name in names)


# --- whole or not at all --------------------------------------------------------------------


def test_a_failure_leaves_the_old_report(
    case: Case, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "report.html"
    path.write_text("old")

    def broken(*_: object) -> None:
        raise OSError("no space left on the device")

    for target in ((os, "replace"), (identify.report, "render")):
        with monkeypatch.context() as patch:
            patch.setattr(*target, broken)
            with pytest.raises(OSError, match="no space"):
                case.write(path)
        assert path.read_text() == "old"
        assert [p.name for p in tmp_path.iterdir()] == ["report.html"]


def test_a_missing_folder_is_said(case: Case, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="its folder does not exist"):
        case.write(tmp_path / "nowhere" / "report.html")


# --- numbers --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.02, "N", "20.0 mN"),
        (1.234, "N", "1.23 N"),
        (-3.3e-4, "s", "−330 µs"),
        (1e-9, "m", "1.00 nm"),
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
    assert quantity(value, unit) == text


def test_an_interval_sets_the_digits_of_its_value() -> None:
    scale = Scale.of("m", [0.027])
    assert scale.within(0.02698, 0.02702, 0.02698, 0.027, 0.02702) == ["26.980", "27.000", "27.020"]
    assert Scale.of("N", [1.0]).within(-1.0, 1.0, -0.01) == ["0.0"]
    assert Scale.of("N", [1.0]).within(1.0, 1.0, 1.0) == ["1.00"]


def test_a_mean_is_drawn_only_where_samples_are() -> None:
    x = np.concatenate([np.linspace(0.0, 1.0, 500), np.linspace(9.0, 10.0, 500)])
    y = np.where(x < 5.0, 1.0, -1.0)
    y[::7] = np.nan
    centre, mean = binned_mean(x, y)
    assert np.allclose(mean[centre < 0.9], 1.0)
    assert np.allclose(mean[centre > 9.1], -1.0)
    assert np.isnan(mean[(centre > 1.5) & (centre < 8.5)]).all()


def test_the_stretch_shown_has_the_error_of_the_whole() -> None:
    time = np.arange(0.0, 40.0, 0.01)
    error = np.where(time < 20.0, 0.0, np.where(time < 30.0, 1.0, 3.0))
    forces = LogForces("log", time, error, np.zeros_like(error), None)
    span = representative(forces, 4.0)
    whole = np.sqrt(np.mean(error**2))
    assert abs(np.sqrt(np.mean(error[span] ** 2)) - whole) < 0.35 * whole
    assert span.stop - span.start == 400
