"""The self-test counts: each outcome exactly once, in its own row."""

from __future__ import annotations

import math
from concurrent.futures import Future
from dataclasses import replace
from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import CATALOGUE, PLAIN, axis_of, built, built_dataset, built_fit, fitted

from identify.estimation.fit import Outcome, finished
from identify.estimation.force_balance import residual
from identify.estimation.intervals import Estimate
from identify.output.words.selftest import rate_in_words, target_in_words, trial_in_words
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from identify.selftest import cases, design, trial
from identify.selftest.design import FULL, PAIR_STRENGTH, QUICK, Design, plantable
from identify.selftest.tally import COVERED, Rate, confusion, coverage, rates
from identify.selftest.trial import Case, TrialResult, _covered, _right_coordinates
from twin.effect import Kind


def outcomes_of(counts: dict[TrialResult, int]) -> list[TrialResult]:
    """Each outcome as often as asked, in an order that is drawn."""
    every = [o for o, n in counts.items() for _ in range(n)]
    return [every[i] for i in np.random.default_rng(2).permutation(len(every))]


def one(
    strength: float, *answers: tuple[str, ...], verdict="MISSING_EFFECT", **changes
) -> TrialResult:
    known = changes.pop("known", True)
    return TrialResult(Case(("a",), strength, 1, known), verdict, answers, **changes)


RIGHT, TIED = one(5.0, ("a",)), one(5.0, ("b", "a"), verdict="AMBIGUOUS")
WRONG, MISSED = one(5.0, ("b",)), one(5.0, verdict="UNEXPLAINED")
SILENT, TOO_MANY = one(5.0, verdict="NOTHING_MISSING"), one(5.0, ("a",), ("b",))
WEAK, WEAK_WRONG = one(2.0, ("a",)), one(2.0, ("c",))
HIDDEN = one(5.0, shown=False)
FOUND = one(5.0, ("b",), known=False, left=1.29)
FAR = one(5.0, ("b",), known=False, left=1.31)
LOST = one(
    5.0, known=False, verdict="UNEXPLAINED", left=1.0, depends_on="time", coordinates=("position",)
)
SEEN = replace(LOST, depends_on="position", left=9.0)
COVERING = (("mass", True), ("Fc", False), ("Fs", True))
QUIET = TrialResult(Case((), 0.0, 1), "NOTHING_MISSING", covered=COVERING)
ALARM = TrialResult(Case((), 0.0, 2), "AMBIGUOUS", (("c", "d"),), covered=(("mass", False),))
BOTH = TrialResult(Case(("a", "b"), 5.0, 1), "MISSING_EFFECT", (("b",), ("a",)))
HALF = TrialResult(Case(("a", "b"), 5.0, 2), "MISSING_EFFECT", (("b",),))
COUNTS = {
    RIGHT: 11, TIED: 5, WRONG: 3, MISSED: 2, SILENT: 1, TOO_MANY: 1, WEAK: 7, WEAK_WRONG: 4,
    HIDDEN: 6, FOUND: 9, FAR: 8, LOST: 10, SEEN: 13, QUIET: 17, ALARM: 12, BOTH: 19, HALF: 14,
}  # fmt: skip
EVERY = outcomes_of(COUNTS)


def test_every_outcome_is_counted_once_in_its_own_row():
    found = {r.what: (r.count, r.trials, target_in_words(r)) for r in rates(EVERY)}
    named = "named or in a declared ambiguity, force {} times the noise floor"
    assert found == {
        named.format(2): (7, 11, "at least 80 %"),
        named.format(5): (11 + 5, 11 + 5 + 3 + 2 + 1 + 1, "at least 95 %"),
        "false alarms, nothing planted": (12, 29, "at most 1 %"),
        "wrong names given with confidence, one planted": (3 + 1 + 4, 23 + 11, ""),
        "both of two named": (19, 33, "at least 85 %"),
        "effect outside the catalogue: floor reached or the right coordinate": (
            9 + 13, 40, "at least 80 %",
        ),
        "90 % intervals that hold the truth": (2 * 17, 3 * 17 + 12, "85 to 95 %"),
    }  # fmt: skip


