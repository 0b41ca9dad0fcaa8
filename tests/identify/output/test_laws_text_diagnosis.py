"""The text of a diagnosis: each line holds the numbers that it names, in their order."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import built_results as made
import pytest
from built_fits import NOISE, built, built_fit, dataset_stub
from identify.selection.decoys import Proof

from identify.dataset.given_logs import Role
from identify.estimation.fit import Outcome
from identify.output import remarks as remarks_module
from identify.output.diagnosis_json import diagnose_json
from identify.output.remarks import remarks
from identify.output.text import (
    diagnose_text,
    plan_text,
)
from identify.output.words.estimation import outcome_in_words
from identify.output.words.findings import advice, finding_in_words, shares_in_words
from identify.output.words.selection import (
    SEVERAL,
    change_in_words,
    moved_in_words,
    named_errors_in_words,
    refit_in_words,
    repeat_in_words,
    ties_in_words,
    verdict_in_words,
)
from identify.output.words.steps import (
    not_named_in_words,
    step_lines,
    support_in_words,
    together_in_words,
)
from identify.output.words.validation import region_in_words
from identify.selection.confidence import LEVELS
from identify.selection.confounded import Change, Refit
from identify.selection.diagnosis import Step, Verdict
from identify.selection.findings import FindingKind

pytestmark = pytest.mark.usefixtures("nothing_moved")


def test_a_diagnosis():
    x = made.diagnosis_of(Verdict.MISSING_EFFECTS, unexplained=made.STRUCTURE, findings=made.FOUND)
    x.__dict__["repeat"] = made.REPEAT
    result = made.diagnosed(x)
    text = diagnose_text(result)
    y, lines = text.split("axis x: ", 1)
    lines = lines.splitlines()
    assert lines[0] == f"{SEVERAL} Missing: cogging or quadratic_drag, and lugre."
    assert lines[1] == "  force error 8.37 N, noise floor 2.11 N (ratio 3.97)"
    tested = x.tested
    assert lines.pop(2) == (
        f"  force error on the selection logs {tested.before:.3g} N, with what is named "
        f"{tested.after:.3g} N"
    )
    assert lines[2] == "  these data cannot separate cogging from: quadratic_drag"
    planned = [f"  {line}" for line in plan_text(result.next_experiments["x"]).splitlines()]
    assert lines[3 : 3 + len(planned)] == planned
    rest = [" ".join(line.split()) for line in lines[3 + len(planned) :]]
    sure = [
        f"confidence {100.0 * f.confidence:.0f} %: {f.left:.3g} times the noise floor is left on "
        f"the selection logs, {f.left_fitted:.3g} times on the training logs"
        for f in made.FOUND
    ]
    assert rest[:4] == [
        "cogging explains 87 % of the squared error above the noise floor: without it the error "
        "on the selection logs is 7.17 N, with it 2.19 N; tried beside decoys (its force shifted "
        "in time) it takes 81 % of the squared error left without it, 1 in 20 of them 14 % or "
        f"more; {sure[0]}",
        "lugre explains 12 % of the squared error above the noise floor: without it the error on "
        f"the selection logs is 3.23 N, with it 2.19 N; {sure[1]}",
        *shares_in_words(x),
        "what remains beside the named effects is 3.19 N on the fit logs, 1.6 times the noise "
        "floor",
    ]
    rest = rest[4:]
    assert rest[:3] == [
        "The error depends most on other axis position, which accounts for 63 % of the squared "
        "error, with a period of 0.0273 m.",
        f"it is largest at {region_in_words(made.LEFT_OVER)}",
        advice(),
    ]  # fmt: skip
    rest = rest[1:]
    assert rest[2:5] == [
        "cogging evidence 510.0 held-out error 7.13 -> 2.17 N",
        "quadratic_drag evidence 423.0 held-out error 7.34 -> 2.38 N",
        "constant_force evidence 66.0 held-out error 7.46 -> 2.5 N not supported",
    ]
    assert rest[5:7] == [
        "step 1: with cogging the held-out error falls from 7.13 to 2.17 N",
        "step 2: with lugre beside cogging the held-out error falls from 7.57 to 2.61 N; no "
        "longer needed: wear",
    ]
    assert rest[7:] == [f"note: {r}" for r in remarks(x, result.refits["x"])]
    assert "axis y: Nothing is missing" in y
    refused = diagnose_text(replace(result, next_experiments={}, not_planned={"x": "no travel"}))
    assert "\n  note: no experiment that would tell them apart is proposed: no travel" in refused
    assert "cannot be told" not in y
    assert "squared error" not in y


def test_what_decided_nothing_is_told_apart_from_what_also_chose():
    """The error of test logs is a result; that of logs that chose says that they did."""
    dataset = replace(made.DATASET, test=made.DATASET.holdout)
    finding = replace(made.FOUND[0], tested=made.errors(7.17, 2.19, Role.TEST)[0])
    tested = made.diagnosis_of(dataset=dataset, findings=(finding,))
    assert "without it the test error is 7.17 N" in diagnose_text(made.diagnosed(tested))
    told = made.diagnosis_of(findings=made.FOUND)
    for on, d in (("test", tested), ("selection", told)):
        errors = f"force error on the {on} logs {d.tested.before:.3g} N, with what is named"
        assert named_errors_in_words(d).startswith(errors)
        flatters = [r for r in remarks(d, None) if "which took part in the choice" in r]
        assert [f"are of the {on} logs" in r for r in flatters] == [True] * (on != "test")
    assert diagnose_json(made.diagnosed(tested))["axes"]["x"]["test_error_on"] == "test"


def test_nothing_is_said_of_held_out_logs_where_there_are_none():
    steps = (Step(made.BEST, ()),)
    held = made.diagnosis_of(steps=steps)
    alone = replace(held, dataset=replace(made.DATASET, holdout=()))
    assert verdict_in_words(held).endswith("the fit logs and the held-out logs prove it.")
    assert verdict_in_words(alone).endswith(
        "the fit logs prove it, block by block; no log was held out."
    )
    text = diagnose_text(made.diagnosed(alone)).split("axis x: ", 1)[1]
    assert "with cogging the cross-validated error falls from 7.13 to 2.17 N" in text
    assert "held-out" not in text


def test_a_decoy_is_explained_where_it_is_told():
    short = replace(made.FOUND[0], proof=Proof(0.94, 0.05, typical=True))
    assert (
        "; tried beside decoys (its force shifted in time) it takes 94 % of the squared error left "
        "without it in a typical stretch of the log, 1 in 20 of them 5 % or more; "
    ) in finding_in_words(short)
    assert "decoy" not in finding_in_words(made.FOUND[1])


@pytest.mark.parametrize(
    ("left", "fitted", "level"), [(1.28, 2.5, 0), (2.5, 1.28, 0), (1.33, 2.5, 1), (2.5, 1.33, 1)]
)
def test_a_confidence_tells_what_it_is_read_from(left, fitted, level):
    """Not from the test error, which may be at its noise floor beside the lower level."""
    told = finding_in_words(replace(made.FOUND[1], left=left, left_fitted=fitted))
    assert told.endswith(
        f"; confidence {100 * LEVELS[level].right:.0f} %: {left} times the noise floor is left on "
        f"the selection logs, {fitted} times on the training logs"
    )
    on_fit = replace(made.FOUND[1].chosen, on=Role.TRAINING)
    alone = finding_in_words(replace(made.FOUND[1], chosen=on_fit, left=1.33, left_fitted=1.33))
    assert alone.endswith(" %: 1.33 times the noise floor is left on the training logs")


def test_shares_of_several_are_said_to_be_no_parts_of_a_whole():
    (said,) = shares_in_words(made.diagnosis_of(findings=made.FOUND))
    assert "the shares need not sum to 100 %" in said
    assert shares_in_words(made.diagnosis_of(findings=made.FOUND[:1])) == []


def test_every_named_effect_is_in_the_headline():
    two = made.diagnosis_of(steps=(Step(made.BEST, ()), Step(made.LATER, ())))
    line = diagnose_text(made.diagnosed(two)).split("axis x: ", 1)[1].splitlines()[0]
    assert line == f"{verdict_in_words(two)} Missing: cogging and lugre."
    assert "several effects" in line
    both = (replace(made.FOUND[0], tied=("lugre",)), replace(made.FOUND[1], tied=("cogging",)))
    assert ties_in_words(replace(two, findings=both)) == [
        "these data cannot separate cogging from: lugre"
    ]


def test_a_step_that_makes_the_rest_noise_has_no_errors():
    (line,) = step_lines(made.diagnosis_of(steps=(Step(built(NOISE), ()),)))
    assert line == f"step 1: {NOISE.name} explains the remaining error as noise"


def test_two_effects_that_need_each_other_are_told_as_such(monkeypatch):
    """Neither is supported alone, so the answer says how both are added."""
    drag = replace(made.RIVAL, evidence=replace(made.RIVAL.evidence, log_gain=0.0))
    steps = (Step(made.BEST, (), beside="quadratic_drag"), Step(drag, (), beside="cogging"))
    x = made.diagnosis_of(steps=steps, ranking=(made.BEST, drag, made.WEAK))
    assert [support_in_words(x, c) for c in x.ranking] == [
        "supported", "only together with cogging", "not supported",
    ]  # fmt: skip
    (said,) = together_in_words(x)
    assert said.startswith("cogging and quadratic_drag are needed together")
    assert "twin add quadratic_drag first.toml LOG... -o both.toml; judge after the second" in said
    assert "neither alone" in said
    text = diagnose_text(made.diagnosed(x)).split("axis x: ", 1)[1]
    assert f"\n  {said}\n" in text
    assert "N   only together with cogging\n" in text
    assert diagnose_json(made.diagnosed(x))["axes"]["x"]["needed_together"] == [said]
    assert together_in_words(made.diagnosis_of()) == []


def test_a_step_whose_effect_is_not_named_says_why():
    cogging, lugre = Step(made.BEST, ()), Step(made.LATER, ())
    drag = replace(made.RIVAL, fit=made.LATER.fit)

    def why(*steps, **changes):
        return [not_named_in_words(made.diagnosis_of(steps=steps, **changes), i) for i in (0, 1)]

    assert why(cogging, lugre) == [None, None]
    unproved = "not proved beside the others, or less than 1 % of the squared error"
    assert why(cogging, replace(lugre, proved=False)) == [None, unproved]
    assert why(cogging, lugre, verdict=Verdict.UNEXPLAINED) == [unproved, unproved]
    assert why(Step(drag, ()), replace(lugre, dropped=("quadratic_drag",))) == [
        "no longer needed beside lugre", None,
    ]  # fmt: skip
    shape = replace(made.FOUND[1], kind=FindingKind.WRONG_SHAPE)
    named = (made.FOUND[0], shape)
    assert why(cogging, replace(lugre, proved=False), findings=named)[1].startswith("it is part")
    assert why(cogging, Step(drag, ()), findings=named) == [
        None, "a free curve of lugre takes its place",
    ]  # fmt: skip
    left = made.diagnosis_of(steps=(cogging, replace(lugre, proved=False)))
    assert step_lines(left)[1].endswith(f" N; not named: {unproved}")
    assert diagnose_json(made.diagnosed(left))["axes"]["x"]["steps"][1]["not_named"] == unproved


def test_remarks_are_about_what_a_reader_must_know(monkeypatch):
    moved = (made.MOVED, replace(made.MOVED, label="b"))
    asked = []
    monkeypatch.setattr(
        remarks_module, "moved_parameters", lambda *fits: asked.append(fits) or moved
    )
    x = made.diagnosis_of()
    found = remarks(x, made.refit_of(0.0))
    assert asked == [(x.base, made.BEST.fit)]
    assert found[0] == refit_in_words(made.refit_of(0.0))
    assert "217 us" in found[1]
    assert found[2:] == tuple(f"with cogging, {moved_in_words(m)}" for m in moved)
    bad = built_fit(2.0, outcome=Outcome.NOT_CONVERGED)
    best = replace(made.BEST, fit=replace(made.BEST.fit, outcome=Outcome.AT_BOUND))
    steps = (Step(best, ()),)
    loose = replace(
        x, base=bad, steps=steps, dataset=replace(made.DATASET, channel_delay=0.0, holdout=())
    )
    loose.__dict__["repeat"] = made.REPEAT
    found = remarks(loose, None)
    assert found[:2] == (
        outcome_in_words(Outcome.NOT_CONVERGED),
        f"with cogging: {outcome_in_words(Outcome.AT_BOUND)}",
    )
    assert found[-2] == repeat_in_words(made.REPEAT)
    assert "no log was held out" in found[-1]
    quiet = made.diagnosed().axes["y"]
    assert remarks(quiet, None) == ()
    assert remarks(quiet, Refit(1.0, 1.0, ())) == ()


def test_numbers_that_differ_look_different():
    """Where the error is above noise intervals are refused, so none is told of."""
    moved = moved_in_words(replace(made.MOVED, before=15.2004, after=15.2021))
    assert moved == (
        "mass moved from 15.200 to 15.202 kg: more than it scatters between blocks of the logs"
    )
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
        "with the given values the force error is 0.913 N, after the fit 0.127 N: "
        f"{change_in_words(change)}, mass 15.1 -> 15.7 kg changes the force by 0.572 N"
    )
    assert refit_in_words(Refit(0.913, 0.127, ())) is None


@pytest.mark.parametrize(("held", "explained"), [(("log",), False), (("log",), True), ((), False)])
def test_nothing_missing_of_the_training_logs_alone_is_told_as_such(monkeypatch, held, explained):
    found = SimpleNamespace(
        dataset=dataset_stub(holdout=held), base=built_fit(1.0), chosen=SimpleNamespace(before=6.0)
    )
    monkeypatch.setattr(remarks_module, "held_at_floor", lambda fit, dataset: explained)
    monkeypatch.setattr(remarks_module, "floor_of", lambda axis, logs: 2.0)
    told = remarks_module._beyond_in_words(found)
    if not held or explained:
        assert told is None
    else:
        assert "the force error is 3.0 times its noise floor" in told
