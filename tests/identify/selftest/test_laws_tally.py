"""The self-test counts: each outcome exactly once, in its own row."""

from __future__ import annotations

import math
from concurrent.futures import Future
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import CATALOGUE, PLAIN, built, built_dataset, built_fit, fitted
from built_results import errors
from scipy.stats import binomtest

from identify.estimation.fit import Outcome, finished
from identify.estimation.force_balance import residual
from identify.estimation.intervals import half_widths
from identify.output.words.selftest import (
    failure_in_words,
    rate_in_words,
    target_in_words,
    trial_in_words,
)
from identify.selection.decoys import Proof
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from identify.selection.findings import Finding, FindingKind
from identify.selftest import cases, design, trial
from identify.selftest.case import Case
from identify.selftest.design import FULL, QUICK, STRONG, WEAK, Design, plantable, release_seed
from identify.selftest.laws import OUTSIDE
from identify.selftest.tally import (
    CONFIDENT,
    COVERED,
    Rate,
    by_stratum,
    confusion,
    coverage,
    coverage_by_parameter,
    failures,
    rates,
)
from identify.selftest.trial import Answer, Held, TrialResult, _held, _right_coordinates
from identify.selftest.variations import VARIATIONS
from twin.effect import Kind

FOREIGN = next(iter(OUTSIDE))


def answer(*names: str, right: bool, sure: float = 0.6, shape: bool = False) -> Answer:
    kind = FindingKind.WRONG_SHAPE if shape else FindingKind.MISSING
    return Answer(names, kind, right, 1.0, sure)


def outcomes_of(counts: dict[TrialResult, int]) -> list[TrialResult]:
    """Each outcome as often as asked, in an order that is drawn."""
    every = [o for o, n in counts.items() for _ in range(n)]
    return [every[i] for i in np.random.default_rng(2).permutation(len(every))]


def one(
    strength: float, *answers: Answer, verdict="MISSING_EFFECT", effect="a", **changes
) -> TrialResult:
    case = Case((effect,), strength, 1, changes.pop("variation", "plain"))
    return TrialResult(case, verdict, answers, **{"tested": 1.1, **changes})


A, B, C = answer("a", right=True), answer("b", right=False), answer("c", right=False, sure=0.95)
SHAPE = answer("s", right=True, shape=True)
OFF = (Held("mass", 0.9, True), Held("Fc", 1.1, True), Held("Fs", 1.4, True), Held("v0", 0, False))
RIGHT = one(5.0, A, held=OFF)
TIED = one(5.0, answer("b", "a", right=True), verdict="AMBIGUOUS")
WRONG, MISSED = one(5.0, B), one(5.0, verdict="UNEXPLAINED", tested=2.0)
SILENT, TOO_MANY = one(5.0, verdict="NOTHING_MISSING"), one(5.0, A, B)
SHAPED = one(5.0, A, SHAPE, variation="bumps", tested=1.5)
WEAK_ONE, WEAK_WRONG = one(2.0, A), one(2.0, C)
HIDDEN = one(5.0, shown=False)
NAMED_OUTSIDE = one(5.0, C, effect=FOREIGN)
LEFT_OUT = replace(WRONG, case=replace(WRONG.case, known=False))
LOST = one(5.0, verdict="UNEXPLAINED", effect=FOREIGN, depends_on="t", coordinates=("x",))
HONEST = replace(LOST, depends_on="x")
QUIET = TrialResult(Case((), 0.0, 1), "NOTHING_MISSING", held=OFF)
ALARM = TrialResult(Case((), 0.0, 2), "AMBIGUOUS", (answer("c", "d", right=False),), held=OFF[:1])
BOTH = TrialResult(Case(("a", "b"), 5.0, 1), "MISSING_EFFECT", (answer("b", right=True), A))
HALF = TrialResult(Case(("a", "b"), 5.0, 2), "MISSING_EFFECT", (answer("b", right=True),))
COUNTS = {
    RIGHT: 11, TIED: 5, WRONG: 3, MISSED: 2, SILENT: 1, TOO_MANY: 1, SHAPED: 6, WEAK_ONE: 7,
    WEAK_WRONG: 4, HIDDEN: 6, NAMED_OUTSIDE: 9, LEFT_OUT: 8, LOST: 10, HONEST: 13, QUIET: 17,
    ALARM: 12, BOTH: 19, HALF: 14,
}  # fmt: skip
EVERY = outcomes_of(COUNTS)


