"""Which steps are kept and taken back, and the verdict on them."""

from __future__ import annotations

import importlib
from dataclasses import replace

import numpy as np
import pytest
from built_fits import axis_of, built, built_fit, dataset_stub, fitted, stage, step
from identify.selection.decoys import Proof
from identify.selection.forward_selection import _eliminated_backwards
from identify.selection.verdict import _graded
from identify.selection.verdict import decided as decide

from identify.dataset.given_logs import Role
from identify.estimation.errors import Errors
from identify.selection.diagnosis import AxisDiagnosis, Verdict, kept
from identify.selection.residual_dependence import Dependence

module = importlib.import_module("identify.selection.verdict")
searched = importlib.import_module("identify.selection.forward_selection")
diagnoses = importlib.import_module("identify.selection.diagnosis")
# The rules as they were decided.
BEYOND_DOUBT, FLOOR_SURE, MOST_STEPS = 100.0, (0.85, 1.15), 5
DATASET = dataset_stub()
HIGH, LOW = built_fit(8.0), built_fit(1.1)  # over a floor of 1 N


def fit_with_part(part: float, base_error: float = 5.0, base_floor: float = 3.0):
    """A fit that leaves all but that part of what stood above the floor of (5, 3)."""
    floor = 0.7
    excess = base_error**2 - base_floor**2
    return built_fit(np.sqrt(floor**2 + (1.0 - part) * excess), floor)


# --- which steps stay -----------------------------------------------------------------------


def diagnosis(verdict: Verdict, *steps, ranking=()) -> AxisDiagnosis:
    return AxisDiagnosis(DATASET, HIGH, tuple(ranking), steps, LOW, verdict, None)


def test_a_name_that_comes_again_after_it_was_dropped_is_an_answer():
    """A second cogging took the place of the first, and another second one was added then."""
    steps = (
        step("cogging"),
        step("wear", dropped=("wear",)),
        step("wear"),
    )
    assert kept(steps) == [steps[0], steps[2]]


def test_what_a_later_step_made_needless_is_not_an_answer():
    steps = (
        step("cogging", ("wear",)),
        step("quadratic_drag", ("payload_mass", "constant_force")),
        step("lugre", dropped=("cogging",)),
    )
    assert [s.candidate.effect.name for s in kept(steps)] == ["quadratic_drag", "lugre"]
    found = diagnosis(Verdict.MISSING_EFFECTS, *steps)
    expected = (("quadratic_drag", "payload_mass", "constant_force"), ("lugre",))
    assert found.answers == expected
    assert found.named == ("quadratic_drag", "lugre")
    assert found.best is steps[1].candidate
    assert found.ambiguous_with == ("payload_mass", "constant_force")


@pytest.mark.parametrize("verdict", [Verdict.UNEXPLAINED, Verdict.NOTHING_MISSING])
def test_without_a_convincing_effect_none_is_named(verdict):
    found = diagnosis(verdict, step("cogging", ("wear",)))
    assert (found.named, found.best, found.ambiguous_with) == ((), None, ())


def test_a_force_that_repeats_is_only_sought_where_error_is_left(monkeypatch):
    seen = []
    monkeypatch.setattr(
        diagnoses, "not_general", lambda fit, dataset: seen.append((fit, dataset)) or 7
    )
    assert diagnosis(Verdict.UNEXPLAINED).repeat is None
    assert replace(diagnosis(Verdict.UNEXPLAINED), final=HIGH).repeat == 7
    assert seen == [(HIGH, DATASET)]


def looked_back(monkeypatch, needed):
    """_eliminated_backwards on a fit with two earlier effects; needed: verdicts as asked."""
    full = built_fit(1.0, axis=axis_of(fitted("cogging"), fitted("wear"), fitted("end_stop")))
    answers, scored = iter(needed), []

    def less(effect, fit, base, dataset):
        return built_fit(2.0, axis=fit.axis.without(effect.name))

    def score(smaller, larger, dataset, effect):
        scored.append((smaller.axis.names[1:], larger.axis.names[1:], effect.name))
        return built(effect, t=9.0 if next(answers) else 1.0)

    monkeypatch.setattr(searched, "less", less)
    monkeypatch.setattr(searched, "score", score)
    monkeypatch.setattr(searched, "fit_thoroughly", lambda axis, *_: built_fit(3.0, axis=axis))
    earlier = [built("cogging"), built("wear")]
    fit, dropped = _eliminated_backwards(HIGH, full, DATASET, earlier)
    return fit, dropped, scored, full


