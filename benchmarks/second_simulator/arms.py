"""Arms of joints in bare MuJoCo: files as their makers write them, machines that differ from these.

It shares no line with the package but the log. An arm is drawn: two joints or more, most of them
hinges, with links, rotors (armature), damping and dry friction that its file states. The machine
is the same with some things changed. Dry friction is MuJoCo's own, or one with presliding (P. R.
Dahl, 1968) that this file adds to ``qfrc_applied``; what no attribute of MuJoCo holds is added
there as well. A computed-torque loop follows sums of sines.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.logs import ROTARY_UNITS, AxisLog, Log

Array = NDArray[np.float64]

STEP = 5e-4  # s, of the simulation
LOOP = 2  # steps of it, in which the torque holds
DURATION = 20.0  # s of a log
BANDWIDTH = 2.0 * np.pi * 3.0  # rad/s, of the loop
RATES = (100, 250, 500, 1000)  # Hz, of the recorder
TURNS = ("0 0 1", "0 1 0", "1 0 0")


@dataclass(frozen=True)
class Arm:
    """A drawn arm as its file has it, SI units; (n,) of each joint or of the link that it moves.

    size: m, of links. radius: of inertia. coulomb, viscous, armature: of joints. reach: rad or m,
    of a motion.
    """

    slides: tuple[bool, ...]
    axes: tuple[str, ...]
    mass: Array
    size: Array
    radius: Array
    armature: Array
    coulomb: Array
    viscous: Array
    reach: Array
    presliding: bool
    rate: int
    encoder: Array
    noise: float

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of the joints."""
        return tuple(f"joint{i + 1}" for i in range(len(self.mass)))

    @property
    def links(self) -> tuple[str, ...]:
        """Names of the bodies."""
        return tuple(f"link{i + 1}" for i in range(len(self.mass)))

    @property
    def text(self) -> str:
        """Its MJCF file."""
        bodies, place = "", "0 0 0.3"
        for i, (joint, link) in enumerate(zip(self.joints, self.links, strict=True)):
            kind = "slide" if self.slides[i] else "hinge"
            own = self.mass[i] * self.radius[i] ** 2
            centre = (
                f"{0.45 * self.size[i]:.4g} {0.04 * self.size[i]:.3g} {0.03 * self.size[i]:.3g}"
            )
            bodies += (
                f'<body name="{link}" pos="{place}"><joint name="{joint}" type="{kind}" '
                f'axis="{self.axes[i]}" armature="{self.armature[i]:.4g}" '
                f'damping="{self.viscous[i]:.4g}" frictionloss="{self.coulomb[i]:.4g}"/>'
                f'<inertial pos="{centre}" mass="{self.mass[i]:.4g}" '
                f'diaginertia="{0.4 * own:.4g} {own:.4g} {own:.4g}"/>'
            )
            place = f"{self.size[i]:.4g} 0 0"
        close = "</body>" * len(self.mass)
        option = f'<option timestep="{STEP:g}" integrator="implicitfast"/>'
        return f'<mujoco model="arm">{option}<worldbody>{bodies}{close}</worldbody></mujoco>'


@dataclass(frozen=True)
class Changed:
    """By how much a machine is another than its file; each by number of the joint or link.

    payload: kg on the last link's end, or where it is held, (3,) m of the link's frame. mass: kg of
    a link, with its inertia. rotor: kg m^2 or kg. coulomb: N m or N. load: 1/(N m), growth of the
    dry friction by the load. spring: N m/rad, about 0.2 rad. gain: part by which the motor makes
    more torque than is recorded. weightless: the recorded torque has the weight of all links taken
    out.
    """

    payload: float = 0.0
    held: tuple[float, float, float] | None = None
    mass: Mapping[int, float] = field(default_factory=dict)
    rotor: Mapping[int, float] = field(default_factory=dict)
    coulomb: Mapping[int, float] = field(default_factory=dict)
    load: Mapping[int, float] = field(default_factory=dict)
    spring: Mapping[int, float] = field(default_factory=dict)
    gain: Mapping[int, float] = field(default_factory=dict)
    weightless: bool = False


