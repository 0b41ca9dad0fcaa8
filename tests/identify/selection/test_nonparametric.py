"""What no physical effect explains: a map or a learned model, its linear algebra and its choice."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise
from math import sin
from pathlib import Path

import numpy as np
import pytest
from built_fits import PLAIN, axis_of, built_dataset, built_machine, fitted
from machines import CATALOGUE, PROTON, one_axis, tracked

from identify.adding import add
from identify.dataset.prepared_log import on_blocks, total_force
from identify.estimation.evidence import BLOCKS, effective_samples
from identify.estimation.fit import Outcome, finished, fit_axis
from identify.estimation.force_balance import jacobian
from identify.estimation.least_squares import RIDGE, ROUNDING, solve
from identify.estimation.splines import STIFFNESS, Linearised, choose_stiffness
from identify.estimation.variable_projection import absent_effects
from identify.output.words.fit import nonparametric_in_words
from identify.results.grown import Addition
from identify.results.results import FitResult
from identify.selection.nonparametric import (
    _filled,
    fit_nonparametric,
    nonparametric_labels,
    physics_alone,
)
from identify.workflow import fit
from twin.effect import OUT, Effect, Kind, Parameter, X
from twin.logs import Log
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.model.parameters import ParameterReference

RATE = 2500.0  # Hz: quicker than 10 kHz, and enough for curves over the travel
STAGE = replace(one_axis(PROTON), sample_rate=RATE)
QUICK = replace(STAGE, sample_rate=1000.0)
MAP, LEARNED = "empirical_map", "learned_residual"
SLOW = pytest.mark.slow
DESCRIPTIONS = pytest.mark.parametrize("name", [MAP, LEARNED])
Logs = dict[str, Log]
SHORT = 6.0  # s of a log that is enough for most
HEIGHT = 0.05  # N, of the chirp


def with_x(effect: Effect, **values: float) -> MachineModel:
    fitted = Fitted.at_start(effect, values)
    return STAGE.with_axis("x", STAGE.axes["x"].with_effect(fitted))


def recorded(machine: MachineModel, seeds: tuple[int, ...], duration: float = 20.0) -> Logs:
    return {f"log {s}": tracked(machine, s, duration) for s in seeds}


def test_descriptions_are_marked_and_never_a_diagnosis() -> None:
    marked = {name for name, effect in CATALOGUE.items() if effect.is_nonparametric}
    assert marked == {MAP, LEARNED, "free_curve"}
    offered = {e.name for e in absent_effects(STAGE.axes["x"], CATALOGUE)}
    assert not marked & offered
    for name in marked:
        assert "not a physical law" in CATALOGUE[name].summary


def chirp_law(p, s, io):
    place = io[X] + 0.15
    io[OUT] = p[0] * sin(10.0 * place + 200.0 * place * place)


CHIRP = Effect(
    kind=Kind.FORCE, summary="in no catalogue", equation="F = a f(x)", source="this test",
    parameters=(Parameter("a", "N", 0.0, -10.0, 10.0, "height", strength=True),), law=chirp_law,
    fingerprint="none", excited_by="none",
)  # fmt: skip


@pytest.fixture(scope="module")
def chirping() -> tuple[Logs, Logs]:
    """Two logs of a machine with the chirp, and one held out."""
    machine = replace(with_x(CHIRP, a=HEIGHT), sample_rate=QUICK.sample_rate)
    return recorded(machine, (1, 2), SHORT), recorded(machine, (3,), SHORT)


@pytest.fixture(scope="module")
def mapped(chirping: tuple[Logs, Logs]) -> Addition:
    """The stage with a map added for the chirp."""
    return add(CATALOGUE[MAP], QUICK, *chirping)


@cache
def honest(seed: int) -> FitResult:
    """The stage's fit to logs of a machine that lacks nothing."""
    return fit(STAGE, recorded(STAGE, (seed, seed + 1), SHORT), recorded(STAGE, (seed + 2,), SHORT))


@pytest.mark.slow
def test_adding_a_map_lowers_the_errors_of_force_and_position(mapped: Addition) -> None:
    assert mapped.kept
    assert mapped.candidate.gain.t > 3.0
    assert mapped.step.holdout_error_before is not None
    assert mapped.step.holdout_error_after is not None
    # All but what lies at the ends of the travel, which the short logs hardly reach.
    assert mapped.step.holdout_error_after * 5.0 < mapped.step.holdout_error_before
    assert "not a physical law" in mapped.notes[0]
    assert mapped.position_error[1] < mapped.position_error[0]
    assert mapped.position_error_in_mujoco == pytest.approx(mapped.position_error[1], rel=0.02)


