"""Machines of the second simulator: drawn values, an effect of it, and their logs."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from benchmarks.second_simulator.kernel import (
    AHEAD,
    BEHIND,
    FORCE,
    FRICTION,
    HALF_SPAN,
    MOTOR,
    PLACES,
    SPEEDS,
    STRIBECK,
    TOP_SPEED,
    Gains,
    Plant,
    simulate,
)  # fmt: skip
from twin.logs import AxisLog, Log

PLACE = np.linspace(-HALF_SPAN, HALF_SPAN, PLACES)  # m
SPEED = np.linspace(-TOP_SPEED, TOP_SPEED, SPEEDS)  # m/s
FORCE_CONSTANT = 53.4  # N/A
PITCH, WIDTH = 0.034, 0.004  # m, of the rollers


def raised_cosine(offset, width):
    """Bump of height 1 and full width (m) about zero."""
    return np.where(np.abs(offset) < width / 2, 0.5 + 0.5 * np.cos(2 * np.pi * offset / width), 0.0)


def gaussian(offset, width):
    """Bump of height 1 whose full width at half height is half of width, as the raised cosine's."""
    return np.exp(-4.0 * np.log(2.0) * (2.0 * offset / width) ** 2)


def train(pitch, phase, width, bump=raised_cosine):
    """A bump of height 1 each pitch along the track."""
    return bump((PLACE - phase + pitch / 2) % pitch - pitch / 2, width)


@dataclass
class Machine:
    """One axis: constants, tables over place and speed, disturbance over time, control, noise."""

    plant: Plant
    gains: Gains
    rate: float = 10e3  # Hz, of the control
    log_rate: float = 10e3
    encoder_noise: float = 1e-9  # m
    current_noise: float = 2e-4  # A
    tables: np.ndarray = field(default_factory=lambda: np.zeros((7, PLACES)))
    drag: np.ndarray = field(default_factory=lambda: np.zeros(SPEEDS))
    disturbance: object = None  # (time s, generator) -> N
    other: bool = False  # whether the other axis moves too
    early: float = 0.0  # samples by which the command is logged before it acts as held
    motion: dict = field(default_factory=dict)

    def having(self, **values):
        """The same machine with other constants."""
        return replace(self, plant=self.plant._replace(**values))

    def plus(self, row, table):
        """The same machine with a position table added to one of its own."""
        tables = self.tables.copy()
        tables[row] += table
        return replace(self, tables=tables)


def drawn(rng, rate=10e3, log_rate=None, bump=raised_cosine, spread=0.4, **noise):
    """A machine about the nominal stage; each value off by up to exp(spread)."""

    def about(value):
        return value * np.exp(rng.uniform(-spread, spread))

    coulomb = about(0.285)
    plant = Plant(
        mass=about(15.0), Fc=coulomb, Fs=coulomb + about(0.05), v0=about(0.010), s2=about(0.018),
        s0=about(260.0), s1=about(0.6), resolution=noise.pop("resolution", 1e-9),
    )  # fmt: skip
    tables = np.zeros((7, PLACES))
    tables[[FRICTION, STRIBECK, MOTOR]] = 1.0
    offset, k1, k2, k3 = about(0.05), about(1.5), about(-2.0), about(8.0)
    tables[FORCE] = offset - k1 * PLACE - k2 * PLACE**2 - k3 * PLACE**3
    bumps = train(PITCH, 0.006 + rng.uniform(-0.002, 0.002), WIDTH * about(1.0), bump)
    tables[AHEAD], tables[BEHIND] = about(0.06) * bumps, about(0.04) * bumps
    gains = control(rng, plant, rate)
    return Machine(plant, gains, rate, log_rate or rate, tables=tables, **noise)


def control(rng, plant, rate):
    """Gains of a random bandwidth, with or without integral action and friction feedforward."""
    omega = 2 * np.pi * min(rng.uniform(12.0, 40.0), rate / 60.0)
    speed = omega * plant.mass
    return Gains(
        position=omega / 3.0, speed=speed, integral=rng.choice([0.0, speed * omega / 6.0]),
        filter=1.0 - np.exp(-6.0 * omega / rate), mass=plant.mass * rng.uniform(0.8, 1.1),
        friction=rng.choice([0.0, 0.2]), limit=200.0,
    )  # fmt: skip


