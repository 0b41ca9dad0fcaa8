"""Each rule of the verdict on both sides of its threshold, on fits and candidates as given."""

from __future__ import annotations

import importlib
from dataclasses import replace

import numpy as np
import pytest
from built_fits import NOISE, PLAIN, axis_of, built, built_fit, fitted, stage, step, study_stub

from identify.diagnose import (
    AxisDiagnosis,
    Stage,
    Verdict,
    _asked_for,
    _compared_again,
    _convincing,
    _decided,
    _friction_instead,
    _gone,
    _kept,
    _looked_back,
    _near,
    _next,
    _part,
    diagnose_axis,
)
from identify.lookahead import Pair
from identify.structure import Structure
from twin.effects import Catalogue

module = importlib.import_module("identify.diagnose")
# The rules as they were decided.
BEYOND_DOUBT, FLOOR_SURE, MOST_STEPS = 100.0, (0.85, 1.15), 5
STUDY = study_stub()
HIGH, LOW = built_fit(8.0), built_fit(1.1)  # over a floor of 1 N


def fit_with_part(part: float, base_error: float = 5.0, base_floor: float = 3.0):
    """A fit that leaves all but that part of what stood above the floor of (5, 3)."""
    floor = 0.7
    excess = base_error**2 - base_floor**2
    return built_fit(np.sqrt(floor**2 + (1.0 - part) * excess), floor)


# --- evidence -------------------------------------------------------------------------------


@pytest.mark.parametrize("part", [-0.5, 0.0, 0.3, 0.95, 1.0])
def test_the_part_explained_is_counted_above_the_floor_of_each_fit(part):
    assert _part(built_fit(5.0, 3.0), fit_with_part(part)) == pytest.approx(part, abs=1e-12)


def test_no_part_is_explained_of_an_error_within_its_floor():
    assert _part(built_fit(2.0, 2.0), built_fit(0.5, 0.4)) == 0.0
    assert _part(built_fit(1.0, 2.0), built_fit(0.5, 0.4)) == 0.0


@pytest.mark.parametrize(
    ("bic", "t", "base", "asked"),
    [
        (40.0, 9.0, HIGH, True),
        (40.0, 2.0, HIGH, False),
        (40.0, 9.0, LOW, False),
        (BEYOND_DOUBT, 9.0, LOW, False),
        (BEYOND_DOUBT + 0.1, 9.0, LOW, True),
        (BEYOND_DOUBT + 0.1, 2.0, LOW, False),
    ],
)
def test_at_the_floor_only_much_evidence_asks_for_an_effect(bic, t, base, asked):
    assert _asked_for(built(bic=bic, t=t), base) is asked


def test_a_rival_gains_more_than_four_fifths_of_the_best():
    best = built(gain=5.0)
    assert _near(best, built(gain=4.01))
    assert not _near(best, built(gain=4.0))
    assert not _near(best, built(gain=3.9))
    assert not _near(best, built(NOISE, gain=4.5))
    assert _near(built(gain=1.0), built(gain=5.0))  # the larger is always near


# --- what stands in for a friction ----------------------------------------------------------


def test_a_friction_that_explains_nearly_all_is_named_where_the_best_took_the_dry_friction():
    weak = PLAIN.with_effect(replace(PLAIN.effects[0], values={"Fc": 0.01, "Fs": 0.3, "sigma2": 1}))
    base = built_fit(5.0, 3.0)
    best = built("cable_hysteresis", fit=built_fit(1.0, axis=weak))
    ranking = [
        best,
        built("cogging", fit=fit_with_part(0.99)),
        built("dahl", fit=fit_with_part(0.99), t=1.0),
        built("gms", fit=fit_with_part(0.94)),
        built("lugre", fit=fit_with_part(0.96)),
        built("leuven", fit=fit_with_part(0.98)),
    ]
    assert _friction_instead(base, best, ranking) == ("lugre",)
    assert _friction_instead(base, best, ranking[:4]) == ()
    kept = built("cable_hysteresis", fit=built_fit(1.0, axis=PLAIN))
    assert _friction_instead(base, kept, ranking) == ()


# --- what a step convinces of ---------------------------------------------------------------


def told(monkeypatch, *, held=False, explains=False):
    """The two rules that read logs, as given; the pairs of fits they were asked about."""
    asked = []

    def explained(before, after, study):
        asked.append((before, after))
        return explains

    monkeypatch.setattr(module, "held_at_floor", lambda fit, study: held)
    monkeypatch.setattr(module, "explains", explained)
    return asked