def test_every_outcome_is_counted_once_in_its_own_row():
    found = {r.what: (r.count, r.trials, target_in_words(r)) for r in rates(EVERY)}
    named = "named or in a declared ambiguity, force {} times the noise floor"
    strong = 11 + 5 + 3 + 2 + 1 + 1 + 6
    inside = strong + 7 + 4 + 19 + 14
    assert found == {
        named.format(2): (7, 11, "at least 80 %"),
        named.format(5): (11 + 5 + 6, strong, "at least 95 %"),
        "false findings, nothing planted": (12, 29, "at most 1 %"),
        "both of two named": (19, 33, "at least 85 %"),
        "wrong names, planted inside the catalogue": (3 + 1 + 4, inside, ""),
        "confident wrong names, planted inside the catalogue": (4, inside, "at most 1 %"),
        "wrong names, planted outside the catalogue": (9, 32, ""),
        "confident wrong names, planted outside the catalogue": (9, 32, "at most 3 %"),
        "outside the catalogue: no name, and the right coordinate": (13, 32, "at least 80 %"),
        "another name for an effect taken out of the catalogue": (8, 8, ""),
        "test error within 1.3 of what noise leaves, where the answer is right": (23, 29, ""),
        "90 % intervals that hold the truth, nothing missing": (
            17 + 12, 3 * 17 + 12, "85 to 95 %",
        ),
        "90 % intervals that hold the truth beside a missing effect of 5 floors": (
            11, 33, "at least 85 %",
        ),
    }  # fmt: skip


def test_a_name_counts_as_confident_from_where_one_acts_on_it():
    def counted(sure):
        found = rates([one(5.0, answer("b", right=False, sure=sure))])
        return next(r.count for r in found if r.what.startswith("confident"))

    assert [counted(s) for s in (CONFIDENT - 0.01, CONFIDENT, 1.0)] == [0, 1, 1]


def test_a_row_without_trials_is_left_out():
    assert [r.what for r in rates([QUIET])] == [
        "false findings, nothing planted", "90 % intervals that hold the truth, nothing missing",
    ]  # fmt: skip
    assert rates([HIDDEN]) == []


def test_each_machine_is_in_the_stratum_of_its_variation():
    found = by_stratum(EVERY)
    assert set(found) == {"plain", "bumps"}
    assert [(r.what, r.count, r.trials) for r in found["bumps"]] == [
        ("named at 5", 6, 6), ("wrong inside", 0, 6),
    ]  # fmt: skip
    plain = {r.what: (r.count, r.trials) for r in found["plain"]}
    assert plain == {
        "named at 2": (7, 11), "named at 5": (16, 23), "false": (12, 29),
        "wrong inside": (8, 34), "wrong outside": (9, 32),
    }  # fmt: skip


def test_the_machines_that_failed_are_those_to_mend():
    failed = {WRONG, MISSED, SILENT, TOO_MANY, WEAK_WRONG, NAMED_OUTSIDE, LEFT_OUT, ALARM, HALF}
    assert set(failures(EVERY)) == failed
    assert len(failures(EVERY)) == sum(COUNTS[o] for o in failed)


def test_coverage_counts_the_intervals_given_as_they_are_or_wider():
    found = coverage_by_parameter(EVERY)
    assert {k: (r.count, r.trials) for k, r in found.items()} == {
        "mass": (29, 29), "Fc": (0, 17), "Fs": (0, 17),
    }  # fmt: skip
    assert found["Fc"].asked == COVERED
    assert [coverage([RIGHT], "", wider=w).count for w in (1.0, 1.2, 1.5)] == [1, 2, 3]


