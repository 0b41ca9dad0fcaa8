"""The order of candidates, and ties between them."""

from __future__ import annotations

import time
from dataclasses import replace
from threading import Barrier

import numpy as np
import pytest
from built_fits import (
    CATALOGUE,
    NOISE,
    PLAIN,
    axis_of,
    built,
    built_fit,
    dataset_stub,
    fitted,
)
from identify.selection.ranking import _ranked, less, rank, tie

from identify.estimation.evidence import Evidence, effective_samples, held_out_gain
from identify.selection import ranking
from identify.selection.candidates import Look
from twin.effects import Catalogue
from twin.parallel import parallel

# The rules as they were decided.
AT_FLOOR, SETTLED, FIRSTS, LEAST_PART = 1.3, 0.999, 3, 0.1
CONTENDER = 0.1
DATASET = dataset_stub()
NAMES = ("cogging", "end_stop", "gms", "quadratic_drag", "wear")


def names(found) -> list[str]:
    return [c.effect.name for c in found]


# --- order ----------------------------------------------------------------------------------


def test_candidates_come_by_falling_evidence_supported_first():
    made = [built(n, bic=b, t=t) for n, b, t in zip(NAMES, (90, 300, 900, 40, 700),
                                                    (9, 9, 1, 9, 1), strict=True)]  # fmt: skip
    expected = ["end_stop", "cogging", "quadratic_drag", "gms", "wear"]
    for seed in range(5):
        order = np.random.default_rng(seed).permutation(len(made))
        assert names(_ranked([made[i] for i in order])) == expected


@pytest.mark.parametrize(("behind", "level"), [(1.9, True), (2.1, False)])
def test_within_no_evidence_of_the_best_the_catalogue_decides(behind, level):
    made = [built("wear", bic=90.0), built("cogging", bic=90.0 - behind), built("gms", bic=50.0)]
    first = ["cogging", "wear"] if level else ["wear", "cogging"]
    assert names(_ranked(made)) == [*first, "gms"]
    unsupported = [replace(c, gain=replace(c.gain, t=0.0)) for c in made]
    assert names(_ranked(unsupported)) == ["wear", "cogging", "gms"]
    mixed = [made[0], unsupported[1], made[2]]
    assert names(_ranked(mixed)) == ["wear", "gms", "cogging"]


@pytest.mark.parametrize(
    ("ratio", "left", "floor", "first"),
    [
        (0.93, 0.84, 0.5, True),  # an effect that lowers what the model makes of the noise
        (0.84, 0.84, 0.5, False),
        (1.16, 0.84, 0.5, False),
        (0.93, 0.86, 0.5, False),  # one behind the noise, which it leaves
        (0.93, 0.64, 0.5, False),  # one after which noise of its own is left
    ],
)
def test_a_noise_as_large_as_the_error_comes_first_where_effects_only_lower_it(
    ratio, left, floor, first
):
    noise = built(NOISE, bic=900.0, fit=built_fit(ratio))
    lowers = built("wear", bic=3000.0, fit=built_fit(left, floor))
    found = names(_ranked([lowers, noise]))
    assert found == ([NOISE.name, "wear"] if first else ["wear", NOISE.name])


@pytest.mark.parametrize(
    ("present", "other", "first"),
    [
        ("lugre", "stribeck", NOISE.name),  # which sees nothing of what the other makes at creep
        ("lugre", "dahl", "dahl"),
        ("coulomb_viscous", "stribeck", "stribeck"),
    ],
)
def test_a_friction_without_memory_does_not_come_before_the_noise_in_ones_with_it(
    present, other, first
):
    rubs = replace(axis_of(), effects=(fitted(present),))
    noise = built(NOISE, bic=900.0, fit=built_fit(0.93, axis=rubs))
    left = built_fit(0.5, 0.49, axis=replace(rubs, effects=(fitted(other),)))
    assert names(_ranked([built(other, bic=3000.0, fit=left), noise]))[0] == first


