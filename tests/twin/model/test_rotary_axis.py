"""A rotary axis: its entries, its inertia and its hinge, and the counterparts of linear units."""

import re
from dataclasses import replace

import mujoco
import numpy as np
import pytest
from axis_kinds import (
    CATALOGUE,
    MACHINES,
    OF_A_SLIDE,
    ROTARY_AXIS,
    ROUNDING,
    SLIDE,
    machine,
    stated_units,
)

from identify import workflow
from identify.dataset.preparation import datasets
from identify.estimation.residual_dependence import unit_of
from identify.output import as_json, text
from twin.errors import InputError
from twin.experiments.file import format_experiment
from twin.experiments.kinds import Passes
from twin.experiments.named import simulate
from twin.model.file import format_model
from twin.model.units import LINEAR, ROTARY, units_of
from twin.mujoco.mjcf import machine_spec
from twin.simulator import ReducedSimulator


def test_a_plan_is_in_units_of_the_axis() -> None:
    model = machine(ROTARY_AXIS)
    chosen = workflow.plan(
        model, catalogue=CATALOGUE, duration=2.0, axis="c",
        between=(CATALOGUE["cogging"], CATALOGUE["quadratic_drag"]),
    )  # fmt: skip
    shown = text.plan_text(chosen)
    assert not (wrong := OF_A_SLIDE.search(shown)), wrong
    assert "N·m RMS unexplained" in shown
    assert stated_units(as_json.json_of(chosen)) == {"N m", "s"}
    planned = Passes("c", span=0.3, speed=0.2, repeats=1)
    file = format_experiment(planned, units=model.axis("c").units)
    assert "# rad, length of a pass" in file
    assert "# rad/s, held" in file


@pytest.mark.parametrize(
    ("log_of", "model_of", "message"),
    [
        ("rotary", SLIDE.replace("axes.x", "axes.c"), r"is rotary \(position in rad\), .* in m\)"),
        ("linear", ROTARY_AXIS.replace("axes.c", "axes.x"), r"is linear \(position in m\), .* rad"),
    ],
)  # fmt: skip
def test_a_log_of_the_other_kind_is_refused(log_of: str, model_of: str, message: str) -> None:
    log = simulate(machine(MACHINES[log_of][0]), "tracking", duration=1.0)
    for act in (workflow.fit, workflow.compare):
        with pytest.raises(InputError, match=message) as told:
            act(machine(model_of), {"run": log})
        assert "\n" not in str(told.value)


