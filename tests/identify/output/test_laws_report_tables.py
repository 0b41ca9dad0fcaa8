"""The report's tables: each number beside its row and column, read back from the page."""

from __future__ import annotations

from dataclasses import replace

import built_results as made
from built_fits import CATALOGUE, axis_of, built_fit, fitted
from report_cases import page_of, subject_of

from identify.estimation.intervals import NotExcited, refusal
from identify.output.numbers import number, title_case
from identify.output.report.effects import given_table, growth_table, values_of
from identify.output.report.page import Listing
from identify.output.report.residual import logs, whiteness
from identify.output.words.fit import no_interval_in_words


def test_the_ledger_shows_each_step_in_its_row_and_column():
    shown = page_of(subject_of())
    x, y = shown.table("growth", 0), shown.table("growth", 1)
    assert x == {
        "Cogging": {
            "Training, before": "7.31 N", "Training, after": "4.57 N",
            "Selection, before": "7.83 N", "Selection, after": "4.91 N",
            "Test, before": "–", "Test, after": "–",
        },
        "Lugre": {
            "Training, before": "4.53 N", "Training, after": "2.29 N",
            "Selection, before": "4.97 N", "Selection, after": "2.71 N",
            "Test, before": "5.03 N", "Test, after": "2.83 N",
        },
        "Noise floor of these logs": {
            "Training, before": "", "Training, after": "0.0113 N",
            "Selection, before": "", "Selection, after": "–",
            "Test, before": "", "Test, after": "–",
        },
    }  # fmt: skip
    assert y["replace wear"] == {
        "Training, before": "3.41 N", "Training, after": "3.13 N",
        "Selection, before": "–", "Selection, after": "–",
    }  # fmt: skip
    text = shown.texts["growth"]
    assert text.index("Axis x") < text.index("4.57 N") < text.index("Axis y") < text.index("3.13")


def test_the_ledger_has_the_unit_of_its_largest_error():
    steps = (replace(made.STEPS[0], fit_error_before=0.713, fit_error_after=0.0341),)
    (row,) = growth_table(steps, {}).rows
    assert row.cells[1:3] == ("0.713 N", "0.0341 N")
    rising = (replace(made.STEPS[0], fit_error_before=0.0341, fit_error_after=0.713),)
    assert growth_table(rising, {}).rows[0].cells[1:3] == ("0.0341 N", "0.713 N")
    table = growth_table(made.STEPS, {})
    assert table.numeric == [False] + 6 * [True]
    assert growth_table(rising, {}).numeric == [False] + 4 * [True]
    assert logs(subject_of().views[0])[0].numeric == [False] + 5 * [True]


def test_errors_of_the_model_before_are_told_as_such():
    diagnosed, compared = subject_of(made.diagnosed()), subject_of()
    for section in ("regions", "logs"):
        assert "Of the model without all that was" in page_of(diagnosed).texts[section]
        assert "Of the model" not in page_of(compared).texts[section]
    first, unlabelled = (whiteness(subject.views[0])[0] for subject in (diagnosed, compared))
    assert first == Listing(["Of the model without all that was found."])
    assert unlabelled != first


def test_errors_log_by_log():
    shown = page_of(subject_of())
    assert shown.table("logs", 0)["run 1"] == {
        "Duration": "2.00 s", "Force error, RMS": "51.7 mN", "Times noise floor": "4.58",
        "Position error, free run, RMS": "3.17 µm", "Expected from noise": "0.213 µm",
    }  # fmt: skip
    assert shown.table("logs", 1)["run 1"]["Times noise floor"] == number(0.0536 / 0.0132)
    text = shown.texts["logs"]
    assert "Noise floor of the force: 11.3 mN RMS with test functions of 40.0 ms" in text


