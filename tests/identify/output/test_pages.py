"""The pages and tables of results with made-up numbers, all different, are those of ``pages.txt``.

`PYTHONPATH=tests python tests/identify/output/test_pages.py` writes them anew, to be read before
they are committed: whatever has changed there has changed for a user.
"""

from __future__ import annotations

import html
import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import built_results as made
import numpy as np
import pytest
from built_fits import axis_of, built_fit, fitted
from test_texts import TEXTS, of

from identify.dataset.dataset import Role
from identify.estimation.intervals import refusal
from identify.output.report.page import page
from identify.output.shown.report import SECTIONS, facts, sections
from identify.output.shown.subject import Subject
from identify.printed import Printed
from identify.results.results import Comparison, Diagnosis, OnMachine
from identify.selection.diagnosis import Verdict

FILE = Path(__file__).parent / "pages.txt"
SAID = ("answer", "found", "law-shape", "notes")  # sections that a diagnosis alone changes
ONE = replace(made.FOUND[0], tied=())


def subject_of(result: Diagnosis | Comparison | None = None, **changes: object) -> Subject:
    """The subject of a report of a built result."""
    given = Subject("The <title>", result or made.compared(), made.STEPS)
    return replace(given, **changes)


def whole(result: Diagnosis | Comparison | None = None, **changes: object) -> str:
    return written(subject_of(result, **changes))


def written(subject: Subject, anchors: tuple[str, ...] = ()) -> str:
    """A page without its styles and scripts, a line an element; of charts what they draw."""
    parts = [part for part in SECTIONS if part.anchor in anchors or not anchors]
    text = page(subject.title, facts(subject), sections(subject, parts))
    return in_lines(text[text.index("<main>" if anchors else "<body>") : text.index("</main>")])


def said_of(found: Diagnosis) -> str:
    """What a page says of a diagnosis alone."""
    axes = {name: c for name, c in found.comparison.axes.items() if name in found.axes}
    shown = replace(found, comparison=replace(found.comparison, axes=axes))
    return written(subject_of(shown, history=()), SAID)


def notebook(result: Printed) -> str:
    """What a notebook shows, in which nothing is run or loaded."""
    text = result._repr_html_() or ""
    assert not re.search(r"<(script|style|link|img|button)", text)
    return in_lines(text)


def in_lines(text: str) -> str:
    drawn = re.sub(r'data-chart="(.*?)"', lambda spec: chart(html.unescape(spec[1])), text)
    lines = (line.strip() for line in drawn.splitlines())
    return re.sub(r"(?<=</t[dh]>)\n|\n(?=</tr>)", "", "\n".join(filter(None, lines)))


def chart(text: str) -> str:
    """What is drawn over what, with its largest value."""
    spec = json.loads(text)
    for part in (spec["x"], *spec["series"]):
        part["most"] = f"{max(v for v in part.pop('values') if v is not None):.3g}"
    return json.dumps(spec, ensure_ascii=False)


def of_error(over_floor: float) -> Comparison:
    """A comparison of one axis with so large an error."""
    c = made.comparison_of()
    scaled = c.residual * (over_floor * c.floor / c.total_error)
    return Comparison(made.MODEL, {"x": replace(c, residual=scaled)})


def quiet_beside() -> Comparison:
    """A comparison of two axes, one of which is at its noise floor."""
    y = made.comparison_of("y")
    y = replace(y, residual=np.full(len(y.residual), 0.001))
    return Comparison(made.MODEL, {"x": made.comparison_of(), "y": y})


def by_frequency() -> Comparison:
    """A comparison of one axis with the spectrum of its error."""
    maps = [made.map_of("frequency", "Hz", 0.0)]
    return Comparison(made.MODEL, {"x": replace(made.comparison_of(), maps=maps)})


def of_a_curve() -> str:
    """A model with a fitted curve, whose many parameters are not listed."""
    axis = axis_of(fitted("empirical_map"))
    model = replace(made.MODEL, axes={"x": axis})
    compared = Comparison(model, {"x": made.comparison_of()})
    return written(subject_of(compared), ("equations", "parameters"))


def no_intervals() -> Diagnosis:
    """Before anything was found, for a reason that holds for all parameters."""
    found, why = made.diagnosed(), refusal(made.BASE)
    wrong = (
        replace(e, low=None, high=None, reason=why if e.free else None)
        for e in found.summaries["x"].before
    )
    x = replace(found.summaries["x"], before=tuple(wrong))
    return replace(found, summaries={**found.summaries, "x": x})


def y_first() -> Diagnosis:
    """What is missing is missing on y, although the model has x first."""
    found = made.diagnosed()
    x, y = found.axes["x"], found.axes["y"]
    x, y = replace(y, dataset=x.dataset), replace(x, dataset=y.dataset)
    return replace(found, axes={"x": x, "y": y})


def undecided() -> Diagnosis:
    """One effect without selection logs, and an experiment that is too short."""
    dataset = replace(made.DATASET, selection=())
    found = made.diagnosed(made.diagnosis_of(findings=(ONE,), dataset=dataset, on=Role.TRAINING))
    plan = made.plan_of("a", "b", ranking=(replace(made.TRIALS[0], gain=1.0),))
    return replace(found, next_experiments={"x": plan})


