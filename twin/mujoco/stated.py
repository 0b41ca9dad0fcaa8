"""What a MuJoCo file states of the joints or tendons that are axes: rotors, friction, springs.

They are the model: effects with the values of the file (``Effect.of_joint``). What the file does
not state is 0 there, and is what a model made of it lacks.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache

import mujoco
import numpy as np

from twin.errors import InputError
from twin.model.machine import MachineModel
from twin.mujoco.mechanism import read_bodies

# By attribute what holds it in a compiled model, of a joint and of a tendon; of what may be a
# polynomial its linear part.
OF_JOINTS = {
    "armature": "dof_armature", "damping": "dof_damping", "frictionloss": "dof_frictionloss",
    "stiffness": "jnt_stiffness", "springref": "qpos_spring",
}  # fmt: skip
OF_TENDONS = {key: f"tendon_{key}" for key in ("armature", "damping", "frictionloss", "stiffness")}
OF_TENDONS["springref"] = "tendon_lengthspring"


def stated(text: str, name: str, joints: Mapping[str, str]) -> dict[str, dict[str, float]]:
    """By axis, the attributes of its joint or tendon, SI units; 0 where none is stated.

    text, name: of an MJCF or URDF file. joints: axis -> name of its joint or fixed tendon. Raises
    InputError where MuJoCo cannot read or build it.
    """
    found = _stated(text, name, (*joints.values(),))
    return {axis: dict(own) for axis, own in zip(joints, found, strict=True)}


def stated_in(model: MachineModel) -> dict[str, dict[str, float]]:
    """The same of the file of a machine; nothing of one whose axes are no joints."""
    return stated(model.mjcf or "", model.mjcf_name or "", model.joints) if model.joints else {}


def gear_in(model: MachineModel, axis: str) -> float:
    """The gear of the motor of a joint in the file of a machine; 1 where it has none."""
    built = read_bodies(model.mjcf or "", model.mjcf_name or "").compile()
    joint = mujoco.mj_name2id(built, mujoco.mjtObj.mjOBJ_JOINT, model.joints[axis])
    of_joints = built.actuator_trntype == mujoco.mjtTrn.mjTRN_JOINT
    own = np.flatnonzero(of_joints & (built.actuator_trnid[:, 0] == joint))
    return float(built.actuator_gear[own[0], 0]) if joint >= 0 and len(own) else 1.0


@lru_cache(maxsize=4)  # of one model it is asked several times
def _stated(text: str, name: str, joints: tuple[str, ...]) -> list[dict[str, float]]:
    try:
        model = read_bodies(text, name).compile()
    except ValueError as error:
        said = " ".join(str(error).split())
        raise InputError(f"{name}: MuJoCo cannot build it: {said}") from error
    return [_attributes(model, joint) for joint in joints]


def _attributes(model: mujoco.MjModel, joint: str) -> dict[str, float]:
    at = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_JOINT, joint)
    held = OF_JOINTS if at >= 0 else OF_TENDONS
    own = at if at >= 0 else model.tendon(joint).id
    return {key: float(np.ravel(getattr(model, field)[own])[0]) for key, field in held.items()}
