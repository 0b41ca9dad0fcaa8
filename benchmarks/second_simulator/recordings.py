"""Five recordings of one drive, as a user makes them, one of which may be spoiled.

Random moves twice, constant speeds, sines, and slow moves, each of another seed. A recording is
spoiled in one of ten ways, each of which has happened to somebody: ``SPOILED``.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.second_simulator.drives import (
    DURATION,
    NOISE,
    STEP,
    Drive,
    Plant,
    Recorder,
    moves,
    simulate,
)
from twin.logs import AxisLog, Log
from twin.logs.log import LINEAR_UNITS, ROTARY_UNITS
from twin.signals import Array

AXIS = "q"
Columns = dict[str, Array]


@dataclass(frozen=True)
class Spoiling:
    """What spoils a recording: a change of the plant, of what was recorded, or the motion itself.

    plant: of the machine while it ran. recorded: of position and force, (n,) each, at a rate (Hz).
    aliased: whether its speeds are those whose encoder steps come at a multiple of the log's rate.
    """

    plant: Callable[[Plant], Plant] = lambda p: p
    recorded: Callable[[Columns, float], Columns] = lambda columns, rate: columns
    aliased: bool = False


def _warm(plant: Plant) -> Plant:
    parts = {n: 0.6 * getattr(plant, n) for n in ("friction", "static", "viscous")}
    return plant._replace(**parts)


def _glitch(columns: Columns, rate: float) -> Columns:
    force = columns["force"].copy()
    at = len(force) // 3
    force[at : at + max(round(0.02 * rate), 4)] += 4.0 * np.abs(force).max()
    return {**columns, "force": force}


def _slipped(columns: Columns, rate: float) -> Columns:
    position = columns["position"].copy()
    position[len(position) // 2 :] += 0.05 * np.ptp(position)
    return {**columns, "position": position}


def _scaled(columns: Columns, rate: float) -> Columns:
    return {**columns, "force": 0.75 * columns["force"]}


def _late(columns: Columns, rate: float) -> Columns:
    return {**columns, "force": np.roll(columns["force"], max(round(0.01 * rate), 2))}


def _clipped(columns: Columns, rate: float) -> Columns:
    most = 0.5 * np.abs(columns["force"]).max()
    return {**columns, "force": np.clip(columns["force"], -most, most)}


SPOILED = {
    "aliased": Spoiling(aliased=True),
    "touched": Spoiling(lambda p: p._replace(push=1.5 * p.friction)),
    "payload": Spoiling(lambda p: p._replace(mass=1.5 * p.mass)),
    "warm": Spoiling(_warm),
    "tilted": Spoiling(lambda p: p._replace(tilt=0.5 * p.friction)),
    "glitch": Spoiling(recorded=_glitch),
    "slipped": Spoiling(recorded=_slipped),
    "other gain": Spoiling(recorded=_scaled),
    "late": Spoiling(recorded=_late),
    "clipped": Spoiling(recorded=_clipped),
}


def recordings(
    drive: Drive, plant: Plant, recorder: Recorder, seed: int, spoiled: str | None, which: str
) -> dict[str, Log]:
    """The recordings by name, in the order in which they were made; ``which`` of them is spoiled.

    spoiled: a name of SPOILED; None where all are sound. An aliased one is that of speeds.
    """
    out = {}
    for i, (name, made) in enumerate(PATHS.items()):
        rng = np.random.default_rng([seed, i])
        own = SPOILED[spoiled] if spoiled and name == which else Spoiling()
        path = _resonant(drive, recorder) if own.aliased else made(drive, rng)
        out[name] = _log_of(drive, plant, recorder, path, own, rng)
    return out


def _log_of(
    drive: Drive, plant: Plant, recorder: Recorder, path: Array, own: Spoiling,
    rng: np.random.Generator,
) -> Log:  # fmt: skip
    speed = np.gradient(path, 1.0 / STEP)
    pushed = plant.mass * np.gradient(speed, 1.0 / STEP)
    every = STEP // recorder.rate, STEP // recorder.control
    gains = np.array(drive.gains)
    read, command = simulate(
        own.plant(plant), gains, path, speed, pushed, drive.encoder, *every, recorder.mean
    )
    command = command + NOISE * plant.friction * rng.standard_normal(len(command))
    columns = own.recorded({"position": read, "force": command}, float(recorder.rate))
    units = ROTARY_UNITS if drive.rotary else LINEAR_UNITS
    return Log(float(recorder.rate), {AXIS: AxisLog(columns, units)})


# --- motions --------------------------------------------------------------------------------------


def _slow(drive: Drive, rng: np.random.Generator) -> Array:
    return moves(replace(drive, speed=0.3 * drive.speed), rng)


def _sines(drive: Drive, rng: np.random.Generator) -> Array:
    """Sines one after another, each of a frequency, as large as speed and acceleration allow."""
    each = 4
    time = np.arange(round(DURATION * STEP / each)) / STEP
    grown = np.minimum(np.minimum(time, time[::-1]) / 0.5, 1.0)  # 0.5 s, until it is as large
    parts = []
    for frequency in np.geomspace(0.3, 6.0, each) * rng.uniform(0.8, 1.2, each):
        turn = 2.0 * np.pi * frequency
        size = min(drive.travel, drive.speed / turn, drive.acceleration / turn**2)
        parts.append(size * np.sin(turn * time) * np.sin(0.5 * np.pi * grown) ** 2)
    return np.concatenate(parts)


def _at_speeds(drive: Drive, speeds: Array) -> Array:
    """Forth and back at each speed, for about as long each, as far as the travel allows."""
    each, parts = round(DURATION * STEP / len(speeds)), []
    for v in speeds:
        ways = max(int(np.ceil(each / STEP * v / (1.6 * drive.travel) / 2.0)), 1) * 2
        edges = np.linspace(0, each, ways + 1).astype(int)[1:-1]
        signs = np.where(np.searchsorted(edges, np.arange(each), side="right") % 2, -1.0, 1.0)
        parts.append(v * signs)
    ramp = max(round(1.5 * max(speeds) / drive.acceleration * STEP), 100)
    asked = np.concatenate(parts)
    asked[-ramp:] = 0.0
    smooth = np.convolve(np.pad(asked, (ramp, 0)), np.full(ramp, 1.0 / ramp))[
        ramp : ramp + len(asked)
    ]
    path = np.cumsum(smooth) / STEP
    return path - 0.5 * (path.max() + path.min())


def _speeds(drive: Drive, rng: np.random.Generator) -> Array:
    return _at_speeds(drive, drive.speed * np.geomspace(0.01, 1.0, 8) * rng.uniform(0.9, 1.1, 8))


def _resonant(drive: Drive, recorder: Recorder) -> Array:
    """The same at speeds whose encoder steps come at a multiple of the log's rate."""
    first = drive.encoder * recorder.rate
    fits = max(int(drive.speed / first), 1)
    return _at_speeds(drive, first * np.minimum([1, 2, 1, 3, 1, 2, 1, 4], fits))


PATHS: dict[str, Callable[[Drive, np.random.Generator], Array]] = {
    "moves": moves, "speeds": _speeds, "sines": _sines, "slow": _slow, "again": moves,
}  # fmt: skip
