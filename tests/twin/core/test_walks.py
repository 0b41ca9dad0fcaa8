"""Walks of the laws along a motion agree: for several sets of parameters, for columns."""

from dataclasses import replace

import numpy as np
import pytest
from machines import CATALOGUE

from identify.dataset.blocks import Blocks
from identify.dataset.motion import Motion
from identify.dataset.prepared_log import total_force, total_forces
from twin.core.native import Table, build_table
from twin.core.settling import settle
from twin.core.walks import averaged_columns, reading_columns, walk, walk_sensing
from twin.effect import (
    A_OTHER,
    DT,
    INDEX,
    MOVED,
    OUT,
    PRESSURE,
    TIME,
    V_OTHER,
    WHEN,
    X_OTHER,
    Effect,
    Kind,
    Parameter,
    U,
    V,
    X,
)
from twin.model.machine import AxisModel, Fitted, axis_table
from twin.signals import Array

PERIOD, N = 1e-3, 400  # s, samples
PHYSICS = [e for e in CATALOGUE.values() if e.kind is not Kind.SENSING]


def motion(n: int = N) -> Motion:
    """With a rest, beside an axis that moves otherwise."""
    t, rng = PERIOD * np.arange(n), np.random.default_rng(7)
    x = 0.03 * np.sin(9.0 * t) + 0.002 * np.sin(70.0 * t)
    x[150:160] = x[150]
    signals = np.stack([x, np.gradient(x, PERIOD), 3.0 * np.cos(11.0 * t)])
    others = np.stack([0.5 * x, rng.normal(0.0, 0.1, n), rng.normal(0.0, 1.0, n)])
    return Motion("run", "x", Blocks(signals, signals[1:]), others, PERIOD, 0.5 * PERIOD, PERIOD,
                  0.0, time_origin=0.013)  # fmt: skip


def drawn(effect: Effect, seed: int) -> Fitted:
    """Values between start and a tenth of the way to a bound within reach."""
    rng, values = np.random.default_rng(seed), effect.starts()
    for p in effect.parameters:
        if not p.fixed:
            step = 0.3 * max(abs(p.start), 1e-2 * min(p.upper - p.lower, 1.0))
            values[p.name] = float(np.clip(p.start + rng.uniform(0, 1) * step, p.lower, p.upper))
        if p.at_least:
            values[p.name] = max(values[p.name], values[p.at_least])
    return Fitted.at_start(effect, values)


def by_effect(table: Table, along: Motion) -> Array:
    """Sum of the rows of a walk that gives the force of each effect by itself."""
    rows = np.zeros((len(table.entries), N))
    first, last, state, _, _ = table.axes[0]
    walk(
        table.entries, first, last, table.parameters, np.zeros(table.n_states), state,
        along.signals, along.others, along.period, 0, rows, table.masses[0], along.time_origin,
    )  # fmt: skip
    return rows.sum(axis=0)


def test_what_a_contact_holds_at_rest_balances_the_push() -> None:
    """Where the readings tell no motion, and less than the contact can hold pushes."""
    dahl = Fitted.at_start(CATALOGUE["dahl"], {"Fc": 8.0, "sigma2": 0.0, "sigma0": 2e6})
    table, n = axis_table({"": AxisModel(5.0, effects=(dahl,))}), 90
    rest, nothing, first, last, at = np.zeros((3, n)), np.zeros((3, n)), *table.axes[0][:3]
    pushed = np.repeat([3.0, -5.0, 7.0], 30)
    for room, holds in ((1e-3, pushed), (0.0, np.zeros(n))):
        moved = settle(
            table, rest, nothing, pushed, np.zeros(n), np.ones(n, bool), room, 1.0, PERIOD, 0.0
        )  # fmt: skip
        rows = np.zeros((len(table.entries), n))
        walk(
            table.entries, first, last, table.parameters, np.zeros(table.n_states), at,
            np.stack([rest[0], moved / PERIOD, rest[0]]), nothing, PERIOD, 0, rows,
        )  # fmt: skip
        assert rows.sum(axis=0)[29::30] == pytest.approx(-holds[29::30], abs=0.05)


@pytest.mark.parametrize("effect", PHYSICS, ids=lambda e: e.name)
def test_all_effects_together_give_the_sum_of_each(effect: Effect) -> None:
    along = motion()
    lugre = () if effect.kind is Kind.FRICTION else (drawn(CATALOGUE["lugre"], 1),)
    spring = () if effect.name == "cable_slab" else (drawn(CATALOGUE["cable_slab"], 2),)
    axes = [AxisModel(5.0, effects=(*lugre, *spring, drawn(effect, s))) for s in (3, 4, 5, 5)]
    tables = [axis_table({"": axis}) for axis in axes]
    together = total_forces(tables[0], np.stack([t.parameters for t in tables]), along)
    for found, table in zip(together, tables, strict=True):
        expected = by_effect(table, along)
        size = np.abs(expected).max()
        assert size > 0.0
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * size)
        np.testing.assert_array_equal(found, total_force(table, along))
    np.testing.assert_array_equal(together[3], together[2])  # no set knows of those before it


