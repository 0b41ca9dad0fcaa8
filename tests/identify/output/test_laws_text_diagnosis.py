"""The text of a diagnosis: each line holds the numbers that it names, in their order."""

from __future__ import annotations

from dataclasses import replace

import built_results as made
import pytest
from built_fits import NOISE, built, built_fit, step

from identify.dataset.dataset import Role
from identify.estimation.fit import Outcome
from identify.output.as_json import json_of
from identify.output.text import diagnose_text, plan_text
from identify.output.words.diagnosis import (
    SEVERAL,
    named_errors_in_words,
    not_named_in_words,
    remarks_on,
    step_lines,
    ties_in_words,
    verdict_in_words,
    why_not,
)
from identify.output.words.findings import (
    SHARES,
    advice,
    finding_in_words,
    next_command,
    together_in_words,
)
from identify.output.words.fit import OUTCOMES, change_in_words, moved_in_words, refit_in_words
from identify.output.words.residual import region_in_words, repeat_in_words
from identify.selection.confounded import Change, Refit

COGGING, LUGRE = made.FOUND
CONFIRMED_NOT = replace(COGGING, tested=made.errors(2.17, 2.29, Role.TEST)[0], tied=())


def told_of_x(x):
    """The lines of the text after "axis x: "."""
    return diagnose_text(made.diagnosed(x)).split("axis x: ", 1)[1].splitlines()


def test_a_diagnosis():
    x = made.diagnosis_of(unexplained=made.STRUCTURE, repeat=made.REPEAT)
    result = made.diagnosed(x)
    lines = told_of_x(x)
    assert lines[:4] == [
        f"{SEVERAL} Missing: cogging or quadratic_drag, and lugre.",
        "  force error on the training logs 8.37 -> 3.19 N with all that was found, noise floor "
        "2.03 N (ratio 4.12 -> 1.57)",
        "  force error on the selection logs 7.81 -> 2.39 N with all that was found",
        "  these data cannot separate cogging from: quadratic_drag",
    ]
    planned = [f"  {line}" for line in plan_text(result.next_experiments["x"]).splitlines()]
    assert lines[4 : 4 + len(planned)] == planned
    rest = [" ".join(line.split()) for line in lines[4 + len(planned) :]]
    found = [*finding_in_words(COGGING), *finding_in_words(LUGRE), SHARES]
    assert rest[: len(found)] == found
    assert rest[len(found) :] == [
        "What remains beside the named effects is 3.19 N on the training logs, 1.6 times the "
        "noise floor.",
        "The error depends most on other axis position, which accounts for 63 % of the squared "
        "error, with a period of 27.3 mm.",
        f"It is largest at {region_in_words(made.LEFT_OVER)}.",
        advice(),
        "candidates with their evidence (difference of BIC) and the selection error",
        "cogging 510.0 7.13 -> 2.17 N",
        "quadratic_drag 423.0 7.34 -> 2.38 N",
        "constant_force 66.0 7.46 -> 2.50 N gain uncertain: t = 1.3, where 1.6 is sure",
        "step 1: with cogging the selection error falls from 7.13 to 2.17 N",
        "step 2: with lugre the selection error falls from 7.57 to 2.61 N; no longer needed: wear",
        *(f"note: {r}" for r in remarks_on(result, "x")),
    ]
    y = diagnose_text(result).split("axis x: ", 1)[0]
    assert "axis y: Nothing is missing" in y
    assert "squared error" not in y


def test_a_finding_is_told_with_what_it_takes_and_what_could_not_be_real():
    assert finding_in_words(COGGING) == (
        "cogging explains 87 % of the squared error above the noise floor: without it the error "
        "on the selection logs is 7.17 N, with it 2.19 N",
        "On the logs that decided it removes 81 % of what is left above the noise floor",
        "The same force shifted in time, which cannot be real, removes at most 14 % (19 of 20 "
        "times)",
        "Found: p = 26.1 mm, a1 = 127 mN",
        f"{100.0 * COGGING.confidence:.0f} % of such answers were right in the self-test. What is "
        "left is 1.00 times the noise floor on the selection logs, 1.00 times on the training logs",
    )
    alone = replace(LUGRE, chosen=replace(LUGRE.chosen, on=Role.TRAINING), left=1.33)
    assert finding_in_words(alone)[-1].endswith(
        "What is left is 1.33 times the noise floor on the training logs, so something else is "
        "missing too"
    )


