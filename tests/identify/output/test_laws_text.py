"""The text for a terminal: each line holds the numbers that it names, in their order."""

from __future__ import annotations

import re
from dataclasses import replace

import built_results as made
import pytest
from built_fits import CATALOGUE, built_fit, fitted

from identify.estimation.fit import Outcome
from identify.estimation.intervals import NotExcited, refusal
from identify.experiment_design.candidate_experiments import NotRun
from identify.experiment_design.missing_excitation import Gap
from identify.output.as_json import json_of
from identify.output.machine import check_text, effect_text, effects_text
from identify.output.numbers import quantity, span
from identify.output.text import (
    add_text,
    compare_text,
    fit_text,
    in_short,
    plan_text,
)
from identify.output.words.addition import axis_in_words
from identify.output.words.fit import OUTCOMES, moved_in_words, no_interval_in_words, refit_in_words
from identify.output.words.plan import gap_in_words, in_order
from identify.output.words.residual import loop_in_words
from twin.checks import CheckReport, Fault, Finding, Severity
from twin.experiments.kinds import Rests


def test_a_fit():
    result = made.fit_result()
    wrong = replace(made.estimates(0.0)[1], reason=refusal(result.fits["x"]))
    result = replace(result, estimates={**result.estimates, "x": (wrong,)})
    lines = fit_text(result).splitlines()
    assert lines[0] == (
        "axis x: force error on the training logs 51.3 mN, on the selection logs 61.1 mN, noise "
        "floor 12.7 mN (ratio 4.04)"
    )
    second = lines.index(
        "axis y: force error on the training logs 31.7 mN, on the test logs 73.3 mN, noise floor "
        "13.1 mN (ratio 2.42)"
    )
    assert lines[1].strip() == OUTCOMES[Outcome.AT_BOUND]
    x, y = lines[:second], lines[second:]
    assert any("acts 217 µs (0.22 samples)" in line for line in x)
    assert not any("samples)" in line for line in y)
    assert sum(refit_in_words(made.refit_of(0.0)) in line for line in x) == 1
    assert not any("with the given values" in line for line in y)
    reason = [line for line in x if "is 4.0 times the noise floor 12.7 mN" in line]
    assert len(reason) == 1
    mass, hidden, held = (line.split() for line in y[-3:])
    assert mass == ["mass", "5.33", "kg", "90", "%", "in", "5.25", "to", "5.49"]
    assert hidden == ["cogging.p", "44.1", "mm", *no_interval_in_words(NotExcited()).split()]
    assert held == ["coulomb_viscous.Fs", "357", "mN", "fixed"]


def test_a_reason_that_holds_for_all_is_said_once():
    result = made.fit_result()
    reason = refusal(result.fits["x"])
    own = replace(made.estimates(0.0)[1], reason=reason)
    again = replace(result, estimates={"x": (own,), "y": made.estimates(0.0)})
    text = fit_text(again)
    assert text.count(no_interval_in_words(reason)) == 1
    label = next(line for line in text.splitlines() if "cogging.p" in line)
    assert label.split() == ["cogging.p", "24.1", "mm"]


def test_the_strengths_of_a_description_are_one_sentence():
    effect = CATALOGUE["empirical_map"]
    axis = made.axis_of(fitted(effect.name))
    result = made.fit_result()
    strength = replace(made.estimates(0.0)[0], label=f"{effect.name}.{effect.strengths[0].name}")
    again = replace(
        result, fits={"x": built_fit(1.0, axis=axis)}, estimates={"x": (strength,)},
    )  # fmt: skip
    lines = fit_text(again).splitlines()
    told = [line.strip() for line in lines if "is a fitted curve" in line]
    assert len(told) == 1
    assert told[0].startswith("empirical_map")
    assert not any(strength.label in line for line in lines)


