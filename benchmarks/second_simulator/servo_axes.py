"""Drawn axes under a sampled position loop, rigid or with a mass on a spring, and their logs.

Friction of LuGre's kind with presliding, cogging, encoder steps, delay, a loop of any bandwidth
with feedforward or without, at 200 Hz to 10 kHz; along random moves, sines, multisines, sweeps and
noise. The equations are those of the drives.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.second_simulator.drives import STEP, Drive, Plant, Recorder, moves, simulate
from twin.logs import AxisLog, Log
from twin.signals import Array

TURN = 2.0 * np.pi
RATES = (200, 500, 1000, 2000, 5000, 10_000)  # Hz
DURATION = 16.0  # s of each log


@dataclass(frozen=True)
class ServoAxis:
    """An axis with its loop. drive: motion, gains, encoder; bands: Hz that its setpoint spans.

    fed: part of speed and mass that is fed forward. agitation: m/s^2, RMS, of what is excited.
    resonance: Hz and damping ratio of both masses free; None of a rigid one.
    """

    drive: Drive
    recorder: Recorder
    motion: str
    fed: float
    agitation: float
    band: tuple[float, float]
    slow: float
    with_setpoint: bool
    resonance: tuple[float, float] | None = None

    @property
    def plant(self) -> Plant:
        return self.drive.plant

    @property
    def mass(self) -> float:
        """kg of both masses."""
        return self.plant.mass + self.plant.load

    def log(self, rng: np.random.Generator) -> Log:
        """A log of a run of its own; of a loop whose gains are lowered until it is stable."""
        path, noise = MOTIONS[self.motion](self, rng), rng.bit_generator.random_raw()
        speed = np.gradient(path, 1.0 / STEP)
        pushed = self.fed * self.mass * np.gradient(speed, 1.0 / STEP)
        every = STEP // self.recorder.rate, STEP // self.recorder.control
        for lower in 0.5 ** np.arange(8):
            gains = np.array(self.drive.gains) * [lower, lower, lower**2]
            fed = (path, self.fed * speed, pushed)
            read, command = simulate(
                self.plant, gains, *fed, self.drive.encoder, *every, self.recorder.mean
            )
            wanted = path[:: every[0]][: len(read)]
            if np.std(read - wanted) < np.std(wanted) and np.abs(command).max() < self._most:
                break
        draws = np.random.default_rng(noise)
        command += 0.01 * self.plant.friction * draws.standard_normal(len(command))
        signals = {"position": read, "force": command}
        if self.with_setpoint:
            signals["setpoint_position"] = wanted
        return Log(float(self.recorder.rate), {"q": AxisLog(signals)})

    @property
    def _most(self) -> float:
        """N, more than any motion asks for: that of a loop that is not stable."""
        return 10.0 * (self.mass * self.drive.acceleration + 4.0 * self.plant.friction)


def drawn(rng: np.random.Generator, resonant: bool, motion: str) -> ServoAxis:
    """An axis of any size, with every nuisance."""
    rate = int(rng.choice(RATES))
    control = int(rng.choice([c for c in RATES if rate <= c <= 5 * rate and STEP % c == 0]))
    speed, mass = _log(rng, 0.05, 1.0), _log(rng, 0.02, 20.0)
    acceleration, travel = speed / rng.uniform(0.03, 0.3), speed * rng.uniform(0.3, 1.5)
    friction = mass * acceleration * _log(rng, 0.03, 0.6)
    plant = Plant(
        mass, friction, friction * rng.uniform(1.0, 1.5), speed * _log(rng, 5e-3, 0.1),
        rng.uniform(0.0, 0.5) * friction / speed, mass * (TURN * _log(rng, 8.0, 150.0)) ** 2,
        travel / rng.uniform(5.0, 60.0), travel / rng.uniform(5.0, 100.0),
        cogging=friction * rng.choice([0.0, rng.uniform(0.1, 1.0)]),
        second=friction * rng.choice([0.0, rng.uniform(0.1, 0.5)]),
        delay=rng.uniform(0.0, min(3.0 / control, 3e-3)),
        asymmetry=rng.choice([0.0, 0.3]),
    )  # fmt: skip
    resonance = None
    if resonant:
        plant, resonance = _elastic(plant, rng, min(200.0, 0.3 * rate))
    width = min(_log(rng, 2.0, 30.0), 0.03 * control)  # Hz, of the loop
    if rng.random() < 0.5 and plant.delay:
        width = min(width, 0.04 / plant.delay)
    turn, fed = TURN * width, float(rng.choice([0.0, 1.0]))
    gains = (turn / 3.0, mass * turn, float(rng.choice([0.0, mass * turn**2 / 8.0])))
    encoder = min(travel / 10.0 ** rng.uniform(3.0, 6.0), 0.2 * speed / control)
    mean, coarse = bool(rng.random() < 0.2), False
    highest = min(0.35 * rate, 300.0)
    return ServoAxis(
        Drive(plant, gains, travel, speed, acceleration, encoder, ()),
        Recorder(rate, control, mean, coarse), motion, fed,
        agitation=_log(rng, 0.5, 10.0) * max(0.3 * acceleration, friction / mass),
        band=(_log(rng, 0.3, 3.0), highest), slow=float(rng.choice([0.0, 1.0, 1.0])) * 0.5 * speed,
        with_setpoint=bool(rng.random() < 0.85), resonance=resonance,
    )  # fmt: skip


def _elastic(
    plant: Plant, rng: np.random.Generator, highest: float
) -> tuple[Plant, tuple[float, float]]:
    """The same mass as two on a spring, and what resonates where both are free."""
    load = plant.mass * rng.uniform(0.15, 0.7)
    motor, turn = plant.mass - load, TURN * _log(rng, 20.0, highest)
    ratio, reduced = _log(rng, 5e-3, 0.05), (plant.mass - load) * load / plant.mass
    elastic = plant._replace(
        mass=motor, load=load, coupling=reduced * turn**2, loss=2.0 * ratio * reduced * turn,
        far=float(rng.choice([0.0, 1.0])),
    )  # fmt: skip
    return elastic, (turn / TURN, ratio)


def _log(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(np.log(low), np.log(high))))


# --- setpoints (n,) m, at the steps of the simulation ---------------------------------------------


def _random_moves(axis: ServoAxis, rng: np.random.Generator) -> Array:
    return np.asarray(moves(axis.drive, rng))


def _sines(axis: ServoAxis, rng: np.random.Generator) -> Array:
    """Three sines, as far and as fast as the axis may."""
    time = np.arange(round(DURATION * STEP)) / STEP
    path = np.zeros(len(time))
    for _ in range(3):
        turn, phase = TURN * _log(rng, 0.2, 5.0), rng.uniform(0.0, TURN)
        size = min(axis.drive.speed / turn, axis.drive.acceleration / turn**2, axis.drive.travel)
        path += size / 3.0 * np.sin(turn * time + phase)
    return path


def _size(axis: ServoAxis, frequency: Array) -> Array:
    """m of a setpoint that asks for the same force at each frequency; as much as travel allows."""
    turn, width = TURN * frequency, axis.drive.gains[0] * 3.0
    fall = np.maximum(turn, TURN * 2.0) ** 2
    if axis.fed == 0.0:  # the loop alone makes the force
        fall = np.minimum(fall, np.maximum(turn, TURN * 2.0) * width)
    return axis.agitation / fall


def _within(axis: ServoAxis, path: Array) -> Array:
    """A setpoint made smaller to stay within speed and travel, on a slow motion if it has one."""
    speed, span = np.abs(np.gradient(path, 1.0 / STEP)).max(), np.abs(path).max()
    path = path * min(1.0, 3.0 * axis.drive.speed / speed, axis.drive.travel / span)
    time = np.arange(len(path)) / STEP
    turn = TURN / DURATION * 4.0
    return np.asarray(path + axis.slow / turn * np.cos(turn * time))


def _multisine(axis: ServoAxis, rng: np.random.Generator) -> Array:
    """Lines of random phases, repeated every 4 s."""
    cells = 4 * STEP
    lines = np.arange(1, cells // 2)
    frequency = lines * STEP / cells
    kept = (frequency >= axis.band[0]) & (frequency <= axis.band[1])
    spectrum = np.zeros(cells // 2 + 1, dtype=complex)
    turns = np.exp(1j * rng.uniform(0.0, TURN, np.count_nonzero(kept)))
    count = np.count_nonzero(kept)
    spectrum[lines[kept]] = _size(axis, frequency[kept]) * turns * cells / np.sqrt(2.0 * count)
    period = np.fft.irfft(spectrum, cells)
    return _within(axis, np.tile(period, round(DURATION * STEP) // cells))


def _sweep(axis: ServoAxis, rng: np.random.Generator) -> Array:
    """Frequencies rising evenly in their logarithm, over the whole log or every 4 s."""
    lasts = float(rng.choice([4.0, DURATION]))
    time = np.arange(round(lasts * STEP)) / STEP
    low, high = axis.band
    along = np.log(high / low) * time / lasts
    frequency = low * np.exp(along)
    phase = TURN * low * lasts / np.log(high / low) * np.expm1(along)
    once = np.sqrt(2.0) * _size(axis, frequency) * np.sin(phase)
    ends = np.minimum(1.0, np.minimum(time, lasts - time) / 0.1)
    return _within(axis, np.tile(once * ends, round(DURATION / lasts)))


def _noise(axis: ServoAxis, rng: np.random.Generator) -> Array:
    """Noise of the band, which never repeats."""
    n = round(DURATION * STEP)
    frequency = np.asarray(np.fft.rfftfreq(n, 1.0 / STEP), dtype=float)
    kept = (frequency >= axis.band[0]) & (frequency <= axis.band[1])
    spectrum = np.zeros(len(frequency), dtype=complex)
    drawn = rng.standard_normal((2, np.count_nonzero(kept)))
    spectrum[kept] = _size(axis, frequency[kept]) * (drawn[0] + 1j * drawn[1])
    spectrum *= n / (2.0 * np.sqrt(np.count_nonzero(kept)))
    return _within(axis, np.fft.irfft(spectrum, n))


MOTIONS: dict[str, Callable[[ServoAxis, np.random.Generator], Array]] = {
    "moves": _random_moves, "sines": _sines, "multisine": _multisine, "sweep": _sweep,
    "noise": _noise,
}  # fmt: skip
