"""Drives that have nothing of the stage: a motor, a geared servo, a cart, a small linear actuator.

Each is one moved mass with friction of LuGre's kind under a sampled position loop; the log holds
readings of an encoder and the command, of an instant or its mean, at a rate of its own. No law is
shared with the product.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numba
import numpy as np

from twin.logs import AxisLog, Log
from twin.model.units import LINEAR, ROTARY

STEP = 20_000  # Hz, of the simulation
DURATION = 16.0  # s of each log
NOISE = 0.01  # of the friction, RMS noise of the logged command
QUANTUM = 0.005  # of the friction, a step of the logged command
LOWPASS = 0.5  # of each new speed, that the controller takes
PRELOAD = 0.3  # damping of presliding over the critical one


class Plant(NamedTuple):
    """One moved mass, SI units (m or rad). What is zero is absent.

    slip: Stribeck speed. stiffness: of presliding. hysteresis: N of a second, softer friction.
    asymmetry, modulation: parts of the friction. cogging, second: N, at pitch and other. weight: N
    times the sine of the position. ripple: part of the force. lag: s. load, coupling, loss: kg, N/m
    and N s/m of a mass on a spring. far: part of the load's place in the logged reading. delay: s,
    of the command. tilt: N, always. push: N, by a hand from 0.4 to 0.45 of the time.
    """

    mass: float
    friction: float
    static: float
    slip: float
    viscous: float
    stiffness: float
    pitch: float
    other: float
    weight: float = 0.0
    spring: float = 0.0
    hysteresis: float = 0.0
    asymmetry: float = 0.0
    modulation: float = 0.0
    cogging: float = 0.0
    second: float = 0.0
    ripple: float = 0.0
    lag: float = 0.0
    load: float = 0.0
    coupling: float = 0.0
    loss: float = 0.0
    far: float = 0.0
    delay: float = 0.0
    tilt: float = 0.0
    push: float = 0.0


@dataclass(frozen=True)
class Drive:
    """A plant with its loop (gains of position 1/s, speed N s/m, integral N/m) and its motion."""

    plant: Plant
    gains: tuple[float, float, float]
    travel: float
    speed: float
    acceleration: float
    encoder: float
    recorders: tuple[Recorder, ...]
    rotary: bool = field(default=False)


@dataclass(frozen=True)
class Recorder:
    """How it is logged: rates of log and controller, Hz; the command's mean or that of an instant.

    The command is read in steps where ``coarse``.
    """

    rate: int
    control: int
    mean: bool = False
    coarse: bool = False


TURN = 2.0 * np.pi
DRIVES = {
    "motor": Drive(
        Plant(2e-5, 0.01, 0.01, 2.0, 2e-5, 10.0, TURN / 7, TURN / 12), (30.0, 0.004, 0.05),
        20.0, 120.0, 6000.0, TURN / 8192, (Recorder(1000, 1000), Recorder(1000, 10_000, mean=True)),
        rotary=True,
    ),
    "servo": Drive(
        Plant(0.02, 0.3, 0.3, 0.2, 0.05, 150.0, TURN / 7, TURN / 12), (15.0, 1.5, 10.0),
        1.2, 4.0, 60.0, TURN / 4096, (Recorder(200, 1000), Recorder(100, 200)), rotary=True,
    ),
    "cart": Drive(
        Plant(1.2, 1.5, 1.5, 0.02, 6.0, 7500.0, 0.05, 0.031), (12.0, 60.0, 200.0),
        0.25, 0.6, 6.0, 2e-5, (Recorder(100, 1000, mean=True), Recorder(500, 500, coarse=True)),
    ),
    "actuator": Drive(
        Plant(0.3, 2.0, 2.0, 0.004, 15.0, 4e5, 0.012, 0.0071), (40.0, 60.0, 1500.0),
        0.03, 0.12, 4.0, 1e-6, (Recorder(1000, 1000), Recorder(2000, 2000, coarse=True)),
    ),
}  # fmt: skip


def log_of(drive: Drive, plant: Plant, recorder: Recorder, seed: int) -> Log:
    """A log of random moves, with noise of the seed."""
    rng = np.random.default_rng(seed)
    path = moves(drive, rng)
    speed = np.gradient(path, 1.0 / STEP)
    pushed = plant.mass * np.gradient(speed, 1.0 / STEP)
    every = STEP // recorder.rate, STEP // recorder.control
    gains = np.array(drive.gains)
    read, command = simulate(
        plant, gains, path, speed, pushed, drive.encoder, *every, recorder.mean
    )
    command += NOISE * plant.friction * rng.standard_normal(len(command))
    if recorder.coarse:
        step = QUANTUM * plant.friction
        command = step * np.round(command / step)
    units = ROTARY if drive.rotary else LINEAR
    told = {"position": units.position, "force": units.force}
    axis = AxisLog({"position": read, "force": command}, told)
    return Log(float(recorder.rate), {"q": axis})


def moves(drive: Drive, rng: np.random.Generator) -> np.ndarray:
    """Positions (n,) of moves of fifth order between random places, with random rests."""
    count = round(DURATION * STEP)
    path, at, here = np.zeros(count), 0, 0.0
    while at < count:
        way = rng.uniform(-drive.travel, drive.travel) - here
        taken = max(
            1.5 * abs(way) / (drive.speed * rng.uniform(0.1, 1.0)),
            np.sqrt(6.0 * abs(way) / drive.acceleration),
            0.05,
        )
        s = np.minimum(np.arange(round((taken + rng.uniform(0.02, 0.3)) * STEP)) / STEP / taken, 1)
        piece = here + way * (10.0 * s**3 - 15.0 * s**4 + 6.0 * s**5)
        path[at : at + len(piece)] = piece[: count - at]
        at, here = at + len(piece), here + way
    return path


@numba.njit
def _friction(p, x, v, z, dt):  # pragma: no cover
    """The friction (N) and the bristle's state after a step, exactly at its speed and strength.

    By Euler steps the bristle swings where it relaxes within one, and its damping is a drag.
    """
    g = p.friction + (p.static - p.friction) * np.exp(-((v / p.slip) ** 2))
    g *= 1.0 + p.modulation * np.sin(TURN * 0.37 * x / p.pitch)
    if v < 0.0:
        g *= 1.0 + p.asymmetry
    end = np.sign(v) * g / p.stiffness
    then = end + (z - end) * np.exp(-p.stiffness * abs(v) / g * dt)
    damping = 2.0 * PRELOAD * np.sqrt(p.stiffness * p.mass)
    return p.stiffness * then + damping * (then - z) / dt, then


@numba.njit
def simulate(plant, gains, path, speed, pushed, encoder, each, control, mean):  # pragma: no cover
    """Readings and commands as logged, a sample each so many steps; semi-implicit Euler steps."""
    p, dt = plant, 1.0 / STEP
    read, command = np.zeros((2, len(path) // each))
    sent, late = np.zeros(len(path)), round(p.delay / dt)
    x, v, z, h, at, rate, seen, last, whole = (
        path[0],
        0.0,
        0.0,
        0.0,
        path[0],
        0.0,
        0.0,
        path[0],
        0.0,
    )
    asked, given, total = 0.0, 0.0, 0.0
    held = 0.4 * len(path), 0.45 * len(path)
    for i in range(len(read) * each):
        if i % control == 0:
            reading = encoder * np.round(x / encoder)
            seen += LOWPASS * ((reading - last) / (control * dt) - seen)
            last = reading
            error = gains[0] * (path[i] - reading) + speed[i] - seen
            whole += error * control * dt
            asked = gains[1] * error + gains[2] * whole + pushed[i]
        sent[i] = asked
        then = sent[max(i - late, 0)]
        given += (then - given) * (1.0 if p.lag == 0.0 else dt / p.lag)
        if i % each == 0:
            place = x + p.far * (at - x)
            read[i // each] = encoder * np.round(place / encoder)
            command[i // each] = asked
        total += asked
        if (i + 1) % each == 0:
            if mean:
                command[i // each] = total / each
            total = 0.0
        force, z = _friction(p, x, v, z, dt)
        force += p.viscous * v + p.weight * np.sin(x) + p.spring * x + p.tilt
        if held[0] <= i < held[1]:
            force += p.push
        force += p.cogging * np.sin(TURN * x / p.pitch + 0.3)
        force += p.second * np.sin(TURN * x / p.other + 1.1)
        if p.hysteresis > 0.0:
            soft = p.hysteresis / (0.05 * p.pitch)
            h += dt * (v - soft * abs(v) / p.hysteresis * h)
            force += soft * h
        if p.load > 0.0:
            pull = p.coupling * (x - at) + p.loss * (v - rate)
            force += pull
            rate += dt * pull / p.load
            at += dt * rate
        v += dt * (given * (1.0 + p.ripple * np.sin(TURN * x / p.pitch)) - force) / p.mass
        x += dt * v
    return read, command
