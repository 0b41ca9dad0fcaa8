"""Two effects at once: each needs the other, and together they leave noise."""

from __future__ import annotations

import numpy as np
from built_fits import (
    axis_of,
    built,
    built_fit,
    dataset_stub,
    fitted,
)
from identify.selection.pair_search import held_at_floor, search_pairs

from identify.selection import pair_search as lookahead

# The rules as they were decided.
AT_FLOOR, COLLAPSE, SETTLED, FIRSTS, LEAST_PART = 1.3, 0.3, 0.999, 3, 0.1
DATASET = dataset_stub()
NAMES = ("cogging", "end_stop", "gms", "quadratic_drag", "wear")


def names(found) -> list[str]:
    return [c.effect.name for c in found]


# --- two at once ----------------------------------------------------------------------------


def test_held_out_logs_are_explained_where_their_error_is_at_the_floor(monkeypatch):
    fit = built_fit(9.0, 3.0)  # the floor of the held-out logs counts, not of those fitted
    dataset = dataset_stub(holdout=("log",))
    for error, held in ((2.0 * AT_FLOOR - 0.01, True), (2.0 * AT_FLOOR + 0.01, False)):

        def error_on(axis, logs, e=error):
            assert (axis, logs) == (fit.axis, ("log",))
            return e * np.array([1.0, -1.0])

        monkeypatch.setattr(lookahead, "error_on", error_on)
        monkeypatch.setattr(lookahead, "floor_of", lambda axis, logs: {("log",): 2.0}[logs])
        assert held_at_floor(fit, dataset) is held
        assert not held_at_floor(fit, dataset_stub())


def ahead(monkeypatch, made, seconds, *, base=None, needed=True, together=True, held=False):
    """search_pairs where beside each first the ranking holds those seconds."""
    base = base or built_fit(4.0)
    beside, calls, last = {}, [], None

    def ranked(fit, dataset):
        nonlocal last
        name = fit.axis.names[-1]
        last = next((c.fit.axis.names[-1] for c in seconds.get(name, ())), None)
        beside[name] = built_fit(3.9, axis=fit.axis)
        return beside[name], tuple(seconds.get(name, ()))

    def score(smaller, fit, dataset, effect):
        assert smaller is base or smaller.axis == fit.axis.without(effect.name)
        assert (dataset, fit.axis.names[-1]) == (DATASET, last)
        calls.append((smaller is base, effect.name))
        good = together if smaller is base else needed
        return built(effect, bic=fit.error * 100, t=9.0 if good else 1.0, fit=fit)

    def less_of(effect, fit, base_, dataset):
        assert base_ is base
        return built_fit(3.0, axis=fit.axis.without(effect.name))

    monkeypatch.setattr(lookahead, "score", score)
    monkeypatch.setattr(lookahead, "less", less_of)

    def at_floor(fit, dataset):
        assert (dataset, fit.axis.names[-1]) == (DATASET, last)
        return held

    monkeypatch.setattr(lookahead, "held_at_floor", at_floor)
    return search_pairs(base, DATASET, made, ranked), beside, calls


def second(name, first, error=1.1, t=9.0):
    axis = axis_of(fitted(first), fitted(name))
    return built(name, t=t, fit=built_fit(error, axis=axis))


def first(name, error=3.0, gain=1.0):
    return built(name, gain=gain, t=1.0, fit=built_fit(error, axis=axis_of(fitted(name))))


def test_a_pair_brings_the_error_to_the_floor_and_needs_both(monkeypatch):
    made = [first("cogging")]
    seconds = {"cogging": [second("wear", "cogging")]}
    (pair,), beside, calls = ahead(monkeypatch, made, seconds)
    assert pair.names == {"cogging", "wear"}
    assert pair.first.effect.name == "cogging"
    assert pair.first.fit is beside["cogging"]
    assert pair.second is seconds["cogging"][0]
    assert pair.together.fit is pair.second.fit
    assert calls == [(True, "wear"), (False, "cogging")]
    for refused in ({"needed": False}, {"together": False}):
        assert ahead(monkeypatch, made, seconds, **refused)[0] == []
    above = {"cogging": [second("wear", "cogging", error=1.4)]}
    assert ahead(monkeypatch, made, above)[0] == []
    assert len(ahead(monkeypatch, made, above, held=True)[0]) == 1
    weak = {"cogging": [second("wear", "cogging", t=1.0)]}
    assert ahead(monkeypatch, made, weak)[0] == []
    assert ahead(monkeypatch, made, {})[0] == []


def test_a_friction_that_takes_the_place_of_another_makes_no_pair_with_it(monkeypatch):
    alone, other = (
        built(name, t=9.0, fit=built_fit(error, axis=axis_of().with_effect(fitted(name))))
        for name, error in (("dahl", 3.0), ("gms", 1.1))
    )
    assert ahead(monkeypatch, [alone], {"dahl": [other]})[0] == []


def test_a_pair_far_above_the_floor_must_explain_nearly_all(monkeypatch):
    """What stood above a floor of 1 N beside noise that no model foretells."""
    base = built_fit(40.0)
    for part, found in ((0.951, 1), (0.949, 0)):
        left = np.sqrt(1.0 + (1.0 - part) * (40.0**2 - 1.0))
        seconds = {"cogging": [second("wear", "cogging", error=left)]}
        pairs = ahead(monkeypatch, [first("cogging", 30.0)], seconds, base=base)[0]
        assert len(pairs) == found


def test_a_first_explains_a_part_alone(monkeypatch):
    seconds = {"cogging": [second("wear", "cogging")]}
    edge = 4.0 * np.sqrt(1.0 - LEAST_PART)
    assert len(ahead(monkeypatch, [first("cogging", edge - 0.01)], seconds)[0]) == 1
    assert ahead(monkeypatch, [first("cogging", edge + 0.01)], seconds)[0] == []


def test_pairs_begin_with_the_candidates_that_explain_most_and_come_once(monkeypatch):
    gains = {"cogging": 1.0, "end_stop": 4.0, "gms": 3.0, "quadratic_drag": 2.0}
    others = {"cogging": "wear", "end_stop": "gms", "quadratic_drag": "wear"}
    errors = {"end_stop": 1.1, "quadratic_drag": 1.2}
    made = [first(n, gain=g) for n, g in gains.items() if n != "gms"]
    friction_first = built("gms", gain=3.0, fit=built_fit(3.0, axis=axis_of(fitted("wear"))))
    made.append(friction_first)
    seconds = {n: [second(o, n, errors.get(n, 1.0))] for n, o in others.items() if o != "gms"}
    both = axis_of(fitted("end_stop")).with_effect(fitted("gms"))
    seconds["end_stop"] = [built("gms", fit=built_fit(1.1, axis=both))]
    swapped = axis_of(fitted("end_stop")).with_effect(fitted("gms"))
    seconds["wear"] = [built("end_stop", fit=built_fit(1.0, axis=swapped))]
    pairs, beside, _ = ahead(monkeypatch, made, seconds)
    assert len(beside) == FIRSTS
    assert [p.names for p in pairs] == [{"quadratic_drag", "wear"}, {"end_stop", "gms"}]