def test_a_noise_comes_after_what_lowers_the_error_if_both_are_supported():
    noise, weak = built(NOISE, bic=900.0), built("wear", bic=20.0)
    assert names(_ranked([noise, weak])) == ["wear", NOISE.name]
    assert names(_ranked([weak, noise])) == ["wear", NOISE.name]
    unsupported = built("wear", bic=20.0, t=1.0)
    assert names(_ranked([unsupported, noise])) == [NOISE.name, "wear"]


def ranked(monkeypatch, ratio, t=9.0, left=3.0):
    """rank among two effects, where a refit of the base gives that ratio of its error.

    left: N, error of the model with either effect, of 4 N.
    """
    base, again = built_fit(4.0), built_fit(4.0 * ratio)
    bics = {"cogging": 40.0, "wear": 90.0}
    asked, bars = [], []

    def less_of(effect, fit, base, dataset):
        asked.append((effect.name, fit))
        return again

    def look_at(given, dataset, effect):
        assert (given, dataset) == (base, DATASET)
        fit = built_fit(left, axis=axis_of(fitted(effect.name)))
        return Look(effect, (), 0.0, built(effect, bic=bics[effect.name], t=t, fit=fit))

    monkeypatch.setattr(ranking, "look_at", look_at)
    monkeypatch.setattr(ranking, "less", less_of)

    def score(given, fit, dataset, effect):
        assert (dataset, fit.axis.names[-1]) == (DATASET, effect.name)
        return built(effect, bic=1e3 * given.error, fit=fit)

    monkeypatch.setattr(ranking, "score", score)
    catalogue = Catalogue([CATALOGUE[n] for n in bics])
    found = rank(base, DATASET, catalogue, lambda *done: bars.append(done))
    assert bars == [(1, 2), (2, 2)]
    return found, base, again, asked


def test_candidates_that_are_tried_side_by_side_are_told_one_at_a_time(monkeypatch):
    both, within, told = Barrier(2), [], []

    def look_at(base, dataset, effect):
        both.wait(timeout=10.0)
        return Look(effect, (), 0.0, built(effect, t=1.0))

    def tell(*at):
        within.append(at)
        time.sleep(0.02)
        told.append((at, len(within)))
        within.pop()

    monkeypatch.setattr(ranking, "look_at", look_at)
    catalogue = Catalogue([CATALOGUE[n] for n in ("cogging", "wear")])
    with parallel(2):
        rank(built_fit(4.0), DATASET, catalogue, tell)
    assert told == [((1, 2), 1), ((2, 2), 1)]


def refits(monkeypatch, shares, explained, t=9.0):
    """Names of the effects that are refitted, and of those that stay as they were looked at.

    shares: what a linear step of each promises, None for a friction. explained: what each explains.
    """
    base, fitted_again, looked = built_fit(1.0), [], []
    order = iter(shares.items())

    def look_at(given, dataset, effect):
        name, share = next(order)
        assert effect.name == name
        return Look(effect, (), share, None)

    def refitted(given, dataset, look):
        fitted_again.append(look.effect.name)
        fit = built_fit(np.sqrt(1.0 - explained[look.effect.name]))
        return built(look.effect, t=t, fit=fit)

    def as_looked(given, dataset, look):
        looked.append(look.effect.name)
        return built(look.effect, t=0.0, fit=built_fit(0.99))

    monkeypatch.setattr(ranking, "look_at", look_at)
    monkeypatch.setattr(ranking, "refitted", refitted)
    monkeypatch.setattr(ranking, "as_looked", as_looked)
    monkeypatch.setattr(ranking, "less", lambda *_: base)
    catalogue = Catalogue([CATALOGUE[n] for n in shares])
    shares = {e.name: shares[e.name] for e in catalogue.values()}
    order = iter(shares.items())
    _, found = rank(base, DATASET, catalogue)
    assert sorted(names(found)) == sorted(shares)
    return fitted_again, looked


