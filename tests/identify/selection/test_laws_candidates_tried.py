"""How far an effect is tried before it is scored: on both sides of what each look asks."""

from __future__ import annotations

from dataclasses import replace
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

from identify.estimation.evidence import effective_samples
from identify.estimation.fit import Outcome
from identify.estimation.variable_projection import Start
from identify.selection import candidates
from identify.selection.candidates import _fitted_to_heads, _promising, simplified, try_effect

# The rules as they were decided.
FIRST_EVALUATIONS = 12
LEAST_BIC, LEAST_T, PROMISE, SAME_ERROR, AT_FLOOR = 10.0, 3.0, 0.3, 1.01, 1.3
RNG = np.random.default_rng(5)


def of_size(squared, at):
    """A start that leaves one test function of that squared error, N^2."""
    left = np.array([np.sqrt(squared)])
    return Start({}, at, left, left)


# --- how far an effect is tried -------------------------------------------------------------


def test_a_first_look_must_show_a_part_of_the_evidence_asked_for():
    noise = RNG.standard_normal(500)
    base = built_fit(0, residual=noise, jacobian=np.zeros((500, 1)))
    n, before = effective_samples(noise), float(np.sum(noise**2))
    for effect, free in (("constant_force", 1), ("cogging", 7)):
        wanted = PROMISE * (LEAST_BIC + free * np.log(n))
        for gain, promising in ((0.99 * wanted, False), (1.01 * wanted, True)):
            left = before * np.exp(-gain / n)
            assert _promising(base, of_size(left, fitted(effect))) is promising
    held = replace(fitted("cogging"), fixed=frozenset({"p", "a1", "b1", "a2", "b2", "a3"}))
    one = PROMISE * (LEAST_BIC + np.log(n))
    assert _promising(base, of_size(before * np.exp(-1.01 * one / n), held))
    nothing = built_fit(0.0, jacobian=np.zeros((16, 1)))
    assert not _promising(nothing, of_size(0.0, fitted("cogging")))


def test_what_the_base_could_take_by_itself_promises_nothing_for_an_effect():
    """Priors and smoothing keep a fit from taking all that its parameters could."""
    noise, column = RNG.standard_normal(500), np.full((500, 1), 2.0)
    base = built_fit(0, residual=noise + 0.4, jacobian=column)
    left = noise - noise.mean()
    np.testing.assert_allclose(base.unabsorbed, left, atol=1e-9)
    useless = Start({}, fitted("constant_force"), left, left)
    assert useless.share(base) == pytest.approx(0.0, abs=1e-9)
    assert not _promising(base, useless)


@pytest.mark.parametrize(("error", "simpler"), [(0.99, True), (1.01, False)])
def test_simpler_values_may_cost_a_hundredth(monkeypatch, error, simpler):
    multiple = fitted("cogging", p=0.06, a2=0.5)
    fit = built_fit(2.0, axis=axis_of(multiple))
    again = {}

    def refit(axis, logs):
        again.update(axis["cogging"].values)
        return built_fit(2.0 * (1.0 + (SAME_ERROR - 1.0) * error), axis=axis)

    monkeypatch.setattr(candidates, "fit_axis", refit)
    found = simplified(fit, dataset_stub(), CATALOGUE["cogging"])
    assert (again["p"], again["a1"]) == (0.03, 0.5)
    assert (found is not fit) is simpler
    plain = built_fit(2.0, axis=axis_of(fitted("cogging", p=0.06, a1=0.5)))
    assert simplified(plain, dataset_stub(), CATALOGUE["cogging"]) is plain
    other = built_fit(2.0, axis=axis_of(fitted("wear")))
    assert simplified(other, dataset_stub(), CATALOGUE["wear"]) is other


def tried(
    monkeypatch, effect, *, promising=True, looked=None, errors=(0.5, 0.4, 0.3), bic=90.0,
    unfinished=False,
):  # fmt: skip
    """try_effect with every part given; the axis each fit began from, and what was scored."""
    begun, left = [], list(errors)
    starts = [of_size(float(i), fitted(effect)) for i in (1, 2)]
    other = axis_of(mass=9.9)
    base = built_fit(2.0, 0.1, begun=other, jacobian=np.zeros((16, 1)))
    dataset = dataset_stub()

    def given(fit):
        """A part that is asked about this base, dataset and start, in that order."""

        def part(*asked):
            assert asked == (base, dataset, tuple(starts))
            return fit, starts[0]

        return part

    def simplest(fit, where, what):
        assert (where, what) == (dataset, CATALOGUE[effect])
        return fit

    def promises(asked, start):
        assert (asked, start) == (base, starts[0])
        return promising

    def begin(*asked):
        assert asked == (base, dataset, CATALOGUE[effect])
        return starts

    def scored(asked, fit, where, what):
        assert (asked, where, what) == (base, dataset, CATALOGUE[effect])
        return built(what, bic=bic, fit=fit)

    def stepped(*asked):
        assert asked == (base, starts[0])
        return built_fit(1.7, 0.1)

    def fit_axis(axis, logs, most=None):
        begun.append((axis.mass, axis[effect] is starts[1].fitted, most))
        converged = Outcome.NOT_CONVERGED if most and unfinished else Outcome.CONVERGED
        return built_fit(left.pop(0), 0.1, axis, outcome=converged)

    monkeypatch.setattr(candidates, "starts", begin)
    monkeypatch.setattr(candidates, "fit_axis", fit_axis)
    monkeypatch.setattr(candidates, "fit_thoroughly", lambda axis, s: built_fit(0.2, 0.1, axis))
    monkeypatch.setattr(candidates, "simplified", simplest)
    monkeypatch.setattr(candidates, "_promising", promises)
    monkeypatch.setattr(candidates, "one_linear_step", stepped)
    monkeypatch.setattr(candidates, "_fitted_to_heads", given(looked))
    monkeypatch.setattr(candidates, "score", scored)
    return try_effect(base, dataset, CATALOGUE[effect]).fit.error, begun


