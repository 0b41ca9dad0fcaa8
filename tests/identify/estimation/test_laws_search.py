"""The search of an effect's shape: which values are tried, and how many of them."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from built_fits import (
    CATALOGUE,
    PLAIN,
    built_dataset,
    built_motion,
    fitted,
    pushed,
)

from identify.dataset.dataset import Dataset
from identify.dataset.prepared_log import PreparedLog
from identify.estimation.fit import Outcome, finished, fit_axis
from identify.estimation.variable_projection import (
    starts,
    tried_shapes,
    with_what_repeats,
)
from twin.effect import Excitation

# The rules as they were decided.
REFINED_STARTS, RESIDUAL_LINES, FEWEST_CYCLES = 2, 6, 2.5
RNG = np.random.default_rng(3)
SEEN = Excitation(-0.05, 0.07, 0.4, 0.3, 3.0, 1e-3)


@pytest.fixture(scope="module")
def dataset():
    return built_dataset("one", "two")


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


def planted(effect: str, **values: float) -> Dataset:
    """Two logs, longer than their heads, of an axis with one effect more; without values none."""
    motions = [built_motion(name, 7.0, seed) for seed, name in enumerate(("one", "two"))]
    if values:
        motions = [pushed(m, fitted(effect, **values)) for m in motions]
    return replace(built_dataset(), fit=tuple(PreparedLog.of(m, 0.04) for m in motions))


@pytest.mark.parametrize(
    ("effect", "values"),
    [
        ("quadratic_drag", {"c": 5.0}),
        ("periodic_disturbance", {"f": 11.0, "a": 0.1, "b": 0.05}),
        ("cogging", {"p": 0.0213, "a1": 0.1, "b2": 0.05}),
        ("end_stop", {"low": -0.0465, "high": 0.048, "stiffness": 500.0}),
    ],
)
def test_the_first_start_has_the_scanned_values_nearest_to_the_planted_ones(effect, values):
    """However many shapes there are, and although most are seen on the heads of the logs alone."""
    dataset, effect = planted(effect, **values), CATALOGUE[effect]
    base = fit_axis(PLAIN, dataset.fit)
    shapes = list(tried_shapes(effect, with_what_repeats(base, dataset)))
    found = starts(base, dataset, effect)
    assert len(found) == min(REFINED_STARTS, len(shapes))
    for name, value in found[0].shape.items():
        assert value == min((s[name] for s in shapes), key=lambda v: abs(v - values[name]))
    assert [s.squared_error for s in found] == sorted(s.squared_error for s in found)
    assert found[0].share(base) > 0.9


def test_where_nothing_gains_more_than_chance_one_start_is_enough():
    dataset = planted("cogging")
    found = starts(fit_axis(PLAIN, dataset.fit), dataset, CATALOGUE["cogging"])
    assert len(found) == 1


def test_a_wave_longer_than_the_logs_can_show_is_no_start():
    dataset = planted("cogging", p=0.09, a1=0.3)  # m; the travel is 0.1 m
    base = fit_axis(PLAIN, dataset.fit)
    position = np.concatenate([log.motion.position for log in dataset.fit])
    longest = np.ptp(position) / FEWEST_CYCLES
    seen = with_what_repeats(base, dataset)
    assert any(s["p"] > 2.0 * longest for s in tried_shapes(CATALOGUE["cogging"], seen))
    assert all(s.shape["p"] <= longest for s in starts(base, dataset, CATALOGUE["cogging"]))


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
