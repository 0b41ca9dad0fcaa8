"""Laws of a fit: priors and smoothing are rows; what leaves nothing is found."""

from dataclasses import replace

import numpy as np
import pytest
from constructed import effect, fit_of, moved, windowed

from identify.dataset.prepared_log import moving
from identify.estimation.evidence import effective_samples
from identify.estimation.fit import (
    Outcome,
    error_on,
    finished,
    fit_axis,
    rms,
)
from identify.estimation.fit_problem import PRIOR_SPREAD, FitProblem, has_nonparametric
from identify.estimation.force_balance import jacobian, residual
from identify.rules import RULE
from twin.model.machine import AxisModel
from twin.model.parameters import free_parameters, read

ODD = AxisModel(
    1.7,
    effects=(
        effect("lugre", {"Fc": 0.31, "Fs": 0.47, "v0": 0.013, "sigma2": 1.9, "sigma0": 700.0}),
        effect("cable_slab", {"offset": -0.2, "k1": 1.3}),
        effect("cogging", {"p": 0.021, "a1": 0.06}),
    ),
)

# --- priors -------------------------------------------------------------------------------------

LOGS = [windowed(moved(np.random.default_rng(k), 1.5, 1000.0)) for k in (1, 2)]


def test_priors_are_rows_beside_the_residual():
    problem = FitProblem(ODD, LOGS, 10)
    problem.set_priors(problem.start)
    z = problem.start + np.random.default_rng(6).normal(0.0, 0.01, len(problem.start))
    n, k = int(problem.kept.sum()), len(z)
    rows = problem.rows(z)
    axis = problem.scaling.outside(ODD, z)
    np.testing.assert_allclose(rows[:n], residual(axis, LOGS)[problem.kept])
    others = ("cable_slab", "cogging")
    added = [c.effect in others and c.parameter.strength for c in problem.scaling.where]
    np.testing.assert_array_equal(problem.added, added)
    static = [c.label == "lugre.Fs" for c in problem.scaling.where]
    wanted = problem.pull * np.where(np.logical_or(added, static), z, z - problem.start)
    np.testing.assert_allclose(rows[n:], wanted)
    slopes = problem.slopes(z)
    assert slopes.shape == (len(rows), k)
    np.testing.assert_allclose(slopes[n:], np.diag(problem.pull))
    differences = (problem.rows(z + 1e-7 * np.eye(k)[1]) - rows) / 1e-7
    np.testing.assert_allclose(slopes[:, 1], differences, atol=1e-4 * np.abs(differences).max())


@pytest.mark.parametrize("quiet", [False, True])
def test_priors_weigh_by_the_noise_and_the_force_to_be_explained(quiet):
    """Where it is quiet a tenth of that force is expected of an effect, else the noise."""
    noise = np.random.default_rng(7).normal(0.0, 1e-3, len(LOGS[0]))
    log = replace(LOGS[0], command=LOGS[0].command - residual(ODD, LOGS[:1]) + noise)
    logs = [log] if quiet else LOGS
    problem = FitProblem(ODD, logs, 10)
    problem.set_priors(problem.start)
    left = residual(ODD, logs)[problem.kept]
    size = rms(left) * np.sqrt(len(left) / effective_samples(left))
    is_log = problem.scaling.is_logarithm()
    np.testing.assert_allclose(problem.pull[is_log & ~problem.added], size / PRIOR_SPREAD)
    explained = rms(np.concatenate([log.command - 1.7 * log.acceleration for log in logs]))
    expected = 0.1 * explained
    assert (expected > size) == quiet
    columns = np.sqrt(np.mean(problem.columns(problem.start) ** 2, axis=0))
    wanted = (size * columns / max(expected, size))[problem.added]
    np.testing.assert_allclose(problem.pull[problem.added], wanted)
    static = np.array([c.label == "lugre.Fs" for c in problem.scaling.where])
    np.testing.assert_allclose(problem.pull[static], size / (3.0 * 0.31))
    others = ~is_log & ~problem.added & ~static
    assert others.any()
    assert not problem.pull[others].any()


def test_a_strength_that_the_motion_hardly_reaches_stays_where_it_starts():
    """Bumps of a roller that is passed one way alone: those of the other way tell nothing."""
    bumps = effect("roller_spikes", {"ahead": 0.05, "behind": 0.04, "width": 3e-3})
    one_way = moved(np.random.default_rng(5), 1.5, 1000.0)
    signals = one_way.signals.copy()
    signals[0] = 0.1 * np.arange(signals.shape[1]) * one_way.period
    signals[1] = 0.1
    logs = [windowed(replace(one_way, signals=signals, raw=signals[1:]))]
    axis = AxisModel(1.7, effects=(*ODD.effects[:1], bumps))
    problem = FitProblem(axis, logs, 10)
    problem.set_priors(problem.start)
    labels = [c.label for c in problem.scaling.where]
    ahead, behind = (labels.index(f"roller_spikes.{name}") for name in ("ahead", "behind"))
    assert problem.pull[behind] == pytest.approx(problem.pull[ahead])
    assert (problem.centre[ahead], problem.centre[behind]) == (0.0, 0.04)
    assert fit_axis(axis, logs).axis["roller_spikes"].values["behind"] == pytest.approx(0.04)


