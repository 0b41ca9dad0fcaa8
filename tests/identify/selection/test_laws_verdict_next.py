"""What is added next, and when adding ends."""

from __future__ import annotations

import importlib
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import built, built_fit, dataset_stub, step
from identify.selection.forward_selection import _next, diagnose_axis
from identify.selection.pair_search import Pair

from identify.selection.diagnosis import SelectionState
from twin.effects import Catalogue

module = importlib.import_module("identify.selection.forward_selection")
# The rules as they were decided.
BEYOND_DOUBT, FLOOR_SURE, MOST_STEPS = 100.0, (0.85, 1.15), 5
DATASET = dataset_stub()
HIGH, LOW = built_fit(8.0), built_fit(1.1)  # over a floor of 1 N


def fit_with_part(part: float, base_error: float = 5.0, base_floor: float = 3.0):
    """A fit that leaves all but that part of what stood above the floor of (5, 3)."""
    floor = 0.7
    excess = base_error**2 - base_floor**2
    return built_fit(np.sqrt(floor**2 + (1.0 - part) * excess), floor)


# --- what is added next ---------------------------------------------------------------------


def test_the_best_is_added_with_the_supported_rivals_that_tie(monkeypatch):
    monkeypatch.setattr(module, "tie", lambda s, best, c: c.effect.name in ("wear", "lugre"))
    ranking = [
        built("cogging", gain=5.0), built("wear", gain=4.5), built("end_stop", gain=4.5),
        built("lugre", gain=4.5, t=1.0), built("dahl", gain=3.0),
    ]  # fmt: skip
    (found,) = _next(HIGH, DATASET, ranking, None)
    assert found.candidate is ranking[0]
    assert found.tied == ("wear",)
    assert [r.effect.name for r in found.rivals] == ["wear", "end_stop"]


def test_the_other_frictions_are_rivals_of_a_friction_however_far_they_are():
    """A hysteresis that comes later may be what parted them."""
    far = [built("dahl", bic=40.0, gain=0.4), built("lugre", bic=3.0, t=0.0, gain=0.1)]
    far.append(built("wear", bic=500.0, gain=0.5))
    for best, names in (("gms", ["dahl"]), ("cogging", [])):
        (found,) = _next(HIGH, DATASET, [built(best, gain=5.0), *far], None)
        assert [r.effect.name for r in found.rivals] == names


@pytest.mark.parametrize(("base", "held"), [(LOW, False), (HIGH, True)])
def test_no_pair_is_sought_at_the_floor(monkeypatch, base, held):
    monkeypatch.setattr(module, "held_at_floor", lambda fit, dataset: held and dataset is DATASET)
    monkeypatch.setattr(module, "search_pairs", lambda *_: pytest.fail("sought"))
    assert _next(base, DATASET, [built(t=1.0)], None) == []
    assert _next(base, DATASET, [], None) == []


def test_no_pair_is_sought_where_nothing_foretells_what_is_left(monkeypatch):
    monkeypatch.setattr(module, "held_at_floor", lambda fit, dataset: False)
    monkeypatch.setattr(module, "is_unpredictable", lambda fit, dataset: dataset is DATASET)
    sought = []
    monkeypatch.setattr(module, "search_pairs", lambda *_: sought.append(1))
    for taken, bic in ((0.05, 90.0), (0.2, 9.0)):  # a small part, or without evidence
        left = (1.0 - taken) ** 0.5
        assert (
            _next(HIGH, DATASET, [built(bic=bic, t=1.0, before=2.0, after=2.0 * left)], None) == []
        )
    assert not sought
    foretold = built(bic=90.0, t=1.0, before=2.0, after=1.7)
    assert _next(HIGH, DATASET, [built(bic=9.0, t=1.0), foretold], None) == []
    assert sought


