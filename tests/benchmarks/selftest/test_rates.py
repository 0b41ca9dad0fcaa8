"""The self-test counts: which answers are right, each outcome once, confidence on others."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import PLAIN, axis_of, built_dataset, fitted
from built_results import errors, score_of
from machines import CATALOGUE

from benchmarks.selftest.confidence import FIGURES, LEAST_ANSWERS, levels
from benchmarks.selftest.laws import OUTSIDE
from benchmarks.selftest.machines import Case
from benchmarks.selftest.tally import (
    CONFIDENT,
    COVERED,
    Rate,
    by_stratum,
    confusion,
    coverage,
    coverage_by_parameter,
    failures,
    rates,
    reliability,
)
from benchmarks.selftest.trial import Answer, Held, TrialResult, answer_of, held
from benchmarks.selftest.words import (
    failure_in_words,
    target_in_words,
    trial_in_words,
)
from identify.estimation.fit import Outcome, finished
from identify.estimation.intervals import half_widths
from identify.selection.findings import (
    BY_PART,
    BY_T,
    ConfidenceBin,
    Finding,
    FindingKind,
    confidence,
    read,
)
from twin.curve import Coordinate
from twin.model.machine import Fitted

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
        "outside the catalogue: no wrong name, and the right coordinate": (
            13, 32, "at least 80 %",
        ),
        "another name for an effect taken out of the catalogue": (8, 8, ""),
        "test error within 1.3 of what noise leaves, where the answer is right": (23, 29, ""),
        "90 % intervals that hold the truth, nothing missing": (
            17 + 12, 3 * 17 + 12, "85 to 95 %",
        ),
        "90 % intervals that hold the truth beside a missing effect of 5 floors": (
            11, 33, "at least 85 %",
        ),
    }  # fmt: skip


def test_a_curve_tells_a_coordinate_as_a_remainder_does():
    """A bump at one place: what is told is the cable's curve over position, and nothing is left."""

    def counted(*answers):
        found = rates([replace(LOST, answers=answers)])
        return next(r.count for r in found if r.what.startswith("outside"))

    assert [counted(replace(SHAPE, coordinate=c)) for c in ("x", "y", None)] == [1, 0, 0]
    assert counted(replace(SHAPE, coordinate="y"), replace(SHAPE, coordinate="x")) == 1
    assert counted(replace(SHAPE, coordinate="x"), B) == 0


def test_a_name_counts_as_confident_from_where_one_acts_on_it():
    def counted(sure):
        found = rates([one(5.0, answer("b", right=False, sure=sure))])
        return next(r.count for r in found if r.what.startswith("confident"))

    assert [counted(s) for s in (CONFIDENT - 0.01, CONFIDENT, 1.0)] == [0, 1, 1]


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


def test_two_effects_need_an_answer_each():
    assert BOTH.right
    assert not HALF.named
    both_in_one = replace(BOTH, answers=(answer("a", "b", right=True),))
    assert not both_in_one.named
    assert replace(BOTH, answers=(answer("a", "b", right=True), answer("a", right=True))).named
    shape = replace(A, kind=FindingKind.WRONG_SHAPE)
    assert not one(5.0, shape).named


def test_a_rate_has_the_interval_of_its_binomial():
    from scipy.stats import binomtest  # half a second to load

    for count, trials in ((0, 9), (3, 4), (31, 40), (12, 12)):
        exact = binomtest(count, trials).proportion_ci(0.95, "exact")
        assert Rate("", count, trials).interval == pytest.approx((exact.low, exact.high))


def test_an_outcome_in_words():
    assert trial_in_words(TIED) == "a@5/plain/1: b or a (60 %)"
    assert trial_in_words(BOTH) == "a+b@5/plain/1: b (60 %) and a (60 %)"
    assert trial_in_words(SHAPED) == "a@5/bumps/1: a (60 %) and s of another shape (60 %)"
    assert trial_in_words(QUIET) == "nothing@0/plain/1: nothing missing"
    assert "a@5/plain/1: cannot reach 5 times the noise floor" in trial_in_words(HIDDEN)
    assert failure_in_words(LEFT_OUT) == (
        "wrong: python -m benchmarks selftest --case a@5/plain/1/out: b (60 %)"
    )
    assert (
        failure_in_words(MISSED)
        == "missed: python -m benchmarks selftest --case a@5/plain/1: unexplained"
    )


# --- confidence ------------------------------------------------------------------------------


PART = FIGURES["BY_PART"]


def answers(count: int, seed: int) -> list[Answer]:
    """Right with a chance that is the part they took."""
    rng = np.random.default_rng(seed)
    return [
        Answer(("a",), FindingKind.MISSING, bool(rng.random() < part), part)
        for part in rng.random(count)
    ]


@pytest.mark.parametrize("table", [BY_PART, BY_T])
def test_a_table_that_is_shipped_falls_and_has_no_end(table: tuple[ConfidenceBin, ...]) -> None:
    right = [level.right for level in table]
    assert right == sorted(right, reverse=True)
    assert all(0.0 < r < 1.0 for r in right)
    assert table[-1].least == 0.0


def test_a_gain_near_chance_is_not_stated_with_confidence_whatever_it_takes() -> None:
    assert confidence(1.0, 1.7) < 0.8 < confidence(1.0, 10.0)
    assert confidence(0.3, 10.0) < confidence(1.0, 10.0)


