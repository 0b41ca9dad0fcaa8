"""The same data in other units of force and length give the same fit, whatever the effect.

Every effect of the catalogue is scanned for and fitted beside a friction on a log that holds a
little of all of them, and on the same log with positions and forces a hundred times smaller or
larger. Time has one unit.
"""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from constructed import Array, log_of, waves
from machines import CATALOGUE

from identify.dataset.dataset import Dataset
from identify.dataset.motion import motion_of
from identify.dataset.preparation import datasets
from identify.dataset.prepared_log import total_force
from identify.estimation.fit import Fit, at_bounds, fit_axis
from identify.estimation.scaling import limits_of
from identify.estimation.variable_projection import starts
from twin.effect import Effect, Kind
from twin.laws.trials import moderate
from twin.model.machine import AxisModel, Fitted, MachineModel, axis_table
from twin.model.units import Scale, dimension

RATE = 1000.0  # Hz
UNITS = [(0.01, 20.0), (100.0, 0.01)]
FRICTION = {"Fc": 0.4, "Fs": 0.4, "sigma2": 1.1}
MASS = 2.3  # kg
SMALL = 0.03  # N RMS of each effect
SAME = 1e-3  # relative, between the ends of two searches that stop at a small fall of the error
# A plain axis has nothing of what those of joints read, and these logs no channels.
EFFECTS = [e for e in CATALOGUE.values() if not (e.is_nonparametric or e.of_joints or e.channels)]
TURNING = {e.name for e in EFFECTS if e.suits and e.suits((), True) > e.suits((), False)}
IN_METRES = {"encoder_ripple.period"}  # tried at the signal periods of the scales that are sold


def in_units(fitted: Fitted, length: float, force: float) -> Fitted:
    """The same effect where lengths and forces are multiplied by these."""
    newton, metre, _ = np.array([dimension(p.unit) for p in fitted.effect.parameters]).T
    factors = force ** newton.astype(float) * length ** metre.astype(float)
    values = dict(zip(fitted.values, factors * list(fitted.values.values()), strict=True))
    return Fitted.at_start(fitted.effect, values)


@cache
def logged() -> tuple[Array, Array, Array]:
    """Positions (m) of two axes and the force (N) of one that has every effect, (n,) each."""
    rng = np.random.default_rng(1)
    t = np.arange(round(4.0 * RATE)) / RATE
    x, y = waves((0.09, 0.6, 0.3), (0.02, 1.7, 1.0))(t), waves((0.05, 0.9, 2.0))(t)
    axis = AxisModel(MASS, effects=(Fitted.at_start(CATALOGUE["coulomb_viscous"], FRICTION),))
    for effect in EFFECTS:
        if effect.kind not in (Kind.FRICTION, Kind.SENSING):
            axis = axis.with_effect(Fitted.at_start(effect, moderate(effect, rng, SMALL)))
    table = axis_table({"": axis})
    command = inertia = MASS * np.gradient(np.gradient(x, t), t)
    for _ in range(3):  # for what depends on the motor's force
        motion = motion_of(log_of(RATE, x, command, y), "x", "log", ripples=())
        command = inertia - np.interp(t, motion.time, total_force(table, motion))
    return x, y, command + rng.normal(0.0, 2e-3, len(t))


@cache
def begun(length: float, force: float, rubs: bool = True) -> tuple[Fit, Dataset]:
    x, y, command = logged()
    friction = in_units(Fitted.at_start(CATALOGUE["coulomb_viscous"], FRICTION), length, force)
    axis = AxisModel(2.0 * MASS * force / length, effects=(friction,) if rubs else ())
    model = MachineModel("stage", {"x": axis, "y": axis}, RATE)
    log = log_of(RATE, length * x, force * command, length * y)
    dataset = datasets(model, {"log": log}, {})["x"]
    return fit_axis(axis, dataset.training), dataset


def of_friction(effect: Effect) -> bool:
    return effect.suits is None or effect.suits((CATALOGUE["coulomb_viscous"],), False) == (
        effect.suits((), False)
    )


@cache
def fitted_in(effect: Effect, length: float, force: float) -> Fit:
    base, dataset = begun(length, force, of_friction(effect))
    start = starts(base, dataset, effect)[0]
    return fit_axis(base.axis.with_effect(start.fitted), dataset.training)


def differing(effect: Effect, length: float, force: float) -> list[str]:
    """What is another in these units: relative error of the fit, parameters, bounds that hold."""
    here, there = fitted_in(effect, 1.0, 1.0), fitted_in(effect, length, force)
    out = []
    if at_bounds(here, effect.name) != at_bounds(there, effect.name):
        out.append("bounds")
    if not IN_METRES.isdisjoint(f"{effect.name}.{p.name}" for p in effect.parameters):
        return out
    if abs(there.error / force / here.error - 1.0) > SAME:
        out.append(f"error {here.error:g} N, {there.error / force:g} N")
    back = in_units(there.axis[effect.name], 1.0 / length, 1.0 / force)
    for p in effect.parameters:
        one, other = here.axis[effect.name].values[p.name], back.values[p.name]
        # Of a ratio that is nothing, such as of a payload that is not there, rounding decides.
        nothing = 1e-5 if p.unit == "1" else 0.0
        if abs(one - other) > SAME * max(abs(one), abs(other), nothing):
            out.append(f"{p.name} {one:g}, {other:g} {p.unit}")
    return out


@pytest.mark.short(12)
@pytest.mark.parametrize("effect", EFFECTS, ids=lambda e: e.name)
def test_a_fit_is_the_same_in_other_units(effect: Effect) -> None:
    units = [(1.0 if effect.name in TURNING else u[0], u[1]) for u in UNITS]  # a radian is one
    found = {u: differing(effect, *u) for u in units}
    assert not any(found.values()), found


def test_a_curve_over_speed_is_sought_where_the_motion_is() -> None:
    """What falls far beyond the highest speed is a constant; a value given beyond is kept."""
    p, scale = CATALOGUE["stribeck"].parameter("v0"), Scale(force=20.0, length=0.3, time=1.5)
    speed = 0.3 / 1.5
    low, high = limits_of(p, 0.01, scale)
    assert low < 1e-6 * speed
    assert high == pytest.approx(4.0 * speed)
    assert limits_of(p, 9.0 * speed, scale)[1] == pytest.approx(9.0 * speed)
    tau = CATALOGUE["actuator_lag"].parameter("tau")
    assert limits_of(tau, 0.0, scale) == (tau.lower, tau.upper), "time has one unit"
