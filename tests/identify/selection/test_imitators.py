"""A law whose knee the motion does not pass is not named: it is another law there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from built_fits import CATALOGUE
from numpy.typing import NDArray
from planted_logs import FIRST, HARDWARE, RATE, SLIDE, Ride, asked, begun, few, having, logged

from identify.dataset.dataset import Dataset
from identify.estimation.fit import Fit, fit_axis, fit_themselves, turned
from identify.output.words.findings import finding_in_words
from identify.output.words.refusal import refusal_in_words
from identify.selection.candidates import imitation_of
from identify.selection.findings import FindingKind
from identify.selection.refusal import OutsideKnee
from identify.selection.trying import try_effect
from twin.knee import Imitated
from twin.logs import Log
from twin.model.machine import AxisModel

Array = NDArray[np.float64]

BARE = AxisModel(5.3, HARDWARE)
SHORT = replace(FIRST, seconds=4.0)


def commanded(axis: AxisModel, ride: Ride, command: Callable[[Array], Array]) -> Log:
    """A log whose command is that of the force on the axis, (n,) N -> (n,) N."""
    log = logged(axis, ride)
    own = log.axes["x"]
    columns = {**own.columns, "force": command(own.columns["force"])}
    return replace(log, axes={"x": replace(own, columns=columns)})


def fitted(
    base: AxisModel, true: AxisModel, command: Callable[[Array], Array] = lambda u: u
) -> tuple[Fit, Dataset]:
    """A base fitted to two logs of a machine, and one more held out."""
    one, two, held = (commanded(true, replace(SHORT, seed=i), command) for i in (1, 2, 3))
    return begun(base, {"one": one, "two": two}, {"held": held})


@pytest.mark.short(1)
@pytest.mark.parametrize("known", [(), ("spring",)])
def test_what_does_not_slip_within_the_travel_is_a_spring(known):
    """Named as friction with 99 %, one without a bound: Fc = 5e14 N."""
    sticking = ("dahl", "presliding_hysteresis")
    found = asked(BARE, having(BARE, "spring", k1=6.0), few(*sticking, *known), ride=SHORT)
    assert found.answers == tuple((name,) for name in known)
    refused = {c.effect.name: c.refused for c in found.ranking}
    assert {refused[name].of for name in sticking} == {Imitated.SPRING}


@pytest.mark.parametrize(("pitch", "imitated"), [(0.05, Imitated.OF_POSITION), (0.03, None)])
def test_what_repeats_too_few_times_is_told_as_a_force_of_position(pitch, imitated):
    """It was "unexplained". Whether it repeats, 2.1 cycles do not tell, 3.5 do; pitch: m."""
    true = having(SLIDE, "cogging", p=pitch, a1=0.4)
    (finding,) = asked(SLIDE, true, few("cogging", "quadratic_drag"), ride=SHORT).findings
    assert (finding.effect, finding.imitated) == ("cogging", imitated)
    assert finding.kind is (FindingKind.RESEMBLES if imitated else FindingKind.MISSING)
    told = "what is missing is a force of position, as cogging is here"
    assert finding_in_words(finding)[0].startswith(told if imitated else "cogging explains")


@pytest.mark.slow  # 5 s
def test_beside_a_force_of_position_another_is_more_of_it():
    """The second was named as a cogging with 99 %, or as a spring."""
    known = few("cogging", "spring", "quadratic_drag")
    true = having(having(SLIDE, "cogging", p=0.055, a1=0.4), "quadratic_drag", c=3.0)
    found = asked(SLIDE, true, known, lambda x, v: 0.2 * np.sin(2 * np.pi * x / 0.04 + 1.0), SHORT)
    told = {f.effect: f.kind for f in found.findings}
    assert told.pop("quadratic_drag") is FindingKind.MISSING
    assert len(told) == 2
    assert set(told.values()) == {FindingKind.RESEMBLES}


def test_what_a_free_curve_misses_between_its_knots_is_no_cogging():
    """A spring of another shape, and with 99 % two coggings of 4 mN, three knots a period."""
    true = having(SLIDE, "cogging", p=0.0545, a1=0.4)
    found = asked(SLIDE, true, few("cogging", "spring"), ride=SHORT)
    assert found.answers == (("spring",),)


@pytest.mark.parametrize(
    ("imitator", "mass", "gain", "told"),
    [
        ("actuator_saturation", 1.0, 1.25, Imitated.GAIN),
        ("actuator_saturation", 0.5, 1.0, Imitated.GAIN),
        ("base_vibration", 2.0, 1.0, Imitated.INERTIA),
    ],
)
def test_a_gain_and_an_inertia_are_no_limit_and_no_frame(imitator, mass, gain, told):
    """Mass held at that part of the true one; gain: command over force.

    A saturation at 0.15 mN of 30 N was named with 99 %.
    """
    held = replace(SLIDE, mass=mass * SLIDE.mass, mass_fixed=True)
    found = try_effect(*fitted(held, SLIDE, lambda u: gain * u), CATALOGUE[imitator])
    assert isinstance(found.refused, OutsideKnee)
    assert found.refused.of is told
    assert refusal_in_words(found.refused).endswith(f"so that it is {told.value} here")


LIMIT, WIDTH, LAG = 3.0, 2.0, 4e-3  # N: a fifth of the commands are beyond, a tenth of the largest


@pytest.mark.short(1)
@pytest.mark.parametrize(
    ("name", "value", "command"),
    [
        ("actuator_saturation", LIMIT, lambda u: 2.0 * u - np.clip(u, -LIMIT, LIMIT)),
        ("actuator_deadband", WIDTH, lambda u: u + WIDTH * np.sign(u)),
        ("actuator_lag", LAG, lambda u: u + LAG * RATE * np.append(np.diff(u), 0.0)),
    ],
)
def test_a_law_of_the_actuation_is_found_where_the_motion_passes_its_knee(name, value, command):
    found = try_effect(*fitted(SLIDE, SLIDE, command), CATALOGUE[name])
    assert found.refused is None
    assert found.fit.axis[name].vector()[0] == pytest.approx(value, rel=0.1)


@pytest.mark.short(2)
@pytest.mark.parametrize(
    ("law", "values"),
    [("actuator_saturation", {"limit": 5.0, "loss": 0.5}), ("actuator_deadband", {"width": 0.3}),
     ("actuator_lag", {"tau": 4e-3}), ("torque_constant", {"error": 0.1})],
)  # fmt: skip
def test_no_refit_lets_an_actuation_take_the_command(law, values):
    """Friction and spring are taken out, the mass is free: 0.2 mN of 1.5 N had been left."""
    true = having(SLIDE, "spring", k1=60.0)
    without, dataset = fitted(BARE, true)
    driven, _ = fitted(having(BARE, law, **values), true)
    assert driven.gain > 0.5
    assert driven.error > 0.75 * without.error
    own = driven.axis[law]
    assert own.effect.imitation(own.values, dataset.excitation) is None


def test_what_slips_does_not_become_the_spring_that_is_taken_out():
    """So that a refit without the spring had been as good, and the spring was dropped."""
    slips = having(SLIDE, "presliding_hysteresis", reach=0.045, f0=0.2)
    _, dataset = fitted(SLIDE, having(SLIDE, "spring", k1=6.0))
    alone, kept = (fit(slips, dataset.training) for fit in (fit_axis, fit_themselves))
    assert turned(slips, alone.axis, dataset.training) == ["presliding_hysteresis"]
    assert turned(slips, kept.axis, dataset.training) == []
    assert kept.error > 3.0 * alone.error
    assert kept.axis["presliding_hysteresis"].fixed == slips["presliding_hysteresis"].fixed


def test_a_mass_that_no_motion_told_is_nobodys_place():
    """The base of a light axis took its friction for inertia, and the friction was refused."""
    true = replace(SLIDE, mass=0.02)
    base, dataset = fitted(replace(BARE, mass=1.0), true)
    found = try_effect(base, dataset, CATALOGUE["coulomb_viscous"])
    assert base.axis.mass > 3.0 * found.fit.axis.mass
    assert found.refused is None


@pytest.mark.slow  # 2 s
def test_a_friction_out_of_step_is_no_late_motor():
    """A soft friction, as simulators make it, is ahead of its speed: a lag of 9 ms, with 98 %.

    That a late motor is one still is in ``test_ties``.
    """
    light = replace(SLIDE, mass=0.05)

    def rubbed(_: Array, speed: Array) -> Array:
        return -2.0 * np.tanh((speed + 0.003 * RATE * np.gradient(speed)) / 0.05)

    found = asked(light, light, few("actuator_lag", "actuator_delay"), rubbed, SHORT)
    (finding,) = found.findings
    assert (finding.effect, finding.kind) == ("coulomb_viscous", FindingKind.WRONG_SHAPE)


@pytest.mark.parametrize(
    ("friction", "imitated"),
    [({"Fc": 1.0, "Fs": 1.5, "sigma0": 5e4}, Imitated.WITHOUT_PEAK), ({}, None)],
)
def test_what_a_law_is_depends_on_the_friction_beside_it(friction, imitated):
    """A slip of 2 um is within the 20 um that bristles bend, and beyond what dry contacts do."""
    held = having(BARE, "lugre" if friction else "coulomb_viscous", **friction)
    axis = having(held, "dwell_stiction", growth=1.0, slip=2e-6)
    _, dataset = fitted(BARE, SLIDE)
    found = imitation_of(axis, axis["dwell_stiction"], (), dataset.excitation)
    assert (found and found.of) is imitated
