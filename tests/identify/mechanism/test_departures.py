"""What of a mechanism must move away from its file is named on its body or joint, and nothing else.

Arms of bare MuJoCo whose files state rotors, damping and dry friction of their joints.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.arms import machine
from benchmarks.second_simulator.arms import Changed, drawn, inertia, log_of
from identify.analysis.first_model import first_model
from identify.mechanism.bodies import possible
from identify.mechanism.departures import departures_of
from identify.output.as_json import json_of
from identify.selection.refusal import Instead
from identify.selection.trying import try_effect
from identify.selection.what import What
from identify.workflow import diagnose, fit
from twin.effects import Catalogue, load_catalogue

CATALOGUE = load_catalogue()
FEW = Catalogue([CATALOGUE[n] for n in ("rotor_inertia", "torque_constant", "spring", "gravity")])


def arm_of(axes=("0 0 1", "0 1 0", "0 1 0")):
    """Three hinges, read without steps and recorded at 250 Hz."""
    arm = drawn(np.random.default_rng(5), len(axes), 250)
    still = tuple(False for _ in axes)
    coarse = np.full(len(axes), 1e-5)
    return replace(arm, axes=axes, slides=still, presliding=False, encoder=coarse)


ARM = arm_of()
OWN = inertia(ARM)


def found_of(changed, seed=1):
    logs = [{f"{i}": log_of(ARM, changed, 10 * seed + i, 8.0)} for i in range(2)]
    model = first_model(logs[0], "arm", CATALOGUE, ("arm.xml", ARM.text))
    fitted = fit(model, *logs)
    return departures_of(fitted.model, fitted.fits, fitted.datasets, FEW)


def named(found):
    return [(m.group.what, m.group.place) for m in found.moved]


@pytest.mark.short(1)
@pytest.mark.parametrize(
    ("changed", "right"),
    [
        (Changed(payload=0.8), [(What.BODY, "link3")]),
        (Changed(), []),
        (Changed(rotor={1: 0.4 * OWN[1]}), [(What.ROTOR, "joint2")]),
        (Changed(gain={1: 0.12}), [(What.GAIN, "joint2")]),
        pytest.param(
            Changed(payload=0.8, gain={1: -0.12}),
            [(What.BODY, "link3"), (What.GAIN, "joint2")],
            marks=pytest.mark.slow,
        ),
    ],
)
def test_what_is_changed_must_move_and_nothing_else(changed, right):
    found = found_of(changed)
    assert sorted(named(found), key=str) == sorted(right, key=str)
    if changed.payload:
        (body,) = found.bodies
        assert body.change[0] == pytest.approx(0.8, abs=max(body.band[0], 0.04))
    if right == [(What.BODY, "link3")]:  # beside which it is seen that torque is not held
        assert 0.2 / 250 < found.datasets["joint1"].channel_delay < 0.6 / 250


@pytest.mark.slow  # 3 s
def test_a_rotor_of_the_file_is_the_model_and_another_one_is_told_as_another_value():
    changed = Changed(rotor={1: 0.4 * OWN[1]})
    logs = [{f"{i}": log_of(ARM, changed, 30 + i, 8.0)} for i in range(2)]
    model = first_model(logs[0], "arm", CATALOGUE, ("arm.xml", ARM.text))
    for joint, axis in model.axes.items():
        stated = float(f"{ARM.armature[ARM.joints.index(joint)]:.4g}")
        assert axis["rotor_inertia"].values == {"inertia": stated}
        assert axis["rotor_inertia"].fixed == {"inertia"}
    found = diagnose(model, *logs, catalogue=FEW)
    assert [d.named for d in found.axes.values()] == [(), ("rotor_inertia",), ()]
    assert "of rotor_inertia the file says inertia = " in str(found)
    given = found.axes["joint2"].findings[0].parameters["inertia"]
    assert given == pytest.approx(ARM.armature[1] + 0.4 * OWN[1], rel=0.02)


def test_logs_of_a_load_that_is_held_another_way_disagree():
    ways = [Changed(payload=0.8, held=(0.25, 0.0, z)) for z in (0.1, -0.1)]
    logs = [{f"{i}": log_of(ARM, way, 50 + i, 8.0)} for i, way in enumerate(ways)]
    model = first_model(logs[0], "arm", CATALOGUE, ("arm.xml", ARM.text))
    found = diagnose(model, *logs, catalogue=FEW)
    assert not found.bodies
    assert found.disputed == {"link3": ("1",)}
    assert str(found).startswith("The logs disagree about body link3: 1 tells another change")
    assert json_of(found)["disputed"] == {"link3": ["1"]}


def test_a_body_has_the_nearest_parameters_that_it_can_have():
    ball = np.array([2.0, 0.0, 0.0, 0.0, 0.02, 0.02, 0.02, 0.0, 0.0, 0.0])
    assert possible(ball, np.eye(10), [ball]) is ball
    off = ball - np.array([2.5, 0.0, 0.0, 0.0, 0.05, 0.0, 0.0, 0.0, 0.0, 0.0])
    near = possible(off, np.eye(10), [ball])
    assert 0.0 <= near[0] < 0.1  # a mass below zero is none
    assert near[4] >= -1e-6
    assert near[4] + near[5] >= near[6] - 1e-6  # the triangle of moments


@pytest.mark.slow  # a diagnosis of three joints, 13 s
def test_a_body_is_told_beside_the_friction_that_was_found_after_it():
    """Alone its payload of 0.8 kg is 0.783 kg ± 0.013 kg, as a part of it is friction."""
    arm = replace(ARM, presliding=True)
    logs = [{f"{i}": log_of(arm, Changed(payload=0.8), 20 + i, 8.0)} for i in range(2)]
    model = first_model(logs[0], "arm", CATALOGUE, ("arm.xml", arm.text))
    few = Catalogue([CATALOGUE[n] for n in ("rotor_inertia", "spring", "lugre", "dahl")])
    fitted = fit(model, *logs)
    alone = departures_of(fitted.model, fitted.fits, fitted.datasets, few).bodies
    found = diagnose(model, *logs, catalogue=few).bodies
    (first,), (last,) = ([b for b in some if b.body == "link3"] for some in (alone, found))
    assert abs(first.change[0] - 0.8) > first.band[0]
    assert last.change[0] == pytest.approx(0.8, abs=last.band[0])
    assert abs(last.change[0] - 0.8) < 0.6 * abs(first.change[0] - 0.8)


@pytest.mark.slow
def test_a_rotor_that_a_lacking_friction_hides_is_asked_again_beside_it():
    arm = replace(arm_of(("0 1 0",)), presliding=True)
    changed = Changed(rotor={0: 0.1 * inertia(arm)[0]})
    logs = [{f"{i}": log_of(arm, changed, 40 + i, 8.0)} for i in range(2)]
    model = first_model(logs[0], "arm", CATALOGUE, ("arm.xml", arm.text))
    few = Catalogue([CATALOGUE[n] for n in ("rotor_inertia", "lugre", "dahl")])
    fitted = fit(model, *logs)
    alone = departures_of(fitted.model, fitted.fits, fitted.datasets, few)
    assert What.ROTOR not in [m.group.what for m in alone.moved]
    assert "rotor_inertia" in diagnose(model, *logs, catalogue=few).axes["joint1"].named


@pytest.mark.slow
def test_a_spring_that_turns_as_the_weight_does_is_no_doubt_beside_all_bodies():
    """One joint alone takes a tenth of its weight for it; all joints at once do not."""
    own = machine(98, 21)
    logs = [{f"{i}": log_of(own.arm, own.changed, 21000 + i)} for i in range(2)]
    model = first_model(logs[0], "arm", CATALOGUE, ("arm.xml", own.arm.text))
    fitted = fit(model, *logs)
    found = departures_of(fitted.model, fitted.fits, fitted.datasets, FEW)
    ((_, joint),) = named(found)
    known, spring = found.datasets[joint], CATALOGUE["spring"]
    assert try_effect(found.fits[joint], known, spring).doubt is None
    alone = replace(known, beside_bodies=False)
    assert try_effect(found.fits[joint], alone, spring).doubt is Instead.WEIGHT_OF_BODIES


@pytest.mark.slow
@pytest.mark.parametrize("number", [7, 19])
def test_the_soft_friction_of_a_light_joint_is_no_late_motor_and_no_other_joints(number):
    """A lag (91 %) and a friction by another joint (82 %) were told of a friction alone."""
    own = machine(105, number)
    logs = [{f"{i}": log_of(own.arm, own.changed, 1000 * own.number + i)} for i in range(3)]
    model = first_model(logs[0], "arm", CATALOGUE, ("arm.xml", own.arm.text))
    found = diagnose(model, *logs, catalogue=CATALOGUE)
    told = {f.effect for axis in found.axes.values() for f in axis.findings}
    assert told <= {"coulomb_viscous"}