def test_an_earlier_effect_stays_where_the_fit_without_it_is_worse_twice(monkeypatch):
    fit, dropped, scored, full = looked_back(monkeypatch, [True, True, True, True])
    assert (fit, dropped) == (full, ())
    every = ("cogging", "wear", "end_stop")
    without = (("wear", "end_stop"), every, "cogging")
    assert scored == [without, without, *[(("cogging", "end_stop"), every, "wear")] * 2]


@pytest.mark.parametrize(("needed", "error"), [([False], 2.0), ([True, False], 3.0)])
def test_an_earlier_effect_goes_where_the_fit_without_it_is_as_good(monkeypatch, needed, error):
    fit, dropped, scored, _ = looked_back(monkeypatch, [*needed, True, True])
    assert dropped == ("cogging",)
    assert fit.error == pytest.approx(error)
    assert fit.axis.names[1:] == ("wear", "end_stop")
    assert scored[-1] == (("end_stop",), ("wear", "end_stop"), "wear")


# --- the verdict ----------------------------------------------------------------------------

STRUCTURE = Dependence(0.5, "position", None, "m", {"position": 0.5})


def decided(monkeypatch, stages, convinced, held=False, graded=None):
    """The verdict with convinced(number of steps before, after); what structure was sought in."""
    sought = []

    def structure(fit, dataset):
        sought.append(fit)
        return STRUCTURE

    monkeypatch.setattr(
        module, "_convincing", lambda a, b, dataset: convinced(len(a.steps), len(b.steps))
    )
    monkeypatch.setattr(module, "_compared_again", lambda stages, dataset: stages[-1].steps)
    monkeypatch.setattr(module, "find_dependence", structure)
    monkeypatch.setattr(module, "held_at_floor", lambda fit, dataset: held and dataset is DATASET)
    monkeypatch.setattr(module, "_graded", lambda states, sure, dataset: graded)
    found = decide(DATASET, (built("wear"),), stages)
    return found, sought


FIRST, SECOND = step("cogging"), step("wear", ("end_stop",))
STAGES = [stage(HIGH), stage(built_fit(5.0), FIRST), stage(built_fit(4.0), FIRST, SECOND)]


def test_stages_that_do_not_convince_are_taken_back_one_by_one(monkeypatch):
    found, sought = decided(monkeypatch, STAGES, lambda a, b: b == 1)
    assert found.verdict is Verdict.MISSING_EFFECTS
    assert (found.base, found.final, found.steps) == (HIGH, STAGES[1].fit, (FIRST,))
    assert found.unexplained is STRUCTURE
    assert sought == [STAGES[1].fit]


def test_the_whole_must_convince_against_the_base(monkeypatch):
    found, sought = decided(monkeypatch, STAGES, lambda a, b: (a, b) == (1, 2))
    assert found.verdict is Verdict.UNEXPLAINED
    assert (found.final, found.steps) == (STAGES[2].fit, (FIRST, SECOND))
    assert sought == [HIGH]


@pytest.mark.parametrize("first", [FIRST, SECOND])
def test_a_tie_of_the_first_effect_that_stays_is_told(monkeypatch, first):
    second = FIRST if first is SECOND else SECOND
    stages = [stage(HIGH), stage(LOW, first), stage(LOW, first, second)]
    found, sought = decided(monkeypatch, stages, lambda a, b: True)
    assert found.verdict is Verdict.MISSING_EFFECTS
    assert found.ambiguous_with == first.tied
    assert (found.unexplained, sought) == (None, [])


def test_structure_is_not_sought_where_the_held_out_logs_are_explained(monkeypatch):
    found, sought = decided(monkeypatch, STAGES, lambda a, b: True, held=True)
    assert (found.unexplained, sought) == (None, [])


def test_what_is_proved_is_named_although_other_error_remains(monkeypatch):
    steps = (replace(FIRST, proved=False), SECOND)
    fit = built_fit(4.4)
    found, sought = decided(monkeypatch, STAGES, lambda a, b: False, graded=(steps, fit))
    assert (found.verdict, found.named) == (Verdict.MISSING_EFFECTS, ("wear",))
    assert found.best is SECOND.candidate
    assert (found.final, found.unexplained, sought) == (fit, STRUCTURE, [fit])


