"""The search of an effect's shape: which values are tried, and how many of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import (
    PERIOD,
    PLAIN,
    axis_of,
    built_dataset,
    built_machine,
    built_motion,
    fitted,
    pushed,
)
from machines import CATALOGUE

from identify.dataset.blocks import Blocks
from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import PreparedLog
from identify.estimation.fit import Outcome, finished, fit_axis
from identify.estimation.force_balance import jacobian, residual
from identify.estimation.variable_projection import (
    fit_multistart,
    fit_without,
    starts,
    tried_shapes,
    with_what_repeats,
)
from twin.effect import Excitation
from twin.excitation import Repeating
from twin.model.parameters import ParameterReference


@pytest.fixture(scope="module")
def dataset():
    return built_dataset("one", "two")


@pytest.fixture(scope="module")
def base(dataset):
    """The axis off its best values, with the residual and Jacobian that it has there."""
    off = replace(axis_of(fitted("constant_force", F0=0.2)), mass=5.6)
    return finished(off, PLAIN, dataset.training, Outcome.CONVERGED)


# The rules as they were decided.
REFINED_STARTS, RESIDUAL_LINES, FEWEST_CYCLES = 2, 6, 2.5
SEEN = Excitation(-0.05, 0.07, 0.4, 0.3, 3.0, 1e-3)


def planted(effect: str, **values: float) -> Dataset:
    """Two logs, longer than their heads, of an axis with one effect more; without values none."""
    motions = [built_motion(name, 7.0, seed) for seed, name in enumerate(("one", "two"))]
    if values:
        motions = [pushed(m, fitted(effect, **values)) for m in motions]
    return replace(built_dataset(), training=tuple(PreparedLog.of(m, 0.04) for m in motions))


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("periodic_disturbance", {"f": 11.0, "a": 0.1, "b": 0.05}),
        ("cogging", {"p": 0.0213, "a1": 0.1, "b2": 0.05}),
        ("end_stop", {"low": -0.0465, "high": 0.048, "stiffness": 500.0}),
    ],
)
def test_the_first_start_has_the_scanned_values_nearest_to_the_planted_ones(effect, values):
    dataset, effect = planted(effect, **values), CATALOGUE[effect]
    base = fit_axis(PLAIN, dataset.training)
    shapes = list(tried_shapes(effect, with_what_repeats(base, dataset)))
    found = starts(base, dataset, effect)
    assert len(found) == min(REFINED_STARTS, len(shapes))
    for name, value in found[0].shape.items():
        assert value == min((s[name] for s in shapes), key=lambda v: abs(v - values[name]))
    assert [s.squared_error for s in found] == sorted(s.squared_error for s in found)
    assert found[0].share(base) > 0.9


def test_where_nothing_gains_more_than_chance_one_start_is_enough():
    dataset = planted("end_stop")
    found = starts(fit_axis(PLAIN, dataset.training), dataset, CATALOGUE["end_stop"])
    assert len(found) == 1


def test_a_wave_longer_than_the_logs_can_show_is_no_start():
    dataset = planted("cogging", p=0.035, a1=0.3)  # m; the travel is 0.1 m
    base = fit_axis(PLAIN, dataset.training)
    position = np.concatenate([log.motion.position for log in dataset.training])
    longest = np.ptp(position) / FEWEST_CYCLES
    seen = with_what_repeats(base, dataset)
    assert any(s["p"] > 2.0 * longest for s in tried_shapes(CATALOGUE["cogging"], seen))
    assert all(s.shape["p"] <= longest for s in starts(base, dataset, CATALOGUE["cogging"]))


def test_a_tone_in_the_residual_is_among_the_first_lines_tried(dataset):
    base = finished(PLAIN, PLAIN, dataset.training, Outcome.CONVERGED)
    tone = np.concatenate([np.sin(2.0 * np.pi * 7.3 * w.time) for w in dataset.training])
    loud = replace(base, residual=tone[base.kept])
    known = replace(dataset, covered=lambda: replace(SEEN, repeats=Repeating((3.21, 4.56))))
    found = with_what_repeats(loud, known)
    assert found.lines[-2:] == (3.21, 4.56)
    assert abs(found.lines[0] - 7.3) < 0.5
    assert len(found.lines) <= RESIDUAL_LINES + 2
    assert replace(found, repeats=known.excitation.repeats) == known.excitation
    assert (found.pitches, found.thrust_pitches) == (loud.pitches, loud.thrust_pitches)


@pytest.mark.parametrize("name", ["axis_coupling", "cogging", "coulomb_viscous"])
def test_a_start_leaves_what_joint_least_squares_leave(dataset, base, name):
    """Of its strengths and the parameters of the base, without the friction that it replaces."""
    found = starts(base, dataset, CATALOGUE[name])[0]
    where = [ParameterReference(name, p) for p in found.fitted.effect.strengths]
    axis = base.axis.with_effect(found.fitted)
    stays = [not c.effect or c.effect in axis.without(name).names for c in base.scaling.where]
    own = jacobian(axis, dataset.training, where)[base.kept]
    both = np.hstack([own, base.jacobian[:, stays]])
    both = both / np.maximum(np.linalg.norm(both, axis=0), 1e-300)
    force = residual(axis, dataset.training)[base.kept]
    left = force - both @ np.linalg.lstsq(both, force, rcond=1e-9)[0]
    assert found.squared_error == pytest.approx(float(left @ left), rel=1e-3)
    np.testing.assert_allclose(found.force, force, atol=1e-6 * np.abs(force).max())


def test_a_strength_stops_at_its_bound():
    log = PreparedLog.of(pushed(built_motion("one", 3.0, 1), fitted("quadratic_drag", c=5.0)), 0.04)
    log = replace(log, command=log.command - 2.0 * residual(PLAIN, [log]))
    dataset = replace(built_dataset(), training=(log,))
    (found,) = starts(finished(PLAIN, PLAIN, dataset.training, Outcome.CONVERGED), dataset,
                      CATALOGUE["quadratic_drag"])  # fmt: skip
    assert found.fitted.values["c"] == 0.0


def test_without_an_effect_the_rest_stays_where_it_was(dataset, base):
    found = fit_without(base, dataset, "constant_force")
    assert found.axis == base.axis.without("constant_force")
    assert (found.begun, found.outcome) == (base.begun, base.outcome)
    np.testing.assert_allclose(
        found.residual, residual(base.axis, dataset.training)[found.kept] - 0.2, atol=1e-9
    )


def test_a_stop_that_only_a_late_move_reaches_is_the_first_start():
    """The heads, on which no strength of it makes a force, tell nothing of it."""
    plain = built_motion("late", 10.0)
    time = PERIOD * np.arange(len(plain.position))
    turn = 2.0 * np.pi * np.clip(time - 8.5, 0.0, 1.5) / 1.5
    x = plain.position + 0.04 * np.sin(turn) * (1.0 - np.cos(turn))
    v = np.gradient(x, PERIOD)
    u = plain.command + 5.3 * np.gradient(v - plain.velocity, PERIOD)
    motion = replace(plain, track=Blocks(np.stack([x, v, u]), np.stack([v, u])))
    low, high = (x.min() + 0.05 * np.ptp(x), x.max() - 0.05 * np.ptp(x))
    stopped = pushed(motion, fitted("end_stop", low=low, high=high, stiffness=2000.0))
    covered = replace(SEEN, position_low=float(x.min()), position_high=float(x.max()))
    dataset = replace(
        built_dataset(), training=(PreparedLog.of(stopped, 0.04),), covered=lambda: covered
    )
    (head,) = dataset.heads
    found = starts(fit_axis(PLAIN, dataset.training), dataset, CATALOGUE["end_stop"])
    first = found[0].shape
    assert first["low"] < head.motion.position.min()
    assert first["high"] > head.motion.position.max()
    assert not found[0].is_silent
    assert (first["low"], first["high"]) == pytest.approx((low, high), abs=0.03 * np.ptp(x))


def test_a_shape_is_sought_anew_where_error_is_left_and_nowhere_else():
    """From a wrong pitch a fit ends beside the right one; what is held stays held."""
    right = fitted("cogging", p=0.02, a1=0.4, b1=0.1)
    right = replace(right, fixed=right.fixed | {"b1"})
    dataset = built_machine(built_dataset("one", "two"), axis_of(right))
    begun = axis_of(replace(right, values={**right.values, "p": 0.031, "a1": 0.01}))
    stuck, found = fit_axis(begun, dataset.training), fit_multistart(begun, dataset)
    assert found.error < 0.1 * stuck.error
    values = found.axis["cogging"].values
    assert (values["p"], values["a1"]) == pytest.approx((0.02, 0.4), rel=0.01)
    assert (values["b1"], found.axis["cogging"].fixed) == (0.1, right.fixed)
    assert found.begun is begun
    quiet = fit_multistart(found.axis, dataset, begun=begun)
    assert quiet.error == pytest.approx(found.error, rel=1e-3)
    assert quiet.begun is begun


def bounded(name: str, **bounds: tuple[float, float, float]):
    """The effect with other starts and bounds of its strengths."""
    effect = CATALOGUE[name]
    parameters = tuple(
        replace(p, start=bounds[p.name][0], lower=bounds[p.name][1], upper=bounds[p.name][2])
        if p.name in bounds
        else p
        for p in effect.parameters
    )
    return replace(effect, parameters=parameters)


@pytest.mark.parametrize(("begin", "truth"), [(0.0, 0.5), (0.03, 0.5), (0.03, -0.5), (-0.03, 0.04)])
def test_a_strength_is_the_best_within_its_bounds_wherever_it_begins(begin, truth):
    """The least squares of one strength within bounds are the free ones, clipped."""
    dataset = planted("constant_force", F0=truth)
    base = fit_axis(PLAIN, dataset.training)
    narrow = bounded("constant_force", F0=(begin, -0.06, 0.08))
    (free, *_), (found, *_) = (
        starts(base, dataset, e) for e in (CATALOGUE["constant_force"], narrow)
    )
    best = free.fitted.values["F0"]
    assert best == pytest.approx(truth, abs=0.01)
    assert found.fitted.values["F0"] == pytest.approx(np.clip(best, -0.06, 0.08), rel=1e-3)
    if not -0.06 < best < 0.08:
        assert found.squared_error > free.squared_error


def test_of_several_strengths_each_stays_within_its_bounds():
    dataset = planted("spring", k1=20.0, k2=60.0, offset=0.0, k3=0.0, middle=0.0)
    base = fit_axis(PLAIN, dataset.training)
    narrow = bounded("spring", k1=(5.0, -1.0, 8.0), k2=(-9.0, -10.0, 30.0))
    found = starts(base, dataset, narrow)[0].fitted.values
    assert found["k1"] == pytest.approx(8.0, rel=1e-3)
    assert found["k2"] == pytest.approx(30.0, rel=1e-3)