def test_a_pair_is_added_with_the_others_that_tie_with_it(monkeypatch):
    seconds = (built("cogging", gain=5.0), built("gms", gain=4.5), built("lugre", gain=3.0))

    def pair(first, second, bic):
        return Pair(built(first), built(second, gain=5.0), built(second, bic=bic), seconds)

    pairs = [pair("wear", "cogging", 90.0), pair("wear", "dahl", 80.0), pair("gms", "lugre", 70.0)]
    monkeypatch.setattr(module, "held_at_floor", lambda fit, dataset: False)
    monkeypatch.setattr(module, "is_unpredictable", lambda fit, dataset: False)
    monkeypatch.setattr(module, "search_pairs", lambda *_: pairs)
    monkeypatch.setattr(
        module, "tie", lambda s, a, b: a is pairs[0].together and b is pairs[1].together
    )
    alone = [built(e, gain=g, t=1.0) for e, g in (("wear", 2.0), ("dahl", 1.7), ("leuven", 1.0))]
    first, second = _next(HIGH, DATASET, alone, None)
    assert (first.candidate, first.tied, first.beside) == (pairs[0].first, ("dahl",), "cogging")
    assert (second.candidate, second.tied, second.beside) == (pairs[0].second, (), "wear")
    # Compared with these once both are there, as neither had evidence before.
    assert (first.rivals, second.rivals) == ((alone[1],), (seconds[1],))
    monkeypatch.setattr(module, "search_pairs", lambda *_: [])
    assert _next(HIGH, DATASET, [], None) == []


# --- the loop -------------------------------------------------------------------------------


def looped(monkeypatch, errors, *, moved=(), shifts=2):
    """diagnose_axis where each addition leads to the next error; the stages it decided on."""
    names = ["cogging", "wear", "end_stop", "lugre", "dahl", "gms", "leuven"]
    fits, seen, calls = [built_fit(e) for e in errors], {}, []
    moves = iter(moved)

    def following(base, dataset, found, ranked):
        done = len(calls)
        calls.append(base.error)
        return [step(names[done])] if done < len(fits) else []

    def back(base, fit, dataset, earlier):
        return fits[len(calls) - 1], tuple(c.effect.name for c in earlier)[:1]

    def decide(dataset, ranking, stages):
        seen.update(dataset=dataset, ranking=ranking, stages=stages)
        return SimpleNamespace(beside=lambda base, curve: (base, curve))

    monkeypatch.setattr(module, "rank", lambda base, dataset, **_: (base, (built("wear"),)))
    monkeypatch.setattr(module, "curve_in_place", lambda fit, dataset, ranking, given: None)
    monkeypatch.setattr(module, "_next", following)
    monkeypatch.setattr(module, "_eliminated_backwards", back)
    monkeypatch.setattr(module, "decided", decide)
    monkeypatch.setattr(module, "moved_by", lambda fit, dataset: next(moves, None))
    monkeypatch.setattr(module, "fit_axis", lambda axis, logs: built_fit(6.0, axis=axis))
    monkeypatch.setattr(module, "synchronised", lambda fit, dataset: (dataset, fit))
    monkeypatch.setattr(module, "with_own_noise", lambda fit, dataset: (dataset, fit))
    diagnose_axis(HIGH, DATASET, Catalogue([]), shifts=shifts)
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
    other = dataset_stub(fit=())
    seen, _ = looped(monkeypatch, [7.0, 6.0, 5.0], moved=[other, other, other])
    assert seen["dataset"] is other
    assert [s.fit.error for s in seen["stages"]] == pytest.approx([6.0, 5.0])
    seen, _ = looped(monkeypatch, [7.0, 6.0], moved=[other, other], shifts=0)
    assert seen["dataset"] is DATASET


def test_a_stage_knows_the_fit_it_led_to():
    assert SelectionState((), HIGH).fit is HIGH


def test_clocks_are_set_beside_a_curve_before_effects_are_ranked_there(monkeypatch):
    clocked, curves, ranked = dataset_stub(fit=()), iter(["a curve"]), []

    def rank(base, dataset, **_):
        ranked.append(dataset)
        return base, (built("wear"),)

    monkeypatch.setattr(module, "_needed_beside", lambda curves, steps, base, dataset: ([], HIGH))
    looped(monkeypatch, [])
    monkeypatch.setattr(module, "rank", rank)
    monkeypatch.setattr(module, "curve_in_place", lambda *_: next(curves, None))
    monkeypatch.setattr(module, "synchronised", lambda fit, dataset: (clocked, fit))
    diagnose_axis(HIGH, DATASET, Catalogue([]))
    assert [d is clocked for d in ranked] == [False, True]
