"""The bodies of a machine whose axes are joints of its MuJoCo file.

MuJoCo takes long to load, so this is imported where it is needed.
"""

from __future__ import annotations

import mujoco
import numpy as np

from twin.model.machine import MachineModel
from twin.mujoco.mechanism import Mechanism, mechanism_of
from twin.mujoco.reading import read_bodies
from twin.mujoco.stated import stated


def mechanism_in(model: MachineModel) -> Mechanism:
    """The mechanism of a machine whose axes are joints; raises InputError as ``mechanism_of``."""
    return mechanism_of(model.mjcf or "", model.mjcf_name or "", model.joints)


def stated_in(model: MachineModel) -> dict[str, dict[str, float]]:
    """What the file of a machine states of its joints (``stated``); nothing of plain axes."""
    return stated(model.mjcf or "", model.mjcf_name or "", model.joints) if model.joints else {}


def gear_in(model: MachineModel, axis: str) -> float:
    """The gear of the motor of a joint in the file of a machine; 1 where it has none."""
    built = read_bodies(model.mjcf or "", model.mjcf_name or "").compile()
    joint = mujoco.mj_name2id(built, mujoco.mjtObj.mjOBJ_JOINT, model.joints[axis])
    of_joints = built.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT
    own = np.flatnonzero(of_joints & (built.actuator_trnid[:, 0] == joint))
    return float(built.actuator_gear[own[0], 0]) if joint >= 0 and len(own) else 1.0
