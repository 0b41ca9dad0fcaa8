"""The search of an effect's shape: each linear step is the least-squares solution it stands for."""

from __future__ import annotations

import itertools
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import CATALOGUE, PLAIN, axis_of, built_dataset, built_fit, fitted

from identify.estimation import variable_projection as search
from identify.estimation.evidence import effective_samples
from identify.estimation.fit import Outcome, finished
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.variable_projection import (
    Start,
    _best,
    _beyond_chance,
    _bounded_step,
    _clipped,
    _Ground,
    _try,
    one_linear_step,
    starts,
    tried_shapes,
    with_what_repeats,
)
from twin.effect import Excitation
from twin.model.machine import Fitted
from twin.model.parameters import ParameterReference

# The rules as they were decided.
BETTER, CHANCE, FULL_SHAPES, REFINED_STARTS = 0.99, 4.0, 4, 2
RESCORED_SHAPES, RESIDUAL_LINES = 12, 6
RNG = np.random.default_rng(3)
SEEN = Excitation(-0.05, 0.07, 0.4, 0.3, 3.0, 1e-3)


@pytest.fixture(scope="module")
def dataset():
    return built_dataset("one", "two")


@pytest.fixture(scope="module")
def base(dataset):
    """The axis off its best values, with the residual and Jacobian that it has there."""
    off = replace(axis_of(fitted("constant_force", F0=0.2)), mass=5.6)
    return finished(off, PLAIN, dataset.fit, Outcome.CONVERGED)


# --- one linear step ------------------------------------------------------------------------


def test_a_step_within_bounds_is_the_least_squares_beside_the_base():
    n = 300
    basis = np.linalg.qr(RNG.standard_normal((n, 3)))[0]
    columns, force = RNG.standard_normal((n, 2)), RNG.standard_normal(n)
    effect = CATALOGUE["axis_coupling"]
    first = Fitted.at_start(effect)
    where = [ParameterReference(effect.name, p) for p in effect.strengths]
    found = _bounded_step(basis, force, columns, where, first)
    both = np.hstack([columns, basis])
    solution = np.linalg.lstsq(both, -force, rcond=None)[0]
    np.testing.assert_allclose(found, solution[:2], rtol=1e-5)


def test_a_step_beyond_a_bound_stops_there_and_the_others_follow():
    n = 400
    columns = RNG.standard_normal((n, 2)) * (0.2, 30.0)
    effect = CATALOGUE["coulomb_viscous"]
    own = {p.name: p for p in effect.parameters}
    where = [ParameterReference(effect.name, own[name]) for name in ("Fc", "sigma2")]
    first = Fitted.at_start(effect, {"Fc": 0.5, "Fs": 0.6, "sigma2": 0.1})
    columns[:, 1] += 20.0 * columns[:, 0]
    wanted = np.array([-4.0, 0.3])  # Fc would end at -3.5 N, below its bound of 0
    force = -columns @ wanted + 0.01 * RNG.standard_normal(n)
    nothing = np.zeros((n, 0))
    found = 0.5, 0.1
    found = found + _bounded_step(nothing, force, columns, where, first)
    assert found[0] == pytest.approx(0.0, abs=1e-6)
    rest = force + columns[:, 0] * -0.5
    step = -float(columns[:, 1] @ rest) / float(columns[:, 1] @ columns[:, 1])
    assert found[1] == pytest.approx(0.1 + step, rel=1e-4)


@pytest.mark.parametrize("wanted", [-0.9, 2e7])
def test_a_strength_alone_stops_at_either_bound(wanted):
    column = RNG.standard_normal((300, 1))
    effect = CATALOGUE["coulomb_viscous"]
    where = [ParameterReference(effect.name, effect.parameter("Fc"))]
    first = Fitted.at_start(effect, {"Fc": 0.5, "Fs": 0.6})
    found = 0.5 + _bounded_step(
        np.zeros((300, 0)), -column[:, 0] * (wanted - 0.5), column, where, first
    )
    highest = effect.parameter("Fc").upper
    assert wanted < highest * 3.0
    assert found[0] == pytest.approx(0.0 if wanted < 0.0 else highest, rel=1e-9, abs=1e-4)