MAPPED = AxisModel(1.7, effects=(*ODD.effects[:2], effect("empirical_map")))


def test_a_description_is_smoothed_and_its_columns_are_those_of_the_jacobian():
    problem = FitProblem(MAPPED, LOGS[:1], 10)
    assert has_nonparametric(MAPPED)
    assert not has_nonparametric(ODD)
    where = problem.scaling.where
    np.testing.assert_allclose(problem.jacobian(MAPPED), jacobian(MAPPED, LOGS[:1], where))
    # beside a description the physics is pulled to where it was
    np.testing.assert_array_equal(problem.centre, problem.start)
    assert not problem.added[[c.effect == "empirical_map" for c in where]].any()
    z = problem.start + np.random.default_rng(7).normal(0.0, 0.1, len(problem.start))
    rows = problem.rows(z)[int(problem.kept.sum()) + len(z) :]
    fitted = MAPPED["empirical_map"]
    values = zip(where, z, strict=True)
    own = {c.parameter.name: v for c, v in values if c.effect == "empirical_map"}
    bends = []
    for part in fitted.effect.parts:
        strengths = np.array([own.get(n, 0.0) for n in part.strengths])
        bends.append(fitted.values[part.stiffness] * part.rows(len(strengths)) @ strengths)
    assert np.sum(rows**2) / problem.kept.sum() == pytest.approx(np.sum(np.concatenate(bends) ** 2))


# --- fits ---------------------------------------------------------------------------------------


def made_for(axis: AxisModel):
    """Logs whose command is what this axis leaves nothing of."""
    logs = []
    for log in LOGS:
        found = residual(replace(axis), [log])
        logs.append(replace(log, command=log.command - found))
    return logs


def test_a_fit_finds_the_values_that_leave_nothing():
    """But for the shapes, which stay: a problem linear in what is free."""
    friction = effect("coulomb_viscous", {"Fc": 0.41, "Fs": 0.41, "sigma2": 1.7})
    cable = effect("cable_slab", {"offset": -0.3, "k1": 4.0, "k2": 20.0, "k3": 90.0})
    axis = AxisModel(1.7, effects=(replace(friction, fixed=friction.fixed | {"Fs"}), cable))
    logs = made_for(axis)
    off = replace(axis.effects[0], values={**friction.values, "Fc": 0.2, "sigma2": 0.4})
    begun = AxisModel(1.1, effects=(off, effect("cable_slab")))
    found = fit_axis(begun, logs)
    assert found.outcome is Outcome.CONVERGED
    where = free_parameters(axis)
    np.testing.assert_allclose(read(found.axis, where), read(axis, where), rtol=0.02)
    assert found.error < 1e-3
    assert found.begun is begun
    np.testing.assert_array_equal(found.kept, moving(logs, True))
    np.testing.assert_array_equal(found.residual, residual(found.axis, logs)[found.kept])
    np.testing.assert_array_equal(error_on(found.axis, logs), found.residual)
    assert fit_axis(begun, logs, 1).outcome is Outcome.NOT_CONVERGED
    nothing = fit_axis(AxisModel(1.7, mass_fixed=True), logs)
    assert nothing.outcome is Outcome.CONVERGED
    assert nothing.axis.mass == 1.7


def test_a_fit_is_at_its_floor_below_a_ratio():
    fit = fit_of(AxisModel(1.7), *LOGS)
    np.testing.assert_allclose(fit.jacobian, jacobian(fit.axis, LOGS, fit.scaling.where)[fit.kept])
    assert fit.error == pytest.approx(np.sqrt(np.mean(fit.residual**2)))
    for ratio, wanted in ((0.999, True), (1.001, False)):
        scaled = replace(fit, residual=fit.residual * ratio * RULE.at_floor * fit.floor / fit.error)
        assert scaled.ratio == pytest.approx(ratio * RULE.at_floor)
        assert scaled.at_floor is wanted
    assert np.isnan(rms(np.zeros(0)))
    assert fit.lessened == 1.0
    assert finished(fit.axis, fit.axis, LOGS, Outcome.AT_BOUND).outcome is Outcome.AT_BOUND
