"""The report's tables, tiles and sentences: each number beside its label, read back from the page."""

from __future__ import annotations

from dataclasses import replace

import built_results as made
import pytest
from built_fits import CATALOGUE, axis_of, built_fit, fitted
from built_results import Page

from identify import remarks as remarks_module
from identify.as_text import advice
from identify.diagnose import Verdict
from identify.report import (
    answer,
    equations,
    growth,
    logs,
    maps,
    notes,
    parameters,
    ranking,
    regions,
    render,
    sections,
)
from identify.report.blocks import Picture, Table, Tone
from identify.report.subject import Subject
from identify.report.units import Scale, number, quantity, spaced, title_case


@pytest.fixture(autouse=True)
def given_estimates(monkeypatch):
    """Estimates by the fit's error; pictures and parameters that moved are other tests'."""
    blank = Picture(None, "")
    for module, name in (
        (growth, "_picture"), (ranking, "_picture"), (maps, "picture"), (regions, "_picture"),
    ):  # fmt: skip
        monkeypatch.setattr(module, name, lambda *_: blank)
    monkeypatch.setattr(remarks_module, "moved_parameters", lambda before, after: ())
    known = {made.BEST.fit.error: made.estimates(0.0)}
    monkeypatch.setattr(
        parameters, "estimates", lambda fit: known.get(fit.error, made.estimates(0.5)[::2])
    )


def subject_of(diagnosis=None, *, history=made.STEPS, additions=(), **changes) -> Subject:
    return Subject("The title", diagnosis, made.compared(), history, additions, **changes)


def page_of(subject: Subject, *parts) -> Page:
    """The page with some sections, their pictures left out."""
    shown = [part.section(subject) for part in parts]
    bare = [
        replace(s, blocks=[b for b in s.blocks if not isinstance(b, Picture)]) for s in shown if s
    ]
    return Page(render(subject, bare))


# --- the error ledger -----------------------------------------------------------------------


def test_the_ledger_shows_each_step_in_its_row_and_column():
    page = page_of(subject_of(), growth)
    x, y = page.table("growth", 0), page.table("growth", 1)
    assert x == {
        "Cogging": {
            "Fit, before": "7.31 N", "Fit, after": "4.57 N",
            "Held out, before": "7.83 N", "Held out, after": "4.91 N",
        },
        "Lugre": {
            "Fit, before": "4.53 N", "Fit, after": "2.29 N",
            "Held out, before": "4.97 N", "Held out, after": "2.71 N",
        },
    }  # fmt: skip
    assert y == {
        "replace wear": {
            "Fit, before": "3.41 N", "Fit, after": "3.13 N",
            "Held out, before": "–", "Held out, after": "–",
        }
    }  # fmt: skip
    text = page.texts["growth"]
    assert text.index("Axis x") < text.index("4.57 N") < text.index("Axis y") < text.index("3.13")


def test_the_ledger_has_the_unit_of_its_largest_error():
    steps = (replace(made.STEPS[0], fit_error_before=0.713, fit_error_after=0.0341),)
    (row,) = growth._table(steps).rows
    assert row.cells[1:3] == ("0.713 N", "0.0341 N")
    table = growth._table(made.STEPS)
    assert [c.numeric for c in table.columns] == [False, True, True, True, True]
    assert [c.numeric for c in logs._table(made.comparison_of()).columns] == [False] + 4 * [True]


def test_each_section_has_its_anchor_and_title():
    subject = subject_of(made.diagnosed(), additions=(made.addition(),))
    shown = [
        part.section(subject)
        for part in (answer, regions, ranking, growth, equations, parameters, logs, notes)
    ]
    assert {s.anchor: s.title for s in shown} == {
        "answer": "Answer", "regions": "Where the error is", "ranking": "Candidates, ranked",
        "growth": "The error, effect by effect", "equations": "The law of the named effect",
        "parameters": "Parameters", "logs": "Errors log by log", "notes": "Notes",
    }  # fmt: skip


