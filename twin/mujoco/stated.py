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
from twin.mujoco.reading import read_bodies

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