def run(machine, seed, duration=15.0):
    """A log of random moves."""
    rng = np.random.default_rng(seed)
    rate = machine.rate
    setpoint = random_moves(rng, duration, rate, **machine.motion)
    time = np.arange(len(setpoint)) / rate
    second = np.zeros((len(setpoint), 2))
    axes = {}
    if machine.other:
        plain = drawn(np.random.default_rng(seed + 1), rate)
        y_setpoint = random_moves(rng, duration, rate)
        y = _signals(plain, y_setpoint, second, np.zeros(len(time)), rng)
        second[:, 0] = y[:, 3]
        second[:, 1] = np.gradient(y[:, 3]) * rate
        axes["y"] = _axis_log(plain, y_setpoint, y, rng)
    push = machine.disturbance(time, rng) if machine.disturbance else np.zeros(len(time))
    signals = _signals(machine, setpoint, second, push, rng)
    axes = {"x": _axis_log(machine, setpoint, signals, rng), **axes}
    return Log(machine.log_rate, axes, {"source": "simulation"})


def _signals(machine, setpoint, second, push, rng):
    noise = machine.encoder_noise * rng.standard_normal(len(setpoint))
    return simulate(
        machine.plant, machine.gains, setpoint, second, machine.tables, machine.drag, push, noise,
        machine.rate,
    )  # fmt: skip


def _axis_log(machine, setpoint, signals, rng):
    keep = slice(None, None, round(machine.rate / machine.log_rate))
    command = signals[keep, 1]
    at = np.arange(len(command))
    current = np.interp(at - machine.early, at, command) / FORCE_CONSTANT
    current = current + machine.current_noise * rng.standard_normal(len(current))
    names = ("setpoint_position", "setpoint_velocity", "setpoint_acceleration")
    columns = {n: setpoint[keep, i].copy() for i, n in enumerate(names)}
    columns |= {"position": signals[keep, 0].copy(), "current": current}
    columns["force"] = FORCE_CONSTANT * current
    return AxisLog(columns, force_constant=FORCE_CONSTANT)


def logs_of(machine, seed, duration=15.0):
    """Two logs to fit and one held out."""
    logs = {f"log {i}": run(machine, 1000 * seed + i, duration) for i in (1, 2, 3)}
    return logs, {"log 3": logs.pop("log 3")}


# --- setpoints: random moves as smoothed trapezoids of speed ---------------------------------


def trapezoid(distance, speed, acceleration, rate):
    """Speed samples of a rest-to-rest move, exact in its length."""
    speed = min(speed, np.sqrt(abs(distance) * acceleration))
    ramp = max(int(np.ceil(speed / acceleration * rate)), 1)
    hold = int(abs(distance) / speed * rate)
    shape = np.convolve(np.ones(max(hold, 1)), np.ones(ramp)) / ramp
    return shape * distance * rate / shape.sum()


def random_moves(rng, duration, rate, span=0.16, fastest=0.25, acceleration=2.0, smoothing=0.02):
    """(n, 3) position m, speed m/s, acceleration m/s^2: fast and slow moves, tiny ones, rests."""
    place, parts, total = rng.uniform(-0.5, 0.5) * span, [], 0
    start = place
    n = round(duration * rate)
    while total < n:
        kind = rng.choice(3, p=(0.7, 0.2, 0.1))
        if kind == 0:
            target, speed = rng.uniform(-span, span), fastest * rng.uniform(0.1, 1.0)
        elif kind == 1:
            target, speed = place + rng.uniform(-0.01, 0.01), 10.0 ** rng.uniform(-2.7, -1.7)
        else:
            target, speed = place + rng.uniform(-3e-4, 3e-4), 2e-3
        target = np.clip(target, -span, span)
        if abs(target - place) < 1e-5:
            continue
        move = trapezoid(target - place, speed, acceleration * rng.uniform(0.3, 1.0), rate)
        rest = np.zeros(int(rng.uniform(0.03, 0.3) * rate))
        parts += [move, rest]
        total += len(move) + len(rest)
        place = target
    speed = np.concatenate([np.zeros(int(0.1 * rate)), *parts])
    width = max(int(smoothing * rate), 2)
    speed = np.convolve(speed, np.ones(width) / width)[:n]
    step = np.append(np.diff(speed), 0.0)
    position = start + np.cumsum(speed) / rate - 0.5 * speed / rate
    return np.column_stack([position, speed, step * rate])