def test_the_ledger_of_positions():
    lost = replace(made.addition(False), step=made.STEPS[1], position_error=(2.9e-6, 2.1e-6))
    page = page_of(subject_of(history=(), additions=(made.addition(), lost)), growth)
    assert page.table("growth", 1) == {
        "Cogging on x": {
            "Free run, before": "3.71 µm", "Free run, after": "1.93 µm",
            "Replayed by MuJoCo": "1.97 µm", "Outcome": "kept",
        },
        "Lugre on x": {
            "Free run, before": "2.90 µm", "Free run, after": "2.10 µm",
            "Replayed by MuJoCo": "1.97 µm", "Outcome": "not supported",
        },
    }  # fmt: skip
    assert page_of(subject_of(history=()), growth).sections == {}
    one = Subject("t", None, made.Comparison(made.MODEL, {"x": made.comparison_of()}),
                  made.STEPS[:2], ())  # fmt: skip
    assert "Axis x" not in page_of(one, growth).texts["growth"]


def test_the_growth_is_that_of_the_history_or_else_of_the_additions():
    assert subject_of().steps == made.STEPS
    assert subject_of(history=(), additions=(made.addition(),)).steps == (made.STEPS[0],)


# --- logs -----------------------------------------------------------------------------------


def test_errors_log_by_log():
    page = page_of(subject_of(), logs)
    assert page.table("logs", 0) == {
        "run 1": {
            "Duration": "2.00 s", "Force error, RMS": "51.7 mN", "Over noise floor": "4.58",
            "Position error, free run, RMS": "3.17 µm",
        },
        "run 2": {
            "Duration": "2.50 s", "Force error, RMS": "73.1 mN", "Over noise floor": "6.47",
            "Position error, free run, RMS": "4.29 µm",
        },
    }  # fmt: skip
    second = page.table("logs", 1)
    assert second["run 1"]["Force error, RMS"] == "53.6 mN"
    assert second["run 1"]["Over noise floor"] == number(0.0536 / 0.0132)
    text = page.texts["logs"]
    assert "Noise floor of the force 11.3 mN RMS in windows of 40.0 ms" in text
    assert "encoder noise 2.13 nm RMS" in text


# --- candidates -----------------------------------------------------------------------------


def test_candidates_have_their_evidence_errors_and_values():
    page = page_of(subject_of(made.diagnosed()), ranking)
    rows = page.table("ranking", 0)
    assert list(rows) == ["Cogging", "Quadratic drag", "Constant force"]
    cells = [list(r.values())[:4] for r in rows.values()]
    assert list(rows["Cogging"])[:4] == ["ΔBIC", "Error before", "Error after", "Supported"]
    assert cells == [
        ["510", "7.13 N", "2.17 N", "yes"], ["423", "7.34 N", "2.38 N", "yes"],
        ["66.0", "7.46 N", "2.50 N", "no"],
    ]  # fmt: skip
    values = rows["Cogging"]["Values"].replace("\u00a0", " ")
    assert values.startswith("p = 26.1 mm, a1 = 127 mN, b1 = 35.3 mN, a2 = 0 N")
    assert rows["Cogging"]["Values"].startswith("p\u00a0=\u00a026.1\u00a0mm, a1")
    assert page.tones["ranking"][:4] == ["head", "strong", "plain", "muted"]
    assert "RMS force, held-out" in page.texts["ranking"]
    four = made.diagnosis_of(ranking=(made.BEST, made.RIVAL, made.WEAK, made.LATER))
    rows = page_of(subject_of(made.diagnosed(four)), ranking).table("ranking", 0)
    assert [bool(r["Values"]) for r in rows.values()] == [True, True, True, False]


