"""Rotors that a MuJoCo file states as at the motor, not as the joint behind a gear feels them.

A data sheet has the inertia of the rotor itself. Before a gear of ratio n the joint feels n^2 times
that (B. Siciliano et al., Robotics: Modelling, Planning and Control, 2009, section 7.1.3), which is
what `armature` of MuJoCo has to be. What the log asks for beside the bodies of the file tells which
of the two it is.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from identify.analysis.recording import balances, head_of
from twin.checks import moves
from twin.checks.content import MAP
from twin.logs import Log
from twin.model.machine import MachineModel


@dataclass(frozen=True)
class RotorBeforeGear:
    """axis: of the joint. stated, asked: rotor of the file and that of the log, kg m^2 (kg).

    gear: turns of the motor for one of the joint.
    """

    axis: str
    stated: float
    asked: float
    gear: float

    @property
    def at_joint(self) -> float:
        """The stated one as the joint feels it behind the gear, kg m^2 (kg)."""
        return self.gear**2 * self.stated


def rotors_before_gears(model: MachineModel, log: Log) -> Iterator[RotorBeforeGear]:
    """The joints whose rotor is stated before the gear, by what a log asks for.

    model: of any machine; only the joints of a mechanism have such a rotor. The gear is that of the
    log's import map, or of the joint's motor in the file.
    """
    joints = {a: own for a, own in model.axes.items() if a in model.joints and a in log.axes}
    rotors = {a: own.weighed.mass - own.mass for a, own in joints.items() if moves(log, a)}
    gears = {a: _gear(model, log, a) for a, rotor in rotors.items() if rotor > 0.0}
    far, about = 2.0, 1.5  # times: a gear that matters; how near an inertia is so rough a one
    sure = 3.0  # times its error, that what the log asks for beside the stated one is
    if not any(gear > far for gear in gears.values()):
        return
    own = balances(model, head_of(model, log), [*rotors])
    for axis, gear in gears.items():
        more, error = own[axis].inertia()
        found = RotorBeforeGear(axis, rotors[axis], rotors[axis] + more, gear)
        near = found.at_joint / about < found.asked < found.at_joint * about
        if gear > far and near and more > sure * error:
            yield found


def _gear(model: MachineModel, log: Log, axis: str) -> float:
    """Turns of the motor for one of the joint; 1 where nothing states it."""
    from twin.model.bodies import gear_in  # MuJoCo takes long to load

    mapped = tomllib.loads(log.metadata.get(MAP, "")).get("axes", {}).get(axis, {}).get("gear")
    ratio = mapped.get(axis) if isinstance(mapped, dict) else mapped
    return float(np.abs(ratio or gear_in(model, axis)))
