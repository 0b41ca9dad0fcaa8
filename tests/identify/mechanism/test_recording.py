"""The ways in which a recording of a mechanism is often another are told by name, in a second."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from benchmarks.second_simulator.arms import Changed, drawn, log_of
from identify.analysis.first_model import first_model
from identify.analysis.recording import SIGNALS, TORQUES, Exchanged, Scaled, misassigned
from identify.workflow import compare, diagnose, fit
from twin.effects import Catalogue, load_catalogue

CATALOGUE = load_catalogue()
FEW = Catalogue([CATALOGUE[n] for n in ("rotor_inertia", "torque_constant", "spring", "gravity")])


@cache
def recorded(weightless=False):
    """Three hinges of different weight, and their model."""
    arm = drawn(np.random.default_rng(5), 3, 250)
    arm = replace(arm, axes=("0 0 1", "0 1 0", "0 1 0"), slides=(False,) * 3, presliding=False)
    log = log_of(arm, Changed(weightless=weightless), 3, 8.0)
    return first_model({"log": log}, "arm", CATALOGUE, ("arm.xml", arm.text)), log


ALL = ("joint1", "joint2", "joint3")
WAYS = {
    "torque": (Scaled(("joint2",), -1.0, TORQUES), "its torque has the other sign"),
    "position": (Scaled(("joint2",), -1.0), "the other sign of its position (sign"),
    "both": (Scaled(("joint2",), -1.0, SIGNALS), "the other sign of its position and torque"),
    "of the motor": (Scaled(("joint2",), 1 / 80, TORQUES), "of the motor before a gear of"),
    "amperes of all": (Scaled(ALL, 0.1, TORQUES), "axis joint3: its torque is 0."),
    "degrees": (Scaled(ALL, 180 / np.pi), "with positions in deg"),
    "exchanged": (Exchanged("joint1", "joint2"), "axes joint1 and joint2: exchanged"),
    "sign and gear": (Scaled(("joint3",), -1 / 50, TORQUES), "and has the other sign, as that"),
}


@pytest.mark.parametrize("way", WAYS)
def test_it_is_told_by_name_and_read_right(way):
    lie, said = WAYS[way]
    model, log = recorded()
    found = misassigned(model, lie(log))
    assert found is not None
    assert said in found.said
    assert found.after < 0.3 * found.before
    right = found.read(lie(log)).axes["joint2"]
    assert np.corrcoef(right.position, log.axes["joint2"].position)[0, 1] > 0.99


def test_a_weight_that_is_taken_out_is_told_and_the_rest_is_of_the_whole_torque():
    model, log = recorded(weightless=True)
    found = diagnose(model, {"a": log}, catalogue=FEW)
    assert found.recording is not None
    assert "weight of the links taken out" in found.recording.said
    assert str(found).startswith("The recording is not what the model needs: the recorded torques")
    assert not any(d.findings for d in found.axes.values())
    assert not found.bodies


@pytest.mark.parametrize("ask", [fit, compare])
def test_every_command_reads_it_right_and_says_so(ask):
    model, log = recorded()
    told = ask(model, {"a": Scaled(("joint2",), -1.0, TORQUES)(log)})
    assert told.recording is not None
    assert str(told).startswith(
        "The recording is not what the model needs: axis joint2: its torque"
    )


def test_a_recording_that_is_right_is_read_as_it_is():
    assert misassigned(*recorded()) is None