def test_the_confusion_matrix_has_shares_of_each_row():
    found = confusion(EVERY)
    assert set(found) == {"a", "nothing", FOREIGN}
    a = {"a": 11 + 1 + 6 + 7, "ambiguous with it": 5, "b": 3, "unexplained": 2, "nothing": 1,
         "c": 4}  # fmt: skip
    assert found["a"] == pytest.approx({k: n / 40 for k, n in a.items()})
    assert found["nothing"] == pytest.approx({"c": 12 / 29, "nothing": 17 / 29})
    assert confusion([one(5.0, SHAPE)]) == {"a": {"wrong shape": 1.0}}


@pytest.mark.parametrize("answers", [(), (B,), (A, SHAPE), (TIED.answers[0],), (A, B)])
def test_an_effect_is_named_where_an_answer_holds_it_as_missing(answers):
    o = one(5.0, *answers)
    assert o.named is any("a" in x.names for x in answers)
    assert o.right is (o.named and B not in answers)


def test_two_effects_need_an_answer_each():
    assert BOTH.right
    assert not HALF.named
    both_in_one = replace(BOTH, answers=(answer("a", "b", right=True),))
    assert not both_in_one.named
    assert replace(BOTH, answers=(answer("a", "b", right=True), answer("a", right=True))).named
    shape = replace(A, kind=FindingKind.WRONG_SHAPE)
    assert not one(5.0, shape).named


def test_a_rate_has_the_interval_of_its_binomial():
    for count, trials in ((0, 9), (3, 4), (31, 40), (12, 12)):
        exact = binomtest(count, trials).proportion_ci(0.95, "exact")
        assert Rate("", count, trials).interval == pytest.approx((exact.low, exact.high))


def test_rates_in_words():
    rate = Rate("what", 3, 4, (0.2, 0.9))
    assert rate_in_words(rate) == (
        "what: 3 of 4 (75 %, 95 % interval 19 to 99 %), target: 20 to 90 %"
    )
    assert rate_in_words(Rate("what", 0, 0)) == "what: 0 of 0"
    assert math.isnan(Rate("what", 0, 0).value)
    assert rate.value == 0.75


def test_an_outcome_in_words():
    assert trial_in_words(TIED) == "a@5/plain/1: b or a (60 %)"
    assert trial_in_words(BOTH) == "a+b@5/plain/1: b (60 %) and a (60 %)"
    assert trial_in_words(SHAPED) == "a@5/bumps/1: a (60 %) and s of another shape (60 %)"
    assert trial_in_words(QUIET) == "nothing@0/plain/1: nothing missing"
    assert "a@5/plain/1: cannot reach 5 times the noise floor" in trial_in_words(HIDDEN)
    assert failure_in_words(LEFT_OUT) == "wrong: twin selftest --case a@5/plain/1/out: b (60 %)"
    assert failure_in_words(MISSED) == "missed: twin selftest --case a@5/plain/1: unexplained"


# --- the design -----------------------------------------------------------------------------


def test_a_design_makes_the_same_cases_from_the_same_seed_only():
    drawn = Design(empty=9, strong=90, weak=60, outside=11, pairs=6, left_out=5)
    made = drawn.cases(5)
    assert made == drawn.cases(5)
    assert not set(made) & set(drawn.cases(6))
    assert len(set(made)) == len(made) == 9 + 90 + 60 + 11 + 6 + 5
    names = set(plantable(CATALOGUE))
    assert "lugre" not in names
    assert not any(CATALOGUE[n].is_nonparametric for n in names)
    empty = [c for c in made if not c.effects]
    assert [(c.strength, c.known) for c in empty] == [(0.0, True)] * 9
    assert {c.variation for c in empty} == set(VARIATIONS)  # in turn
    inside = [c for c in made if len(c.effects) == 1 and c.known and c.effects[0] in names]
    for strength, count in ((STRONG, 90), (WEAK, 60)):
        own = [c.effects[0] for c in inside if c.strength == strength]
        assert len(own) == count
        assert set(own) == names  # in turn
    outside = [c.effects[0] for c in made if c.effects and c.effects[0] in OUTSIDE]
    assert (len(outside), set(outside)) == (11, set(OUTSIDE))
    assert sum(len(c.effects) == 2 for c in made) == 6
    assert sum(not c.known for c in made) == 5


