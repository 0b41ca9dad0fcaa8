"""One effect as a candidate: which are tried, how far, and on which windows they are scored."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import (
    CATALOGUE,
    NOISE,
    PLAIN,
    axis_of,
    built,
    built_dataset,
    built_fit,
    dataset_stub,
    fitted,
)

from identify.estimation import errors
from identify.estimation.evidence import Evidence, Gain, effective_samples, evidence
from identify.selection import scoring
from identify.selection.candidates import absent_effects
from identify.selection.scoring import RIDGE, _cross_validated, on_equal_samples, score
from twin.effect import Kind
from twin.model.machine import AxisModel

# The rules as they were decided.
LEAST_BIC, LEAST_T, PROMISE, SAME_ERROR, AT_FLOOR = 10.0, 3.0, 0.3, 1.01, 1.3
LEAST_PART = 0.4
RNG = np.random.default_rng(5)


# --- which effects, and what supports them --------------------------------------------------


@pytest.mark.parametrize(
    ("bic", "t", "after", "supported"),
    [
        (LEAST_BIC, 9.0, 2.0, False),
        (LEAST_BIC + 0.1, 9.0, 2.0, True),
        (90.0, LEAST_T, 2.0, False),
        (90.0, LEAST_T + 0.1, 2.0, True),
        (90.0, 9.0, 7.0, False),
        (90.0, 9.0, 7.1, False),
    ],
)
def test_evidence_and_held_out_logs_must_both_ask(bic, t, after, supported):
    assert built(bic=bic, t=t, before=7.0, after=after).supported is supported


def test_a_noise_need_not_lower_the_error_and_needs_its_evidence():
    assert built(NOISE, bic=90.0, t=9.0, before=7.0, after=7.0).supported
    assert not built(NOISE, bic=9.0, t=9.0, before=7.0, after=7.0).supported
    assert not built(NOISE, bic=90.0, t=2.0, before=7.0, after=7.0).supported


def test_absent_are_all_effects_but_those_there_and_descriptions():
    def offered(axis: AxisModel) -> set[str]:
        return {e.name for e in CATALOGUE.values() if axis.can_have(e)}

    with_cogging = axis_of(fitted("cogging"))
    names = {e.name for e in absent_effects(with_cogging, CATALOGUE)}
    described = {"empirical_map", "learned_residual", "free_curve"}
    there = {"cogging", "coulomb_viscous"}
    assert names == offered(with_cogging) - there - described | {"cogging_2"}
    bare = replace(PLAIN, effects=())
    modifiers = {e.name for e in CATALOGUE.values() if e.kind is Kind.MODIFIER}
    assert modifiers
    found = {e.name for e in absent_effects(bare, CATALOGUE)}
    assert found == offered(bare) - modifiers - described
    sliding = replace(PLAIN, effects=(fitted("cogging"),))
    assert {e.name for e in absent_effects(sliding, CATALOGUE)} == found - {"cogging"} | {
        "cogging_2"
    }
    assert modifiers <= {e.name for e in absent_effects(PLAIN, CATALOGUE)}


def test_candidates_are_levelled_to_the_samples_of_what_explains_most():
    made = [
        replace(built(n), evidence=Evidence(gain, 1, samples))
        for n, gain, samples in (("cogging", 1.0, 90.0), ("wear", 3.0, 50.0), ("gms", 2.0, 20.0))
    ]
    out = on_equal_samples(made)
    assert [c.evidence for c in out] == [
        Evidence(1.0, 1, 50.0), Evidence(3.0, 1, 50.0), Evidence(2.0, 1, 20.0),
    ]  # fmt: skip
    assert on_equal_samples([]) == []


# --- the score ------------------------------------------------------------------------------


@pytest.fixture
def quiet(monkeypatch):
    """No effect reads a clock."""
    monkeypatch.setattr(scoring, "phases_found", lambda axis, name, dataset: 0)


def test_only_windows_that_both_fits_can_use_are_compared(quiet):
    n = 400
    a, b = RNG.standard_normal(n), 0.5 * RNG.standard_normal(n)
    one, other = np.arange(n) % 3 != 0, np.arange(n) % 4 != 0
    base = built_fit(0, residual=a[one], kept=one)
    fit = built_fit(
        0, axis=axis_of(fitted("constant_force")), residual=b[other], kept=other,
        jacobian=np.ones((other.sum(), 1)),
    )  # fmt: skip
    base.__dict__["jacobian"] = np.ones((one.sum(), 1))
    found = score(base, fit, dataset_stub(), CATALOGUE["constant_force"])
    shared = one & other
    assert found.evidence == evidence(a[shared], b[shared], 1)
    assert (found.fit, found.axis, found.effect.name) == (fit, "x", "constant_force")


@pytest.mark.parametrize("name", ["constant_force", "axis_coupling", "backlash"])
def test_evidence_counts_the_parameters_that_the_fit_has_more(quiet, name):
    axis = PLAIN.with_effect(fitted(name))
    base, fit = built_fit(2.0), built_fit(1.9, axis=axis)
    free = len(fit.scaling.where) - len(base.scaling.where)
    effect = CATALOGUE[name]
    assert score(base, fit, dataset_stub(), effect).evidence.parameters == free
    assert score(fit, base, dataset_stub(), effect).evidence.parameters == 1


def test_phases_found_count_as_parameters(monkeypatch):
    monkeypatch.setattr(scoring, "phases_found", lambda axis, name, dataset: 3)
    fit = built_fit(1.9, axis=axis_of(fitted("constant_force")))
    found = score(built_fit(2.0), fit, dataset_stub(), CATALOGUE["constant_force"])
    assert found.evidence.parameters == 4


def test_a_motor_made_weak_is_no_smaller_error(quiet):
    axis = axis_of(fitted("actuator_deadband"))
    noise = RNG.standard_normal(300)
    weak = built_fit(0, axis=axis, residual=0.25 * noise, lessened=0.25)
    found = score(
        built_fit(0, residual=noise), weak, dataset_stub(), CATALOGUE["actuator_deadband"]
    )
    assert found.evidence.log_gain == pytest.approx(0.0, abs=1e-12)
    assert found.gain == Gain(found.gain.before, found.gain.before, 0.0)


def test_the_held_out_logs_judge_before_and_after_in_that_order(quiet):
    dataset = built_dataset("fit", held=("held",))
    base = built_fit(0.4, 0.02)
    richer = axis_of(fitted("constant_force", F0=2.0))
    fit = built_fit(0.1, 0.02, richer)
    found = score(base, fit, dataset, CATALOGUE["constant_force"])
    kept = errors.moving(dataset.holdout, True)
    before, after = (
        np.sqrt(np.mean(errors.residual(a, dataset.holdout)[kept] ** 2)) for a in (PLAIN, richer)
    )
    assert found.gain.before == pytest.approx(before)
    assert found.gain.after == pytest.approx(after)
    assert after > before
    assert not found.supported


def test_held_out_windows_at_rest_are_left_out_where_either_friction_sticks(quiet, monkeypatch):
    asked = []

    def moving(logs, either):
        asked.append(either)
        return slice(None)

    monkeypatch.setattr(errors, "moving", moving)
    monkeypatch.setattr(errors, "residual", lambda axis, logs: RNG.standard_normal(300))
    monkeypatch.setattr(errors, "forces_lessened", lambda axis, motions: 1.0)
    monkeypatch.setattr(scoring, "_beats_decoys", lambda *_: False)
    held = SimpleNamespace(motion=None)
    dataset, lugre = dataset_stub(holdout=(held,)), PLAIN.with_effect(fitted("lugre"))
    for one, two in ((PLAIN, lugre), (lugre, PLAIN), (lugre, lugre)):
        score(built_fit(2.0, axis=one), built_fit(1.0, axis=two), dataset, CATALOGUE["lugre"])
    assert asked == [True, True, False]


def test_blocks_are_left_out_only_where_evidence_asks(quiet, monkeypatch):
    noise = RNG.standard_normal(600)
    fit = built_fit(0, axis=axis_of(fitted("constant_force")), residual=noise)
    monkeypatch.setattr(scoring, "_cross_validated", lambda f, rows: 3.0 * f.residual[rows])
    effect = CATALOGUE["constant_force"]
    strong = score(built_fit(0, residual=2.0 * noise), fit, dataset_stub(), effect)
    size = np.sqrt(np.mean(noise**2))
    assert (strong.gain.before, strong.gain.after) == pytest.approx((6.0 * size, 3.0 * size))
    weak = score(built_fit(0, residual=1.001 * noise), fit, dataset_stub(), effect)
    assert weak.gain.after == pytest.approx(size)


def test_a_cross_validated_residual_is_that_of_a_fit_without_the_block():
    n, k = 240, 3
    columns, rows = RNG.standard_normal((n, k)), np.ones(n, dtype=bool)
    rows[::7] = False
    force = RNG.standard_normal(n)
    used, left = columns[rows], force[rows]
    # A fit's residual has no part left along its columns, up to a ridge.
    left = left - used @ np.linalg.lstsq(used, left, rcond=None)[0]
    force[rows] = left
    out = _cross_validated(built_fit(0, residual=force, jacobian=columns), rows)
    edges = np.linspace(0, len(left), 25).astype(int)
    ridge = np.diag((RIDGE * np.linalg.norm(used, axis=0)) ** 2)
    for a, b in pairwise(edges):
        others = np.r_[0:a, b : len(left)]
        normal = used[others].T @ used[others] + ridge
        move = np.linalg.solve(normal, -used[others].T @ left[others])
        np.testing.assert_allclose(out[a:b], left[a:b] + used[a:b] @ move, rtol=1e-6, atol=1e-9)


LESS, FLOOR = 1.0, 2.0  # N, without what the noise adds and with it
MOST = ((FLOOR**2 - LESS**2) / LEAST_PART) ** 0.5  # of an error that it makes a good part of


@pytest.mark.parametrize(
    ("seen", "told"),
    [
        (FLOOR, True),
        (0.99 * MOST, True),
        (1.01 * MOST, False),
        (1.01 * FLOOR / AT_FLOOR, True),
        (0.99 * FLOOR / AT_FLOOR, False),
    ],
)
def test_a_noise_is_told_where_it_makes_a_good_part_of_the_error(monkeypatch, seen, told):
    """On all logs that choose together, and where the error is not less than the noise."""
    noise = RNG.standard_normal(500)
    noise /= np.sqrt(np.mean(noise**2))
    asked = []

    def of(floor):
        return lambda axis, logs: asked.append(logs) or floor

    monkeypatch.setattr(scoring, "error_on", lambda axis, logs: seen * noise)
    monkeypatch.setattr(scoring, "floor_of", of(FLOOR))
    monkeypatch.setattr(scoring, "unrounded_floor_of", of(LESS))
    dataset = dataset_stub(holdout=("held",), fit=("fit",))
    found = score(built_fit(1.6, 1.0), built_fit(0, 1.0, axis_of(), residual=noise), dataset, NOISE)
    assert set(asked) == {("fit", "held")}
    assert (found.evidence.log_gain != 0.0) is told
    assert found.gain.before == found.gain.after == pytest.approx(seen)
    assert found.evidence.samples == effective_samples(noise)
    gain = seen**2 / LESS**2 - seen**2 / FLOOR**2 - 2.0 * np.log(FLOOR / LESS) if told else 0.0
    assert found.evidence.log_gain == pytest.approx(gain)
    assert found.gain.t == pytest.approx(max(found.evidence.samples * gain, 0.0) ** 0.5)


@pytest.mark.parametrize(("mass", "kept"), [(2.9, True), (3.1, False), (0.34, True), (0.32, False)])
def test_an_effect_that_takes_the_place_of_the_inertia_is_not_plausible(mass, kept):
    axis = replace(axis_of(), mass=1.5)
    after = built_fit(1.0, axis=replace(axis_of(), mass=1.5 * mass))
    assert scoring._keeps_inertia(built_fit(8.0, axis=axis), after) is kept
    # Without a saturation that is there, a fit may have found twenty times the mass it began with.
    lost = built_fit(8.0, axis=replace(axis, mass=30.0), begun=axis)
    assert scoring._keeps_inertia(lost, after) is kept
