"""Slides to identify, and their logs.

The motion is made by MuJoCo's own joint damping and LuGre actuator, which mujoco.sysid fits with
itself, at a tenth of the sample period, so that position is that of a machine and not of one
package's steps. Encoder and current noise are those of the Proton stage.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import mujoco
import numpy as np

from benchmarks.timing import Array
from twin.effects import load_catalogue
from twin.logs import AxisLog, Log
from twin.model.machine import AxisModel, Fitted, MachineModel
from twin.model.parameters import ParameterReference, free_parameters, read, write

PERIOD = 1e-4  # s
DURATION = 5.0  # s
FINER = 10  # MuJoCo steps a sample when a log is made
MASS = 15.0  # kg
POSITION_NOISE = 1e-9  # m rms
FORCE_NOISE = 53.4 * 2e-4  # N rms: force constant x current noise
BANDWIDTH = 30.0  # Hz of the position loop that made the motion


@dataclass(frozen=True, eq=False)
class Slide:
    """A slide with known parameters.

    axis: our model with the true values; its free parameters are what is fitted. mjcf: MuJoCo's
    own model for values of those parameters (n_parameters,) and a time step in s.
    """

    name: str
    axis: AxisModel
    mjcf: Callable[[Array, float], str]

    @property
    def where(self) -> tuple[ParameterReference, ...]:
        """The fitted parameters."""
        return free_parameters(self.axis)

    @property
    def true(self) -> Array:
        """Their true values, (n_parameters,) SI."""
        return read(self.axis, self.where)

    def model(self, values: Array) -> MachineModel:
        """Our model with these values."""
        return MachineModel("slide", {"x": write(self.axis, self.where, values)})

    def largest_error(self, values: Array) -> float:
        """Largest relative error over the parameters."""
        return float(np.max(np.abs(values / self.true - 1.0)))


def damped_slide() -> Slide:
    """Mass and viscous friction, no dry friction."""
    effect = load_catalogue()["coulomb_viscous"]
    friction = Fitted(effect, {"Fc": 0.0, "Fs": 0.0, "sigma2": 2.0}, frozenset({"Fc", "Fs"}))
    return Slide(
        "mass and viscous friction",
        AxisModel(MASS, effects=(friction,)),
        lambda values, step: _mjcf(values[0], values[1], "", step),
    )


def lugre_slide() -> Slide:
    """The six LuGre parameters of the thesis' simulation dataset on a known mass."""
    effect = load_catalogue()["lugre"]
    values = {
        "Fc": 0.285, "Fs": 0.335, "v0": 0.01, "sigma2": 0.018, "sigma0": 260.0, "sigma1": 0.6,
    }  # fmt: skip
    return Slide(
        "LuGre friction",
        AxisModel(MASS, effects=(Fitted.at_start(effect, values),), mass_fixed=True),
        _lugre_mjcf,
    )


def _lugre_mjcf(values: Array, step: float) -> str:
    coulomb, static, stribeck, viscous, sigma0, sigma1 = values
    actuator = (
        '<dcmotor joint="x" input="none" resistance="1" motorconst="0 0" '
        f'lugre="{sigma0} {sigma1} {coulomb} {static} {stribeck}" damping="{viscous}"/>'
    )
    return _mjcf(MASS, 0.0, actuator, step)


def _mjcf(mass: float, damping: float, actuator: str, step: float) -> str:
    return f"""
    <mujoco>
      <option timestep="{step}"/>
      <worldbody>
        <body>
          <inertial pos="0 0 0" mass="{mass}" diaginertia="1 1 1"/>
          <joint name="x" type="slide" axis="1 0 0" damping="{damping}"/>
        </body>
      </worldbody>
      <actuator><motor name="motor" joint="x"/>{actuator}</actuator>
      <sensor><jointpos name="position" joint="x"/></sensor>
    </mujoco>"""


@dataclass(frozen=True, eq=False)
class Recording:
    """position m and force N (n,), and the velocity m/s with which the motion begins."""

    position: Array
    force: Array
    velocity: float

    @property
    def log(self) -> Log:
        """The recording as a log."""
        columns = {"position": self.position, "force": self.force}
        return Log(1.0 / PERIOD, {"x": AxisLog(columns)})


def record(slide: Slide, seed: int = 1) -> Recording:
    """Follow two sines (30 mm at 0.4 Hz, 2 mm at 2.3 Hz) with a PD loop, and log it."""
    model = mujoco.MjModel.from_xml_string(slide.mjcf(slide.true, PERIOD / FINER))
    data = mujoco.MjData(model)
    t = PERIOD * np.arange(round(DURATION / PERIOD))
    rates = 2.0 * np.pi * np.array([[0.4], [2.3]])
    sizes = np.array([[0.03], [0.002]])
    aim = np.sum(sizes * np.sin(rates * t), axis=0)
    speed = np.sum(sizes * rates * np.cos(rates * t), axis=0)
    push = -MASS * np.sum(sizes * rates**2 * np.sin(rates * t), axis=0)
    omega = 2.0 * np.pi * BANDWIDTH
    data.qvel[0] = speed[0]
    position, force = np.empty((2, len(t)))
    for k in range(len(t)):
        v = data.qvel[0]
        position[k] = data.qpos[0] - 0.5 * model.opt.timestep * v  # see twin.core.loop
        force[k] = push[k] + MASS * omega * (omega / 3.0 * (aim[k] - position[k]) + speed[k] - v)
        data.ctrl[0] = force[k]
        mujoco.mj_step(model, data, FINER)
    rng = np.random.default_rng(seed)
    position += POSITION_NOISE * rng.standard_normal(len(t))
    force += FORCE_NOISE * rng.standard_normal(len(t))
    return Recording(position, force, speed[0])