def test_a_finding_that_the_test_logs_contradict_is_not_confirmed():
    """Whatever the test logs say decides nothing; but the headline says it, with no confidence."""
    x = made.diagnosis_of(findings=(CONFIRMED_NOT, LUGRE))
    first, *others = finding_in_words(CONFIRMED_NOT)
    assert first == (
        "cogging is not confirmed by the test logs: without it the test error is 2.17 N, with it "
        "2.29 N"
    )
    assert "% of such answers" not in " ".join(others)
    assert "Not confirmed by the test logs: cogging." in told_of_x(x)[0]
    told = json_of(made.diagnosed(x))["axes"]["x"]["findings"]
    assert [f["contradicted_by_test_logs"] for f in told] == [True, False]
    assert [f["confidence"] is None for f in told] == [True, False]
    assert next_command(x) == []


def test_what_is_too_small_to_matter_has_one_line_and_no_headline():
    x = made.diagnosis_of(small=("wear", "quadratic_drag"))
    lines = told_of_x(x)
    assert lines.count("  also seen, too small to matter: wear, quadratic_drag") == 1
    assert "wear" not in lines[0]
    told = json_of(made.diagnosed(x))["axes"]["x"]
    assert told["also_seen"] == ["wear", "quadratic_drag"]
    assert "wear" not in told["missing"]
    assert not any("also seen" in line for line in told_of_x(made.diagnosis_of()))


def test_what_decided_nothing_is_told_apart_from_what_also_chose():
    """The error of test logs is a result; that of logs that chose says that they did."""
    finding = replace(COGGING, tested=made.errors(7.17, 2.19, Role.TEST)[0])
    dataset = replace(made.DATASET, test=made.DATASET.holdout)
    tested = made.diagnosis_of(on=Role.TEST, dataset=dataset, findings=(finding,))
    assert "without it the test error is 7.17 N" in diagnose_text(made.diagnosed(tested))
    for on, d in (("test", tested), ("selection", made.diagnosis_of())):
        what = "cogging" if on == "test" else "all that was found"
        errors = f"force error on the {on} logs 7.81 -> 2.39 N with {what}"
        assert named_errors_in_words(d) == errors
        told = remarks_on(made.diagnosed(d), "x")
        flatters = [r for r in told if "helped to choose" in r]
        assert [f"are of the {on} logs" in r for r in flatters] == [True] * (on != "test")
    assert json_of(made.diagnosed(tested))["axes"]["x"]["test_error_on"] == "test"


def test_nothing_is_said_of_held_out_logs_where_there_are_none():
    held = made.diagnosis_of(findings=(replace(COGGING, tied=()),))
    alone = replace(made.DATASET, holdout=())
    alone = made.diagnosis_of(findings=held.findings, on=Role.TRAINING, dataset=alone)
    assert verdict_in_words(held).endswith("the training logs and the selection logs prove it.")
    assert verdict_in_words(alone).endswith(
        "the training logs prove it, block by block; there is no selection log."
    )
    text = "\n".join(told_of_x(alone))
    assert "with cogging the cross-validated error falls from 7.13 to 2.17 N" in text
    assert "selection error" not in text


def test_shares_of_several_are_said_to_be_no_parts_of_a_whole():
    assert "the shares need not sum to 100 %" in SHARES
    assert f"  {SHARES}" in told_of_x(made.diagnosis_of())
    assert f"  {SHARES}" not in told_of_x(made.diagnosis_of(findings=made.FOUND[:1]))


def test_every_named_effect_is_in_the_headline():
    two = made.diagnosis_of(findings=(replace(COGGING, tied=()), LUGRE))
    line = told_of_x(two)[0]
    assert line == f"{verdict_in_words(two)} Missing: cogging and lugre."
    assert "several effects" in line
    assert next_command(two) == ["next: twin add cogging MODEL LOG... -o better.toml"]
    both = (replace(COGGING, tied=("lugre",)), replace(LUGRE, tied=("cogging",)))
    assert ties_in_words(replace(two, findings=both)) == [
        "these data cannot separate cogging from: lugre"
    ]


def test_a_step_that_makes_the_rest_noise_has_no_errors():
    (line,) = step_lines(made.diagnosis_of(steps=(step(built(NOISE)),)))
    assert line == f"step 1: {NOISE.name} explains the remaining error as noise"


def test_two_effects_that_need_each_other_are_told_as_such():
    """Neither is proved alone, so the answer says what both take, and how both are added."""
    pair = (
        replace(COGGING, tied=(), together=("lugre",)), replace(LUGRE, together=("cogging",))
    )  # fmt: skip
    x = made.diagnosis_of(findings=pair, ranking=(made.WEAK, replace(made.LATER, score=None)))
    assert [why_not(x, c) for c in x.ranking] == [
        "gain uncertain: t = 1.3, where 1.6 is sure", "proved only together with cogging",
    ]  # fmt: skip
    (said,) = together_in_words(x)
    taken = (7.81**2 - 2.39**2) / (7.81**2 - 2.11**2)
    assert said.startswith(
        "cogging and lugre are needed together, so the logs prove neither alone; together they "
        f"explain {100.0 * taken:.0f} % of"
    )
    assert "twin add lugre first.toml LOG... -o both.toml; judge after the second" in said
    assert f"  {said}" in told_of_x(x)
    told = json_of(made.diagnosed(x))["axes"]["x"]
    assert told["needed_together"] == [said]
    assert told["ranking"][1]["why_not"] == "proved only together with cogging"
    assert told["findings"][0]["together"] == ["lugre"]
    assert next_command(x) == together_in_words(made.diagnosis_of()) == []