def test_the_law_of_what_is_named_and_what_ties_with_it():
    page = page_of(subject_of(made.diagnosed()), equations)
    text = page.texts["equations"]
    for name in ("cogging", "quadratic_drag"):
        assert CATALOGUE[name].equation in text
        assert f"{title_case(name)} on x" in text
    assert CATALOGUE["constant_force"].equation not in text
    last = CATALOGUE["quadratic_drag"]
    facts = page.facts
    assert facts["What it is"] == last.summary
    assert (facts["Its trace"], facts["Shown by"]) == (last.fingerprint, last.excited_by)
    assert facts["Source"] == last.source
    assert facts["Fitted"] == ranking.values_of(made.RIVAL)


# --- parameters -----------------------------------------------------------------------------


def test_fitted_values_stand_beside_those_without_the_effect():
    x = made.diagnosis_of()
    table = page_of(subject_of(made.diagnosed(x)), parameters).table("parameters", 0)
    # 8.37 N over a floor of 2.11 N is too wrong for intervals: the column is left out.
    assert table["mass"] == {
        "Without cogging": "5.81 kg", "With cogging": "5.31 kg", "90 % interval": "5.23 … 5.47",
        "Meaning": "moved mass",
    }  # fmt: skip
    assert table["cogging.p"] == {
        "Without cogging": "–", "With cogging": "24.1 mm",
        "90 % interval": "no interval: not shown", "Meaning": "magnet pitch",
    }  # fmt: skip
    assert table["coulomb_viscous.Fs"] == {
        "Without cogging": "0.837 N", "With cogging": "337 mN", "90 % interval": "",
        "Meaning": "static friction, held",
    }  # fmt: skip
    page = page_of(subject_of(made.diagnosed(x)), parameters)
    assert (
        "Without cogging: no intervals, because the force error of 8.37 N stands 3.97 times"
        in (page.texts["parameters"])
    )
    assert page.tones["parameters"][:4] == ["head", "plain", "strong", "plain"]


def test_values_as_given():
    text = page_of(subject_of(), parameters)
    assert text.table("parameters", 0) == {
        "mass": {"Value": "5.30 kg", "Meaning": "moved mass"},
        "coulomb_viscous.Fc": {"Value": "310 mN", "Meaning": "Coulomb friction"},
        "coulomb_viscous.Fs": {"Value": "310 mN", "Meaning": "static friction"},
        "coulomb_viscous.sigma2": {"Value": "0.530 N·s/m", "Meaning": "viscous friction"},
    }
    assert text.table("parameters", 1)["mass"]["Value"] == "7.90 kg"
    described = axis_of(fitted("empirical_map"))
    rows = parameters._given(described).rows
    assert len(rows) == 4 + 163 - len(CATALOGUE["empirical_map"].strengths)


# --- the answer -----------------------------------------------------------------------------


def cards(diagnosis=None, **changes):
    return answer.section(subject_of(diagnosis, **changes)).blocks


def test_the_answer_for_an_ambiguity():
    first, second = cards(made.diagnosed())
    assert first.headline == "Axis x: cogging or quadratic drag and lugre are missing"
    assert (first.sentence, first.tone) == (Verdict.AMBIGUOUS.value, Tone.STRONG)
    tiles = [(t.name, t.value, t.remark) for t in first.tiles]
    ratio = f"{number(8.37 / 2.11)} → {number(1.19 / 1.03)}"
    assert tiles == [
        ("Force error on the fit logs", "8.37 → 1.19 N", "with cogging, RMS"),
        ("Held-out force error", "7.13 → 2.17 N", "t = 9.10 over blocks"),
        ("Error over noise floor", ratio, "floor 2.11 N RMS"),
        ("Position, free run", "4.29 µm", "RMS of the worst log, without cogging"),
    ]  # fmt: skip
    assert first.remarks == [
        "With cogging the force error is at its noise floor.",
        "Runner-up: quadratic drag, ΔBIC 423, held-out error 7.34 → 2.38 N, supported.",
        "The experiment that decides (8.30 s; twin plan writes it): passes: axis x, span 0.0831 m, "
        "speed 0.0127 m/s, repeats 7. It leaves 41.2 mN RMS to the rival, where noise is 11.3 mN; "
        f"{made.plan_of('a').gap.in_words()}.",
    ]
    assert second.headline == "Axis y: nothing is missing"
    assert second.tone is Tone.PLAIN
    words = made.refit_of(0.01).in_words()
    assert second.remarks[-1] == f"{words[0].upper()}{words[1:]}."
    assert second.remarks[0].startswith("Nearest candidate: constant force, ΔBIC 66.0")
    assert second.remarks[0].endswith("not supported.")
    assert [(t.name, t.value) for t in second.tiles] == [
        ("Force error", "1.07 N"), ("Error over noise floor", number(1.07 / 0.97)),
        ("Position, free run", "1.90 mm"),
    ]  # fmt: skip