def test_a_ridge_decides_where_the_base_explains_a_strength_already():
    n = 200
    column = RNG.standard_normal((n, 1))
    basis = column / np.linalg.norm(column)
    effect = CATALOGUE["constant_force"]
    where = [ParameterReference(effect.name, effect.parameters[0])]
    found = _bounded_step(basis, RNG.standard_normal(n), column, where, Fitted.at_start(effect))
    assert abs(found[0]) < 1e-3


@pytest.mark.parametrize("name", ["axis_coupling", "cogging", "coulomb_viscous"])
def test_a_try_of_a_linear_effect_is_the_joint_least_squares(dataset, base, name):
    effect = CATALOGUE[name]
    shape = {"p": 0.021} if name == "cogging" else {}
    ground = _Ground.of(base, dataset, effect, SEEN, on_heads=False)
    found = _try(ground, shape, effect.strengths)
    at = Fitted.at_start(effect, {**effect.starts(SEEN), **shape})
    where = [ParameterReference(effect.name, p) for p in effect.strengths if not p.fixed]
    axis = base.axis.with_effect(at)  # a friction takes the place of the old one
    own = jacobian(axis, dataset.fit, where)[base.kept]
    both = np.hstack([own, ground.basis])
    force = residual(axis, dataset.fit)[base.kept]
    step, *_ = np.linalg.lstsq(both / np.linalg.norm(both, axis=0), -force, rcond=None)
    step = step / np.linalg.norm(both, axis=0)
    left = force + both @ step
    assert found.squared_error == pytest.approx(float(left @ left), rel=1e-4)
    np.testing.assert_allclose(found.left, left, atol=1e-3 * np.abs(left).max())
    own = found.force - force
    np.testing.assert_allclose(
        own, both[:, : len(where)] @ step[: len(where)], atol=1e-2 * np.abs(own).max()
    )
    values = [found.fitted.values[c.parameter.name] for c in where]
    start = [at.values[c.parameter.name] for c in where]
    np.testing.assert_allclose(np.array(values) - start, step[: len(where)], rtol=0.02)
    assert found.shape == shape
    assert shape.items() <= found.fitted.values.items()


def test_a_friction_is_tried_in_the_place_of_the_old_one(dataset, base):
    ground = _Ground.of(base, dataset, CATALOGUE["lugre"], SEEN, on_heads=False)
    assert ground.rest.names == ("constant_force",)
    other = _Ground.of(base, dataset, CATALOGUE["cogging"], SEEN, on_heads=False)
    assert other.rest.names == base.axis.names
    assert other.basis.shape[1] == len(base.scaling.where)
    assert ground.basis.shape[1] == len(base.scaling.where) - 2  # Fc, sigma2


def test_a_ground_on_the_heads_is_that_part_of_the_whole(base, monkeypatch):
    dataset = built_dataset("one", "two")
    heads = tuple(type(w).of(w.motion.head(1.1), w.test_function.length) for w in dataset.fit)
    dataset.__dict__["heads"] = heads
    head = _Ground.of(base, dataset, CATALOGUE["cogging"], SEEN, on_heads=True)
    whole = _Ground.of(base, dataset, CATALOGUE["cogging"], SEEN, on_heads=False)
    assert (head.logs, whole.logs) == (heads, dataset.fit)
    rows = dataset.in_heads[base.kept]
    assert 0 < rows.sum() < len(rows)
    np.testing.assert_array_equal(head.unchanged, base.residual[rows])
    np.testing.assert_array_equal(whole.unchanged, base.residual)
    assert len(head.kept) == sum(map(len, heads))
    assert head.kept.sum() == rows.sum()
    np.testing.assert_allclose(head.basis.T @ head.basis, np.eye(head.basis.shape[1]), atol=1e-9)
    columns = base.jacobian[rows]
    np.testing.assert_allclose(head.basis @ (head.basis.T @ columns), columns, atol=1e-6)