BASE = built_fit(5.0, 3.0)
ONE = step("cogging", bic=50.1)


NEAR_FLOOR = built_fit(2.5)  # from which the floor is less than nearly all


@pytest.mark.parametrize(
    ("base", "after", "held", "explains", "convinced"),
    [
        (NEAR_FLOOR, built_fit(1.29), False, False, True),
        (NEAR_FLOOR, built_fit(1.31), False, False, False),
        (NEAR_FLOOR, built_fit(2.4), True, False, True),
        (BASE, fit_with_part(0.951), False, False, True),
        (BASE, fit_with_part(0.949), False, False, False),
        (BASE, fit_with_part(0.41), False, True, True),
        (BASE, fit_with_part(0.39), False, True, False),
        (BASE, fit_with_part(0.41), False, False, False),
    ],
)
def test_the_floor_or_nearly_all_or_the_foremost_convinces(
    monkeypatch, base, after, held, explains, convinced
):
    told(monkeypatch, held=held, explains=explains)
    assert _convincing(stage(base), stage(after, ONE), STUDY) is convinced


def test_only_the_first_effect_that_was_added_must_be_proven(monkeypatch):
    asked = told(monkeypatch, explains=True)
    after = fit_with_part(0.6)
    weak, strong = step("cogging", bic=50.0), step("wear", bic=50.1)
    assert _gone(BASE, after, [strong, weak], STUDY)
    assert asked == [(BASE, after)]
    assert not _gone(BASE, after, [weak, strong], STUDY)
    earlier = stage(BASE, weak)
    assert _convincing(earlier, stage(after, weak, strong), STUDY)
    assert not _convincing(stage(BASE), stage(after, weak, strong), STUDY)


# --- which steps stay -----------------------------------------------------------------------


def diagnosis(verdict: Verdict, *steps, ranking=()) -> AxisDiagnosis:
    return AxisDiagnosis(STUDY, HIGH, tuple(ranking), steps, LOW, verdict, None)


def test_what_a_later_step_made_needless_is_not_an_answer():
    steps = (
        step("cogging", ("wear",)),
        step("quadratic_drag", ("payload_mass", "constant_force")),
        step("lugre", dropped=("cogging",)),
    )
    assert [s.candidate.effect.name for s in _kept(steps)] == ["quadratic_drag", "lugre"]
    for verdict in (Verdict.MISSING_EFFECT, Verdict.AMBIGUOUS):
        found = diagnosis(verdict, *steps)
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
    monkeypatch.setattr(module, "not_general", lambda fit, study: seen.append((fit, study)) or 7)
    assert diagnosis(Verdict.UNEXPLAINED).repeat is None
    assert replace(diagnosis(Verdict.UNEXPLAINED), final=HIGH).repeat == 7
    assert seen == [(HIGH, STUDY)]


def looked_back(monkeypatch, needed):
    """_looked_back on a fit with two earlier effects; needed: verdicts in the order asked."""
    full = built_fit(1.0, axis=axis_of(fitted("cogging"), fitted("wear"), fitted("end_stop")))
    answers, scored = iter(needed), []

    def less(effect, fit, base, study):
        return built_fit(2.0, axis=fit.axis.without(effect.name))

    def score(smaller, larger, study, effect):
        scored.append((smaller.axis.names[1:], larger.axis.names[1:], effect.name))
        return built(effect, t=9.0 if next(answers) else 1.0)

    monkeypatch.setattr(module, "less", less)
    monkeypatch.setattr(module, "score", score)
    monkeypatch.setattr(module, "fit_thoroughly", lambda axis, study: built_fit(3.0, axis=axis))
    earlier = [built("cogging"), built("wear")]
    fit, dropped = _looked_back(HIGH, full, STUDY, earlier)
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


# --- ties told again beside all that was added ----------------------------------------------