def test_candidates_have_their_evidence_errors_and_values():
    shown = page_of(subject_of(made.diagnosed()))
    rows = shown.table("ranking", 0)
    assert list(rows) == ["Cogging", "Quadratic drag", "Constant force"]
    cells = [list(r.values())[:5] for r in rows.values()]
    assert list(rows["Cogging"])[:5] == [
        "Evidence (ΔBIC)", "Error before", "Error after", "Part removed", "Why not",
    ]  # fmt: skip
    assert cells == [
        ["510", "7.13 N", "2.17 N", "91 %", ""], ["423", "7.34 N", "2.38 N", "89 %", ""],
        ["66.0", "7.46 N", "2.50 N", "89 %", "gain uncertain: t = 1.3, where 1.6 is sure"],
    ]  # fmt: skip
    values = rows["Cogging"]["Values"].replace("\u00a0", " ")
    assert values.startswith("p = 26.1 mm, a1 = 127 mN, b1 = 35.3 mN, a2 = 0 N")
    assert rows["Cogging"]["Values"].startswith("p\u00a0=\u00a026.1\u00a0mm, a1")
    assert shown.tones["ranking"][:4] == ["head", "strong", "plain", "muted"]
    assert "RMS force, selection" in shown.texts["ranking"]
    four = made.diagnosis_of(ranking=(made.BEST, made.RIVAL, made.WEAK, made.LATER))
    rows = page_of(subject_of(made.diagnosed(four))).table("ranking", 0)
    assert [bool(r["Values"]) for r in rows.values()] == [True, True, True, False]


def test_the_laws_of_all_that_is_named_and_what_ties_with_it():
    """Of the final model, with every named effect: not of the first step alone."""
    axis = axis_of(fitted("cogging", p=0.0273)).with_effect(fitted("lugre"))
    both = built_fit(3.19, 2.03, axis)
    shown = page_of(subject_of(made.diagnosed(made.diagnosis_of(final=both))), ("equations",))
    text = shown.texts["equations"]
    assert "p = 27.3 mm" in text.replace("\u00a0", " ")
    for name in ("cogging", "quadratic_drag", "lugre"):
        assert CATALOGUE[name].equation in text
        assert f"{title_case(name)} on x" in text
    assert CATALOGUE["constant_force"].equation not in text
    last = CATALOGUE["lugre"]
    facts = shown.facts
    assert facts["What it is"] == last.summary
    assert (facts["Fingerprint"], facts["Excited by"]) == (last.fingerprint, last.excited_by)
    assert facts["Source"] == last.source
    assert facts["Fitted"] == values_of(last, both.axis)


def test_fitted_values_stand_beside_those_without_the_effect():
    x = made.diagnosis_of()
    table = page_of(subject_of(made.diagnosed(x))).table("parameters", 0)
    assert table["mass"]["90 % interval"] == "5.23 to 5.47"
    assert table["cogging.p"] == {
        "Without all that was found": "–", "With all that was found": "24.1 mm",
        "90 % interval": no_interval_in_words(NotExcited()), "Meaning": "magnet pitch",
    }  # fmt: skip
    assert table["coulomb_viscous.Fs"] == {
        "Without all that was found": "0.837 N", "With all that was found": "337 mN",
        "90 % interval": "fixed",
        "Meaning": "static friction",
    }  # fmt: skip
    shown = page_of(subject_of(made.diagnosed(x)))
    assert shown.tones["parameters"][:4] == ["head", "plain", "strong", "plain"]


def test_a_model_that_is_wrong_has_no_intervals_and_one_reason():
    found = made.diagnosed()
    wrong = tuple(replace(e, low=None, high=None, reason=refusal(made.BASE) if e.free else None)
                  for e in found.summaries["x"].before)  # fmt: skip
    summaries = {**found.summaries, "x": replace(found.summaries["x"], before=wrong)}
    shown = page_of(subject_of(replace(found, summaries=summaries)))
    titles = shown.sections["parameters"][0][0]
    assert titles.count("90 % interval") == 1
    assert (
        "Without all that was found: no interval: the force error 8.37 N is 4.1 times the noise "
        "floor 2.03 N" in shown.texts["parameters"]
    )  # the one floor of the page, as in the tiles


def test_values_as_given():
    text = page_of(subject_of())
    values = text.table("parameters", 0)
    assert len(values) == 4
    viscous = {"Value": "0.530 N·s/m", "Meaning": "viscous friction"}
    assert values["coulomb_viscous.sigma2"] == viscous
    assert text.table("parameters", 1)["mass"]["Value"] == "7.90 kg"
    described = axis_of(fitted("empirical_map"))
    rows = given_table(described)[0].rows
    assert len(rows) == 4 + 163 - len(CATALOGUE["empirical_map"].strengths)