def test_the_answer_for_what_nothing_explains():
    lost = made.diagnosis_of(Verdict.UNEXPLAINED, unexplained=made.STRUCTURE)
    card, _ = cards(made.diagnosed(lost))
    assert card.headline == "Axis x: something outside the catalogue is missing"
    assert card.sentence == (
        f"{Verdict.UNEXPLAINED.value} It depends most on other axis position, which accounts for "
        "63 % of the squared error, with a period of 27.3 mm."
    )
    assert f"{advice()}." in card.remarks
    assert card.remarks[0].startswith("Nearest candidate: cogging")
    aperiodic = replace(lost, unexplained=replace(made.STRUCTURE, period=None))
    assert "period" not in cards(made.diagnosed(aperiodic))[0].sentence


def test_the_answer_for_one_effect_that_leaves_more():
    best = replace(made.BEST, fit=built_fit(3.1, 1.0, made.BEST.fit.axis))
    steps = (replace(made.diagnosis_of().steps[0], candidate=best, tied=()),)
    one = made.diagnosis_of(
        Verdict.MISSING_EFFECT, steps=steps, study=replace(made.STUDY, holdout=())
    )
    found = made.diagnosed(one)
    card, _ = cards(replace(found, next_experiments={"x": made.plan_of("a", "b", ranking=(
        replace(made.TRIALS[0], gain=1.0),))}))  # fmt: skip
    assert card.headline == "Axis x: cogging is missing"
    assert "still stands 3.10 times above its noise floor" in card.remarks[0]
    assert "cross-validated error" in card.remarks[1]
    assert "comes nearest to deciding, but is too short" in card.remarks[2]
    assert [t.name for t in card.tiles][1] == "Cross-validated force error"


@pytest.mark.parametrize(("error", "tone"), [(1.29, Tone.PLAIN), (1.31, Tone.STRONG)])
def test_a_comparison_alone_says_whether_the_error_is_noise(error, tone):
    c = made.comparison_of()
    c = replace(c, residual=c.residual * (error * c.floor / c.total_error))
    card = answer._compared(c)
    assert card.tone is tone
    assert ("explains the measurement" in card.headline) is (tone is Tone.PLAIN)
    assert ("at its noise floor" in card.sentence) is (tone is Tone.PLAIN)
    assert card.tiles[0].value == quantity(error * c.floor, "N")
    assert card.tiles[1].value == number(error)
    assert (tone is Tone.PLAIN) or f"force error {number(error)} times" in card.headline


@pytest.mark.parametrize("kept", [True, False])
def test_an_addition_comes_first_where_nothing_was_diagnosed(kept):
    first, *rest = cards(additions=(replace(made.addition(), kept=True), made.addition(kept)))
    assert len(rest) == 2
    assert first.headline == "Axis x: cogging added"
    assert [(t.name, t.value) for t in first.tiles] == [
        ("Force error on the fit logs", "7.31 → 4.57 N"),
        ("Held-out force error", "7.83 → 4.91 N"), ("Position, free run", "3.71 → 1.93 µm"),
    ]  # fmt: skip
    assert "1.97 µm replayed by MuJoCo" in first.tiles[2].remark
    assert (first.tone is Tone.STRONG) is kept
    assert ("earned its place" in first.sentence) is kept
    assert len(cards(made.diagnosed(), additions=(made.addition(),))) == 2