@pytest.mark.parametrize(
    ("holds", "sure", "named"),
    [
        ({"cogging"}, (), ["cogging"]),
        ({"cogging", "wear"}, (), ["cogging", "wear"]),
        ({"wear"}, ("cogging",), ["cogging", "wear"]),
        (set(), ("cogging",), None),
        (set(), (), None),
        ({"cogging", "wear"}, ("quadratic_drag",), None),  # a later step made it needless
    ],
)
def test_a_step_is_named_that_is_sure_or_beats_its_decoys(monkeypatch, holds, sure, named):
    final = built_fit(4.0, axis=axis_of(fitted("cogging"), fitted("wear")))
    states = [stage(HIGH), stage(built_fit(5.0), FIRST), stage(final, FIRST, SECOND)]
    asked = []

    def proof(without, fitted, dataset, gain):
        assert gain is None  # no held-out logs
        asked.append((without.axis.names, fitted.effect.name))
        holding = fitted.effect.name in holds
        return Proof(0.5, 0.1 if holding else 0.45)

    monkeypatch.setattr(
        module,
        "less",
        lambda effect, fit, base, d: built_fit(9.0, axis=fit.axis.without(effect.name)),
    )
    monkeypatch.setattr(module, "proof", proof)
    found = _graded(states, sure, dataset_stub())
    assert all(name not in names for names, name in asked)
    assert not set(sure) & {name for _, name in asked}
    if named is None:
        assert found is None
        return
    steps, fit = found
    assert [s.candidate.effect.name for s in steps if s.proved] == named
    assert set(named) <= set(fit.axis.names)
    assert ("wear" in fit.axis.names) is ("wear" in named)


@pytest.mark.parametrize(
    ("error", "evidence", "named"), [(1.29, 99.0, False), (1.29, 101.0, True), (1.31, 99.0, True)]
)
def test_beating_decoys_is_not_enough_where_noise_is_all_that_is_left(
    monkeypatch, error, evidence, named
):
    final = built_fit(1.0, axis=axis_of(fitted("wear")))
    without = built_fit(error)
    monkeypatch.setattr(module, "less", lambda *_: without)
    monkeypatch.setattr(module, "proof", lambda *_: Proof(0.5, 0.1))
    monkeypatch.setattr(module.Errors, "of", lambda *_: Errors(4.0, 3.0, Role.SELECTION))

    def score(fit, larger, dataset, effect):
        assert (fit, larger, effect.name) == (without, final, "wear")
        return built("wear", bic=evidence)

    monkeypatch.setattr(module, "score", score)
    states = [stage(HIGH), stage(final, step("wear"))]
    assert (_graded(states, (), dataset_stub()) is not None) is named


@pytest.mark.parametrize(("after", "named"), [(3.5, True), (3.6, False)])
def test_without_decoys_an_effect_is_proved_by_a_fifth_less_of_the_squared_error(
    monkeypatch, after, named
):
    """And one that is not goes with what it replaced: a friction never goes alone."""
    final = built_fit(4.0, axis=axis_of(fitted("wear")).with_effect(fitted("lugre")))
    states = [stage(HIGH), stage(final, step("lugre"), step("wear"))]
    asked = []

    def less(effect, fit, base, dataset):
        asked.append((effect.name, fit.error, base is HIGH))
        return built_fit(4.5, axis=fit.axis)

    errors = Errors(4.0, after, Role.SELECTION)
    monkeypatch.setattr(module, "less", less)
    monkeypatch.setattr(module, "proof", lambda without, fitted, dataset, gain: None)
    monkeypatch.setattr(module.Errors, "of", lambda *_: errors)
    found = _graded(states, (), dataset_stub())
    assert (found is not None) is named
    assert {name for name, _, beside in asked if beside} == {"lugre", "wear"}


@pytest.mark.parametrize(
    ("stages", "verdict"),
    [
        ([stage(LOW)], Verdict.NOTHING_MISSING),
        ([stage(HIGH)], Verdict.UNEXPLAINED),
        ([stage(LOW), stage(LOW, FIRST)], Verdict.UNEXPLAINED),
    ],
)
def test_nothing_is_missing_only_at_the_floor_with_nothing_added(monkeypatch, stages, verdict):
    found, _ = decided(monkeypatch, stages, lambda a, b: False)
    assert found.verdict is verdict
    assert (found.unexplained is None) is (verdict is Verdict.NOTHING_MISSING)
    assert found.ranking[0].effect.name == "wear"
