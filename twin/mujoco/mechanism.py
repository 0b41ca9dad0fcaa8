"""The bodies of a MuJoCo model: what they take of the forces at its joints along a measured motion.

With the generalised momentum p = M(q) v and the bias force c(q, v) of gravity, centrifugal and
Coriolis forces, the forces at the joints are

    tau = dp/dt + c - dM/dt v

so that a weak form integrates the momentum by parts, and nothing is differentiated twice
(R. M. Murray, Z. Li, S. S. Sastry, A Mathematical Introduction to Robotic Manipulation, section
4.3). dM/dt v is the change of M v as the joints move on with v. All of it is computed natively, by
the same library as the callback.

An axis is a joint or a fixed tendon; the other joints move with the axes, and their forces reach
these, by the transmission of the file (``transmission``).

What a joint has of friction, damping, springs and rotor inertia is the matter of the machine
model's effects, and is not among the bodies. Geometry is needed for none of this, so that the
meshes of a file need not be there.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import lru_cache

import mujoco
import numpy as np

from twin.core.compiled import call_at, compiled
from twin.errors import InputError
from twin.mujoco.callback import native_address, offsets, view, word_at
from twin.mujoco.reading import read_bodies
from twin.mujoco.transmission import HINGE, SLIDE, Transmission, transmission_of
from twin.signals import Array

CALLS = (
    "mj_kinematics", "mj_comPos", "mj_tendon", "mj_makeM", "mj_comVel", "mj_rne", "mj_mulM",
)  # fmt: skip
AHEAD = 1e-6  # rad or m, by which the joints move on, of the change of the mass matrix
PASSIVE = ("damping", "stiffness", "frictionloss", "armature")  # of an axis, which are effects here


@dataclass(frozen=True, eq=False, repr=False)
class Mechanism:
    """The bodies of a machine, whose axes are joints or tendons.

    model: of the bodies alone. places (n_axes,): of each axis among the joints, of a tendon one of
    its joints. inertia (n_axes,): kg or kg m^2, that of the bodies about each axis, the mean over
    poses. freed (n_axes,): the least that is felt at each where all others are free.
    """

    model: mujoco.MjModel
    axes: tuple[str, ...]
    places: Sequence[int]
    transmission: Transmission
    inertia: Array
    freed: Array

    def __repr__(self) -> str:
        return f"<Mechanism of {', '.join(self.axes)}>"

    def along(self, position: Array, velocity: Array, smooth: Array) -> tuple[Array, Array]:
        """Momentum p and force c - dM/dt v (n_axes, n) of the bodies along a motion, SI units.

        position, velocity, smooth (n_axes, n): of each axis; the momentum is linear in velocity,
        everything else is made of the smooth one. dp/dt and the second sum to the forces at the
        joints.
        """
        joints, by = self.transmission, self.transmission.by
        rows = (joints.joints(position), by @ velocity, by @ smooth)
        momentum, force = np.empty((2, len(by), position.shape[1]))
        data = mujoco.MjData(self.model)
        _along(
            tuple(map(native_address, CALLS)), self.model._address, data._address,
            tuple(offsets()[2:]), *map(np.ascontiguousarray, rows), np.zeros((4, len(by))),
            momentum, force,
        )  # fmt: skip
        return by.T @ momentum, by.T @ force

    def carried(self, position: Array, acceleration: Array) -> Array:
        """Force (n_axes, n) that holds the bodies' weight and accelerates them, SI units.

        position, acceleration (n_axes, n): of each axis. Without what their velocities make.
        """
        momentum, force = self.along(position, acceleration, np.zeros_like(position))
        return momentum + force

    @property
    def joints(self) -> tuple[str, ...]:
        """Name of the joint of each axis, of a tendon that of ``places``."""
        return tuple(self.model.joint(j).name for j in self.places)

    @property
    def bodies(self) -> tuple[str, ...]:
        """Name of the body that each axis moves, or of its joint where the body has none."""
        numbered = enumerate(self.joints)
        return tuple(self.model.body(self._body(a)).name or joint for a, joint in numbered)

    def _body(self, axis: int) -> int:
        """Number of the body that an axis moves."""
        return int(self.model.jnt_bodyid[self.places[axis]])

    def moved_by(self, axis: int) -> list[int]:
        """The axes whose forces the body of one changes: its own, and those that carry it."""
        dof, found = int(self.places[axis]), set[int]()
        while dof >= 0:
            found.update(np.flatnonzero(self.transmission.by[dof]).tolist())
            dof = int(self.model.dof_parentid[dof])
        return sorted(found)

    def differing(self, other: Mechanism) -> dict[str, tuple[str, ...]]:
        """Bodies whose inertia is another there, and the axes whose forces each changes."""
        return {
            self.bodies[k]: tuple(self.axes[i] for i in self.moved_by(k))
            for k in range(len(self.axes))
            if not np.allclose(self.inertial(k), other.inertial(k), rtol=1e-9, atol=1e-12)
        }

    def inertial(self, axis: int) -> Array:
        """The ten parameters of the body of an axis, as ``per_unit`` has them."""
        model, turned, body = self.model, np.zeros(9), self._body(axis)
        mujoco.mju_quat2Mat(turned, model.body_iquat[body])
        axes, mass, centre = turned.reshape(3, 3), model.body_mass[body], model.body_ipos[body]
        own = axes @ np.diag(model.body_inertia[body]) @ axes.T
        about = own + _of_point(mass, centre)
        return np.array([mass, *(mass * centre), *about.diagonal(), *about[np.triu_indices(3, 1)]])

    def per_unit(self, axis: int, *motion: Array) -> Array:
        """Momentum and force, along a motion, of a unit more of each parameter of a body.

        Of the body of that axis; motion as ``along`` has it; shape (2, 10, n_axes, n). The
        parameters are mass, first moments x, y, z (kg m) and inertia xx, yy, zz, xy, xz, yz
        (kg m^2) about the body's own frame. What the bodies take is linear in them (C. G. Atkeson,
        C. H. An, J. M. Hollerbach, "Estimation of Inertial Parameters of Manipulator Loads and
        Links", Int. J. Robotics Research 5, 1986).
        """
        begun = np.eye(10)[0]  # a body of some mass, whose centre is somewhere
        of = (self._with(axis, begun + more) for more in (0.0 * begun, *np.eye(10)))
        first, *others = (np.stack(m.along(*motion)) for m in of)
        return np.stack([other - first for other in others], axis=1)

    def by_change(self, axis: int, change: Array, *motion: Array) -> Array:
        """Momentum and force (2, n_axes, n) along a motion of a change (10,) of a body."""
        after = self._with(axis, self.inertial(axis) + change)
        return np.stack(after.along(*motion)) - np.stack(self.along(*motion))

    def _with(self, axis: int, inertial: Array) -> Mechanism:
        """With the body of an axis of these parameters (10,)."""
        model, body = copy(self.model), self._body(axis)
        mass, centre = inertial[0], inertial[1:4] / inertial[0]
        xx, yy, zz, xy, xz, yz = inertial[4:]
        about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
        moments, turned = np.linalg.eigh(about - _of_point(mass, centre))
        turned[:, 0] *= np.sign(np.linalg.det(turned))
        mujoco.mju_mat2Quat(model.body_iquat[body], turned.ravel())
        model.body_mass[body], model.body_ipos[body] = mass, centre
        model.body_inertia[body], model.body_sameframe[body] = moments, 0
        return replace(self, model=model)


def _of_point(mass: float, place: Array) -> Array:
    """Inertia (3, 3) kg m^2 of a point about the origin."""
    return np.asarray(mass * (place @ place * np.eye(3) - np.outer(place, place)))


def mechanism_of(text: str, name: str, joints: Mapping[str, str]) -> Mechanism:
    """The mechanism of an MJCF or URDF text; joints: axis -> name of its joint or fixed tendon.

    Raises InputError where one is not in the file or cannot be an axis, where axes depend on each
    other, and where the motion of a joint of the file is not known from the axes.
    """
    return _mechanism(text, name, tuple(joints.items()))


@lru_cache(maxsize=4)  # each command asks for that of its one model several times
def _mechanism(text: str, name: str, joints: tuple[tuple[str, str], ...]) -> Mechanism:
    spec = read_bodies(text, name)
    strip_passive(spec, dict(joints).values())
    try:
        model = spec.compile()
    except ValueError as error:
        said = " ".join(str(error).split())
        raise InputError(f"{name}: MuJoCo cannot build it: {said}") from error
    transmission = transmission_of(model, name, dict(joints))
    axes = tuple(axis for axis, _ in joints)
    inertias = _inertias(model, transmission)
    return Mechanism(model, axes, transmission.places(), transmission, *inertias)


@dataclass(frozen=True)
class Joint:
    """What its joint or tendon is to an axis: whether it turns, and the inertia, kg or kg m^2.

    A tendon turns where all its joints do: it is then a sum of angles.
    """

    rotary: bool
    inertia: float


def joints_of(text: str, name: str, joints: Mapping[str, str]) -> dict[str, Joint]:
    """The joints of an MJCF or URDF text by axis; raises InputError as ``mechanism_of`` does."""
    found = mechanism_of(text, name, joints)
    turns = ~np.any(found.transmission.rows[:, found.model.jnt_type == SLIDE], axis=1)
    pairs = zip(joints, turns, found.inertia, strict=True)
    return {axis: Joint(bool(turns), float(inertia)) for axis, turns, inertia in pairs}


def _inertias(model: mujoco.MjModel, joints: Transmission) -> tuple[Array, Array]:
    """Inertia (n_axes,) about each axis, kg or kg m^2, over poses within the joints' ranges.

    With all others held the mean: in one pose it may vanish, such as that of a straight arm about
    its own line. With all others free the least.
    """
    data, rng = mujoco.MjData(model), np.random.default_rng(0)
    turns = model.jnt_type == HINGE
    free = np.where(turns, np.pi, 0.0)[:, None] * [-1.0, 1.0]
    low, high = np.where(model.jnt_limited[:, None] > 0, model.jnt_range, free).T
    total, full = np.zeros(len(joints.rows)), np.zeros((model.nv, model.nv))
    least = np.full(len(total), np.inf)
    poses = 256  # over which the inertia about a joint is averaged
    for _ in range(poses):
        data.qpos[:] = joints.joints(joints.rows @ rng.uniform(low, high))
        mujoco.mj_forward(model, data)
        mujoco.mj_fullM(model, data, full)
        own = joints.reduced(full)
        total += np.diag(own) / poses
        least = np.minimum(least, 1.0 / np.diag(np.linalg.inv(own)))
    return total, least


def strip_passive(
    spec: mujoco.MjSpec, axes: Collection[str]
) -> list[mujoco.MjsJoint | mujoco.MjsTendon]:
    """Take what is the matter of effects from the joints and from the tendons that are axes."""
    parts = [*spec.joints, *(t for t in spec.tendons if t.name in axes)]
    for part in parts:
        for key in PASSIVE:
            setattr(part, key, 0.0 * np.asarray(getattr(part, key)))
    return parts


@compiled(nogil=True)
def _along(calls, model, data, off, position, velocity, smooth, lent, momentum, force):
    kinematics, com_pos, tendon, make_m, com_vel, rne, mul_m = calls
    n_dofs = position.shape[0]
    moved, before, after, bias = lent
    qpos = view(word_at(data + off[2]), n_dofs)  # hinges and slides: as many as degrees of freedom
    qvel = view(word_at(data + off[3]), n_dofs)
    speed = word_at(data + off[3])
    for k in range(position.shape[1]):
        fastest = 0.0
        for i in range(n_dofs):
            qpos[i] = position[i, k]
            qvel[i] = smooth[i, k]
            moved[i] = velocity[i, k]
            fastest = max(fastest, abs(qvel[i]))
        call_at(kinematics, (model, data))
        call_at(com_pos, (model, data))
        call_at(tendon, (model, data))  # whose armature the mass matrix has
        call_at(make_m, (model, data))
        call_at(mul_m, (model, data, after.ctypes.data, moved.ctypes.data))
        for i in range(n_dofs):
            momentum[i, k] = after[i]
        call_at(mul_m, (model, data, before.ctypes.data, speed))
        call_at(com_vel, (model, data))
        call_at(rne, (model, data, 0, bias.ctypes.data))  # 0: without accelerations
        ahead = AHEAD / max(fastest, AHEAD)
        for i in range(n_dofs):
            qpos[i] += ahead * qvel[i]
        call_at(kinematics, (model, data))
        call_at(com_pos, (model, data))
        call_at(tendon, (model, data))  # whose armature the mass matrix has
        call_at(make_m, (model, data))
        call_at(mul_m, (model, data, after.ctypes.data, speed))
        for i in range(n_dofs):
            force[i, k] = bias[i] - (after[i] - before[i]) / ahead
