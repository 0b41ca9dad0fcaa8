"""Each rule of a verdict's evidence on both sides of its threshold, on fits as given."""

from __future__ import annotations

import importlib
from dataclasses import replace

import numpy as np
import pytest
from built_fits import NOISE, PLAIN, built, built_fit, dataset_stub, stage, step
from identify.selection.forward_selection import _friction_instead, _near
from identify.selection.ranking import part_explained
from identify.selection.verdict import _convincing, _gone

module = importlib.import_module("identify.selection.verdict")
# The rules as they were decided.
BEYOND_DOUBT, FLOOR_SURE, MOST_STEPS = 100.0, (0.85, 1.15), 5
DATASET = dataset_stub()
HIGH, LOW = built_fit(8.0), built_fit(1.1)  # over a floor of 1 N


def fit_with_part(part: float, base_error: float = 5.0, base_floor: float = 3.0):
    """A fit that leaves all but that part of what stood above the floor of (5, 3)."""
    floor = 0.7
    excess = base_error**2 - base_floor**2
    return built_fit(np.sqrt(floor**2 + (1.0 - part) * excess), floor)


# --- evidence -------------------------------------------------------------------------------


@pytest.mark.parametrize("part", [-0.5, 0.0, 0.3, 0.95, 1.0])
def test_the_part_explained_is_counted_above_the_floor_of_each_fit(part):
    assert part_explained(built_fit(5.0, 3.0), fit_with_part(part)) == pytest.approx(
        part, abs=1e-12
    )


def test_no_part_is_explained_of_an_error_within_its_floor():
    assert part_explained(built_fit(2.0, 2.0), built_fit(0.5, 0.4)) == 0.0
    assert part_explained(built_fit(1.0, 2.0), built_fit(0.5, 0.4)) == 0.0


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
    assert built(bic=bic, t=t).is_added_to(base) is asked


def test_a_rival_gains_more_than_four_fifths_of_the_best():
    best, near = built("wear", gain=5.0), built(gain=4.01)
    others = [built(gain=4.0), built(gain=3.9), built(NOISE, gain=4.5)]
    assert _near(best, [best, near, *others]) == (near,)
    assert _near(near, [best, near]) == (best,)  # the larger is always near


def test_dead_times_are_near_whatever_they_gain():
    """One of them may smooth the noise of the reading, and so gain more."""
    late = [built(e, gain=g) for e, g in (("encoder_delay", 5.0), ("actuator_delay", 1.0))]
    assert _near(late[0], [*late, built("actuator_lag", gain=3.9)]) == (late[1],)
    assert _near(built("wear", gain=5.0), late) == (late[0],)


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
    assert _friction_instead(base, best, ranking) == (ranking[4],)
    assert _friction_instead(base, best, ranking[:4]) == ()
    kept = built("cable_hysteresis", fit=built_fit(1.0, axis=PLAIN))
    assert _friction_instead(base, kept, ranking) == ()


# --- what a step convinces of ---------------------------------------------------------------


def told(monkeypatch, *, held=False, explains=False):
    """The two rules that read logs, as given; the pairs of fits they were asked about."""
    asked = []

    def explained(before, after, dataset):
        asked.append((before, after))
        return explains

    monkeypatch.setattr(module, "held_at_floor", lambda fit, dataset: held and dataset is DATASET)
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
    assert _convincing(stage(base), stage(after, ONE), DATASET) is convinced


@pytest.mark.parametrize(
    ("effect", "evidence", "before", "convinced"),
    [
        ("cogging", 99.0, 1.29, False),
        ("cogging", 101.0, 1.29, True),
        ("cogging", 99.0, 1.31, True),
        (NOISE.name, 11.0, 1.29, True),
    ],
)
def test_where_noise_is_all_that_was_left_an_effect_needs_far_more_evidence(
    monkeypatch, effect, evidence, before, convinced
):
    """It was added before what is left of all was told as noise of the drive."""
    told(monkeypatch)
    added = step(effect, bic=evidence)
    assert _convincing(stage(built_fit(before)), stage(built_fit(1.0), added), DATASET) is convinced


def test_only_the_first_effect_that_was_added_must_be_proven(monkeypatch):
    asked = told(monkeypatch, explains=True)
    after = fit_with_part(0.6)
    weak, strong = step("cogging", bic=50.0), step("wear", bic=50.1)
    assert _gone(BASE, after, [strong, weak], DATASET)
    assert asked == [(BASE, after)]
    assert not _gone(BASE, after, [weak, strong], DATASET)
    earlier = stage(BASE, weak)
    assert _convincing(earlier, stage(after, weak, strong), DATASET)
    assert not _convincing(stage(BASE), stage(after, weak, strong), DATASET)