def test_levels_fall_and_are_as_many_as_the_answers_allow() -> None:
    few, some, many = (
        levels(answers(n, 3), PART)
        for n in (LEAST_ANSWERS - 1, 2 * LEAST_ANSWERS + 5, 40 * LEAST_ANSWERS)
    )
    assert len(few) == 1
    assert len(some) <= 2
    assert 10 < len(many) <= 40
    right = [v.right for v in many]
    assert right == sorted(right, reverse=True)
    assert len(set(right)) == len(right)
    assert levels([], PART) == (ConfidenceBin(0.0, 0.5),)


def test_a_table_of_some_answers_holds_on_others() -> None:
    table = levels(answers(4000, 1), PART)
    judged = [replace(a, confidence=read(table, a.part)) for a in answers(4000, 2)]
    found = reliability([TrialResult(Case(("a",), 5.0, 1), answers=tuple(judged))])
    assert sum(t.right.trials for t in found) == 4000
    for tenth in found:
        # Both tables are of a sample: four standard deviations of each.
        allowed = 4.0 * 0.5 * np.sqrt(1.0 / 800 + 1.0 / tenth.right.trials)
        assert abs(tenth.stated - tenth.right.value) < allowed


# Which answers of a trial count as right, and how far the truth lies from a value


SCORE = score_of(0.613, 7.3, 0.137)
LONE = next(n for n, e in OUTSIDE.items() if {c.over for c in e.curves} == {Coordinate.POSITION})


def is_right(
    planted: str,
    over: Coordinate,
    *,
    told: str = "cable_slab",
    known: bool = True,
    reshaped: tuple[str, ...] = (),
) -> bool:
    """Of the answer that a law of the model has another shape over a coordinate."""
    effect = OUTSIDE.get(planted) or CATALOGUE[planted]
    model = SimpleNamespace(axes={"x": axis_of(fitted("cable_slab"))})
    built = SimpleNamespace(
        model=model, planted=(Fitted.at_start(effect),), reshaped=frozenset(reshaped),
        right=frozenset(),
    )  # fmt: skip
    finding = Finding(told, (), 0.9, *errors(2.0, 1.0), "N", {}, SCORE)
    shape = SimpleNamespace(over=over)
    finding = replace(finding, kind=FindingKind.WRONG_SHAPE, shape=shape)
    answer = answer_of(finding, built, Case((planted,), 5.0, 1, "plain", known))
    assert (answer.names, answer.part) == ((told,), finding.score.part)
    return answer.right


@pytest.mark.parametrize(
    ("planted", "over", "known", "right"),
    [
        (LONE, Coordinate.POSITION, True, True),
        (LONE, Coordinate.SPEED, True, False),
        ("cogging", Coordinate.POSITION, True, False),  # it has a name, which should be given
        ("cogging", Coordinate.POSITION, False, True),
        ("cogging", Coordinate.SPEED, False, False),
    ],
)
def test_another_shape_is_right_where_no_better_name_is(planted, over, known, right):
    assert is_right(planted, over, known=known) is right


@pytest.mark.parametrize(
    ("told", "over", "right"),
    [
        ("coulomb_viscous", Coordinate.SPEED, True),
        ("coulomb_viscous", Coordinate.POSITION, False),
        ("cable_slab", Coordinate.SPEED, False),
        ("cable_slab", Coordinate.POSITION, False),
    ],
)
def test_of_another_friction_the_curve_over_speed_of_the_models_own_is_right(told, over, right):
    assert is_right("leuven", over, told=told) is right


def test_another_shape_is_right_where_the_law_of_the_machine_has_one():
    assert is_right("cogging", Coordinate.POSITION, reshaped=("cable_slab",))
    assert not is_right("cogging", Coordinate.POSITION, reshaped=("roller_spikes",))


@pytest.mark.parametrize(
    ("told", "planted", "right"),
    [
        ("dahl", fitted("dahl", n=1.0), False),
        ("dahl", fitted("dahl", n=0.7), True),
        ("lugre", fitted("dahl", n=0.7), False),
        # A start by the travel, and a strength that is held, make no other law.
        (
            "position_dependent_friction",
            fitted("position_dependent_friction", start=-0.07),
            False,
        ),
        ("coulomb_viscous", fitted("coulomb_viscous", Fs=0.3), False),
    ],
)
def test_what_resembles_is_right_where_the_machine_has_another_exponent(told, planted, right):
    built = SimpleNamespace(planted=(planted,))
    finding = Finding(told, (), 0.9, *errors(2.0, 1.0), "N", {}, SCORE)
    finding = replace(finding, kind=FindingKind.RESEMBLES)
    assert answer_of(finding, built, Case((planted.effect.name,), 5.0, 1)).right is right


def test_the_truth_lies_so_many_half_widths_from_a_value():
    dataset = built_dataset("run")
    fit = finished(PLAIN, PLAIN, dataset.training, Outcome.CONVERGED)
    half = dict(zip([c.label for c in fit.scaling.where], half_widths(fit), strict=True))
    assert list(half) == ["mass", "coulomb_viscous.Fc", "coulomb_viscous.sigma2"]
    true = replace(fit.axis, mass=fit.axis.mass + 0.5 * half["mass"])
    machine = SimpleNamespace(
        true=SimpleNamespace(axes={"x": true}), reshaped=frozenset({"coulomb_viscous"})
    )
    (mass,) = held(machine, fit)  # a reshaped law has no true values
    assert mass.label == "mass"
    assert mass.off == pytest.approx(0.5, rel=1e-6)
    machine.reshaped = frozenset()
    assert [h.label for h in held(machine, fit)] == list(half)