def test_a_quick_design_and_the_full_one():
    quick, full = QUICK.cases(1), FULL.cases(1)
    assert len(quick) == 10  # two minutes of one core at twelve seconds each
    assert 200 < len(full) <= 300  # half an hour of two cores
    assert {c.variation for c in full} == set(VARIATIONS)


def test_development_and_release_are_drawn_apart():
    assert release_seed() != design.DEVELOPMENT
    assert release_seed() >= design.FIRST_RELEASE > design.DEVELOPMENT
    assert not set(FULL.cases(release_seed())) & set(FULL.cases(design.DEVELOPMENT))


class Inline:
    """A pool that runs each job at once, in this process."""

    def __init__(self, workers, mp_context) -> None:
        self.workers = workers

    def __enter__(self):
        return self

    def __exit__(self, *_) -> None:
        pass

    def submit(self, function, case):
        future = Future()
        future.set_result(function(case))
        return future


def test_outcomes_come_in_the_order_of_the_cases_with_their_progress(monkeypatch):
    monkeypatch.setattr(design, "ProcessPoolExecutor", Inline)
    monkeypatch.setattr(design, "as_completed", lambda jobs: reversed(list(jobs)))
    monkeypatch.setattr(design, "run", lambda case: TrialResult(case, str(case.seed)))
    wanted = [Case(("a",), 5.0, seed) for seed in (3, 1, 2)]
    told = []
    found = design.run_all(wanted, progress=lambda *given: told.append(given))
    assert [o.case for o in found] == wanted
    assert [(o.verdict, done, total) for o, done, total in told] == [
        ("2", 1, 3), ("1", 2, 3), ("3", 3, 3),
    ]  # fmt: skip
    assert design.run_all(wanted) == found


def test_two_frictions_are_never_planted_together():
    frictions = [n for n in plantable(CATALOGUE) if CATALOGUE[n].kind is Kind.FRICTION]
    assert len(frictions) > 2
    alone = Design(pairs=3).cases(1, frictions)
    assert not any(len(c.effects) == 2 for c in alone)
    mixed = Design(pairs=40).cases(1, [*frictions, "wear"])
    pairs = [c.effects for c in mixed if len(c.effects) == 2]
    assert len(pairs) == 40
    assert all("wear" in pair for pair in pairs)


# --- one trial ------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def dataset():
    return built_dataset("run")


def test_the_right_coordinates_are_those_near_the_strongest_dependence(monkeypatch, dataset):
    base = finished(PLAIN, PLAIN, dataset.fit, Outcome.CONVERGED)
    planted = (fitted("constant_force", F0=0.7), fitted("quadratic_drag", c=2.0))
    built_machine = SimpleNamespace(planted=planted)
    seen = []

    def shares(force, fit, where):
        seen.append(force)
        return {"time": 0.5, "position": 0.41, "velocity": 0.4, "direction": 0.39}

    monkeypatch.setattr(trial, "dependences", shares)
    found = _right_coordinates(built_machine, base, dataset)
    assert found == ("time", "position", "velocity")
    with_both = base.axis.with_effect(planted[0]).with_effect(planted[1])
    change = base.residual - residual(with_both, dataset.fit)[base.kept]
    columns = base.jacobian / np.linalg.norm(base.jacobian, axis=0)
    left = change - columns @ np.linalg.lstsq(columns, change, rcond=None)[0]
    np.testing.assert_allclose(seen[0], left, atol=1e-6)
    assert _right_coordinates(SimpleNamespace(planted=()), base, dataset) == ()
    silent = SimpleNamespace(planted=(fitted("cogging"),))
    assert _right_coordinates(silent, base, dataset) == ()


