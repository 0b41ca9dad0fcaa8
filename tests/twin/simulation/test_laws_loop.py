"""The controller and the loop against plain Python written from their docstrings.

A PID with filtered derivative and mass feedforward, whose integral waits while the force is
saturated; and two axes stepped by v += dt a, x += dt v, logged as the docstring of the loop says.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from axis_runs import effect

from twin.experiments.trajectory import Setpoint
from twin.model.machine import AxisModel, Hardware, MachineModel
from twin.signals import Array
from twin.simulation.loop import (
    COMMAND_COLUMN,
    POSITION_COLUMN,
    READING_COLUMN,
    VELOCITY_COLUMN,
    Controller,
)
from twin.simulation.simulate import simulate
from twin.simulation.simulators import FineSimulator, MujocoSimulator, ReducedSimulator, run

H = 5e-4  # s
LOOP = Controller(proportional=310.0, integral=2900.0, derivative=21.0, filter_bandwidth=83.0,
                  mass=2.3)  # fmt: skip


class Pid:
    """The controller of one axis, from the docstring of twin.simulation.loop.Controller."""

    def __init__(self, c: Controller, limit: float, dt: float) -> None:
        self.c, self.limit, self.dt = c, limit, dt
        # a first-order filter of that bandwidth, sampled: what is left of a step after dt
        self.keeps = math.exp(-2.0 * math.pi * c.filter_bandwidth * dt)
        self.integral, self.before, self.speed = 0.0, None, 0.0

    def force(self, x: float, v: float, a: float, force: float, reading: float) -> float:
        if self.before is None:
            self.before, self.speed = reading, v
        raw = (reading - self.before) / self.dt
        self.before = reading
        self.speed = self.keeps * self.speed + (1.0 - self.keeps) * raw
        asked = force + self.c.mass * a + self.c.proportional * (x - reading)
        asked += self.c.derivative * (v - self.speed) + self.c.integral * self.integral
        if -self.limit <= asked <= self.limit:
            self.integral += (x - reading) * self.dt
        return min(max(asked, -self.limit), self.limit)


@pytest.mark.parametrize("frequency", [3.0, 40.0, 230.0])
def test_the_response_of_a_loop_is_what_it_makes_of_a_sine(frequency):
    """Over whole periods, once the start has died away."""
    samples = round(1.0 / H)
    angle = 2.0 * math.pi * frequency * H * np.arange(2 * samples)
    pid, wave = Pid(LOOP, math.inf, H), np.exp(-1j * angle[samples:])
    force = [pid.force(0.0, 0.0, 0.0, 0.0, reading) for reading in np.sin(angle)]
    gain = -np.sum(force[samples:] * wave) / np.sum(np.sin(angle[samples:]) * wave)
    told = LOOP.response(np.array([frequency]), H)[0]
    assert abs(gain - told) < 1e-3 * abs(told)


@pytest.mark.parametrize(("bandwidth", "mass"), [(5.0, 17.0), (80.0, 0.3)])
def test_a_loop_made_for_an_axis_crosses_over_near_its_bandwidth(bandwidth, mass):
    """Gain 1 within a fifth of the bandwidth, a phase margin above 40 degrees; the integral part
    takes over a decade below, the proportional one a third.
    """
    c = Controller.for_axis(AxisModel(mass, Hardware(bandwidth=bandwidth)))
    assert c.mass == mass
    f = bandwidth * np.geomspace(0.3, 3.0, 2000)
    s = 2j * np.pi * f
    speed = s / (1.0 + s / (2.0 * np.pi * c.filter_bandwidth))
    loop = (c.proportional + c.integral / s + c.derivative * speed) / (mass * s**2)
    at = np.argmin(np.abs(np.log(np.abs(loop))))
    assert f[at] == pytest.approx(bandwidth, rel=0.2)
    assert 180.0 + np.degrees(np.angle(loop[at])) > 40.0
    assert c.integral / c.proportional == pytest.approx(2 * np.pi * bandwidth / 10.0)
    assert c.proportional / c.derivative == pytest.approx(2 * np.pi * bandwidth / 3.0)


COUPLED = {
    "x": (effect("cable_slab", k1=40.0, offset=0.3),
          effect("axis_coupling", mass=0.4, damping=2.0)),
    "y": (effect("cable_slab", k1=-25.0), effect("axis_coupling", mass=-0.3, damping=5.0),
          effect("encoder_ripple", period=0.004, a1=2e-5)),
}  # fmt: skip
MASSES = {"x": 1.7, "y": 2.9}
LIMITS = {"x": 6.0, "y": 4.0}


def machine_model() -> MachineModel:
    return MachineModel(
        "two",
        {
            a: AxisModel(
                MASSES[a],
                Hardware(force_limit=LIMITS[a], encoder_resolution={"x": 1e-6, "y": 0.0}[a]),
                COUPLED[a],
            )
            for a in "xy"
        },
        sample_rate=1.0 / H,
    )


def asked(n: int) -> Setpoint:
    t = H * np.arange(n)
    w = np.array([11.0, 17.0])
    size = np.array([0.02, -0.012])
    force = np.stack([0.3 * np.sin(70.0 * t), -0.2 * np.cos(50.0 * t)], 1)
    angle = w * t[:, None]
    return Setpoint(
        size * np.cos(angle), -size * w * np.sin(angle), -size * w**2 * np.cos(angle), force, 1 / H
    )


def plain(setpoint: Setpoint, substeps: int) -> Array:
    """Reading, command, true position and velocity of both axes, (n, 2, 4)."""
    n, h = len(setpoint.position), H / substeps
    loops = {"x": LOOP, "y": replace(LOOP, proportional=450.0, mass=3.1)}
    pids = [Pid(loops[a], LIMITS[a], H) for a in "xy"]
    x, v = setpoint.position[0].copy(), np.zeros(2)
    known, last = np.zeros(2), np.zeros(2)  # acceleration, from the speeds of two steps
    masses = np.array([MASSES[a] for a in "xy"])
    slab = [(0.3, 40.0), (0.0, -25.0)]
    coupling = [(0.4, 2.0), (-0.3, 5.0)]
    out = np.empty((n, 2, 4))
    for k in range(n):
        u = np.empty(2)
        for a in range(2):
            true = x[a] - 0.5 * h * v[a]
            reading = true + (2e-5 * np.sin(2 * np.pi * true / 0.004) if a else 0.0)
            reading = reading if a else round(reading / 1e-6) * 1e-6
            wanted = [s[k, a] for s in (setpoint.position, setpoint.velocity,
                                        setpoint.acceleration, setpoint.force)]  # fmt: skip
            u[a] = pids[a].force(*wanted, reading)
            out[k, a] = reading, u[a], true, v[a]
        for _ in range(substeps):
            force = [
                u[a] - slab[a][0] - slab[a][1] * x[a]
                - coupling[a][0] * known[1 - a] - coupling[a][1] * v[1 - a]
                for a in range(2)
            ]  # fmt: skip
            known, last = (v - last) / h, v.copy()
            v = v + h * np.array(force) / masses
            x = x + h * v
    return out


STAGES = [(ReducedSimulator, 1), (FineSimulator, 10), (MujocoSimulator, 1)]


@pytest.mark.parametrize(("stage", "substeps"), STAGES, ids=[s.__name__ for s, _ in STAGES])
def test_the_loop_is_that_of_plain_python(stage: type, substeps: int) -> None:
    setpoint = asked(500)
    found = run(
        machine_model(), setpoint, np.random.default_rng(0), simulator=stage,
        controllers={"x": LOOP, "y": replace(LOOP, proportional=450.0, mass=3.1)},
    )  # fmt: skip
    wanted = plain(setpoint, substeps)
    saturated = np.abs(wanted[:, :, COMMAND_COLUMN]) >= [6.0, 4.0]
    assert 0.02 < saturated.mean() < 0.9
    # a reading on the border between two steps of the encoder may fall either way
    size = np.array([1e-9, 1e-4, 1e-9, 1e-6])
    assert np.all(np.abs(found.signals - wanted) <= size * np.abs(wanted).max(axis=0))
    for i, (axis, name) in enumerate(found.table.labels):
        if name == "cable_slab":
            a = "xy".index(axis)
            x = wanted[:, a, POSITION_COLUMN] + 0.5 * H / substeps * wanted[:, a, VELOCITY_COLUMN]
            slab = {"x": -0.3 - 40.0 * x, "y": 25.0 * x}[axis]
            if substeps == 1:
                np.testing.assert_allclose(found.forces[:, i], slab, rtol=0, atol=1e-7)


def test_noise_of_the_encoder_is_that_of_each_axis_and_reported_progress_ends() -> None:
    model = machine_model()
    for axis, noise in (("x", 3e-6), ("y", 7e-6)):
        hardware = replace(model.axes[axis].hardware, encoder_noise=noise, encoder_resolution=0.0)
        bare = replace(model.axes[axis], hardware=hardware, effects=())
        model = model.with_axis(axis, bare)
    told: list[tuple[int, int]] = []
    done = run(
        model, asked(4000), np.random.default_rng(83), simulator=ReducedSimulator,
        progress=lambda k, n: told.append((k, n)),
    )  # fmt: skip
    error = done.signals[..., READING_COLUMN] - done.signals[..., POSITION_COLUMN]
    np.testing.assert_allclose(error.std(axis=0), [3e-6, 7e-6], rtol=0.06)
    assert abs(np.corrcoef(error.T)[0, 1]) < 0.06
    assert told == [(4000, 4000)]


@pytest.mark.parametrize(("step", "noise"), [(0.0, 3e-6), (2e-6, 3e-6), (2e-6, 0.0)])
def test_a_reading_has_the_noise_and_the_rounding_of_its_encoder(step: float, noise: float) -> None:
    hardware = Hardware(travel=(-0.1, 0.1), encoder_resolution=step, encoder_noise=noise)
    model = MachineModel("m", {"x": AxisModel(2.0, hardware)}, 1000.0)
    log = simulate(model, "tracking", seed=3, duration=4.0, simulator=ReducedSimulator)
    off = log.axes["x"].position - log.truth["x"]["position"]
    assert np.std(off) == pytest.approx(math.hypot(noise, step / math.sqrt(12.0)), rel=0.1)
