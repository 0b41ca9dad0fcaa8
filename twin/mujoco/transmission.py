"""How the joints of a MuJoCo file move with the axes of a machine.

An axis is a joint of the file, or a fixed tendon: a sum of joints, each times a ratio. Equalities
that are linear tie joints, or tendons, to others by such sums. Where there are as many sums as
joints, which do not depend on each other, they are inverted once: q = B x + b, of positions q of
the joints and x of the axes; as no power is lost, the forces at the axes are B^T times those at
the joints.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from twin.errors import InputError
from twin.mujoco.callback import Parts, parts_of, tendon_parts
from twin.mujoco.reading import read_spec
from twin.numbers import SINGULAR, independent
from twin.signals import Array

SLIDE, HINGE = int(mujoco.mjtJoint.mjJNT_SLIDE), int(mujoco.mjtJoint.mjJNT_HINGE)
BY_NAME = (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_TENDON)
ROUNDING = 1e-12  # of the largest number of a matrix: smaller ones of its inverse are none


@dataclass(frozen=True, eq=False)
class Transmission:
    """Positions of the joints: by (n_joints, n_axes) @ those of the axes + offset (n_joints,).

    rows (n_axes, n_joints): the sum of joints that each axis is. Hinges and slides: joints,
    positions and degrees of freedom are as many, in one order.
    """

    rows: Array
    by: Array
    offset: Array

    def joints(self, position: Array) -> Array:
        """Positions (n_joints, ...) of the joints; position (n_axes, ...): of the axes."""
        return np.asarray((self.by @ position).T + self.offset).T

    def reduced(self, full: Array) -> Array:
        """A matrix (n_joints, n_joints) of the joints as one (n_axes, n_axes) of the axes."""
        return np.asarray(self.by.T @ full @ self.by)

    def places(self) -> list[int]:
        """Of each axis one of its joints, that it shares with no other."""
        from scipy.optimize import linear_sum_assignment  # SciPy takes long to load

        return [int(joint) for joint in linear_sum_assignment(self.rows == 0.0)[1]]


def transmission_of(model: mujoco.MjModel, name: str, axes: Mapping[str, str]) -> Transmission:
    """The transmission of a file; axes: axis -> name of its joint or tendon.

    Raises InputError where one is not in the file or cannot be an axis, where axes depend on each
    other, and where the motion of a joint is not known.
    """
    used: dict[str, str] = {}
    sums = np.zeros((0, model.njnt))
    for axis, given in axes.items():
        if given in used:
            raise InputError(
                f"axis {axis}: joint = '{given}' is that of axis {used[given]}; give each its own"
            )
        _require_axis(model, name, axis, given)
        sums = np.vstack([sums, _row(model, parts_of(model, given))])
        if not independent(sums):
            raise InputError(
                f"axis {axis}: joint = '{given}' moves as the axes {', '.join(used.values())} say "
                "already; give it a joint or a tendon that moves by itself"
            )
        used[given] = axis
    start = model.qpos0[model.jnt_qposadr]
    begun = [0.0] * len(sums)
    for row, constant in _ties(model):
        if independent(more := np.vstack([sums, row])):  # what axes tell already binds nothing
            sums = more
            begun.append(float(row @ start) + constant)
    _require_all(model, name, sums)
    inverse = np.asarray(np.linalg.inv(sums), float)
    inverse[np.abs(inverse) < ROUNDING * np.abs(inverse).max()] = 0.0
    by = inverse[:, : len(axes)]
    return Transmission(sums[: len(axes)], by, inverse @ begun)


def _require_axis(model: mujoco.MjModel, name: str, axis: str, given: str) -> None:
    """Raise InputError for an axis that is neither a hinge, nor a slide, nor a fixed tendon."""
    joints = [model.joint(j).name for j in range(model.njnt)]
    tendons = [model.tendon(t).name for t in range(model.ntendon)]
    if given in joints:
        if model.joint(given).type[0] not in (SLIDE, HINGE):
            raise InputError(
                f"axis {axis}: joint '{given}' of {name} is neither a hinge nor a slide; a free or "
                "a ball joint cannot be an axis"
            )
    elif given not in tendons:
        there = ", ".join(n or "one without a name" for n in joints + tendons)
        raise InputError(
            f"axis {axis}: joint = '{given}' is not in {name}, which has {there}; give one of these"
        )
    elif not parts_of(model, given):
        raise InputError(
            f"axis {axis}: tendon '{given}' of {name} is spatial; give one that is fixed, a sum of "
            "joints, or the joints themselves"
        )


def _require_all(model: mujoco.MjModel, name: str, sums: Array) -> None:
    """Raise InputError where the sums leave joints free: what these may do is their null space."""
    free = np.linalg.svd(sums)[2][len(sums) :]
    lacking = np.flatnonzero(np.any(np.abs(free) > SINGULAR, axis=0))
    if len(lacking):
        names = (model.joint(j).name or "one without a name" for j in lacking)
        raise InputError(
            f"{name}: the joints {', '.join(names)} are no axes, so that their motion is not "
            "known; measure them as axes, tie them to one by an equality of the file, or take "
            "them out of it"
        )


def _row(model: mujoco.MjModel, parts: Parts) -> Array:
    """A sum of joints as a row (n_joints,)."""
    row = np.zeros(model.njnt)
    for joint, ratio in parts:
        row[joint] += ratio
    return row


def _ties(model: mujoco.MjModel) -> Iterator[tuple[Array, float]]:
    """Of each linear equality the sum of joints that it holds where it begins, plus a constant."""
    by_kind = {
        int(mujoco.mjtEq.mjEQ_JOINT): lambda joint: [(joint, 1.0)],
        int(mujoco.mjtEq.mjEQ_TENDON): lambda tendon: tendon_parts(model, tendon),
    }
    for k in np.flatnonzero(model.eq_active0):
        parts = by_kind.get(int(model.eq_type[k]))
        one, other = model.eq_obj1id[k], model.eq_obj2id[k]
        constant, slope, *bends = model.eq_data[k, :5]
        if parts is None or (other >= 0 and any(bends)):
            continue
        row = _row(model, parts(one))
        if other >= 0:
            row -= slope * _row(model, parts(other))
        yield row, float(constant)


def proposed(text: str, name: str, axes: Sequence[str]) -> dict[str, str]:
    """By axis the joint or tendon of its name, or that which the actuator of its name drives.

    text, name: of an MJCF or URDF file. Raises InputError where MuJoCo cannot read it.
    """
    spec = read_spec(text, name)
    there = {part.name for part in (*spec.joints, *spec.tendons)}
    driven = {a.name: a.target for a in spec.actuators if a.trntype in BY_NAME}
    return {axis: axis if axis in there else driven.get(axis, axis) for axis in axes}