def contradicted() -> Diagnosis:
    """The only effect that the logs ask for is contradicted by the test logs."""
    against, _ = made.errors(2.17, 2.29, Role.TEST)
    finding = replace(ONE, tested=against)
    x = made.diagnosis_of(Verdict.UNEXPLAINED)
    found = made.diagnosed(replace(x, contradicted=(finding,)))
    x = replace(found.summaries["x"], tested=against)
    return replace(found, summaries={**found.summaries, "x": x})


def aperiodic() -> Diagnosis:
    left = replace(made.STRUCTURE, period=None)
    return of(made.diagnosis_of(Verdict.UNEXPLAINED, unexplained=left))


def refused() -> Diagnosis:
    return replace(made.diagnosed(), next_experiments={}, not_planned={"x": "no travel"})


def of_both_laws() -> Diagnosis:
    """The final model has every named effect, with values of its own."""
    axis = axis_of(fitted("cogging", p=0.0273)).with_effect(fitted("lugre"))
    ranking = (made.BEST, made.RIVAL, made.WEAK, made.LATER)
    final = built_fit(3.19, 2.03, axis)
    return made.diagnosed(made.diagnosis_of(final=final, ranking=ranking))


SAID_OF: dict[str, Callable[[], Diagnosis]] = {
    **{name: result for name, result in TEXTS.items() if name.startswith("diagnosis: ")},
    "diagnosis: y first": y_first,
    "diagnosis: undecided": undecided,
    "diagnosis: the only effect contradicted": contradicted,
    "diagnosis: unexplained without a period": aperiodic,
    "diagnosis: no experiment": refused,
    "diagnosis: another body": lambda: replace(made.diagnosed(), bodies=(made.wrong_body(),)),
}
RISING = replace(made.STEPS[0], fit_error_before=0.0341, fit_error_after=0.713)
FALLING = replace(made.STEPS[2], fit_error_before=0.723, fit_error_after=0.0331)
PAGES: dict[str, Callable[[], str]] = {
    "comparison": whole,
    "comparison at the noise floor": lambda: whole(of_error(1.29), history=()),
    "comparison above the noise floor": lambda: whole(of_error(1.31), history=()),
    "comparison of a quiet axis": lambda: whole(quiet_beside(), history=()),
    "comparison of a curve": of_a_curve,
    "errors in the unit of the largest": lambda: written(
        subject_of(history=(RISING, FALLING)), ("growth",)
    ),
    "diagnosis": lambda: whole(
        made.diagnosed(),
        additions=(made.addition(), made.addition(False)),
        findings=2 * ("run 1: warning: a doubt",),
        machine=OnMachine(worth=made.feedforward()),
    ),
    "diagnosis: laws": lambda: written(subject_of(of_both_laws()), ("equations", "ranking")),
    "diagnosis: no intervals": lambda: written(subject_of(no_intervals()), ("parameters",)),
    **{name: lambda d=result: said_of(d()) for name, result in SAID_OF.items()},
    "comparison by frequency": lambda: written(subject_of(by_frequency()), ("regions",)),
    "regions: unexplained": lambda: written(
        subject_of(TEXTS["diagnosis: unexplained"]()), ("regions",)
    ),
    "notebook: fit": lambda: notebook(made.fit_result()),
    "notebook: fit, intervals refused": lambda: notebook(TEXTS["fit, intervals refused"]()),
    "notebook: fit of curves": lambda: notebook(
        replace(made.fit_result(), estimates={"x": (), "y": ()})
    ),
    "notebook: comparison": lambda: notebook(by_frequency()),
    "notebook: diagnosis": lambda: notebook(made.diagnosed()),
}


def kept() -> dict[str, str]:
    parts = re.split(r"^== (.+)\n", FILE.read_text(encoding="utf-8"), flags=re.MULTILINE)[1:]
    return dict(zip(parts[::2], parts[1::2], strict=True))


def test_there_is_a_page_of_every_result() -> None:
    assert list(kept()) == list(PAGES)


@pytest.mark.parametrize("name", PAGES)
def test_a_page_is_as_it_was_read(name: str) -> None:
    assert PAGES[name]().splitlines() == kept()[name].splitlines()


@pytest.mark.parametrize("lacks", [True, False])
def test_a_page_is_titled_by_the_machine_and_what_was_asked(lacks: bool) -> None:
    """With what its model's history tells, of the fit that was diagnosed or of the model given."""
    result = made.diagnosed() if lacks else made.compared()
    model = result.fitted if lacks else result.model
    subject = Subject.of(result, findings=("one",))
    asked = "what the model lacks" if lacks else "model against measurement"
    assert subject.title == f"{model.name}: {asked}"
    assert (subject.result, subject.history, subject.findings) == (result, model.history, ("one",))
    assert subject.diagnosis is (result if lacks else None)
    assert subject.comparison is (result.comparison if lacks else result)


if __name__ == "__main__":
    FILE.write_text("".join(f"== {n}\n{p()}\n" for n, p in PAGES.items()), encoding="utf-8")