def test_a_comparison():
    lines = compare_text(made.compared()).splitlines()
    assert lines[0] == (
        "axis x, run 1: force error 51.7 mN (4.6 times the noise floor), free-running position "
        "error 3.17 µm"
    )
    assert lines[1].startswith("axis x, run 2: force error 73.1 mN (6.5 times the noise floor)")
    assert lines[1].endswith("4.29 µm")
    assert lines[2].strip() == (
        "worst: position between 12.3 and 25.7 mm: 121 mN RMS, 14.3 times the noise floor, "
        "37 % of the squared error"
    )
    assert lines[3].strip().startswith("worst: moving backwards: 87.0 mN RMS, 7.70 times")
    tested = [line for line in lines if line.startswith("  force residual against")]
    assert len(tested) == 6
    assert lines[-1] == loop_in_words(made.whiteness_of().loop)
    assert lines.count(lines[-1]) == 1
    quiet = made.Comparison(made.MODEL, {"x": replace(made.comparison_of(), worst=[])})
    assert "in no region is the error above the noise" in compare_text(quiet)
    assert "in no region" not in compare_text(made.compared())


def test_a_plan_between_two():
    lines = plan_text(made.plan_of("cogging", "wear", favoured="wear", supposed=True)).splitlines()
    assert lines[0] == "axis x: cogging or wear, decided by"
    assert lines[1] == "  passes: axis x, span 0.0831 m, speed 0.0127 m/s, repeats 7"
    assert lines[2] == "  missing motion: speed 13.7 to 59.1 mm/s; 1.2 % of the data is there"
    assert lines[3] == "  cogging is excited by slow passes"
    assert lines[4] == "  the existing logs already favour wear"
    assert lines[5] == (
        "  no logs given: each effect that the model lacks is assumed at 10 times the noise floor"
    )
    assert lines[6:] == [
        "  passes: axis x, span 0.0831 m, speed 0.0127 m/s, repeats 7; takes 8.30 s: expected "
        "evidence (difference of BIC) 57.3, the rival leaves 41.2 mN RMS unexplained, 3.65 times "
        "the noise floor",
        "  tracking: duration 9.7 s; takes 9.90 s: evidence 31.9, the rival "
        "leaves 28.7 mN RMS unexplained, 2.68 times the noise floor",
    ]
    models = made.plan_of("a.toml", "b.toml", supposed=True, excited_by={})
    assert "the models are compared with the values in their files" in plan_text(models)
    assert "assumed" not in plan_text(models)
    weak = replace(made.TRIALS[0], gain=10.0)
    text = plan_text(made.plan_of("cogging", "wear", ranking=(weak,)))
    assert "not decided by any experiment of this length" in text
    many = plan_text(made.plan_of("cogging", "wear", ranking=made.TRIALS * 3))
    assert len(many.splitlines()) == 4 + 4


def test_the_experiments_of_a_plan_are_in_order_of_evidence():
    """After the chosen one; more than its evidence is a linear step's, which was not refitted."""
    first, second = made.TRIALS
    weak, strong = replace(second, gain=9.0), replace(second, gain=91.0)
    impossible = replace(second, gain=0.0, not_run=NotRun(second.experiment, "too far"))
    plan = made.plan_of("cogging", "wear", ranking=(first, weak, impossible, strong))
    assert in_order(plan) == [first, strong, weak]
    rows = plan_text(plan).splitlines()[4:]
    told = [re.search(r"evidence (?:\(.*\) )?([\d.]+)", row)[1] for row in rows]
    assert told == ["57.3", "91.0", "9.00"]
    assert ["by one linear step" in row for row in rows] == [False, True, False]
    assert [t["delta_bic"] for t in json_of(plan)["ranking"]] == [57.3, 91.0, 9.0]


def test_a_plan_for_one_model():
    lines = plan_text(made.plan_of("the stage", supposed=True)).splitlines()
    assert lines[0] == "axis x: the parameters of the stage, best constrained by"
    assert [" ".join(line.split()) for line in lines[4:]] == [
        "passes: axis x, span 0.0831 m, speed 0.0127 m/s, repeats 7; takes 8.30 s: 57.3 nats "
        "of information on the parameters",
        "tracking: duration 9.7 s; takes 9.90 s: 31.9 nats of information on the parameters",
    ]  # fmt: skip