def test_the_base_moves_along_by_one_linear_step_within_its_bounds(dataset, base):
    effect = CATALOGUE["cable_slab"]
    ground = _Ground.of(base, dataset, effect, SEEN, on_heads=False)
    start = _try(ground, {}, effect.strengths)
    found = one_linear_step(base, start)
    assert found.axis.names == (*base.axis.names, "cable_slab")
    assert found.axis["cable_slab"] == start.fitted
    assert len(found.scaling.where) == len(base.scaling.where) + len(effect.strengths)
    assert (found.outcome, found.begun) == (Outcome.NOT_CONVERGED, base.begun)
    # What the base could take by itself is no gain of the effect: it remains.
    own = base.residual - base.unabsorbed
    np.testing.assert_allclose(found.residual, start.left + own, rtol=0, atol=1e-12)
    # All is linear here, so what is predicted is what a walk gives, and normal to the columns.
    np.testing.assert_allclose(
        found.residual, residual(found.axis, dataset.fit)[base.kept], atol=1e-3 * base.error
    )
    norms = np.linalg.norm(base.jacobian, axis=0)
    moved = base.jacobian.T @ (found.residual - own) / norms
    np.testing.assert_allclose(moved, 0.0, atol=1e-3)
    assert found.axis.mass != base.axis.mass
    tight = replace(base, residual=base.residual)
    tight.__dict__["jacobian"] = base.jacobian * -1e-9  # steps of a huge size, the wrong way
    far = one_linear_step(tight, start).axis
    for f in far.effects[:2]:
        for p in f.effect.parameters:
            assert p.lower <= f.values[p.name] <= p.upper


def test_what_the_motion_does_not_reach_stays_in_a_linear_step(dataset, base):
    """As the outer knots of a curve: their columns are nothing, and so is their step."""
    effect = CATALOGUE["cable_slab"]
    start = _try(
        _Ground.of(base, dataset, effect, SEEN, on_heads=False), {}, effect.strengths
    )  # fmt: skip
    unseen = next(i for i, c in enumerate(base.scaling.where) if c.effect == "constant_force")
    partly = replace(base, residual=base.residual)
    columns = base.jacobian.copy()
    columns[:, unseen] = 0.0
    partly.__dict__["jacobian"] = columns
    found = one_linear_step(partly, start).axis
    assert found["constant_force"].values == base.axis["constant_force"].values
    assert found.mass != base.axis.mass


# --- which shapes ---------------------------------------------------------------------------


def test_every_combination_of_the_scanned_values_is_tried_once():
    effect = CATALOGUE["end_stop"]
    scanned = {p.name: list(p.scan(SEEN)) for p in effect.parameters if p.scan}
    assert scanned
    found = [tuple(s.items()) for s in tried_shapes(effect, SEEN)]
    expected = [
        tuple(zip(scanned, values, strict=True)) for values in itertools.product(*scanned.values())
    ]
    assert found == expected
    assert list(tried_shapes(CATALOGUE["constant_force"], SEEN)) == [{}]


def test_a_shape_starts_from_the_data_within_its_bounds():
    effect = CATALOGUE["coulomb_viscous"]
    found = _clipped(effect, replace(SEEN, dry_level=0.37), {"sigma2": -2.0, "Fs": 1e12})
    assert found == {"Fc": 0.37, "Fs": effect.parameter("Fs").upper, "sigma2": 0.0}


def of_size(squared: float, shape=None, fitted=None) -> Start:
    """A start that leaves one test function of that squared error, N^2."""
    left = np.array([np.sqrt(squared)])
    return Start(shape or {}, fitted, left, left)


def test_the_best_tries_come_first_and_no_more_than_asked(monkeypatch):
    errors = [5.0, 1.0, 4.0, 2.0, 3.0]
    tried = [of_size(0.0, {"i": i}) for i in range(5)]
    monkeypatch.setattr(
        search, "_try", lambda g, shape, s: of_size(errors[int(shape["i"])], {**shape, "s": s})
    )
    found = _best(None, tried, "all", 3)
    assert [(s.shape["i"], s.shape["s"]) for s in found] == [(1, "all"), (3, "all"), (4, "all")]
    assert [s.squared_error for s in found] == pytest.approx([1.0, 2.0, 3.0])