def test_no_effects_give_no_force() -> None:
    table = axis_table({"": AxisModel(5.0)})
    assert not total_forces(table, table.parameters[None], motion()).any()


def reads(p, s, io):
    io[OUT] = io[int(p[0])]


READS = Effect(
    Kind.FORCE, "s", "F", "none", (Parameter("slot", "1", 0.0, 0.0, 99.0, "m"),), reads, "f", "e"
)


@pytest.mark.parametrize("slot", [INDEX, TIME, DT, X, V, U, X_OTHER, V_OTHER, A_OTHER, WHEN, MOVED,
                                  PRESSURE, PRESSURE + 1, PRESSURE + 2])  # fmt: skip
def test_a_law_reads_what_each_sample_brings(slot: int) -> None:
    along, n = motion(), np.arange(N)
    along = replace(along, others=np.vstack([along.others, along.others[::-1] + 7.0]))
    table = axis_table({"": AxisModel(5.0, effects=(Fitted.at_start(READS, {"slot": slot}),))})
    brought = {
        INDEX: n, TIME: 0.013 + PERIOD * n, DT: PERIOD + 0.0 * n, WHEN: 0.5 + 0.0 * n,
        MOVED: 5.0 + 0.0 * n, **dict(zip((X, V, U), along.signals, strict=True)),
        **dict(zip((X_OTHER, V_OTHER, A_OTHER), along.others[:3], strict=True)),
        **{PRESSURE + i: along.others[3 + i] for i in range(3)},
    }  # fmt: skip
    for found in (by_effect(table, along), total_force(table, along)):
        np.testing.assert_allclose(found, brought[slot], rtol=1e-15)


COLUMNS = [e for e in CATALOGUE.values() if e.columns]
LAID = ({}, {"closed": 1.0, "per_metre": 40.0}, {"per_metre": 0.0, "per_speed": 5.0, "rest": 0.02})


@pytest.mark.parametrize("effect", COLUMNS, ids=lambda e: e.name)
@pytest.mark.parametrize("laid", LAID)
def test_columns_times_strengths_are_the_law(effect: Effect, laid: dict[str, float]) -> None:
    strengths = np.random.default_rng(3).normal(size=len(effect.strengths))
    names = [p.name for p in effect.strengths]
    laid = {name: value for name, value in laid.items() if name in effect.starts()}
    values = {**effect.starts(), **laid, **dict(zip(names, strengths, strict=True))}
    vector, along = [values[p.name] for p in effect.parameters], motion()
    table = build_table({"x": [(effect, vector)]}, [1.0])
    if effect.kind is Kind.SENSING:
        columns = reading_columns(effect, vector, along.signals[:2], PERIOD)
        wanted = np.empty(N)
        walk_sensing(
            table.entries, 0, 1, table.parameters, np.zeros(table.n_states), along.signals, PERIOD,
            wanted,
        )  # fmt: skip
        wanted -= along.signals[0]
    else:
        weights, stride = np.hanning(42)[1:-1] / np.hanning(42)[1:-1].sum(), 10
        columns = averaged_columns(
            effect, vector, along.signals, PERIOD, along.time_origin, weights, stride
        )
        force = total_force(table, along)
        wanted = np.lib.stride_tricks.sliding_window_view(force, 40)[::stride] @ weights
    np.testing.assert_allclose(columns.T @ strengths, wanted, atol=1e-13)


def test_a_reading_is_delayed_then_rippled_then_rounded_in_whatever_order_they_are_given() -> None:
    """A ripple that is far shorter than a sample's way, delayed by half a sample."""
    period, step, ripple = 1e-5, 1e-8, 1e-7  # m
    given = (
        Fitted.at_start(CATALOGUE["encoder_quantization"], {"step": step}),
        Fitted.at_start(CATALOGUE["encoder_ripple"], {"period": period, "a1": ripple}),
        Fitted.at_start(CATALOGUE["encoder_delay"], {"tau": 0.5 * PERIOD}),
    )
    x = 0.1 * PERIOD * np.arange(N) + 1.3e-6  # m, ten periods of the ripple a sample
    delayed = x - 0.05 * PERIOD
    asked = delayed + ripple * np.sin(2.0 * np.pi * delayed / period)
    for effects in (given, given[::-1]):
        table, reading = axis_table({"": AxisModel(5.0, effects=effects)}), np.empty(N)
        _, _, _, first, last = table.axes[0]
        walk_sensing(
            table.entries, first, last, table.parameters, np.zeros(table.n_states),
            np.stack([x, np.gradient(x, PERIOD)]), PERIOD, reading,
        )  # fmt: skip
        assert reading[5:] / step == pytest.approx(np.rint(reading[5:] / step), abs=1e-4)
        assert reading[5:] == pytest.approx(asked[5:], abs=0.6 * step)
