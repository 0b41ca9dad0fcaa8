"""Each linear step of a search is the least-squares solution that it stands for."""

from __future__ import annotations

import numpy as np
import pytest
from built_fits import CATALOGUE

from identify.estimation.force_balance import jacobian, residual
from identify.estimation.variable_projection import (
    _bounded_step,
    _Ground,
    _try,
)
from twin.effect import Excitation
from twin.model.machine import Fitted
from twin.model.parameters import ParameterReference

RNG = np.random.default_rng(3)
SEEN = Excitation(-0.05, 0.07, 0.4, 0.3, 3.0, 1e-3)


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


@pytest.mark.parametrize("wanted", [-0.9, 2e15])
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
