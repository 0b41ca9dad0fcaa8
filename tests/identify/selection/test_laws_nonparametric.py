"""A description's linear algebra against dense solutions, and what is chosen by it."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from built_fits import CATALOGUE, PLAIN, axis_of, built_dataset, built_machine, fitted

from identify.estimation.evidence import BLOCKS, effective_samples
from identify.estimation.fit import Outcome, finished, fit_axis
from identify.estimation.force_balance import jacobian
from identify.estimation.least_squares import RIDGE, ROUNDING, solve
from identify.estimation.splines import STIFFNESS, Linearised, choose_stiffness
from identify.output.words.fit import nonparametric_in_words
from identify.selection.nonparametric import (
    _filled,
    fit_nonparametric,
    nonparametric_labels,
    physics_alone,
)
from twin.model.machine import Fitted, MachineModel
from twin.model.parameters import ParameterReference

WORTH = 0.99  # as it was decided
RNG = np.random.default_rng(4)
MAP = CATALOGUE["empirical_map"]
PARTS = [part.name for part in MAP.parts]


def linear(n: int = 260, seed: int = 1) -> Linearised:
    """Two columns of physics and two parts of three and two columns, of sizes far apart."""
    rng = np.random.default_rng(seed)
    columns = rng.standard_normal((n, 7)) * (1e3, 1e-2, 1.0, 2.0, 0.5, 3.0, 1.0)
    columns[:, 4] += 0.8 * columns[:, 2]
    force = columns @ (1e-3, 20.0, 0.4, -0.3, 0.2, 0.0, 0.0) + rng.standard_normal(n)
    physics = np.diag((2.0, 3e-5, 0, 0, 0, 0, 0))

    def penalty(places, seed):
        rows = np.zeros((2, 7))
        rows[:, places] = np.random.default_rng(seed).standard_normal((2, len(places)))
        return rows.T @ rows, np.isin(np.arange(7), places)

    parts = {"a": penalty([2, 3, 4], 5), "b": penalty([5, 6], 6)}
    where = [ParameterReference("", PLAIN.effects[0].effect.parameters[0])] * 7
    return Linearised(where, force, columns, physics, parts)


USED = {(): [0, 1], ("a",): [0, 1, 2, 3, 4], ("b",): [0, 1, 5, 6], ("a", "b"): list(range(7))}
CHOICES = [{}, {"a": 0.3}, {"b": 2.0}, {"a": 0.05, "b": 0.7}]


def dense(found: Linearised, stiffness, rows):
    """Normal matrix, right side and columns from the definition, on some rows alone."""
    used = USED[tuple(stiffness)]
    penalty = found.physics.copy()
    for name, value in stiffness.items():
        penalty = penalty + len(found.force) * value**2 * found.parts[name][0]
    columns = found.columns[np.ix_(rows, used)]
    return columns.T @ columns + penalty[np.ix_(used, used)], columns, found.force[rows], used


@pytest.mark.parametrize("stiffness", CHOICES, ids=lambda c: "+".join(c) or "none")
def test_the_solution_is_that_of_the_penalised_normal_equations(stiffness):
    found = linear()
    matrix, columns, force, used = dense(found, stiffness, np.arange(len(found.force)))
    change, freedom = found.solution(stiffness)
    expected = np.linalg.solve(matrix, -columns.T @ force)
    np.testing.assert_allclose(change[used], expected, rtol=1e-6)
    assert not change[[i for i in range(7) if i not in used]].any()
    hat = columns @ np.linalg.solve(matrix, columns.T)
    assert freedom == pytest.approx(np.trace(hat), rel=1e-8)
    assert freedom <= len(used) + 1e-9


@pytest.mark.parametrize("stiffness", CHOICES, ids=lambda c: "+".join(c) or "none")
def test_each_block_is_left_by_a_fit_of_the_others_alone(stiffness):
    found = linear()
    n = len(found.force)
    edges = np.linspace(0, n, BLOCKS + 1).astype(int)
    expected = np.empty(n)
    for a, b in pairwise(edges):
        matrix, columns, force, used = dense(found, stiffness, np.r_[0:a, b:n])
        change = np.linalg.solve(matrix, -columns.T @ force)
        expected[a:b] = found.force[a:b] + found.columns[a:b][:, used] @ change
    np.testing.assert_allclose(found.left_out(stiffness), expected, rtol=1e-6, atol=1e-9)


def test_stiffer_parts_have_less_freedom():
    found = linear()
    free = [found.solution({"a": value})[1] for value in sorted(STIFFNESS)]
    assert np.all(np.diff(free) < 0.0)


def test_a_system_of_unlike_units_is_solved():
    size = np.array([1e-6, 1.0, 1e5])
    matrix = np.array([[2.0, 0.3, 0.1], [0.3, 1.0, -0.2], [0.1, -0.2, 3.0]]) * np.outer(size, size)
    several = np.stack([matrix, 2.0 * matrix, matrix + np.diag(size**2)])
    wanted = RNG.standard_normal((3, 4)) / size[:, None]
    np.testing.assert_allclose(solve(matrix, matrix @ wanted), wanted, rtol=1e-8)
    for system, found in zip(several, solve(several, several @ wanted), strict=True):
        np.testing.assert_allclose(found, solve(system, system @ wanted), rtol=1e-12)
        np.testing.assert_allclose(found, wanted, rtol=1e-8)
    singular = solve(np.diag([1.0, 0.0]), np.array([[2.0], [0.0]]))
    np.testing.assert_allclose(singular, [[2.0 / (1.0 + ROUNDING)], [0.0]])


def test_the_squared_left_out_error_is_that_of_the_left_out_residual():
    found = linear()
    for stiffness in ({}, {"a": STIFFNESS[2]}, {"a": STIFFNESS[0], "b": STIFFNESS[3]}):
        expected = np.sum(found.left_out(stiffness) ** 2)
        assert found.left_out_error(stiffness) == pytest.approx(expected, rel=1e-9)


# --- what is chosen -------------------------------------------------------------------------


def test_one_part_gets_the_stiffness_of_least_error_left_out():
    found = linear()
    errors = {v: float(np.sum(found.left_out({"a": v}) ** 2)) for v in STIFFNESS}
    best = min(errors, key=errors.__getitem__)
    alone = replace(found, parts={"a": found.parts["a"]})
    assert errors[best] < WORTH * float(np.sum(found.left_out({}) ** 2))
    assert choose_stiffness(alone) == {"a": best}


class Table:
    """Stands in for the linear model: squared errors by the parts chosen and their stiffness."""

    def __init__(self, error) -> None:
        self.parts, self.error = dict.fromkeys("ab"), error

    def left_out_error(self, stiffness):
        return self.error(dict(stiffness))


@pytest.mark.parametrize(("gain", "chosen"), [(WORTH + 0.001, []), (WORTH - 0.001, ["a"])])
def test_a_part_must_be_worth_it(gain, chosen):
    table = Table(lambda s: gain if "a" in s else 2.0 if "b" in s else 1.0)
    assert list(choose_stiffness(table)) == chosen


def test_the_part_that_helps_most_comes_first_and_is_tuned_again():
    def error(s):
        if "b" not in s:
            return 9.0 if "a" in s else 10.0
        first = 4.0 + abs(np.log10(s["b"]) - (0.5 if "a" not in s else -1.5))
        return first - (3.0 - 0.1 * abs(np.log10(s["a"])) if "a" in s else 0.0)

    found = choose_stiffness(Table(error))
    assert list(found) == ["b", "a"]
    assert found["a"] == pytest.approx(1.0)
    assert found["b"] == pytest.approx(10.0**-1.5)


# --- from a fit -----------------------------------------------------------------------------


@pytest.fixture(scope="module")
def about():
    """A description about a fit of a built motion."""
    dataset = built_dataset("run")
    base = finished(PLAIN, PLAIN, dataset.fit, Outcome.CONVERGED)
    empty = Fitted.at_start(MAP)
    return base, dataset, empty, Linearised.about(base, dataset, empty)


def test_the_columns_are_physics_then_the_description(about):
    base, dataset, empty, found = about
    k = len(base.scaling.where)
    own = [ParameterReference(MAP.name, p) for p in MAP.strengths]
    assert list(found.where) == [*base.scaling.where, *own]
    np.testing.assert_array_equal(found.force, base.residual)
    np.testing.assert_array_equal(found.columns[:, :k], base.jacobian)
    alone = replace(PLAIN, effects=(empty,))
    np.testing.assert_array_equal(
        found.columns[:, k:], jacobian(alone, dataset.fit, own)[base.kept]
    )
    ridge = (RIDGE * np.linalg.norm(base.jacobian, axis=0)) ** 2
    np.testing.assert_allclose(np.diag(found.physics)[:k], ridge)
    assert not found.physics[k:, k:].any()
    assert list(found.parts) == PARTS
    for part in MAP.parts:
        rows, mask = found.parts[part.name]
        assert {w.parameter.name for w, m in zip(found.where, mask, strict=True) if m} == set(
            part.strengths
        )
        assert rows[np.ix_(mask, mask)].any()
        assert not rows[~mask].any()


def test_parts_that_were_not_chosen_are_zero_and_held(about):
    _, _, empty, found = about
    change = 1.0 + np.arange(len(found.where))
    chosen = PARTS[1]
    filled = _filled(empty, found, {chosen: 0.125}, change)
    step = {c.parameter.name: x for c, x in zip(found.where, change, strict=True) if c.effect}
    for part in MAP.parts:
        for name in part.strengths:
            assert filled.values[name] == (step[name] if part.name == chosen else 0.0)
            assert (name in filled.fixed) is (part.name != chosen)
    stiffness = next(p.stiffness for p in MAP.parts if p.name == chosen)
    assert filled.values[stiffness] == 0.125
    assert f"it depends on {chosen}, and is valid only" in nonparametric_in_words(filled)
    assert "found nothing to depend on" in nonparametric_in_words(empty)


@pytest.mark.parametrize("held", [("held",), ()])
def test_curves_count_as_many_parameters_as_they_are_worth(held):
    dataset = built_machine(built_dataset("run", held=held), PLAIN, lambda x, turn: 40.0 * x**2)
    made = fit_nonparametric(fit_axis(PLAIN, dataset.fit), dataset, MAP)
    assert 1 < made.evidence.parameters < 0.3 * len(MAP.strengths)
    assert made.evidence.samples == effective_samples(made.fit.residual)
    assert made.part > 0.9


# --- descriptions and physics ---------------------------------------------------------------


def test_descriptions_are_told_from_physics():
    axis = axis_of(fitted("cogging"), Fitted.at_start(MAP))
    labels = nonparametric_labels(axis)
    assert labels == {f"{MAP.name}.{p.name}" for p in MAP.strengths}
    assert nonparametric_labels(PLAIN) == frozenset()
    stage = MachineModel("s", {"x": axis, "y": replace(PLAIN, mass=7.0)})
    found = physics_alone(stage)
    assert found.axes["x"].names == ("coulomb_viscous", "cogging")
    assert found.axes["y"] == stage.axes["y"]