def test_ties_are_told_again_only_beside_several_effects(monkeypatch):
    fits, ties = [], []
    final = built_fit(1.0, axis=axis_of(fitted("cogging"), fitted("wear"), fitted("end_stop")))

    def refitted(axis, logs):
        fits.append(axis.names[1:])
        return built_fit(1.0, axis=axis)

    def score(base, fit, study, effect):
        assert base is HIGH
        return built(effect, fit=fit)

    def tie(study, own, rival):
        ties.append((own.effect.name, own.fit is final, rival.effect.name))
        return rival.effect.name == "constant_force"

    monkeypatch.setattr(module, "fit_axis", refitted)
    monkeypatch.setattr(module, "score", score)
    monkeypatch.setattr(module, "tie", tie)
    rivals = (built("constant_force"), built("wear"), built("quadratic_drag"))
    steps = (
        step("cogging", ("quadratic_drag",), rivals=rivals),
        step("wear", ("payload_mass",)),
        step("end_stop", ("payload_mass",), beside="wear"),
        step("lugre", ("dahl",)),
        step("gms", (), dropped=("lugre",)),
    )
    again = _compared_again([stage(HIGH), stage(final, *steps)], STUDY)
    assert [s.tied for s in again] == [("constant_force",), (), ("payload_mass",), ("dahl",), ()]
    assert ties == [("cogging", True, "constant_force"), ("cogging", True, "quadratic_drag")]
    assert fits == [("wear", "end_stop", r) for r in ("constant_force", "quadratic_drag")]
    alone = (steps[0],)
    assert _compared_again([stage(HIGH), stage(final, *alone)], STUDY) == alone


# --- the verdict ----------------------------------------------------------------------------

STRUCTURE = Structure(0.5, "position", None, "m", {"position": 0.5})


def decided(monkeypatch, stages, convinced, held=False):
    """_decided with convinced(number of steps before, after); what structure was sought in."""
    sought = []

    def structure(fit, study):
        sought.append(fit)
        return STRUCTURE

    monkeypatch.setattr(
        module, "_convincing", lambda a, b, study: convinced(len(a.steps), len(b.steps))
    )
    monkeypatch.setattr(module, "_compared_again", lambda stages, study: stages[-1].steps)
    monkeypatch.setattr(module, "find_structure", structure)
    monkeypatch.setattr(module, "held_at_floor", lambda fit, study: held)
    found = _decided(STUDY, (built("wear"),), stages)
    return found, sought


FIRST, SECOND = step("cogging"), step("wear", ("end_stop",))
STAGES = [stage(HIGH), stage(built_fit(5.0), FIRST), stage(built_fit(4.0), FIRST, SECOND)]


def test_stages_that_do_not_convince_are_taken_back_one_by_one(monkeypatch):
    found, sought = decided(monkeypatch, STAGES, lambda a, b: b == 1)
    assert found.verdict is Verdict.MISSING_EFFECT
    assert (found.base, found.final, found.steps) == (HIGH, STAGES[1].fit, (FIRST,))
    assert found.unexplained is STRUCTURE
    assert sought == [STAGES[1].fit]


def test_the_whole_must_convince_against_the_base(monkeypatch):
    found, sought = decided(monkeypatch, STAGES, lambda a, b: (a, b) == (1, 2))
    assert found.verdict is Verdict.UNEXPLAINED
    assert (found.final, found.steps) == (STAGES[2].fit, (FIRST, SECOND))
    assert sought == [HIGH]


@pytest.mark.parametrize(
    ("first", "verdict"), [(FIRST, Verdict.MISSING_EFFECT), (SECOND, Verdict.AMBIGUOUS)]
)
def test_a_tie_of_the_first_effect_that_stays_is_an_ambiguity(monkeypatch, first, verdict):
    second = FIRST if first is SECOND else SECOND
    stages = [stage(HIGH), stage(LOW, first), stage(LOW, first, second)]
    found, sought = decided(monkeypatch, stages, lambda a, b: True)
    assert found.verdict is verdict
    assert (found.unexplained, sought) == (None, [])


def test_structure_is_not_sought_where_the_held_out_logs_are_explained(monkeypatch):
    found, sought = decided(monkeypatch, STAGES, lambda a, b: True, held=True)
    assert (found.unexplained, sought) == (None, [])


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


# --- what is added next ---------------------------------------------------------------------


def test_the_best_is_added_with_the_supported_rivals_that_tie(monkeypatch):
    monkeypatch.setattr(module, "tie", lambda s, best, c: c.effect.name in ("wear", "lugre"))
    ranking = [
        built("cogging", gain=5.0), built("wear", gain=4.5), built("end_stop", gain=4.5),
        built("lugre", gain=4.5, t=1.0), built("dahl", gain=3.0),
    ]  # fmt: skip
    (found,) = _next(HIGH, STUDY, ranking, None)
    assert found.candidate is ranking[0]
    assert found.tied == ("wear",)
    assert [r.effect.name for r in found.rivals] == ["wear", "end_stop"]


