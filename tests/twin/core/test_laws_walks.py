"""The walk of several sets of parameters gives what the walk of one gives, effect by effect."""

import numpy as np
import pytest
from effect_runs import CATALOGUE

from identify.dataset.motion import Motion
from identify.dataset.prepared_log import total_force, total_forces
from twin.core.walks import walk
from twin.effect import Kind
from twin.model.machine import AxisModel, Fitted, axis_table

RNG = np.random.default_rng(7)
N, PERIOD = 400, 1e-3
PHYSICS = [e for e in CATALOGUE.values() if e.kind is not Kind.SENSING]


def motion() -> Motion:
    t = PERIOD * np.arange(N)
    x = 0.03 * np.sin(9.0 * t) + 0.002 * np.sin(70.0 * t)
    signals = np.stack([x, np.gradient(x, PERIOD), 3.0 * np.cos(11.0 * t)])
    others = np.stack([0.5 * x, RNG.normal(0.0, 0.1, N), RNG.normal(0.0, 1.0, N)])
    return Motion("run", "x", signals, others, PERIOD, 0.5 * PERIOD, PERIOD, 0.0, signals[1:],
                  time_origin=0.013)  # fmt: skip


def drawn(effect, seed):
    """Values between start and a tenth of the way to a bound within reach."""
    rng, values = np.random.default_rng(seed), effect.starts()
    for p in effect.parameters:
        if not p.fixed:
            step = 0.3 * max(abs(p.start), 1e-2 * min(p.upper - p.lower, 1.0))
            values[p.name] = float(np.clip(p.start + rng.uniform(0, 1) * step, p.lower, p.upper))
        if p.at_least:
            values[p.name] = max(values[p.name], values[p.at_least])
    return Fitted.at_start(effect, values)


def by_effect(table, along):
    """Sum of the rows of a walk that gives the force of each effect by itself."""
    rows = np.zeros((len(table.entries), N))
    first, last, state, _, _ = table.axes[0]
    walk(
        table.entries, first, last, table.parameters, np.zeros(table.n_states), state,
        along.signals, along.others, along.period, 0, rows, table.masses[0], along.time_origin,
    )  # fmt: skip
    return rows.sum(axis=0)


@pytest.mark.parametrize("effect", PHYSICS, ids=lambda e: e.name)
def test_all_effects_together_give_the_sum_of_each(effect):
    along = motion()
    lugre = () if effect.kind is Kind.FRICTION else (drawn(CATALOGUE["lugre"], 1),)
    spring = () if effect.name == "cable_slab" else (drawn(CATALOGUE["cable_slab"], 2),)
    axes = [AxisModel(5.0, effects=(*lugre, *spring, drawn(effect, s))) for s in (3, 4, 5)]
    tables = [axis_table({"": axis}) for axis in axes]
    sets = np.stack([table.parameters for table in tables])
    together = total_forces(tables[0], sets, along)
    for found, table in zip(together, tables, strict=True):
        expected = by_effect(table, along)
        size = np.abs(expected).max()
        assert size > 0.0
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * size)
        np.testing.assert_array_equal(found, total_force(table, along))


def test_a_set_does_not_know_of_those_before_it():
    """A friction with memory begins afresh in each set."""
    along, axis = motion(), AxisModel(5.0, effects=(drawn(CATALOGUE["lugre"], 1),))
    table = axis_table({"": axis})
    thrice = total_forces(table, np.stack([table.parameters] * 3), along)
    np.testing.assert_array_equal(thrice[1], thrice[0])
    np.testing.assert_array_equal(thrice[2], thrice[0])


def test_no_effects_give_no_force():
    table = axis_table({"": AxisModel(5.0)})
    assert not total_forces(table, table.parameters[None], motion()).any()
