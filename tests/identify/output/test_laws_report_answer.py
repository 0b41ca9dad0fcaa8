"""The report's answer and notes: each number beside its label."""

from __future__ import annotations

from dataclasses import replace

import built_results as made
import numpy as np
import pytest
from report_cases import page_of, subject_of

from identify.dataset.dataset import Role
from identify.output.numbers import arrow, capitalised, number, quantity, spaced
from identify.output.report import facts
from identify.output.report.answer import cards as cards_of
from identify.output.report.answer import notes
from identify.output.report.page import Tone
from identify.output.report.residual import regions
from identify.output.report.subject import Subject
from identify.output.words.diagnosis import (
    VERDICTS,
    advice,
    all_in_words,
    finding_in_words,
    remarks_on,
)
from identify.output.words.fit import refit_in_words
from identify.output.words.plan import next_step_in_words
from identify.output.words.residual import place_in_words, region_in_words
from identify.selection.diagnosis import Verdict
from identify.selection.findings import FindingKind

SEVERAL = (
    "The model lacks several effects: the training logs and the selection logs prove them. The "
    "logs cannot tell cogging from quadratic_drag."
)


def cards(diagnosis=None, **changes):
    return [card for view in subject_of(diagnosis, **changes).views for card in cards_of(view)]


def test_the_answer_for_an_ambiguity():
    first, second = cards(made.diagnosed())
    assert first.headline == "Axis x: cogging or quadratic drag, and lugre are missing"
    assert first.sentence.startswith(SEVERAL)
    assert first.tone is Tone.STRONG
    tiles = [(t.name, t.value, t.remark) for t in first.tiles]
    ratio = arrow(8.37 / 2.03, 3.19 / 2.03, "1")
    assert tiles == [
        ("Force error, training logs", "8.37 -> 3.19 N", "with all that was found, RMS"),
        ("Force error, selection logs", "7.81 -> 2.39 N", "with all that was found, RMS"),
        ("Error over noise floor", ratio, "training logs; floor 2.03 N RMS"),
        ("Position, free run", "4.29 µm", "RMS of the worst log, without all that was found"),
    ]  # fmt: skip
    findings = [spaced(". ".join(finding_in_words(f))) for f in made.FOUND]
    assert first.remarks == [
        *map(capitalised, findings),
        *map(capitalised, all_in_words(made.diagnosis_of())),
        next_step_in_words(made.plan_of("cogging", "quadratic_drag")),
    ]
    assert second.headline == "Axis y: nothing is missing"
    assert second.tone is Tone.PLAIN
    words = refit_in_words(made.refit_of(0.01))
    assert second.remarks == [f"{words[0].upper()}{words[1:]}."]
    assert [(t.name, t.value) for t in second.tiles] == [
        ("Force error, training logs", "1.07 N"),
        ("Force error, selection logs", "7.81 N"),
        ("Error over noise floor", number(1.07 / 0.97)), ("Position, free run", "1.90 mm"),
    ]  # fmt: skip


def test_the_answer_where_error_remains_beside_what_is_named():
    left = made.diagnosis_of(unexplained=made.STRUCTURE)
    card, _ = cards(made.diagnosed(left))
    assert card.sentence.startswith(
        f"{SEVERAL} What is left is 1.57 times the noise floor of 2.03 N on the training logs and "
        "1.00 times that of 2.19 N on the selection logs: something else is missing too. The error "
        "depends most on other"
    )
    where = region_in_words(made.LEFT_OVER)
    assert card.sentence.endswith(f"It is largest at {where}.")
    assert [r.split(" explains ")[0] for r in card.remarks[:2]] == ["Cogging", "Lugre"]
    told = "without it the error on the selection logs is 7.17 N, with it 2.19 N. It removes 81 %"
    assert told in card.remarks[0]
    assert card.remarks[2].startswith("Together they explain 98 % of the squared error above")


def test_the_answer_for_what_nothing_explains():
    lost = made.diagnosis_of(Verdict.UNEXPLAINED, unexplained=made.STRUCTURE)
    card, _ = cards(replace(made.diagnosed(lost), left_over={}))
    assert card.headline == "Axis x: something outside the catalogue is missing"
    assert card.sentence == (
        f"{VERDICTS[Verdict.UNEXPLAINED]} The error depends most on other axis position, "
        "which accounts for 63 % of the squared error, with a period of 27.3 mm."
    )
    assert f"{advice()}." in card.remarks
    aperiodic = replace(lost, unexplained=replace(made.STRUCTURE, period=None))
    assert "period" not in cards(made.diagnosed(aperiodic))[0].sentence


def test_the_answer_for_one_effect_without_held_out_logs():
    only = (replace(made.FOUND[0], tied=()),)
    one = made.diagnosis_of(
        findings=only, dataset=replace(made.DATASET, holdout=()), on=Role.TRAINING
    )
    found = made.diagnosed(one)
    card, _ = cards(replace(found, next_experiments={"x": made.plan_of("a", "b", ranking=(
        replace(made.TRIALS[0], gain=1.0),))}))  # fmt: skip
    assert card.headline == "Axis x: cogging is missing"
    assert "comes nearest to deciding, but is too short" in card.remarks[1]
    assert [t.name for t in card.tiles][1] == "Force error, cross-validated"
    logs = "'run 1' 'run 2' --holdout 'held 1'"
    assert card.commands == [f"twin add cogging MODEL {logs} -o better.toml"]


