"""A machine among its kind: what is off from it, and how few logs a new one needs."""

from __future__ import annotations

import numpy as np
import pytest
from fleet_cases import MODELS, panel

from identify.fleet.kind import begun, kind_of, kinds, off

MEAN, BETWEEN, WITHIN = 2.0, 0.05, 0.2


def test_the_kind_is_what_machines_differ_by_beyond_their_own_scatter() -> None:
    rng = np.random.default_rng(0)
    found = []
    for _ in range(50):
        values = MEAN + np.hypot(BETWEEN, 0.1) * rng.standard_normal(30)
        found.append(kind_of(values, np.full(30, 0.1)).spread)
    assert np.mean(found) == pytest.approx(BETWEEN, rel=0.4)
    assert kind_of(np.full(5, 2.0), np.full(5, 0.1)).expected(3.0, 0.1) == (2.0, 0.0)


def test_a_new_machine_is_known_by_fewer_logs_with_its_kind() -> None:
    """One log with it is worth ten without where machines differ less than nights do."""
    rng = np.random.default_rng(1)
    errors = {1: [], 10: [], "kind": []}
    for _ in range(300):
        others = MEAN + BETWEEN * rng.standard_normal(20)
        kind = kind_of(others + 0.02 * rng.standard_normal(20), np.full(20, 0.02))
        own = MEAN + BETWEEN * rng.standard_normal()
        logs = own + WITHIN * rng.standard_normal(10)
        errors[1].append(logs[0] - own)
        errors[10].append(logs.mean() - own)
        errors["kind"].append(kind.expected(float(logs[0]), WITHIN)[0] - own)
    rms = {name: np.sqrt(np.mean(np.square(e))) for name, e in errors.items()}
    assert rms["kind"] < rms[10] < rms[1]


def test_one_machine_that_is_off_from_its_kind_is_told() -> None:
    rng = np.random.default_rng(2)
    values = MEAN * (
        1.0 + 0.03 * rng.standard_normal((12, 1)) + 0.005 * rng.standard_normal((12, 20))
    )
    assert list(off([panel(values)])) == []
    values[7] *= 1.5
    (found,) = off([panel(values)])
    assert (found.machine, found.parameter) == ("m7", "lugre.Fc")
    assert found.value == pytest.approx(1.5 * found.usual, rel=0.15)
    assert list(off([panel(values[5:9])])) == []  # too few to tell what is usual


def test_a_model_begins_where_its_kind_is() -> None:
    model = MODELS.of("any").model
    rng = np.random.default_rng(3)
    values = rng.normal(2.5, 0.1, (8, 1)) + rng.normal(0.0, 0.02, (8, 20))
    panels = [panel(values, "coulomb_viscous.Fc")]
    told = [*kinds(panels, "stage")]
    made = begun(model, told).axes["x"]
    assert made["coulomb_viscous"].values["Fc"] == pytest.approx(2.5, abs=0.1)
    assert made.mass == model.axes["x"].mass
    (of_one,) = kinds(panels, "stage", "m3")
    assert of_one.machines == 7
    assert of_one.deviation < told[0].deviation
    assert [*kinds(panels, "another")] == []