def drawn(rng: np.random.Generator, joints: int, rate: int) -> Arm:
    """An arm of so many joints, of a recorder at that rate, Hz."""
    slides = tuple(bool(i and rng.random() < 0.15) for i in range(joints))
    turns = [TURNS[rng.integers(3)] for _ in range(joints)]
    turns[0] = TURNS[rng.integers(2)]
    mass = rng.uniform(5.0, 10.0) * 0.62 ** np.arange(joints) * rng.uniform(0.8, 1.2, joints)
    size = rng.uniform(0.2, 0.45, joints)
    bare = Arm(
        slides, tuple(turns), mass, size, rng.uniform(0.2, 0.35, joints) * size,
        np.zeros(joints), np.zeros(joints), np.zeros(joints),
        np.where(slides, 0.15, rng.uniform(0.5, 1.0, joints)), bool(rng.random() < 0.5), rate,
        np.where(slides, 1e-6, 2.0 * np.pi / 2.0 ** rng.integers(17, 21, joints)),
        float(rng.uniform(0.002, 0.01)),
    )  # fmt: skip
    own = inertia(bare)
    weight = 9.81 * size * np.cumsum(mass[::-1])[::-1]
    return replace(
        bare,
        armature=own * rng.uniform(0.15, 0.6, joints),
        coulomb=weight * rng.uniform(0.02, 0.08, joints),
        viscous=weight * rng.uniform(0.01, 0.05, joints),
    )


def inertia(arm: Arm) -> Array:
    """Inertia (n,) kg m^2 or kg about each joint where the arm is stretched out."""
    model = mujoco.MjModel.from_xml_string(arm.text)
    data, full = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, full)
    return np.asarray(np.diag(full) - model.dof_armature)


def machine_of(arm: Arm, changed: Changed) -> mujoco.MjModel:
    """The machine's model, less its dry friction where that has presliding."""
    model = mujoco.MjModel.from_xml_string(arm.text)
    for i, more in changed.mass.items():
        model.body_inertia[1 + i] *= 1.0 + more / model.body_mass[1 + i]
        model.body_mass[1 + i] += more
    for i, more in changed.rotor.items():
        model.dof_armature[i] += more
    for i, more in changed.coulomb.items():
        model.dof_frictionloss[i] += more
    if changed.payload:
        place = changed.held or (arm.size[-1], 0.02, 0.0)
        _load(model, len(arm.mass), changed.payload, np.array(place))
    mujoco.mj_setConst(model, mujoco.MjData(model))
    return model


def _load(model: mujoco.MjModel, body: int, mass: float, place: Array) -> None:
    """Add a ball of 3 cm to a body whose inertia is along its own frame's axes."""
    old, centre = model.body_mass[body], model.body_ipos[body].copy()
    new = (old * centre + mass * place) / (old + mass)
    full = np.diag(model.body_inertia[body]) + mass * 0.4 * 0.03**2 * np.eye(3)
    for m, at in ((old, centre - new), (mass, place - new)):
        full += m * (at @ at * np.eye(3) - np.outer(at, at))
    moments, turned = np.linalg.eigh(full)
    turned[:, 0] *= np.sign(np.linalg.det(turned))
    mujoco.mju_mat2Quat(model.body_iquat[body], turned.ravel())
    model.body_mass[body], model.body_ipos[body] = old + mass, new
    model.body_inertia[body] = moments
    model.body_sameframe[body] = 0
    model.body_simple[body] = 0