def test_an_experiment_in_short_has_the_units_of_its_parameters():
    rests = Rests("y", 0.0021, 0.0043, (0.1, 0.75), effort=0.25)
    assert in_short(rests) == (
        "rests: axis y, effort 0.25 1, span 0.0021 m, speed 0.0043 m/s, rests 0.1 0.75 s"
    )


@pytest.mark.parametrize(
    ("share", "said"),
    [
        (None, "the explanations differ most at"),
        (0.049, "missing motion: speed"),
        (0.051, "no motion is missing"),
    ],
)
def test_a_gap_is_missing_where_few_of_the_data_are(share, said):
    assert gap_in_words(Gap("speed", "m/s", 0.01, 0.05, share)).startswith(said)


@pytest.mark.parametrize("kept", [True, False])
def test_an_addition(kept):
    lines = [" ".join(line.split()) for line in add_text(made.addition(kept)).splitlines()]
    assert lines[:5] == [
        "added cogging to axis x", "force error on the training logs 7.31 -> 4.57 N",
        "force error on the selection logs 7.83 -> 4.91 N",
        "free-running position error 3.71 -> 1.93 µm on run 1 (MuJoCo: 1.97 µm)",
        "mass moved",
    ]  # fmt: skip
    assert lines[5] == "the errors told flatter it"
    assert (
        "The logs do not prove it: gain uncertain: t = 1.3, where 1.6 is sure." in lines[-1]
    ) is not kept
    assert ("has it nevertheless, as asked for" in lines[-1]) is not kept
    assert len(lines) == (6 if kept else 7)
    tested = replace(made.addition(kept), step=made.STEPS[1])
    assert "force error on the test logs      5.03 -> 2.83 N" in add_text(tested)
    assert "helped to choose" not in add_text(tested)
    unheld = add_text(replace(made.addition(kept), step=made.STEPS[2]))
    assert "selection" not in unheld
    assert "added wear to axis y" in unheld


def test_why_an_axis_was_chosen_is_said():
    both = ("x", "y")
    assert axis_in_words("wear", "x", ["x"], []) is None
    assert (
        axis_in_words("wear", "y", both, ["x"]) == "axis x has wear already, so it went to axis y"
    )
    assert axis_in_words("wear", "y", both, []) == (
        "of axes x, y, axis y has the most evidence for it"
    )


def test_a_number_without_dimension_has_no_unit():
    moved = replace(made.MOVED, before=0.2261, after=0.201, unit="1", collapsed=False)
    assert " moved from 0.226 to 0.201: more than" in moved_in_words(moved)
    assert (quantity(0.5, "1"), span(1.0, 2.0, "1")) == ("0.500", "1.00 and 2.00")


def test_the_catalogue_and_one_effect():
    effects = [CATALOGUE[n] for n in ("wear", "position_dependent_friction")]
    first, second = effects_text(effects).splitlines()
    assert first.split()[:2] == ["wear", "modifier"]
    assert second.split()[0] == "position_dependent_friction"
    assert first.index("modifier") == second.index("modifier")
    text = effect_text(CATALOGUE["lugre"])
    for p in CATALOGUE["lugre"].parameters:
        row = next(line for line in text.splitlines() if line.split()[0] == p.name)
        found = re.fullmatch(r"\s+\S+\s+(\S+) (.+?)\s+\[(\S+), (\S+)\]  (.*)", row)
        start, unit, low, high, meaning = found.groups()
        assert (f"{p.start:.4g}", p.unit, f"{p.lower:g}", f"{p.upper:g}", p.meaning) == (
            start, unit, low, high, meaning,
        )  # fmt: skip
    for word in ("equation", "source", "fingerprint", "excited_by"):
        label = word.replace("_", " ")
        line = next(line for line in text.splitlines() if line.startswith(label))
        assert line.removeprefix(label).strip() == getattr(CATALOGUE["lugre"], word).split("\n")[0]


def test_a_check():
    finding = Finding(Severity.WARNING, Fault.LAG, "y", "the what", "the where", "the remedy")
    reports = {"a": CheckReport((finding,)), "b": CheckReport(())}
    assert check_text(reports).splitlines() == [
        "a: warning: axis y, the where: the what; the remedy", "b: suitable for identification",
    ]  # fmt: skip
