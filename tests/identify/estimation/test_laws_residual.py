"""Laws of the force residual: zero on an exact motion, additive, derived as it is computed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import HARDWARE, axis_of, fitted
from constructed import (
    LAG,
    PAYLOAD,
    RIPPLE,
    SENSING,
    SHORT,
    STICKY,
    effect,
    held,
    log_of,
    waves,
    windowed,
)
from machines import CATALOGUE, tracked

from identify.dataset.blocks import Blocks
from identify.dataset.motion import motion_of
from identify.dataset.prepared_log import REST_SPEED, PreparedLog, moving, scale_of, sticks
from identify.dataset.test_function import TestFunction
from identify.estimation.force_along import force_along, steady_friction
from identify.estimation.force_balance import (
    averaged_force,
    difference_step,
    jacobian,
    residual,
)
from identify.workflow import fit
from twin.effect import Kind
from twin.laws.trials import legal
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel
from twin.model.parameters import free_parameters, read, write

LOGS = [windowed(SHORT)]
FREE = [e for e in CATALOGUE.values() if any(not p.fixed for p in e.parameters)]


def drawn(one) -> Fitted:
    """The effect with strengths of either sign, none like another, of a force of about 1 N."""
    known = next((f for f in SENSING if f.effect is one), None)
    if known:
        return known
    share = dict(zip(one.starts(), np.random.default_rng(3).uniform(0.2, 1.0, 200), strict=False))
    size = {p.name: 0.4 * share[p.name] * min(p.upper, 1.0) for p in one.strengths}
    start = {p.name: p.start * (0.8 + 0.4 * share[p.name]) for p in one.parameters if not p.fixed}
    values = legal(one, {**one.starts(), **start, **size})
    if one.kind in (Kind.FORCE, Kind.STRUCTURE):
        weak = {n: 1e-3 * v if n in size else v for n, v in values.items()}
        force = np.std(averaged_force(AxisModel(1.7, effects=(Fitted.at_start(one, weak),)), LOGS))
        values = legal(one, {**weak, **{n: weak[n] * 0.7 / max(force, 1e-3) for n in size}})
    return Fitted.at_start(one, values)


def central(axis: AxisModel, logs, where) -> np.ndarray:
    """Central differences of the whole residual, coordinate by coordinate."""
    columns = []
    for c in where:
        value = read(axis, [c])[0]
        step = abs(difference_step(c, value, scale_of(LOGS)))
        low, high = max(value - step, c.parameter.lower), min(value + step, c.parameter.upper)
        ends = [residual(write(axis, [c], [v]), logs) for v in (low, high)]
        columns.append((ends[1] - ends[0]) / (high - low))
    return np.stack(columns, axis=1)


def assert_derived(axis: AxisModel, where, loose: float = 2e-3) -> None:
    """But for a fifth of the windows, where an event within a friction falls on another sample."""
    found, wanted = jacobian(axis, LOGS, where), central(axis, LOGS, where)
    for j, c in enumerate(where):
        size, value = np.linalg.norm(wanted[:, j]), read(axis, [c])[0]
        if value and size * abs(value) < 1e-5:
            continue  # lost in rounding
        off = np.sort(np.abs(found[:, j] - wanted[:, j]))[: -len(wanted) // 5]
        assert np.linalg.norm(off) <= loose * min(size, np.linalg.norm(found[:, j])), c.label


def beside(one: Fitted, *others: Fitted) -> AxisModel:
    """The effect on an axis with those of the others that are of another name and no friction."""
    axis = AxisModel(1.7)
    for other in others:
        twice = one.effect.kind is other.effect.kind is Kind.FRICTION
        if other.effect.name != one.effect.name and not twice:
            axis = axis.with_effect(other)
    return axis.with_effect(one)


@pytest.mark.parametrize("one", FREE, ids=lambda e: e.name)
def test_the_jacobian_is_the_difference_of_the_residual_beside_every_sensing_effect(one):
    partner = LAG if one.kind is Kind.ACTUATION else RIPPLE
    others = [STICKY, partner, *SENSING]
    if one.kind is not Kind.STRUCTURE:  # the answers of two structures are coupled
        others.append(PAYLOAD)
    axis = beside(drawn(one), *others)
    where = [c for c in free_parameters(axis) if c.effect == one.name][:3]
    # bristles are derived as if they followed a change of the load at once: half a per cent
    loose = 5e-3 if one.name == "load_dependent_friction" else 2e-3
    assert_derived(axis, [c for c in free_parameters(axis) if not c.effect] + where, loose)


@pytest.mark.parametrize("one", ["cogging", "load_dependent_friction", "actuator_lag"])
def test_derivatives_of_some_test_functions_are_those_of_all_there(one):
    axis = beside(drawn(CATALOGUE[one]), STICKY, *SENSING)
    logs, where = [*LOGS, *LOGS], free_parameters(axis)
    kept = np.random.default_rng(1).random(sum(map(len, logs))) < 0.6
    whole = jacobian(axis, logs, where)
    np.testing.assert_array_equal(jacobian(axis, logs, where, kept), whole[kept])


def test_a_friction_that_grows_with_its_load_bears_what_it_makes_itself():
    """A quarter of the load, the weight of a vertical axis above all."""
    friction = {"Fc": 10.0, "Fs": 10.0, "sigma2": 40.0}
    laws = [
        effect("constant_force", {"F0": -150.0}), effect("coulomb_viscous", friction),
        effect("load_dependent_friction", {"motor": 0.025}),
    ]  # fmt: skip
    true = AxisModel(20.0, Hardware(force_limit=1e3, travel=(-0.1, 0.1)), effects=tuple(laws))
    machine = MachineModel("worm", {"x": true}, 1000.0)
    log = tracked(machine, 1, 8.0, "moves")
    begun = true.with_effect(effect("load_dependent_friction", {"motor": 0.01}))
    given = machine.with_axis("x", replace(begun, mass=24.0))
    found = fit(given, {"a": log}, test_function=0.02).fits["x"]
    assert found.axis.mass == pytest.approx(20.0, rel=2e-3)
    assert found.axis["constant_force"].values["F0"] == pytest.approx(-150.0, rel=2e-3)
    assert found.axis["load_dependent_friction"].values["motor"] == pytest.approx(0.025, rel=2e-2)


def test_the_residual_of_an_exactly_integrated_motion_is_zero():
    """A held force on a free mass: the weak form is an identity, not an approximation."""
    rate = 1000.0
    t = np.arange(round(1.1 * rate)) / rate
    force = waves((3.0, 2.7, 0.3), (1.0, 31.0, 1.1))(t)
    x = held(force, 1.7, 1.0 / rate, 0.03, -0.02)
    log = windowed(motion_of(log_of(rate, x, force), "x", "log"))
    assert np.abs(residual(AxisModel(1.7), [log])).max() < 1e-7
    # a mass dm too large leaves -dm a
    left = residual(AxisModel(1.9), [log])
    np.testing.assert_allclose(left, -0.2 / 1.7 * log.command, atol=1e-7)
    pushed = AxisModel(1.7, effects=(effect("constant_force", {"F0": 0.37}),))
    np.testing.assert_allclose(residual(pushed, [log]), 0.37, rtol=1e-6)


def test_windows_with_standstill_are_left_out_for_a_friction_that_sticks_alone():
    velocity = np.full(800, 0.3)
    velocity[200:260] = 0.9 * REST_SPEED * 0.3
    velocity[500:560] = -1.1 * REST_SPEED * 0.3
    motion = replace(SHORT, track=Blocks(np.stack([velocity] * 3), np.zeros((2, 800))))
    window = TestFunction.of_length(0.04, motion.period)
    log = PreparedLog(motion, window, window, window.mean(velocity), window.mean(velocity))
    kept = moving([log, log], True)
    starts = np.arange(len(log)) * window.stride
    overlap = np.clip(np.minimum(starts + 40, 260) - np.maximum(starts, 200), 0, None)
    assert not kept[: len(log)][overlap > 10].any()
    assert kept[: len(log)][overlap == 0].all()
    # a window whose weight on the standstill is just under and just over 2 %
    part = np.cumsum(window.weights)
    for n, wanted in ((int(np.sum(part < 0.02)), True), (int(np.sum(part < 0.02)) + 1, False)):
        still = np.full(40, 0.3)
        still[:n] = 0.0
        one = replace(motion, track=Blocks(np.stack([still] * 3), np.zeros((2, 40))))
        found = moving([PreparedLog(one, window, window, np.zeros(1), np.zeros(1))], True)
        assert found.tolist() == [wanted]
    np.testing.assert_array_equal(kept[: len(log)], kept[len(log) :])
    assert moving([log, log], False).all()
    assert len(moving([log, log], False)) == 2 * len(log)
    assert sticks(AxisModel(1.0, effects=(PAYLOAD, effect("coulomb_viscous"))))
    assert not sticks(AxisModel(1.0, effects=(PAYLOAD, effect("lugre"))))


CABLE = {"offset": 0.05, "k1": 1.5, "k2": -2.0, "k3": 8.0}


def test_forces_are_those_of_the_law_at_that_place_and_speed() -> None:
    axis = AxisModel(2.0, HARDWARE, (fitted("cable_slab", **CABLE), *axis_of().effects))
    x, v = np.linspace(-0.1, 0.12, 40), np.linspace(0.3, 0.01, 40)
    force = force_along(axis, x, v, 1e-3, Kind.FORCE)
    np.testing.assert_allclose(force, -(0.05 + 1.5 * x - 2.0 * x**2 + 8.0 * x**3), rtol=1e-9)
    rubbing = -force_along(axis, x, v, 1e-3, Kind.FRICTION)
    np.testing.assert_allclose(rubbing, 0.31 + 0.53 * v, rtol=1e-9)
    back = force_along(axis, x, -v, 1e-3, Kind.FRICTION)
    np.testing.assert_allclose(back, rubbing, rtol=1e-9)


def test_a_state_goes_on_by_the_speed_and_the_length_of_a_sample() -> None:
    """Dahl's force after a way s is Fc (1 - exp(-sigma s / Fc)), whatever the samples."""
    period = 4e-3
    dahl = fitted("dahl", Fc=0.4, sigma0=250.0)
    way = 1e-2
    count = round(way / (0.005 * period))
    v = np.full(count, 0.005)
    x = np.cumsum(v) * period
    force = -force_along(AxisModel(1.0, HARDWARE, (dahl,)), x, v, period, Kind.FRICTION)
    middle = x - 0.5 * 0.005 * period
    np.testing.assert_allclose(force, 0.4 * (1.0 - np.exp(-250.0 * middle / 0.4)), atol=2e-3)


@pytest.mark.parametrize(("way", "place"), [(1.0, -0.1), (-1.0, 0.05)])
def test_steady_friction_is_what_the_laws_reach_at_one_place(way: float, place: float) -> None:
    """Stribeck's curve with the level of the place, more forwards than backwards."""
    lugre = fitted("lugre", Fc=0.285, Fs=0.335, v0=0.01, sigma2=0.018, sigma0=260.0, sigma1=0.6)
    local = fitted("position_dependent_friction", c1=0.06, c2=-0.015)
    axis = AxisModel(1.0, HARDWARE, (lugre, local, fitted("asymmetric_friction", coulomb=0.02)))
    along = np.pi * (place + 0.17) / 0.34
    level = (1.0 + 0.06 * np.cos(along) - 0.015 * np.cos(2 * along)) * (1.0 + 0.02 * way)
    for v in (0.002, 0.1):
        curve = level * (0.285 + 0.05 * np.exp(-((v / 0.01) ** 2))) + 0.018 * v
        assert steady_friction(axis, place, way * v) == pytest.approx(curve, rel=2e-3)