def test_only_what_promises_a_part_of_the_best_is_refitted(monkeypatch):
    low, high = CONTENDER * 0.8 - 0.001, CONTENDER * 0.8 + 0.001
    shares = {"cogging": 0.8, "end_stop": 0.5, "quadratic_drag": low, "wear": high}
    explained = {"cogging": 0.8, "end_stop": 0.3, "quadratic_drag": 0.9, "wear": 0.1}
    assert refits(monkeypatch, shares, explained) == (
        ["cogging", "end_stop", "wear"], ["quadratic_drag"],
    )  # fmt: skip
    # what a leader explains counts, not what it promised; and where it has no support nothing does
    explained["cogging"] = 0.9
    assert refits(monkeypatch, shares, explained)[1] == ["quadratic_drag", "wear"]
    assert refits(monkeypatch, shares, explained, t=1.0)[1] == []
    # a second leader must be near the first; a friction promises all
    one = {"cogging": 0.8, "end_stop": 0.01, "gms": None}
    assert refits(monkeypatch, one, {"cogging": 0.8, "gms": 0.1})[0] == ["gms", "cogging"]
    assert refits(monkeypatch, {"cogging": 0.8, "end_stop": 0.01}, {"cogging": 0.8}) == (
        ["cogging"], ["end_stop"],
    )  # fmt: skip


@pytest.mark.parametrize(("part", "again"), [(0.949, True), (0.951, False)])
def test_beside_an_effect_that_explains_nearly_all_the_base_is_not_refitted(
    monkeypatch, part, again
):
    _, _, _, asked = ranked(monkeypatch, 0.5, left=4.0 * np.sqrt(1.0 - part))
    assert bool(asked) is again


@pytest.mark.parametrize(("ratio", "settled"), [(SETTLED + 1e-4, True), (SETTLED - 1e-4, False)])
def test_a_base_short_of_its_optimum_is_exchanged_and_all_scored_anew(monkeypatch, ratio, settled):
    (base, found), old, again, asked = ranked(monkeypatch, ratio)
    assert base is (old if settled else again)
    assert [name for name, _ in asked] == ["wear"]
    expected = [90.0, 40.0] if settled else [1e3 * again.error] * 2
    assert [c.delta_bic for c in found] == pytest.approx(expected)


def test_without_support_the_base_stays(monkeypatch):
    (base, found), old, _, asked = ranked(monkeypatch, 0.5, t=1.0)
    assert (base, asked) == (old, [])
    assert names(found) == ["wear", "cogging"]


def test_less_an_effect_the_friction_that_it_replaced_is_back(monkeypatch):
    monkeypatch.setattr(
        ranking, "fit_axis", lambda axis, logs: built_fit(2.0, axis=axis, logs=logs)
    )
    dataset = dataset_stub(fit=("log",))
    rich = built_fit(1.0, axis=axis_of(fitted("cogging")).with_effect(fitted("lugre")))
    base = built_fit(1.0, begun=replace(PLAIN, mass=7.7))
    found = less(CATALOGUE["lugre"], rich, base, dataset)
    assert found.axis.names == ("cogging", "coulomb_viscous")
    assert found.axis["coulomb_viscous"] is PLAIN["coulomb_viscous"]
    assert found.logs == ("log",)
    assert found.begun is base.begun
    bare = built_fit(1.0, axis=replace(PLAIN, effects=()))
    assert less(CATALOGUE["lugre"], rich, bare, dataset).axis.names == ("cogging",)
    assert less(CATALOGUE["cogging"], rich, base, dataset).axis.names == ("lugre",)


# --- ties -----------------------------------------------------------------------------------


NOISY = 1e-3 * np.random.default_rng(7).standard_normal(3000)


SAMPLES = effective_samples(NOISY)