def test_a_step_whose_effect_is_not_named_says_why():
    drag, lugre = step(made.RIVAL), step(made.LATER)

    def why(*steps):
        found = made.diagnosis_of(steps=steps)
        return [not_named_in_words(found, i) for i in range(len(steps))]

    assert why(step(made.BEST), lugre) == [None, None]
    assert why(drag, replace(lugre, dropped=("quadratic_drag",))) == [
        "no longer needed beside lugre", None,
    ]  # fmt: skip
    later = "no longer needed beside what was found after it"
    assert why(drag, lugre) == [later, None]
    left = made.diagnosis_of(steps=(drag, lugre), findings=(LUGRE,))
    assert step_lines(left)[0].endswith(f" N; not named: {later}")
    assert json_of(made.diagnosed(left))["axes"]["x"]["steps"][0]["not_named"] == later


def test_remarks_are_about_what_a_reader_must_know():
    result = made.diagnosed()
    moved = (made.MOVED, replace(made.MOVED, label="b"))
    told = {**result.told, "x": replace(result.told["x"], moved=moved)}
    found = remarks_on(replace(result, told=told), "x")
    assert found[0] == refit_in_words(made.refit_of(0.0))
    assert "217 µs" in found[1]
    assert found[2:4] == tuple(f"with cogging and lugre, {moved_in_words(m)}" for m in moved)
    x = made.diagnosis_of(
        base=built_fit(2.0, outcome=Outcome.NOT_CONVERGED), repeat=made.REPEAT,
        final=replace(made.FINAL, outcome=Outcome.AT_BOUND), findings=(COGGING,),
        dataset=replace(made.DATASET, channel_delay=0.0, holdout=()), on=Role.TRAINING,
    )  # fmt: skip
    found = remarks_on(replace(made.diagnosed(x), refits={}), "x")
    assert found[:3] == (
        OUTCOMES[Outcome.NOT_CONVERGED],
        f"with cogging: {OUTCOMES[Outcome.AT_BOUND]}",
        repeat_in_words(made.REPEAT),
    )
    assert "no selection log" in found[3]
    quiet = replace(made.diagnosed(), refits={"y": Refit(1.0, 1.0, ())})
    assert remarks_on(quiet, "y") == ()
    refused = replace(result, next_experiments={}, not_planned={"x": "no travel"})
    assert "no experiment that would tell them apart is proposed: no travel" in remarks_on(
        refused, "x"
    )


@pytest.mark.parametrize(("ratio", "said"), [(1.29, False), (3.0, True), (None, False)])
def test_nothing_missing_of_the_training_logs_alone_is_told_as_such(ratio, said):
    result = made.diagnosed()
    told = {**result.told, "y": replace(result.told["y"], selection_ratio=ratio)}
    notes = remarks_on(replace(result, told=told), "y")
    assert any("the force error is 3.0 times its noise floor" in n for n in notes) is said


def test_numbers_that_differ_look_different():
    """Where the error is above noise intervals are refused, so none is told of."""
    moved = moved_in_words(replace(made.MOVED, before=15.2004, after=15.2021))
    assert moved == ("mass moved from 15.200 to 15.202 kg: more than its uncertainty")
    assert "mass 15.200 -> 15.202 kg" in change_in_words(
        Change("mass", 15.2004, 15.2021, "kg", 0.572)
    )
    assert "from 15.2 to 15.2 kg" in moved_in_words(replace(made.MOVED, before=15.2, after=15.2))


def test_a_change_has_its_values_and_force_in_place():
    change = Change("mass", 15.1, 15.7, "kg", 0.572, ("payload_mass", "cogging"))
    assert change_in_words(change) == (
        "mass 15.1 -> 15.7 kg changes the force by 0.572 N (payload_mass and cogging give the same "
        "force)"
    )
    one = change_in_words(replace(change, alike=("payload_mass",)))
    assert one.endswith("(payload_mass gives the same force)")
    refit = Refit(0.913, 0.127, (change, replace(change, alike=())))
    assert refit_in_words(refit) == (
        "with the given values the force error is 0.913 N, after the fit 127 mN: "
        f"{change_in_words(change)}, mass 15.1 -> 15.7 kg changes the force by 0.572 N"
    )
    assert refit_in_words(Refit(0.913, 0.127, ())) is None