def test_an_effect_is_tried_as_far_as_it_promises(monkeypatch):
    assert tried(monkeypatch, "cogging", promising=False) == (pytest.approx(1.7), [])
    looked = built_fit(1.5, 0.1)
    assert tried(monkeypatch, "lugre", looked=looked) == (pytest.approx(1.5), [])
    first = [(5.3, False, FIRST_EVALUATIONS)]
    assert tried(monkeypatch, "cogging", errors=[0.12]) == (pytest.approx(0.12), first)
    assert tried(monkeypatch, "cogging", bic=9.0) == (pytest.approx(0.5), first)
    every = [*first, (9.9, False, None), (5.3, True, None)]
    assert tried(monkeypatch, "cogging") == (pytest.approx(0.2), every)
    assert tried(monkeypatch, "lugre", promising=False) == (pytest.approx(0.2), every)
    floor = tried(monkeypatch, "cogging", errors=(0.5, 0.11, 0.3))
    assert floor == (pytest.approx(0.11), every)


def test_a_refit_goes_on_to_its_end_where_its_first_steps_show_evidence(monkeypatch):
    first, on = (5.3, False, FIRST_EVALUATIONS), (5.3, False, None)
    found = tried(monkeypatch, "cogging", bic=-0.1, unfinished=True)
    assert found == (pytest.approx(0.5), [first])
    found = tried(monkeypatch, "cogging", bic=0.1, unfinished=True)
    assert found == (pytest.approx(0.4), [first, on])
    assert tried(monkeypatch, "cogging", bic=0.1) == (pytest.approx(0.5), [first])


def test_a_noise_is_scored_without_a_refit(monkeypatch):

    def finished(axis, begun, logs, outcome):
        assert (begun.mass, logs, outcome) == (9.9, (), Outcome.CONVERGED)
        return built_fit(1.4, axis=axis)

    monkeypatch.setattr(candidates, "finished", finished)
    assert tried(monkeypatch, NOISE.name) == (pytest.approx(1.4), [])


def auditioned(monkeypatch, *, after, head=40, whole=100):
    noise = RNG.standard_normal(400)
    dataset = dataset_stub(fit=[range(whole)])
    dataset.heads = [range(head)]
    new_axis = axis_of(mass=7.7).with_effect(fitted("dahl"))

    starts = [SimpleNamespace(fitted=fitted("dahl", n=n)) for n in (0.5, 1.0)]

    def fit_axis(axis, logs, most):
        assert logs is dataset.heads
        further = axis["dahl"].values["n"] == 1.0  # the second start
        return built_fit(1.0, axis=new_axis) if further else built_fit(1.1, axis=axis)

    def on_heads(given, where):
        assert (given, where) == (base, dataset)
        return built_fit(1.0)

    base = built_fit(2.0)
    monkeypatch.setattr(candidates, "_on_heads", on_heads)
    monkeypatch.setattr(candidates, "fit_axis", fit_axis)
    monkeypatch.setattr(candidates, "fit_roughly", fit_axis)
    monkeypatch.setattr(candidates, "moving", lambda logs, either: np.full(400, either))
    monkeypatch.setattr(
        candidates, "residual",
        lambda axis, logs: noise if axis is PLAIN else after(noise),
    )  # fmt: skip
    monkeypatch.setattr(candidates, "finished", lambda axis, *_: built_fit(0.5, axis=axis))
    found, start = _fitted_to_heads(base, dataset, starts)
    whole_logs = head > 0.5 * whole
    assert start is starts[0 if whole_logs else 1]
    return found, noise, new_axis


@pytest.mark.parametrize(("part", "passed"), [(0.9, False), (1.1, True)])
def test_a_friction_passes_where_the_heads_show_it_better(monkeypatch, part, passed):
    def after(noise):
        gain = part * PROMISE * LEAST_BIC / effective_samples(noise)
        return noise * np.exp(-0.5 * gain)

    found, _, axis = auditioned(monkeypatch, after=after)
    assert (found is None) is passed
    assert passed or found.axis is axis
    assert auditioned(monkeypatch, after=after, head=50)[0] is None or not passed
    assert auditioned(monkeypatch, after=after, head=51)[0] is None


@pytest.mark.parametrize(("error", "goes_on"), [(1.41, True), (1.42, False)])
def test_a_friction_far_worse_on_the_heads_is_fitted_no_further(monkeypatch, error, goes_on):
    """Twice the squared error of the present friction; a rough fit's end is no more than near."""
    dataset, rough, fine = dataset_stub(), built_fit(error), built_fit(0.3)
    monkeypatch.setattr(candidates, "fit_roughly", lambda axis, logs, most: rough)
    monkeypatch.setattr(candidates, "fit_axis", lambda axis, logs, most: fine)
    dataset.heads = ()
    found = candidates._to_heads(PLAIN, dataset, built_fit(1.0))
    assert found is (fine if goes_on else rough)


def test_the_heads_are_fitted_once_for_all_frictions(monkeypatch):
    fitted_on = []
    monkeypatch.setattr(candidates, "fit_axis", lambda axis, logs: fitted_on.append((axis, logs)))
    base, dataset = built_fit(1.0), built_dataset("fit")
    for _ in range(2):
        candidates._on_heads(base, dataset)
    assert fitted_on == [(PLAIN, dataset.heads)]