def test_a_row_without_trials_is_left_out():
    assert [r.what for r in rates([QUIET])] == [
        "false alarms, nothing planted", "90 % intervals that hold the truth",
    ]  # fmt: skip
    assert rates([HIDDEN]) == []


def test_coverage_counts_each_parameter_by_itself():
    found = coverage(EVERY)
    assert {k: (r.count, r.trials) for k, r in found.items()} == {
        "mass": (17, 29), "Fc": (0, 17), "Fs": (17, 17),
    }  # fmt: skip
    assert found["Fc"].asked == COVERED


def test_the_confusion_matrix_has_shares_of_each_row():
    found = confusion(EVERY)
    assert set(found) == {"a", "nothing"}
    a = {"a": 11 + 1 + 7, "ambiguous with it": 5, "b": 3, "unexplained": 2, "nothing": 1, "c": 4}
    assert found["a"] == pytest.approx({k: n / 34 for k, n in a.items()})
    assert found["nothing"] == pytest.approx({"c": 12 / 29, "nothing": 17 / 29})


def test_an_outcome_is_right_where_names_and_planted_effects_match_one_to_one():
    for planted in (("a",), ("a", "b"), ()):
        for named in product([("a",), ("b",), ("c", "a"), ("b", "c")], repeat=len(planted)):
            o = TrialResult(Case(planted, 5.0, 1), "MISSING_EFFECT", named)
            used = [set(answer) & set(planted) for answer in named]
            matched = all(used) and len(set().union(*used)) == len(planted)
            assert o.right is matched, o
    assert not TrialResult(Case((), 0.0, 1), "AMBIGUOUS", (("a",),)).right


def test_rates_in_words():
    rate = Rate("what", 3, 4, (0.2, 0.9))
    assert rate_in_words(rate) == "what: 3 of 4 (75 %), target: 20 to 90 %"
    assert rate_in_words(Rate("what", 0, 0)) == "what: 0 of 0"
    assert math.isnan(Rate("what", 0, 0).value)
    assert rate.value == 0.75


def test_an_outcome_in_words():
    level = "at 5 times the noise floor"
    assert trial_in_words(TIED) == f"a {level}: b or a"
    assert trial_in_words(BOTH) == f"a and b {level}: b and a"
    assert trial_in_words(LOST) == f"a {level}, left out of the catalogue: unexplained"
    assert trial_in_words(QUIET) == "nothing: nothing missing"
    assert "a cannot reach 5 times the noise floor" in trial_in_words(HIDDEN)


# --- the design -----------------------------------------------------------------------------


def test_a_design_makes_the_same_cases_from_the_same_seed_only():
    drawn = Design(strengths=(2.0, 7.0), each=3, empty=4, pairs=6, left_out=2)
    made = drawn.cases(5)
    assert made == drawn.cases(5)
    assert made != drawn.cases(6)
    names = plantable(CATALOGUE)
    assert "lugre" not in names
    assert not any(CATALOGUE[n].is_nonparametric for n in names)
    empty = [c for c in made if not c.effects]
    assert [(c.seed, c.strength, c.known) for c in empty] == [(5 + i, 0.0, True) for i in range(4)]
    single = [c for c in made if len(c.effects) == 1 and c.known]
    assert {(c.effects[0], c.strength, c.seed) for c in single} == set(
        product(names, (2.0, 7.0), (5, 6, 7))
    )
    assert len(single) == 6 * len(names)
    out = [c for c in made if not c.known]
    assert {(c.effects[0], c.strength, c.seed) for c in out} == set(
        product(names, (PAIR_STRENGTH,), (1005, 1006))
    )
    pairs = [c for c in made if len(c.effects) == 2]
    assert [c.seed for c in pairs] == list(range(5, 11))
    assert all(c.strength == PAIR_STRENGTH and c.known for c in pairs)
    assert len(made) == len(empty) + len(single) + len(out) + len(pairs)