def tied(monkeypatch, best_scale, other_scale, gains=(1.0, 1.0), logs=("held out",), **parts):
    best = built("cogging", fit=built_fit(1.0, 1e-3, axis_of(mass=1.0)))
    other = built("wear", fit=built_fit(1.0, 1e-3, axis_of(mass=2.0)))
    best, other = (
        replace(c, evidence=Evidence(g, 1, 1000.0))
        for c, g in zip((best, other), gains, strict=True)
    )
    scales, seen = {1.0: best_scale, 2.0: other_scale}, []

    def residual(axis, given):
        seen.append(given)
        return scales[axis.mass] * NOISY

    monkeypatch.setattr(ranking, "residual", residual)
    monkeypatch.setattr(ranking, "moving", lambda given, either: np.ones(len(NOISY), dtype=bool))
    dataset = dataset_stub(holdout=logs, fit=("fit",))
    return tie(dataset, best, other), seen


def test_a_tie_ends_where_the_best_gains_more_than_next_to_nothing(monkeypatch):
    t = held_out_gain(1.003 * NOISY, NOISY, 1e-3).t
    assert tied(monkeypatch, 1.0, np.exp(0.5 * 1.9 / SAMPLES))[0] is True
    assert tied(monkeypatch, 1.0, np.exp(0.5 * 2.1 / SAMPLES))[0] is False
    assert t > 10.0  # in every block
    assert tied(monkeypatch, 1.0, 1.0003)[0] is True
    assert tied(monkeypatch, 1.0, 1.003)[0] is False
    assert tied(monkeypatch, 1.003, 1.0)[0] is True  # the other is better: no reason to part


@pytest.mark.parametrize(
    ("t", "bic", "alike"), [(1.9, 50.0, True), (2.1, 50.0, False), (2.1, 2.1, False),
                            (2.1, 1.9, True), (9.0, 1.9, True), (-9.0, 50.0, True)],
)  # fmt: skip
def test_a_tie_is_parted_by_t_above_two_and_evidence_above_two(monkeypatch, t, bic, alike):
    found = type("Found", (), {"t": t, "delta_bic": bic})
    monkeypatch.setattr(ranking, "held_out_gain", lambda other, best, floor: found)
    monkeypatch.setattr(ranking, "evidence", lambda other, best, parameters: found)
    assert tied(monkeypatch, 1.0, 1.0)[0] is alike


def test_evidence_on_the_fit_logs_parts_no_two_candidates(monkeypatch):
    assert tied(monkeypatch, 1.0, 1.0, (9.0, 1.0))[0] is True
    assert tied(monkeypatch, 1.0, 1.1, (1.0, 9.0))[0] is False


def test_no_log_tells_which_of_force_and_reading_is_late(monkeypatch):
    monkeypatch.setattr(ranking, "residual", lambda *_: pytest.fail("compared"))
    late = [built(e) for e in CATALOGUE.values() if e.dead_time]
    assert len(late) > 1
    assert all(tie(DATASET, one, other) for one in late for other in late if one is not other)


def test_a_tie_is_judged_on_the_held_out_logs_where_there_are_any(monkeypatch):
    assert tied(monkeypatch, 1.0, 1.0)[1] == [("held out",)] * 2
    assert tied(monkeypatch, 1.0, 1.0, logs=())[1] == [("fit",)] * 2


def test_windows_at_rest_are_left_out_where_either_sticks(monkeypatch):
    asked = []
    monkeypatch.setattr(ranking, "residual", lambda axis, logs: NOISY)

    def moving(logs, either):
        asked.append(either)
        return np.ones(len(NOISY), dtype=bool)

    monkeypatch.setattr(ranking, "moving", moving)
    sliding = axis_of().with_effect(fitted("lugre"))
    pairs = [(PLAIN, sliding), (sliding, PLAIN), (sliding, sliding)]
    for one, two in pairs:
        made = [built("wear", fit=built_fit(1.0, axis=axis)) for axis in (one, two)]
        tie(dataset_stub(holdout=(1,)), *made)
    assert asked == [True, True, False]


def test_what_only_makes_noise_ties_with_nothing(monkeypatch):
    monkeypatch.setattr(ranking, "residual", lambda *_: pytest.fail("compared"))
    assert not tie(DATASET, built(NOISE), built("wear"))
    assert not tie(DATASET, built("wear"), built(NOISE))