# --- regions, notes, facts ------------------------------------------------------------------


def test_the_worst_regions_in_words():
    near, back = made.comparison_of().worst
    assert regions.in_words(near) == (
        "Position between 12.3 and 25.7 mm: 121 mN RMS, 14.3 times the noise floor, 37 % of the "
        "squared error."
    )
    assert regions.in_words(back).startswith("Moving backwards: 87.0 mN RMS, 7.70 times")
    assert regions.in_words(replace(back, low=0.0, high=1.5)).startswith("Moving forwards")


@pytest.mark.parametrize(("ratio", "shown"), [(1.29, False), (1.31, True)])
def test_regions_are_shown_above_the_noise(ratio, shown):
    c = made.comparison_of()
    c = replace(c, residual=c.residual * (ratio * c.floor / c.total_error))
    subject = Subject("t", None, made.Comparison(made.MODEL, {"x": c}), (), ())
    assert (regions.section(subject) is not None) is shown


def test_notes_are_said_once():
    subject = subject_of(made.diagnosed(), additions=(made.addition(),))
    (listing,) = notes.section(subject).blocks
    assert listing.items.count("Axis x, cogging added: mass moved.") == 1
    told = [i for i in listing.items if i.startswith("Axis x: ")]
    expected = remarks_module.remarks(made.diagnosis_of(), made.refit_of(0.0))
    assert told == [f"Axis x: {r.removesuffix('.')}." for r in expected]
    assert notes.section(subject_of(history=())) is None


def test_the_line_under_the_title_and_the_order_of_axes():
    found = made.diagnosed()
    facts = page_of(subject_of(found)).facts
    assert facts == {
        "Model": "the stage", "Logs": "run 1, run 2", "Held out": "held 1", "Window": "40.0 ms",
    }  # fmt: skip
    assert "Held out" not in page_of(subject_of()).facts
    y_first = replace(
        found,
        axes={
            "x": replace(found.axes["y"], study=made.STUDY),
            "y": replace(found.axes["x"], study=found.axes["y"].study),
        },
    )
    assert [a.axis for a in subject_of(y_first).axes] == ["y", "x"]
    assert [a.axis for a in subject_of(found).axes] == ["x", "y"]
    quiet = replace(found, axes={"y": found.axes["y"]})
    assert [a.axis for a in subject_of(quiet).axes] == ["x", "y"]


def test_only_sections_with_something_to_show_are_made(monkeypatch):
    def empty(subject):
        return None

    def one(subject):
        return regions.Section("one", subject.title, [Table([], [])])

    monkeypatch.setattr("identify.report.SECTIONS", (empty, one, empty))
    assert [s.anchor for s in sections(subject_of())] == ["one"]


# --- units ----------------------------------------------------------------------------------


@pytest.mark.parametrize("unit", ["N", "m", "kg"])
def test_a_scale_keeps_the_value(unit):
    for value in (3.21e-8, 4.9e-4, 5.1e-4, 0.49, 0.51, 23.0):
        scale = Scale.of(unit, [value, -value / 3.0])
        assert scale(value) * scale.size == pytest.approx(value)
        prefixed = {1.0: "", 1e-3: "m", 1e-6: "µ", 1e-9: "n"}[scale.size]
        assert scale.unit == prefixed + unit
        assert unit == "kg" or scale(value) >= 0.5
        assert unit == "kg" or scale.size == 1.0 or scale(value) < 500.0
    assert Scale.of(unit, []).size == 1.0


def test_an_interval_has_two_digits_of_its_half_width():
    scale = Scale(1e-3, "mN")
    assert scale.within(0.01, 0.05, -0.0314159) == ["−31"]
    assert scale.within(0.01, 0.014, 0.0123456) == ["12.3"]
    assert scale.within(0.0, 5.0, 1.2345) == ["1234"] or scale.within(0.0, 5.0, 1.2345) == ["1235"]
    assert spaced("a_b_c") == "a b c"
    assert title_case("a_b_c") == "A b c"
