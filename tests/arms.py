"""A three-joint arm in bare MuJoCo, with friction that the test plants, under a test's control.

It shares no line with the package: friction, ripples and the like are forces that this file adds
to ``qfrc_applied``, and a velocity loop follows sums of sines.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import mujoco
import numpy as np
from numpy.typing import NDArray

from twin.experiments.trajectory import Setpoint
from twin.logs import ROTARY_UNITS, AxisLog, Log

Array = NDArray[np.float64]
Forces = Callable[[Array, Array], Array]  # of position and velocity (3,), N m

JOINTS = ("base", "shoulder", "elbow")
ARM = """<mujoco model="arm">
  <option timestep="0.0005" integrator="implicitfast"/>
  <worldbody>
    <body name="column" pos="0 0 0.3">
      <joint name="base" axis="0 0 1"/>
      <inertial pos="0 0.01 0" mass="8" diaginertia="0.06 0.06 0.05"/>
      <body name="upper" pos="0 0 0.1">
        <joint name="shoulder" axis="0 1 0"/>
        <inertial pos="0.2 0 0.02" mass="4" diaginertia="0.01 0.06 0.06"/>
        <body name="fore" pos="0.4 0 0">
          <joint name="elbow" axis="0 1 0"/>
          <inertial pos="0.15 0.02 0" mass="2" diaginertia="0.004 0.02 0.02"/>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
# A belt couples the joints. What its file has of friction and springs is not the machine's.
SUMS = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.5], [0.0, -0.5, 1.0]])
COUPLED = ARM.replace(
    "</mujoco>",
    """  <tendon>
    <fixed name="lift" frictionloss="3" stiffness="7" armature="2" damping="1">
      <joint joint="shoulder" coef="1"/><joint joint="elbow" coef="0.5"/>
    </fixed>
    <fixed name="belt"><joint joint="shoulder" coef="-0.5"/><joint joint="elbow" coef="1"/></fixed>
  </tendon>
  <actuator><motor name="roll" tendon="belt" gear="20"/></actuator>
</mujoco>""",
).replace('"elbow" axis', '"elbow" damping="4" frictionloss="5" axis')
MOTORS = {"base": "base", "lift": "lift", "roll": "belt"}
SAMPLE, STEPS = 0.002, 4  # s, and steps of MuJoCo within it
COULOMB, VISCOUS = np.array([0.8, 0.4, 0.1]), np.array([0.3, 0.2, 0.05])
STEEP = 1e-3  # rad/s, over which the planted Coulomb friction changes its sign


def friction(_: Array, velocity: Array) -> Array:
    """The planted friction, N m."""
    return -COULOMB * np.tanh(velocity / STEEP) - VISCOUS * velocity


def arm_log(
    seed: int,
    forces: Forces = friction,
    *,
    duration: float = 12.0,
    noise: float = 1e-6,
    text: str = ARM,
    change: Callable[[mujoco.MjModel], None] = lambda model: None,
    planned: Setpoint | None = None,
) -> Log:
    """The arm under a velocity loop that follows sines, or a planned motion of its own rate.

    noise: rad RMS of the encoders.
    """
    model = mujoco.MjModel.from_xml_string(text)
    model.opt.timestep = SAMPLE / STEPS
    change(model)
    data, rng = mujoco.MjData(model), np.random.default_rng(seed)
    rate = 2.0 * np.pi * rng.uniform(0.1, 0.7, (3, 3))
    size, phase = rng.uniform(0.2, 0.5, (3, 3)), rng.uniform(0.0, 2.0 * np.pi, (3, 3))
    gain = np.array([25.0, 40.0, 8.0])
    at = rate * (SAMPLE * np.arange(round(duration / SAMPLE)))[:, None, None] + phase
    wanted, speed = (size * np.sin(at)).sum(axis=2), (size * rate * np.cos(at)).sum(axis=2)
    if planned is not None:
        wanted, speed = planned.position, planned.velocity
    position, command = np.empty((2, *wanted.shape))
    data.qpos[:], data.qvel[:] = wanted[0], speed[0]
    for k in range(len(wanted)):
        mujoco.mj_forward(model, data)
        torque = data.qfrc_bias + gain * (speed[k] - data.qvel + 8.0 * (wanted[k] - data.qpos))
        # Its steps put the position half a step ahead of the velocity.
        position[k], command[k] = data.qpos - 0.5 * model.opt.timestep * data.qvel, torque
        for _ in range(STEPS):
            data.qfrc_applied[:] = torque + forces(data.qpos, data.qvel)
            mujoco.mj_step(model, data)
    position += noise * rng.standard_normal(position.shape)
    return arm_of(position, command)


def arm_of(position: Array, command: Array) -> Log:
    """A log of the arm's joints: position rad, torque N m (n, 3)."""
    signals = {
        a: {"position": position[:, i], "force": command[:, i]} for i, a in enumerate(JOINTS)
    }
    return Log(1.0 / SAMPLE, {a: AxisLog(columns, ROTARY_UNITS) for a, columns in signals.items()})


def coupled_log(seed: int, forces: Forces = friction) -> Log:
    """The log of the motors of COUPLED; forces: of their positions and velocities."""
    log = arm_log(seed, lambda q, v: SUMS.T @ forces(SUMS @ q, SUMS @ v))
    signals = ([log.axes[joint].columns[n] for joint in JOINTS] for n in ("position", "force"))
    position, torque = (np.transpose(columns) for columns in signals)
    made = arm_of(position @ SUMS.T, torque @ np.linalg.inv(SUMS))
    return replace(made, axes=dict(zip(MOTORS, made.axes.values(), strict=True)))