def test_what_is_only_like_an_effect_or_contradicted_stands_in_the_headline():
    like = replace(made.FOUND[0], kind=FindingKind.RESEMBLES)
    card, _ = cards(made.diagnosed(made.diagnosis_of(findings=(like, made.FOUND[1]))))
    assert card.headline == (
        "Axis x: something like cogging or quadratic drag, and lugre are missing"
    )
    assert card.remarks[0].startswith("What is missing resembles cogging, in another shape; that ")
    against = replace(made.FOUND[0], tied=(), tested=made.errors(2.17, 2.29, Role.TEST)[0])
    card, _ = cards(made.diagnosed(made.diagnosis_of(findings=(against,))))
    assert card.headline == ("Axis x: cogging is missing (not confirmed by the test logs: cogging)")
    assert not any("in the self-test" in r for r in card.remarks)
    assert card.commands == []


@pytest.mark.parametrize(("error", "tone"), [(1.29, Tone.PLAIN), (1.31, Tone.STRONG)])
def test_a_comparison_alone_says_whether_the_error_is_noise(error, tone):
    c = made.comparison_of()
    c = replace(c, residual=c.residual * (error * c.floor / c.total_error))
    (view,) = Subject("t", None, made.Comparison(made.MODEL, {"x": c}), (), ()).views
    (card,) = cards_of(view)
    assert bool(regions(view)) is (tone is Tone.STRONG)
    assert card.tone is tone
    assert ("explains the measurement" in card.headline) is (tone is Tone.PLAIN)
    assert ("at its noise floor" in card.sentence) is (tone is Tone.PLAIN)
    assert card.tiles[0].value == quantity(error * c.floor, "N")
    assert card.tiles[1].value == number(error)
    assert (tone is Tone.PLAIN) or f"force error {number(error)} times" in card.headline


def test_regions_have_headings_only_among_axes_with_regions():
    quiet = made.comparison_of("y")
    quiet = replace(quiet, residual=np.full(len(quiet.residual), 0.001))
    for y, expected in ((made.comparison_of("y"), ["Axis x", "Axis y"]), (quiet, ["Axis x"])):
        compared = made.Comparison(made.MODEL, {"x": made.comparison_of(), "y": y})
        text = page_of(Subject("t", None, compared, (), ())).texts["regions"]
        assert [name for name in ("Axis x", "Axis y") if name in text] == expected


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"low": 0.0, "high": 1.5}, "moving forwards"),
        ({"low": -1.5, "high": 0.0}, "moving backwards"),
        ({"coordinate": "standstill", "unit": "1", "low": 0.0, "high": 1.0}, "in motion"),
        ({"coordinate": "standstill", "unit": "1", "low": 1.0, "high": 2.0}, "at standstill"),
        (
            {"coordinate": "position", "unit": "m", "low": 0.01131, "high": 0.01157},
            "position between 11.31 and 11.57 mm",
        ),
    ],
)
def test_a_place_is_named_with_the_digits_of_its_width(changed, said):
    _, back = made.comparison_of().worst
    assert place_in_words(replace(back, **changed)) == said


def test_notes_are_said_once():
    subject = subject_of(made.diagnosed(), additions=(made.addition(),))
    (listing,) = notes(subject)
    assert listing.items.count("Axis x, cogging added: mass moved.") == 1
    told = [i for i in listing.items if i.startswith("Axis x: ")]
    expected = remarks_on(made.diagnosed(), "x")
    assert "after the fit 0.127 N" in expected[0]
    assert told == [f"Axis x: {r.removesuffix('.')}." for r in expected]
    assert notes(subject_of(history=())) == []
    refused = replace(made.diagnosed(), next_experiments={}, not_planned={"x": "no travel"})
    (listing,) = notes(subject_of(refused))
    why = "no experiment that would tell them apart is proposed: no travel"
    assert f"Axis x: {why}." in listing.items


def test_the_line_under_the_title_and_the_order_of_axes():
    found = made.diagnosed()
    assert dict(facts(subject_of(found))) == {
        "Model": "the stage", "Training logs": "run 1, run 2", "Selection logs": "held 1",
        "Test functions": "40.0 ms",
    }  # fmt: skip
    assert "Selection logs" not in dict(facts(subject_of()))
    y_first = replace(
        found,
        axes={
            "x": replace(found.axes["y"], dataset=made.DATASET),
            "y": replace(found.axes["x"], dataset=found.axes["y"].dataset),
        },
    )
    assert [a.name for a in subject_of(y_first).views] == ["y", "x"]
    assert [a.name for a in subject_of(found).views] == ["x", "y"]
    quiet = replace(found, axes={"y": found.axes["y"]})
    assert [a.name for a in subject_of(quiet).views] == ["x", "y"]