def log_of(arm: Arm, changed: Changed, seed: int, duration: float = DURATION) -> Log:
    """One recording of the machine, of so many s."""
    model, rng = machine_of(arm, changed), np.random.default_rng(seed)
    nominal, n = mujoco.MjModel.from_xml_string(arm.text), len(arm.mass)
    # Semi-implicit steps take weight and Coriolis forces half a step before the acceleration: of a
    # joint of seed 91 that left 38 mN m, above a floor of 46 mN m, which were told as an effect.
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
    data, plan, still = mujoco.MjData(model), mujoco.MjData(nominal), mujoco.MjData(model)
    dry = model.dof_frictionloss.copy()
    stiff = dry / np.where(arm.slides, 2e-5, 1e-4)  # N m/rad before it slides
    growth, spring, gain = (_each(of, n) for of in (changed.load, changed.spring, changed.gain))
    if arm.presliding:
        model.dof_frictionloss[:] = 0.0
    own = inertia(arm) + arm.armature
    pull, hold = own * BANDWIDTH**2, 2.0 * own * BANDWIDTH
    every = round(1.0 / (STEP * arm.rate))
    time = STEP * np.arange(round(duration / STEP), dtype=float)
    wanted, speed = _sines(rng, arm.reach, time)
    position, torque = np.empty((2, len(wanted) // every, n))
    bent, command, load = np.zeros(n), np.zeros(n), np.zeros(n)
    data.qpos[:], data.qvel[:] = wanted[0], speed[0]
    for k in range(len(wanted)):
        if k % LOOP == 0:
            plan.qpos[:], plan.qvel[:] = wanted[k], speed[k]
            mujoco.mj_forward(nominal, plan)
            command = (
                plan.qfrc_bias + pull * (wanted[k] - data.qpos) + hold * (speed[k] - data.qvel)
            )
        if k % every == 0:
            weight = 0.0
            if changed.weightless:
                still.qpos[:] = data.qpos
                mujoco.mj_forward(model, still)
                weight = still.qfrc_bias
            position[k // every] = data.qpos
            torque[k // every] = command / (1.0 + gain) - weight
        applied = command - spring * (data.qpos - 0.2)
        level = dry * (1.0 + growth * np.abs(load))
        if arm.presliding:
            bent = _bristles(bent, stiff, level, data.qvel)
            applied = applied - bent
        elif growth.any():
            model.dof_frictionloss[:] = level
        data.qfrc_applied[:] = applied
        mujoco.mj_step(model, data)
        if growth.any():
            taken = np.zeros(n)
            mujoco.mj_mulM(model, data, taken, data.qacc)
            load = taken - model.dof_armature * data.qacc + data.qfrc_bias
    steps = np.round(position / arm.encoder) * arm.encoder
    size = torque.std(axis=0)
    torque += arm.noise * size * rng.standard_normal(torque.shape)
    units = [
        AxisLog({"position": steps[:, i], "force": torque[:, i]}, ROTARY_UNITS)
        if not slide
        else AxisLog({"position": steps[:, i], "force": torque[:, i]})
        for i, slide in enumerate(arm.slides)
    ]
    return Log(float(arm.rate), dict(zip(arm.joints, units, strict=True)))


def _bristles(bent: Array, stiff: Array, level: Array, velocity: Array) -> Array:
    """The friction (n,) of Dahl's law after a step at these velocities, exactly."""
    end, by = np.sign(velocity) * level, np.abs(velocity) * STEP * stiff / level
    return np.asarray(end + (bent - end) * np.exp(-by))


def _each(of: Mapping[int, float], count: int) -> Array:
    return np.array([of.get(i, 0.0) for i in range(count)])


def _sines(rng: np.random.Generator, reach: Array, time: Array) -> tuple[Array, Array]:
    """Position and velocity (k, n) of three sines of each joint."""
    shape = (3, len(reach))
    rate, phase = 2.0 * np.pi * rng.uniform(0.1, 0.8, shape), rng.uniform(0.0, 2.0 * np.pi, shape)
    size = reach * rng.dirichlet(np.ones(3) * 3.0, len(reach)).T
    at = rate * time[:, None, None] + phase
    return (size * np.sin(at)).sum(axis=1), (size * rate * np.cos(at)).sum(axis=1)
