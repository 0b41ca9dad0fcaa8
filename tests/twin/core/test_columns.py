"""Columns of a law of many strengths: times the strengths they are the law, averaged."""

from __future__ import annotations

import numpy as np
import pytest

from twin.core.native import build_table
from twin.core.walks import averaged_columns, reading_columns, walk_sensing, walk_sets
from twin.effect import Effect, Kind
from twin.effects import load_catalogue

PERIOD = 1e-3  # s
TIME = PERIOD * np.arange(4000)
WEIGHTS = np.hanning(42)[1:-1] / np.hanning(42)[1:-1].sum()
STRIDE = 10
EFFECTS = [e for e in load_catalogue().values() if e.columns and e.kind is not Kind.SENSING]
SENSING = [e for e in load_catalogue().values() if e.columns and e.kind is Kind.SENSING]
LAID = ({}, {"closed": 1.0, "per_metre": 40.0}, {"per_metre": 0.0, "per_speed": 5.0, "rest": 0.02})


def motion() -> np.ndarray:
    x = 0.1 * np.sin(TIME) + 0.02 * np.sin(11.0 * TIME)
    x[1500:1600] = x[1500]  # at rest
    return np.stack([x, np.gradient(x, PERIOD), np.cos(TIME)])


@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
@pytest.mark.parametrize("laid", LAID)
def test_columns_times_strengths_are_the_law(effect: Effect, laid: dict[str, float]) -> None:
    rng = np.random.default_rng(3)
    strengths = rng.normal(size=len(effect.strengths))
    names = [p.name for p in effect.strengths]
    laid = {name: value for name, value in laid.items() if name in effect.starts()}
    values = {**effect.starts(), **laid, **dict(zip(names, strengths, strict=True))}
    vector = [values[p.name] for p in effect.parameters]
    signals = motion()
    columns = averaged_columns(effect, vector, signals, PERIOD, 0.0, WEIGHTS, STRIDE)

    table = build_table({"x": [(effect, vector)]}, [1.0])
    force = np.zeros((1, len(TIME)))
    walk_sets(
        table.entries, 0, 1, table.parameters[None], table.n_states, signals,
        np.zeros_like(signals), PERIOD, 0, force, 1.0, 0.0,
    )  # fmt: skip
    windows = np.lib.stride_tricks.sliding_window_view(force[0], len(WEIGHTS))[::STRIDE]
    np.testing.assert_allclose(columns.T @ strengths, windows @ WEIGHTS, atol=1e-13)


@pytest.mark.parametrize("effect", SENSING, ids=lambda e: e.name)
def test_columns_times_strengths_are_the_error_of_the_reading(effect: Effect) -> None:
    strengths = np.random.default_rng(3).normal(size=len(effect.strengths))
    names = [p.name for p in effect.strengths]
    values = {**effect.starts(), **dict(zip(names, strengths, strict=True))}
    vector, signals = [values[p.name] for p in effect.parameters], motion()[:2]
    columns = reading_columns(effect, vector, signals, PERIOD)

    table = build_table({"x": [(effect, vector)]}, [1.0])
    readings = np.empty(len(TIME))
    walk_sensing(
        table.entries, 0, 1, table.parameters, np.zeros(table.n_states), signals, PERIOD, readings
    )
    np.testing.assert_allclose(columns.T @ strengths, readings - signals[0], atol=1e-13)


def test_there_are_such_laws() -> None:
    assert EFFECTS
    assert SENSING
