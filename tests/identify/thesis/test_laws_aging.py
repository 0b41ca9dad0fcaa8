"""A machine that ages: what its laws make of logged states, and the drift that is found of it."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import CATALOGUE, fitted

from identify.thesis import aging, residuals
from twin.log import AxisLog, Log
from twin.model.file import load_model
from twin.model.machine import AxisModel, MachineModel
from twin.model.parameters import free_parameters

AGING = load_model("thesis_aging", CATALOGUE)


def aged(count: int = 400) -> tuple[AxisModel, dict[str, np.ndarray]]:
    """The axis that ages, and its states as they were logged: distance and heat that grow."""
    axis = AGING.axes["x"]
    return axis, {"wear_distance": np.linspace(0.0, 40.0, count),
                  "thermal_drift_heat": np.linspace(0.0, 3.0, count)}  # fmt: skip


def test_what_ages_a_friction_is_a_modifier_that_remembers():
    names = [f.effect.name for f in AGING.axes["x"].effects if aging._ages(f)]
    assert names == ["wear", "thermal_drift"]
    assert not aging._ages(fitted("asymmetric_friction"))
    assert not aging._ages(fitted("lugre"))


def test_the_level_that_a_machine_had_is_that_of_its_states():
    """Wear multiplies by 1 + 0.002 s, heat by exp(-0.05 E); a state is read every 100 samples."""
    axis, states = aged()
    at = np.repeat(np.arange(0, 400, aging.THINNED), aging.THINNED)
    s, heat = states["wear_distance"][at], states["thermal_drift_heat"][at]
    wear, drift = (axis[n] for n in ("wear", "thermal_drift"))
    np.testing.assert_allclose(aging._factor(wear, states), 1.0 + 0.002 * s)
    np.testing.assert_allclose(aging._factor(drift, states), np.exp(-0.05 * heat))
    log = SimpleNamespace(truth={"x": states})
    part = slice(100, 300)
    expected = 0.335 * np.mean(((1.0 + 0.002 * s) * np.exp(-0.05 * heat))[part])
    assert aging._true_level(axis, log, "x", part, "Fs") == pytest.approx(expected)


def test_a_drift_is_the_slope_of_the_second_half_over_the_distance(monkeypatch):
    """Forty parts of 10 s at 0.1 m/s; the level found grows by 0.003 per m once it is warm."""
    axis = AGING.axes["x"]
    young = replace(axis, effects=tuple(f for f in axis.effects if not aging._ages(f)))
    rate, parts = 20.0, 40
    t = np.arange(round(parts * aging.PART * rate)) / rate
    x = 0.05 * (2.0 * np.abs((t / 1.0) % 2.0 - 1.0) - 1.0)  # a triangle: 0.1 m/s both ways
    truth = {"position": x, "wear_distance": 0.0 * t, "thermal_drift_heat": 0.0 * t}
    log = Log(rate, {"x": AxisLog({"position": x, "force": x})}, truth={"x": truth})
    rng, seen = np.random.default_rng(2), []
    scatter = 1e-4 * rng.standard_normal(parts)

    def level(k: int) -> float:
        return 0.3 + 0.003 * max(k, parts // 2) + scatter[k]

    def fit(axis, logs):
        seen.append(logs)
        friction = residuals.friction_of(axis)
        found = replace(friction, values={**friction.values, "Fc": level(len(seen) - 1)})
        return SimpleNamespace(axis=axis.with_effect(found))

    monkeypatch.setattr(aging, "datasets", lambda machine, logs, held: {
        "x": SimpleNamespace(fit=len(logs["part"]))})  # fmt: skip
    monkeypatch.setattr(aging, "fit_axis", fit)
    names = [c.parameter.name for c in free_parameters(young)]
    wide = np.array([0.002 if n == "Fc" else 9.0 for n in names])
    monkeypatch.setattr(aging, "half_widths", lambda fit: wide)
    machine = MachineModel("m", {"x": axis}, rate)
    found = aging._drift(machine, "x", young, log)
    assert seen == [round(aging.PART * rate)] * parts
    np.testing.assert_allclose(found.found, [level(k) for k in range(parts)])
    np.testing.assert_allclose(found.half, 0.002)
    np.testing.assert_allclose(found.truth, 0.285)
    np.testing.assert_allclose(found.distance, 0.5 + np.arange(parts), atol=0.02)
    slope, error = found.slope
    late = slice(parts // 2, None)
    fine, spread = np.polyfit(found.distance[late], found.found[late], 1, cov=True)
    assert slope == pytest.approx(fine[0])
    assert slope == pytest.approx(0.003, abs=5.0 * error)
    assert error == pytest.approx(np.sqrt(spread[0, 0]))
    assert found.detected


def test_both_machines_run_alike_and_the_aging_alone_is_fitted_to_the_whole(monkeypatch):
    """The machine as it is, then the same without what ages it; planted beside found."""
    runs, drifts, wholes = [], [], []

    def simulate(machine, kind, *, seed, duration, simulator):
        runs.append((machine, seed, duration))
        return f"log {len(runs)}"

    def drift(machine, name, young, log):
        drifts.append((machine, name, young, log))
        return f"drift {len(drifts)}"

    def whole(machine, name, log):
        wholes.append((machine, log))
        axis = machine.axes[name]
        doubled = [replace(f, values={k: 2.0 * v for k, v in f.values.items()}) for f in
                   axis.effects]  # fmt: skip
        scaling = SimpleNamespace(
            where=[
                SimpleNamespace(effect=n, parameter=SimpleNamespace(name=p))
                for n, p in (("lugre", "Fc"), ("wear", "rate"), ("thermal_drift", "tau"))
            ]
        )
        return SimpleNamespace(
            axis=replace(axis, effects=tuple(doubled)), ratio=1.3, scaling=scaling
        )

    for name, stub in (("simulate", simulate), ("_drift", drift), ("_whole", whole)):
        monkeypatch.setattr(aging, name, stub)
    monkeypatch.setattr(aging, "half_widths", lambda fit: np.array([9.0, 0.1, 0.2]))
    found = aging.aging(AGING, 40.0, np.random.default_rng(1), lambda *_: None)
    assert (found.level, found.steady, found.ratio) == ("drift 1", "drift 2", 1.3)
    (old, one, _), (young, two, _) = runs
    assert old.axes["x"] == AGING.axes["x"]
    assert young.axes["x"].names == ("lugre",)
    assert one != two
    assert [d[3] for d in drifts] == ["log 1", "log 2"]
    assert all(d[2].names == ("lugre",) for d in drifts)
    assert [log for _, log in wholes] == ["log 1"]
    assert found.half == {"wear.rate": 0.1, "thermal_drift.tau": 0.2}
    planted = {k: (r.true, r.mean, r.unit) for k, r in found.planted.items()}
    assert planted == {
        "wear.rate": (0.002, 0.004, "1/m"), "thermal_drift.dry": (0.05, 0.1, "1/J"),
        "thermal_drift.viscous": (0.05, 0.1, "1/J"), "thermal_drift.tau": (60.0, 120.0, "s"),
    }  # fmt: skip


def test_the_whole_run_is_fitted_from_start_values_of_what_ages_alone(monkeypatch):
    seen = SimpleNamespace(
        excitation=SimpleNamespace(duration=500.0, speed_max=1.0), fit=("prepared",)
    )
    monkeypatch.setattr(aging, "datasets", lambda *_: {"x": seen})
    monkeypatch.setattr(aging, "fit_axis", lambda axis, logs: (axis, logs))
    axis, logs = aging._whole(AGING, "x", "log")
    assert logs == ("prepared",)
    assert axis["lugre"] == AGING.axes["x"]["lugre"]
    assert axis["thermal_drift"].values["tau"] == 250.0  # by its start rule, not as planted
    assert axis["wear"].values["rate"] == 0.0