def test_the_shape_is_recovered_and_the_physics_keeps_its_values(
    mapped: Addition,
) -> None:
    found, motion = mapped.candidate.fit.axis, mapped.candidate.fit.logs[0].motion
    machine = with_x(CHIRP, a=HEIGHT)
    shape, true = (
        total_force(on_blocks(AxisModel(1.0, effects=(part,))), motion)
        for part in (found[MAP], machine.axes["x"][CHIRP.name])
    )
    # A constant and the slow part of the curve are the cable's, which the model has already.
    smooth = np.polynomial.Polynomial.fit(motion.position, shape - true, 3)
    left = shape - true - smooth(motion.position)
    assert np.sqrt(np.mean(left**2)) < 0.06 * np.sqrt(np.mean(true**2))
    assert found.mass == pytest.approx(STAGE.axes["x"].mass, rel=1e-3)
    assert found["lugre"].values["Fc"] == pytest.approx(0.285, rel=0.03)


@pytest.mark.parametrize("name", [MAP, pytest.param(LEARNED, marks=SLOW)])
def test_a_refit_smooths_as_was_chosen(
    name: str, chirping: tuple[Logs, Logs], mapped: Addition
) -> None:
    added = mapped if name == MAP else add(CATALOGUE[name], QUICK, *chirping)
    first = added.candidate.fit
    again = fit_axis(first.axis, first.logs)
    assert again.error == pytest.approx(first.error, rel=0.05)


@DESCRIPTIONS
@pytest.mark.parametrize("seed", [11, pytest.param(21, marks=SLOW)])
def test_nothing_is_kept_on_an_honest_machine(name: str, seed: int) -> None:
    before = honest(seed)
    found = fit_nonparametric(before.fits["x"], before.datasets["x"], CATALOGUE[name])
    assert not found.supported
    assert found.gain.after < 1.01 * found.gain.before


def test_a_physical_effect_takes_the_place_of_a_description(tmp_path: Path) -> None:
    machine = with_x(CATALOGUE["cogging"], a1=0.05, p=0.03)
    logs = recorded(machine, (1,), SHORT)
    described = add(CATALOGUE[MAP], STAGE, logs).model
    better = add(CATALOGUE["cogging"], described, logs)
    assert better.kept
    assert MAP not in better.model.axes["x"].names
    assert any(MAP in note for note in better.notes)


# A description's linear algebra against dense solutions, and what is chosen by it


WORTH = 0.99  # as it was decided
RNG = np.random.default_rng(4)
MAP_EFFECT = CATALOGUE["empirical_map"]
PARTS = [part.name for part in MAP_EFFECT.parts]


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
    base = finished(PLAIN, PLAIN, dataset.training, Outcome.CONVERGED)
    empty = Fitted.at_start(MAP_EFFECT)
    return base, dataset, empty, Linearised.about(base, dataset, empty)


def test_the_columns_are_physics_then_the_description(about):
    base, dataset, empty, found = about
    k = len(base.scaling.where)
    own = [ParameterReference(MAP_EFFECT.name, p) for p in MAP_EFFECT.strengths]
    assert list(found.where) == [*base.scaling.where, *own]
    np.testing.assert_array_equal(found.force, base.residual)
    np.testing.assert_array_equal(found.columns[:, :k], base.jacobian)
    alone = replace(PLAIN, effects=(empty,))
    np.testing.assert_array_equal(
        found.columns[:, k:], jacobian(alone, dataset.training, own)[base.kept]
    )
    ridge = (RIDGE * np.linalg.norm(base.jacobian, axis=0)) ** 2
    np.testing.assert_allclose(np.diag(found.physics)[:k], ridge)
    assert not found.physics[k:, k:].any()
    assert list(found.parts) == PARTS
    for part in MAP_EFFECT.parts:
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
    for part in MAP_EFFECT.parts:
        for name in part.strengths:
            assert filled.values[name] == (step[name] if part.name == chosen else 0.0)
            assert (name in filled.fixed) is (part.name != chosen)
    stiffness = next(p.stiffness for p in MAP_EFFECT.parts if p.name == chosen)
    assert filled.values[stiffness] == 0.125
    assert f"it depends on {chosen}, and is valid only" in nonparametric_in_words(filled)
    assert "found nothing to depend on" in nonparametric_in_words(empty)


@pytest.mark.parametrize("held", [("held",), ()])
def test_curves_count_as_many_parameters_as_they_are_worth(held):
    dataset = built_machine(built_dataset("run", held=held), PLAIN, lambda x, turn: 40.0 * x**2)
    made = fit_nonparametric(fit_axis(PLAIN, dataset.training), dataset, MAP_EFFECT)
    assert 1 < made.evidence.parameters < 0.3 * len(MAP_EFFECT.strengths)
    assert made.evidence.samples == effective_samples(made.fit.residual)
    assert made.part > 0.9


# --- descriptions and physics ---------------------------------------------------------------


def test_descriptions_are_told_from_physics():
    axis = axis_of(fitted("cogging"), Fitted.at_start(MAP_EFFECT))
    labels = nonparametric_labels(axis)
    assert labels == {f"{MAP_EFFECT.name}.{p.name}" for p in MAP_EFFECT.parameters}
    assert nonparametric_labels(PLAIN) == frozenset()
    stage = MachineModel("s", {"x": axis, "y": replace(PLAIN, mass=7.0)})
    found = physics_alone(stage)
    assert found.axes["x"].names == ("coulomb_viscous", "cogging")
    assert found.axes["y"] == stage.axes["y"]