def test_the_truth_lies_so_many_half_widths_from_a_value(dataset):
    fit = finished(PLAIN, PLAIN, dataset.fit, Outcome.CONVERGED)
    half = dict(zip([c.label for c in fit.scaling.where], half_widths(fit), strict=True))
    assert list(half) == ["mass", "coulomb_viscous.Fc", "coulomb_viscous.sigma2"]
    true = replace(fit.axis, mass=fit.axis.mass + 0.5 * half["mass"])
    machine = SimpleNamespace(
        true=SimpleNamespace(axes={"x": true}), reshaped=frozenset({"coulomb_viscous"})
    )
    (mass,) = _held(machine, fit)  # a reshaped law has no true values
    assert mass.label == "mass"
    assert mass.off == pytest.approx(0.5, rel=1e-6)
    machine.reshaped = frozenset()
    assert [h.label for h in _held(machine, fit)] == list(half)


@pytest.mark.parametrize("known", [True, False])
def test_a_trial_diagnoses_what_was_built(monkeypatch, dataset, known):
    base, final = built_fit(4.0, 0.5), built_fit(1.1, 1.0)
    machine = SimpleNamespace(
        planted=(), model=SimpleNamespace(axes={"x": PLAIN}), reshaped={"lugre"}, right={"gms"},
    )  # fmt: skip
    asked = {}
    finding = Finding("wear", ("cogging",), 0.9, *errors(2.0, 1.0), "N", {}, Proof(0.9, 0.1))
    findings = (
        finding, replace(finding, effect="gms"), replace(finding, effect="wear", tied=()),
        replace(finding, effect="lugre", kind=FindingKind.WRONG_SHAPE),
        replace(finding, effect="cable", kind=FindingKind.WRONG_SHAPE, tied=(), proof=None),
    )  # fmt: skip
    found = AxisDiagnosis(
        dataset, base, tuple(built(n, bic=b) for n, b in (("wear", 90.0), ("gms", 80.0))), (),
        final, Verdict.UNEXPLAINED, SimpleNamespace(depends_on="time"),
    )  # fmt: skip

    def build(stage, effects, strength, variation, rng):
        asked.update(
            effects=[e.name for e in effects], strength=strength, varied=variation,
            draw=rng.random(),
        )  # fmt: skip
        return machine

    def diagnose(given, where, catalogue, workers):
        asked.update(catalogue=set(catalogue), workers=workers)
        return SimpleNamespace(with_findings=lambda: replace(found, findings=findings))

    monkeypatch.setattr(trial, "machine", build)
    monkeypatch.setattr(trial, "prepared", lambda built: "dataset")
    monkeypatch.setattr(trial, "fit_aligned", lambda axis, given: (given, base))
    monkeypatch.setattr(trial, "diagnose_axis", diagnose)
    monkeypatch.setattr(trial, "_tested", lambda found, built: 1.2)
    monkeypatch.setattr(trial, "_held", lambda built, base: (OFF[0],))
    out = trial.run(Case(("cogging",), 3.0, 7, "bumps", known))
    first = asked["draw"]
    assert (asked["effects"], asked["strength"], asked["workers"]) == (["cogging"], 3.0, 1)
    assert asked["varied"] == "bumps"
    assert ("cogging" in asked["catalogue"]) is known
    assert len(asked["catalogue"]) == len(CATALOGUE) - (not known)
    assert (out.verdict, out.ratio, out.left) == ("UNEXPLAINED", 8.0, pytest.approx(1.1))
    assert out.ranking == (("wear", 90.0), ("gms", 80.0))
    assert (out.depends_on, out.held, out.shown) == ("time", (OFF[0],), True)
    assert out.tested == 1.2
    # Planted; right besides; neither; its law is another; it is not.
    assert [a.right for a in out.answers] == [True, True, False, True, False]
    assert out.answers[0].names == ("wear", "cogging")
    assert (out.answers[0].left, out.answers[0].confidence) == (
        finding.left, finding.confidence,
    )  # fmt: skip
    trial.run(Case(("cogging",), 3.0, 7, "bumps", known))
    assert asked["draw"] == first
    trial.run(Case((FOREIGN,), 3.0, 8))
    assert asked["effects"] == [FOREIGN]
    assert asked["draw"] != first

    def refused(*_):
        raise cases.NotShown("cogging")

    monkeypatch.setattr(trial, "machine", refused)
    assert not trial.run(Case(("cogging",), 3.0, 7)).shown