@pytest.mark.parametrize(("base", "held"), [(LOW, False), (HIGH, True)])
def test_no_pair_is_sought_at_the_floor(monkeypatch, base, held):
    monkeypatch.setattr(module, "held_at_floor", lambda fit, study: held)
    monkeypatch.setattr(module, "look_ahead", lambda *_: pytest.fail("sought"))
    assert _next(base, STUDY, [built(t=1.0)], None) == []
    assert _next(base, STUDY, [], None) == []


def test_a_pair_is_added_with_the_others_that_tie_with_it(monkeypatch):
    def pair(first, second, bic):
        return Pair(built(first), built(second), built(second, bic=bic))

    pairs = [pair("wear", "cogging", 90.0), pair("wear", "dahl", 80.0), pair("gms", "lugre", 70.0)]
    monkeypatch.setattr(module, "held_at_floor", lambda fit, study: False)
    monkeypatch.setattr(module, "look_ahead", lambda *_: pairs)
    monkeypatch.setattr(
        module, "tie", lambda s, a, b: a is pairs[0].together and b is pairs[1].together
    )
    first, second = _next(HIGH, STUDY, [built(t=1.0)], None)
    assert (first.candidate, first.tied, first.beside) == (pairs[0].first, ("dahl",), "cogging")
    assert (second.candidate, second.tied, second.beside) == (pairs[0].second, (), "wear")
    monkeypatch.setattr(module, "look_ahead", lambda *_: [])
    assert _next(HIGH, STUDY, [], None) == []


# --- the loop -------------------------------------------------------------------------------


def looped(monkeypatch, errors, *, moved=(), shifts=2):
    """diagnose_axis where each addition leads to the next error; the stages it decided on."""
    names = ["cogging", "wear", "end_stop", "lugre", "dahl", "gms", "leuven"]
    fits, seen, calls = [built_fit(e) for e in errors], {}, []
    moves = iter(moved)

    def following(base, study, found, ranked):
        done = len(calls)
        calls.append(base.error)
        return [step(names[done])] if done < len(fits) else []

    def back(base, fit, study, earlier):
        return fits[len(calls) - 1], tuple(c.effect.name for c in earlier)[:1]

    def decide(study, ranking, stages):
        seen.update(study=study, ranking=ranking, stages=stages)
        return seen

    monkeypatch.setattr(module, "rank", lambda base, study, **_: (base, (built("wear"),)))
    monkeypatch.setattr(module, "_next", following)
    monkeypatch.setattr(module, "_looked_back", back)
    monkeypatch.setattr(module, "_decided", decide)
    monkeypatch.setattr(module, "moved_by", lambda fit, study: next(moves, None))
    monkeypatch.setattr(module, "fit_axis", lambda axis, logs: built_fit(6.0, axis=axis))
    monkeypatch.setattr(module, "synchronised", lambda fit, study: (study, fit))
    diagnose_axis(HIGH, STUDY, Catalogue([]), shifts=shifts)
    return seen, calls


def test_effects_are_added_until_none_is_asked_for_or_there_are_enough(monkeypatch):
    seen, calls = looped(monkeypatch, [7.0, 6.0])
    assert [s.fit.error for s in seen["stages"]] == [8.0, 7.0, 6.0]
    assert calls == [8.0, 7.0, 6.0]
    assert seen["stages"][-1].steps[1].dropped == ("cogging",)
    seen, _ = looped(monkeypatch, [7.0, 6.5, 6.0, 5.5, 5.0, 4.5, 4.0])
    assert len(seen["stages"]) == MOST_STEPS + 1


@pytest.mark.parametrize(
    ("error", "sure"),
    [(FLOOR_SURE[0] - 0.01, False), (0.86, True), (1.14, True), (1.16, False), (1.31, False)],
)
def test_nothing_more_is_sought_where_error_and_floor_agree(monkeypatch, error, sure):
    seen, calls = looped(monkeypatch, [error, 0.5])
    assert len(calls) == (1 if sure else 3)
    assert len(seen["stages"]) == (2 if sure else 3)


def test_all_begins_anew_after_a_shift_as_often_as_allowed(monkeypatch):
    other = study_stub(fit=("moved",))
    seen, _ = looped(monkeypatch, [7.0, 6.0, 5.0], moved=[other, other, other])
    assert seen["study"] is other
    assert [s.fit.error for s in seen["stages"]] == pytest.approx([6.0, 5.0])
    seen, _ = looped(monkeypatch, [7.0, 6.0], moved=[other, other], shifts=0)
    assert seen["study"] is STUDY


def test_a_stage_knows_the_fit_it_led_to():
    assert Stage((), HIGH).fit is HIGH
