"""Fits against mujoco.sysid, MuJoCo's own toolbox, on the same logs, from a start 50 % off.

The motion is made by MuJoCo's own joint damping and LuGre actuator, which mujoco.sysid fits with
itself, at a tenth of the sample period, so that position is that of a machine and not of one
package's steps. Encoder and current noise are those of the Proton stage. On noiseless logs of its
own steps the peer's scaled solver is exact; its default solver is wrong there as well.
"""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping
from contextlib import redirect_stdout
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import mujoco
import numpy as np
from mujoco import sysid

from benchmarks.figures import Figure, Target
from benchmarks.timing import Array, interleaved
from identify import workflow
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

TITLE = f"Fits against mujoco.sysid: {DURATION:g} s at 10 kHz, start 50 % off"
START = 0.5  # of the true values
FASTER = Target(low=20.0)
RIGHT = Target(high=0.05)
AS_GOOD = Target(high=1.0)
ROUNDS = 3  # before the peer's fit, and again after it
MOST_SECONDS = 60.0  # after which the peer is stopped
BOUNDS = (0.01, 10.0)  # times the true value, of the peer's search


@dataclass(frozen=True)
class Peer:
    """mujoco.sysid with some options of its ``optimize``."""

    name: str
    options: Mapping[str, Any]


DEFAULT = Peer("mujoco.sysid", {})
SCALED = Peer("mujoco.sysid with SciPy, scaled", {"optimizer": "scipy", "x_scale": "jac"})


def measure() -> list[Figure]:
    """Times and largest parameter errors of both, for two parameters and for LuGre."""
    if not hasattr(sysid, "default_report"):  # without its extras the package is empty
        return [
            Figure("mujoco.sysid", None, note="its extras are absent: pip install --group bench")
        ]
    damped, lugre = damped_slide(), lugre_slide()
    motion = record(lugre)
    return [
        *_against(DEFAULT, damped, record(damped)),
        *_against(DEFAULT, lugre, motion),
        *_against(SCALED, lugre, motion),
    ]


def _against(peer: Peer, slide: Slide, motion: Recording) -> list[Figure]:
    start = START * slide.true
    found: list[Array] = []

    def fit() -> None:
        result = workflow.fit(slide.model(start), {"log": motion.log})
        found.append(read(result.model.axes["x"], slide.where))

    before = interleaved([fit], ROUNDS)
    theirs = fit_with_sysid(peer, slide, motion, start)
    seconds = float(np.median([before, interleaved([fit], ROUNDS)]))
    error, their_error = slide.largest_error(found[-1]), slide.largest_error(theirs.values)
    stopped = ", where it was stopped" if theirs.stopped else ""
    return [
        Figure(
            f"{slide.name}: times faster than {peer.name}", theirs.seconds / seconds, "1", FASTER,
            f"{seconds:.3f} s against {theirs.seconds:.1f} s{stopped}",
        ),
        Figure(f"{slide.name}: our largest parameter error", error, "1", RIGHT),
        Figure(
            f"{slide.name}: our largest parameter error over that of {peer.name}",
            error / their_error, "1", AS_GOOD, f"{error:.2%} against {their_error:.2%}",
        ),
    ]  # fmt: skip


# --- slides and their logs -------------------------------------------------------------------


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
        position[k] = data.qpos[0] - 0.5 * model.opt.timestep * v  # see twin.simulation.loop
        force[k] = push[k] + MASS * omega * (omega / 3.0 * (aim[k] - position[k]) + speed[k] - v)
        data.ctrl[0] = force[k]
        mujoco.mj_step(model, data, FINER)
    rng = np.random.default_rng(seed)
    position += POSITION_NOISE * rng.standard_normal(len(t))
    force += FORCE_NOISE * rng.standard_normal(len(t))
    return Recording(position, force, speed[0])


# --- the peer's fit --------------------------------------------------------------------------


class _TimeUp(Exception):
    pass


@dataclass(frozen=True, eq=False)
class PeerFit:
    """What the peer found: values (n_parameters,), its wall time in s, whether it was stopped."""

    values: Array
    seconds: float
    stopped: bool


def fit_with_sysid(peer: Peer, slide: Slide, recording: Recording, start: Array) -> PeerFit:
    """Fit from these values; where time is up, the best values so far."""
    parameters = sysid.ParameterDict()
    for c, value, true in zip(slide.where, start, slide.true, strict=True):
        parameters.add(sysid.Parameter(c.label, value, BOUNDS[0] * true, BOUNDS[1] * true))
    simulate = sysid.build_residual_fn(
        models_sequences=[_measured(slide, recording, start)],
        build_model=lambda p, _: mujoco.MjModel.from_xml_string(slide.mjcf(p.as_vector(), PERIOD)),
    )
    begun = perf_counter()
    best, lowest = start, np.inf

    def residual(x: Array, p: object, **rest: object) -> tuple:
        nonlocal best, lowest
        if perf_counter() - begun > MOST_SECONDS:
            raise _TimeUp
        found = simulate(x, p, **rest)
        cost = sum(float(np.sum(np.square(r))) for r in found[0])
        if np.size(x) == len(start) and cost < lowest:
            best, lowest = np.array(x).ravel(), cost
        return found

    try:
        with redirect_stdout(io.StringIO()):
            fitted, _ = sysid.optimize(parameters, residual, **peer.options)
    except _TimeUp:
        return PeerFit(best, perf_counter() - begun, True)
    return PeerFit(fitted.as_vector(), perf_counter() - begun, False)


def _measured(slide: Slide, recording: Recording, start: Array) -> sysid.ModelSequences:
    spec = mujoco.MjSpec.from_string(slide.mjcf(start, PERIOD))
    model = spec.compile()
    data = mujoco.MjData(model)
    time = PERIOD * np.arange(len(recording.position))
    # A rollout's sensors describe the state before the step whose end they are stamped with.
    position = sysid.TimeSeries.from_names(time + PERIOD, recording.position[:, None], model)
    state = sysid.create_initial_state(
        model, recording.position[:1], np.array([recording.velocity]), data.act
    )
    control = sysid.TimeSeries(time, recording.force[:, None])
    return sysid.ModelSequences("slide", spec, "log", state, control, position)