@pytest.mark.parametrize(
    ("toml", "message"),
    [
        (ROTARY_AXIS.replace("inertia", "mass = 1.0\ninertia"), "both mass and inertia"),
        (ROTARY_AXIS.replace("inertia = 0.02", ""), "no mass; .* kg m.2 for a rotary axis"),
        (ROTARY_AXIS.replace("0.02", "'big'"), "inertia = 'big': give a number .* kg m.2"),
        (ROTARY_AXIS.replace("= 0.01\n", "= -1.0\n"), r"sigma2 = -1 N m s/rad: outside"),
        (ROTARY_AXIS.replace("inertia", "inertja"), "did you mean 'inertia'"),
    ],
)
def test_a_wrong_rotary_axis_is_refused_in_its_units(toml: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as told:
        machine(toml)
    assert "\n" not in str(told.value)


def test_a_held_inertia_is_said_and_kept() -> None:
    model = machine(ROTARY_AXIS.replace("0.02", "0.02\nfixed = ['inertia']"))
    assert model.axes["c"].mass_fixed
    assert "inertia = 0.02 # kg m^2" in format_model(model)
    assert machine(format_model(model).partition("Hz\n")[2]).axes == model.axes


def test_a_stage_mounts_on_slides_and_hinges_of_its_own() -> None:
    mixed = machine(SLIDE + ROTARY_AXIS)
    spec = machine_spec(mixed)
    assert spec.joint("x").type == mujoco.mjtJoint.mjJNT_SLIDE
    assert spec.joint("c").type == mujoco.mjtJoint.mjJNT_HINGE
    log = simulate(mixed, "tracking", duration=1.0)
    assert (log.axes["x"].kind, log.axes["c"].kind) == (LINEAR, ROTARY)
    reduced = simulate(mixed, "tracking", duration=1.0, simulator=ReducedSimulator)
    for axis in "xc":
        gone = log.truth[axis]["position"] - reduced.truth[axis]["position"]
        assert np.abs(gone).max() < ROUNDING
    motion = datasets(mixed, {"run": log}, {})["x"].fit[0].motion
    assert unit_of("other_axis_velocity", motion) == "rad/s"
    assert unit_of("velocity", motion) == "m/s"


@pytest.mark.parametrize("effect", ["flexible_mode", "base_vibration", "backlash", "payload_mass"])
def test_attached_inertias_agree_on_a_hinge(effect: str) -> None:
    values = {"flexible_mode": "load = 0.3", "base_vibration": "recoil = 0.2",
              "backlash": "load = 0.3\nplay = 1e-3", "payload_mass": "ratio = 0.3"}  # fmt: skip
    model = machine(f"{ROTARY_AXIS}[axes.c.effects.{effect}]\n{values[effect]}\n")
    runs = [
        simulate(model, "tracking", duration=1.0, **more).truth["c"]["position"]
        for more in ({}, {"simulator": ReducedSimulator})
    ]
    assert np.abs(runs[0] - runs[1]).max() < 1e-12


def test_a_joint_of_the_other_kind_is_refused() -> None:
    spec = machine_spec(machine(ROTARY_AXIS))
    spec.compile()
    slide = replace(
        machine(SLIDE.replace("axes.x", "axes.c")), mjcf=spec.to_xml(), mjcf_name="c.xml"
    )
    with pytest.raises(InputError, match=r"joint 'c' is not a slide, but the axis is linear"):
        machine_spec(slide)


def test_what_repeats_may_repeat_once_a_turn() -> None:
    for effect in CATALOGUE.values():
        for p in effect.parameters:
            assert not p.period or p.upper > 2.0 * np.pi, f"{effect.name}.{p.name}"


UNITS = {
    "m": "rad", "m/s": "rad/s", "m/s^2": "rad/s^2", "m/s^3": "rad/s^3", "m rms": "rad rms",
    "N": "N m", "N^2": "(N m)^2", "kg": "kg m^2", "N s/m": "N m s/rad", "N/m": "N m/rad",
    "N/m^2": "N m/rad^2", "N/m^3": "N m/rad^3", "N s^2/m^2": "N m s^2/rad^2", "N/A": "N m/A",
    "N/s": "N m/s", "N/(m s)": "N m/(rad s)", "1/m": "1/rad", "1/N": "1/(N m)",
    "s^2/m": "s^2/rad", "A rms": "A rms", "1": "1", "s": "s", "Hz": "Hz", "1/J": "1/J", "": "",
}  # fmt: skip


@pytest.mark.parametrize("linear", UNITS)
def test_a_linear_unit_has_a_rotary_counterpart(linear: str) -> None:
    assert (LINEAR(linear), ROTARY(linear)) == (linear, UNITS[linear])


def test_no_unit_of_the_catalogue_keeps_a_length_a_force_or_a_mass() -> None:
    for effect in CATALOGUE.values():
        for p in effect.parameters:
            told = ROTARY(p.unit)
            rest = told.replace("N m", "").replace("kg m^2", "")
            assert not set(re.findall(r"[A-Za-z]+", rest)) & {"m", "N", "kg"}, (effect.name, told)


def test_words_have_a_rotary_counterpart_and_names_have_none() -> None:
    said = "Force error, free-running position error; forces at two Positions of constant_force"
    turned = "Torque error, free-running angle error; torques at two Angles of constant_force"
    assert (LINEAR.words(said), ROTARY.words(said)) == (said, turned)
    assert [units_of(u).kind for u in ("rad", "rad/s", "N m", "m", "s", None)] == (
        ["rotary"] * 3 + ["linear"] * 3
    )