def test_a_quick_design_and_the_full_one():
    assert (QUICK.strengths, FULL.strengths) == ((5.0,), (2.0, 5.0, 20.0))
    sizes = [(d.each, d.empty, d.pairs, d.left_out) for d in (QUICK, FULL)]
    assert sizes == [(1, 10, 10, 1), (3, 200, 60, 2)]


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
    assert len(FULL.cases(1)) > 5 * len(QUICK.cases(1))


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


def test_an_interval_holds_the_truth_between_its_ends(monkeypatch):
    fit = built_fit(1.0)
    truth = [c.label for c in fit.scaling.where]
    assert truth == ["mass", "coulomb_viscous.Fc", "coulomb_viscous.sigma2"]
    true = replace(axis_of(mass=5.0), effects=fit.axis.effects)
    machine = SimpleNamespace(true=SimpleNamespace(axes={"x": true}))
    found = SimpleNamespace(base=fit)
    for low, high, inside in ((4.9, 5.1, True), (5.0, 5.1, True), (4.0, 5.0, True),
                              (5.01, 6.0, False), (4.0, 4.99, False)):  # fmt: skip
        given = (
            Estimate("mass", 5.3, "kg", low, high, True),
            Estimate("Fc", 0.3, "N", None, None, True, "no"),
            Estimate("sigma2", 0.5, "N s/m", 0.4, 0.52, True),
        )
        monkeypatch.setattr(trial, "estimates", lambda f, given=given: given)
        assert _covered(machine, found) == (("mass", inside), ("sigma2", False))


@pytest.mark.parametrize("known", [True, False])
def test_a_trial_diagnoses_what_was_built(monkeypatch, dataset, known):
    base, final = built_fit(4.0, 0.5), built_fit(1.1, 1.0)
    machine = SimpleNamespace(
        planted=(), model=SimpleNamespace(axes={"x": PLAIN}), logs="logs", holdout="held"
    )
    asked = {}
    found = AxisDiagnosis(
        dataset, base, tuple(built(n, bic=b) for n, b in (("wear", 90.0), ("gms", 80.0))), (),
        final, Verdict.UNEXPLAINED, SimpleNamespace(depends_on="time"),
    )  # fmt: skip

    def build(stage, effects, strength, rng):
        asked.update(effects=[e.name for e in effects], strength=strength, draw=rng.random())
        return machine

    def diagnose(given, where, catalogue, workers):
        asked.update(catalogue=set(catalogue), workers=workers)
        return found

    monkeypatch.setattr(trial, "machine", build)
    monkeypatch.setattr(trial, "datasets", lambda *given: {"x": given})
    monkeypatch.setattr(trial, "fit_aligned", lambda axis, given: (given, base))
    monkeypatch.setattr(trial, "diagnose_axis", diagnose)
    out = trial.run(Case(("cogging",), 3.0, 7, known))
    first = asked["draw"]
    assert (asked["effects"], asked["strength"], asked["workers"]) == (["cogging"], 3.0, 1)
    assert ("cogging" in asked["catalogue"]) is known
    assert len(asked["catalogue"]) == len(CATALOGUE) - (not known)
    assert (out.verdict, out.ratio, out.left) == ("UNEXPLAINED", 8.0, pytest.approx(1.1))
    assert out.ranking == (("wear", 90.0), ("gms", 80.0))
    assert (out.depends_on, out.covered, out.shown) == ("time", (), True)
    assert out.seconds > 0.0
    trial.run(Case(("cogging",), 3.0, 7, known))
    assert asked["draw"] == first
    trial.run(Case(("cogging",), 3.0, 8, known))
    assert asked["draw"] != first

    def refused(*_):
        raise cases.NotShown("cogging")

    monkeypatch.setattr(trial, "machine", refused)
    assert trial.run(Case(("cogging",), 3.0, 7)) == TrialResult(
        Case(("cogging",), 3.0, 7), shown=False
    )