@pytest.mark.parametrize(
    ("effect", "shapes", "worth", "rounds"),
    [
        ("quadratic_drag", 1, True, [("whole", 1, 1)]),
        ("dahl", FULL_SHAPES, True, [("whole", FULL_SHAPES, 2)]),
        ("backlash", FULL_SHAPES, False, [("whole", FULL_SHAPES, 1)]),
        ("dahl", 5, True, [("head", 5, 2)]),
        ("backlash", 5, True, [("head", 5, 1), ("whole", FULL_SHAPES, 1)]),
        ("backlash", 5, False, [("head", 5, 1), ("whole", 1, 1)]),
        ("cogging", RESCORED_SHAPES, True, [("head", 12, 6), ("whole", 4, 6)]),
        ("cogging", 13, True, [("head", 13, 2), ("head", 12, 6), ("whole", 4, 6)]),
        ("end_stop", 25, True, [("head", 25, None), ("whole", 4, None)]),
    ],
)
def test_many_shapes_are_sifted_on_the_heads_first(monkeypatch, effect, shapes, worth, rounds):
    seen, whole = [], []
    effect = CATALOGUE[effect]

    def best(ground, tried, strengths, count):
        assert all(isinstance(s.fitted, Fitted) and "i" in s.shape for s in tried)
        seen.append((ground, len(tried), len(strengths)))
        return list(tried)[:count]

    def tried_on_all(ground, shape, strengths):
        whole.append(shape["i"])
        assert (ground, len(strengths)) == ("whole", len(effect.strengths))
        return of_size(9.0 - shape["i"], shape)

    monkeypatch.setattr(search, "with_what_repeats", lambda base, dataset: SEEN)
    monkeypatch.setattr(search, "tried_shapes", lambda e, x: ({"i": i} for i in range(shapes)))
    monkeypatch.setattr(search, "_best", best)
    monkeypatch.setattr(search, "_try", tried_on_all)
    monkeypatch.setattr(search, "_beyond_chance", lambda base, start: worth)

    def of(*given, on_heads):
        assert given == ("base", "dataset", effect, SEEN)
        return "head" if on_heads else "whole"

    monkeypatch.setattr(search, "_Ground", SimpleNamespace(of=of))
    found = starts("base", "dataset", effect)
    full = len(effect.strengths)
    wanted = [(g, n, full if k is None else k) for g, n, k in rounds]
    assert seen + ([("whole", len(whole), full)] if whole else []) == wanted
    assert len(found) == min(REFINED_STARTS, rounds[-1][1])
    if whole:  # those on all of the logs by what they leave there, the last of them least
        assert [s.shape["i"] for s in found] == whole[::-1][:REFINED_STARTS]


@pytest.mark.parametrize(("rows", "tries"), [(11, 80), (9, 99)])
def test_of_many_shapes_every_other_is_tried_and_those_beside_the_best(monkeypatch, rows, tries):
    """Unlike powers of two, so that the best lies between the values that are tried first."""
    plays, tones = 1.5 ** np.arange(11.0), 1.25 ** np.arange(float(rows))
    shapes = [{"play": p, "frequency": f} for p in plays for f in tones]
    tried = [of_size(0.0, shape, fitted("backlash")) for shape in shapes]
    asked = []

    def score(ground, shape, strengths):
        asked.append(shape)
        off = np.log(shape["play"] / plays[5]), np.log(shape["frequency"] / tones[3])
        return of_size(float(np.hypot(*off)), shape, fitted("backlash"))

    monkeypatch.setattr(search, "_try", score)
    found = search._scanned(None, tried, ())
    assert found[0].shape == {"play": plays[5], "frequency": tones[3]}
    assert len(asked) == len(found) <= tries
    assert sorted(found, key=lambda s: s.squared_error) == found


def test_more_than_one_shape_deserves_a_try_where_the_gain_is_no_chance():
    noise = RNG.standard_normal(900)
    base = built_fit(0.0, residual=noise, jacobian=np.zeros((900, 1)))
    n, before = effective_samples(noise), float(noise @ noise)
    for effect in ("constant_force", "axis_coupling"):
        free = len(CATALOGUE[effect].strengths)
        for part, worth in ((0.98, False), (1.02, True)):
            left = before * np.exp(-part * CHANCE * free / n)
            assert _beyond_chance(base, of_size(left, {}, fitted(effect))) is worth


def test_a_tone_in_the_residual_is_among_the_first_lines_tried(dataset):
    base = finished(PLAIN, PLAIN, dataset.fit, Outcome.CONVERGED)
    tone = np.concatenate([np.sin(2.0 * np.pi * 7.3 * w.time) for w in dataset.fit])
    loud = replace(base, residual=tone[base.kept])
    known = replace(dataset, covered=lambda: replace(SEEN, lines=(3.21, 4.56)))
    found = with_what_repeats(loud, known)
    assert found.lines[-2:] == (3.21, 4.56)
    assert abs(found.lines[0] - 7.3) < 0.5
    assert len(found.lines) <= RESIDUAL_LINES + 2
    plain = replace(found, lines=(), pitches=(), thrust_pitches=())
    assert plain == replace(known.excitation, lines=())
    assert (found.pitches, found.thrust_pitches) == loud.pitches
