"""Recordings as a recorder writes them: signals of the second simulator, names, locale, faults."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from benchmarks.door.recorders import RECORDERS, Column, Recorder
from benchmarks.second_simulator.drives import DRIVES, STEP, Drive, moves, simulate

RATES = (100, 200, 500, 1000, 2000)  # Hz
COUNTS = 4096.0  # a turn
# what one of a unit is in SI; None: nothing in the file tells it
UNITS: Mapping[str, float | None] = {
    "": 1.0, "mm": 1e-3, "deg": np.pi / 180.0, "rev": 2.0 * np.pi, "rpm": 2.0 * np.pi / 60.0,
    "mm/min": 1e-3 / 60.0, "mA": 1e-3, "counts": None, "percent": None, "permille": None,
    "V": None, "Nm screw": None,
}  # fmt: skip
_RAW = {"counts": 2.0 * np.pi / COUNTS, "percent": 0.05, "permille": 0.01, "V": 0.5,
        "Nm screw": 300.0}  # fmt: skip
FORCES = ("force", "force_asked", "command", "force_total")
CURRENTS = ("current",)
FAULTS = ("none", "reversed", "exchanged", "no force", "held", "wraps", "no unit")
_ODDS = (0.5, 0.12, 0.1, 0.06, 0.08, 0.07, 0.07)
# Name of the times, s of one of its unit, and whether it is written as a date and a time
CLOCKS = (
    ("t", 1.0, False), ("time", 1.0, False), ("Time [s]", 1.0, False), ("Zeit [ms]", 1e-3, False),
    ("timestamp", 1.0, False), ("t_us", 1e-6, False), ("Timestamp", 1.0, True),
    ("时间(s)", 1.0, False),
    ("時間[s]", 1.0, False), ("Temps (s)", 1.0, False), ("time_ms", 1e-3, False),
)  # fmt: skip
LOCALES = ((",", "."), (";", ","), ("\t", "."), (";", "."))


@dataclass(frozen=True)
class Written:
    """What a column of a recording is: of which axis it holds what, and its size in SI.

    size: SI of one of its numbers, None where nothing in the file tells it. sign: -1 where it is
    reversed.
    """

    axis: str
    holds: str
    size: float | None
    sign: int = 1


@dataclass(frozen=True)
class Recording:
    """A file and the truth of it. columns: by name."""

    path: Path
    recorder: str
    fault: str
    rotary: bool
    rate: float
    columns: Mapping[str, Written] = field(default_factory=dict)


def draw(folder: Path, seed: int, number: int) -> Recording:
    """Write the recording of a number."""
    rng = np.random.default_rng([seed, number])
    order = np.random.default_rng([seed, number // len(RECORDERS)]).permutation(len(RECORDERS))
    recorder = RECORDERS[order[number % len(RECORDERS)]]
    rotary = bool(rng.integers(2)) if recorder.rotary is None else recorder.rotary
    fault = str(rng.choice(FAULTS, p=_ODDS))
    rate = int(rng.choice(RATES[1:]))
    axes = recorder.axes[: 1 if len(recorder.axes) == 1 else int(rng.integers(1, 4))]
    values: dict[str, np.ndarray] = {}
    columns: dict[str, Written] = {}
    for axis in axes:
        signals = _signals(rng, rotary, rate)
        for column in recorder.columns:
            name, numbers, written = _column(column, axis, signals, rng, fault)
            if fault == "no force" and column.holds in (*FORCES, *CURRENTS, "current_asked"):
                continue
            values[name], columns[name] = numbers, written
        if fault == "exchanged":
            _exchange(values, columns, axis)
    path = folder / f"{number:03d}.csv"
    _write(path, values, rate, rng)
    return Recording(path, recorder.name, fault, rotary, float(rate), columns)


# --- signals --------------------------------------------------------------------------------------


def _signals(rng: np.random.Generator, rotary: bool, rate: int) -> dict[str, np.ndarray]:
    """What an axis does, SI."""
    drive = _drive(rng, rotary)
    path = moves(drive, rng)
    speed = np.gradient(path, 1.0 / STEP)
    pushed = drive.plant.mass * rng.uniform(0.8, 1.1) * np.gradient(speed, 1.0 / STEP)
    every = STEP // rate
    control = STEP // max(rate, 1000)
    position, command = simulate(
        drive.plant, np.array(drive.gains), path, speed, pushed, drive.encoder, every, control,
        False,
    )  # fmt: skip
    n = len(command)
    size, noise = float(np.std(command)), rng.standard_normal((6, n))
    command = command + 1e-3 * size * noise[0]
    feedforward = pushed[::every][:n]
    velocity = np.convolve(np.gradient(position, 1.0 / rate), np.full(5, 0.2), "same")
    constant = rng.uniform(0.05, 20.0)
    current = np.concatenate([command[:1], command[:-1]]) / constant
    setpoint = path[::every][:n]
    return {
        "position": position, "setpoint": setpoint, "velocity": velocity,
        "setpoint_velocity": speed[::every][:n], "force": command, "force_asked": command,
        "force_total": command, "command": command, "feedforward": feedforward,
        "part": command - feedforward, "current": current + 3e-3 * size / constant * noise[1],
        "current_asked": command / constant, "error": setpoint - position,
        "acceleration": np.gradient(velocity, 1.0 / rate) + noise[2],
        "temperature": 25.0 + 8.0 * (1.0 - np.exp(-np.arange(n) / rate / 20.0)) + 0.05 * noise[3],
        "supply": 48.0 - 0.2 * np.abs(command) / size + 0.05 * noise[4],
        "current_d": 0.02 * size / constant * noise[5],
        "external": np.convolve(0.05 * size * noise[2], np.full(9, 1.0 / 9.0), "same"),
    }  # fmt: skip


def _drive(rng: np.random.Generator, rotary: bool) -> Drive:
    """A drive with values of its own."""
    drive = DRIVES[str(rng.choice(["servo", "motor"] if rotary else ["cart", "actuator"]))]
    plant = drive.plant
    size = float(np.exp(rng.uniform(-0.3, 0.3)))
    changed = plant._replace(
        mass=plant.mass * size, friction=plant.friction * float(np.exp(rng.uniform(-0.7, 0.4))),
        static=plant.static * float(np.exp(rng.uniform(0.0, 0.4))),
        cogging=plant.friction * rng.choice([0.0, 0.3]),
        spring=plant.friction / drive.travel * rng.choice([0.0, 0.0, 0.5]),
    )  # fmt: skip
    return replace(drive, plant=changed)


# --- as written -----------------------------------------------------------------------------------


def _column(
    column: Column, axis: str, signals: Mapping[str, np.ndarray], rng: np.random.Generator,
    fault: str,
) -> tuple[str, np.ndarray, Written]:  # fmt: skip
    """Name and numbers of a column, and what they are."""
    values, name = signals[column.holds], column.name.format(a=axis)
    size = UNITS[column.unit]
    raw = size if size is not None else _RAW[column.unit]
    numbers, sign = values / raw, 1
    if fault == "reversed" and column.holds in (*FORCES, *CURRENTS, "current_asked", "part",
                                                "feedforward"):  # fmt: skip
        numbers, sign = -numbers, -1
    if column.unit == "counts":
        numbers = np.rint(numbers)
        if fault == "wraps" and column.holds == "position":
            numbers = np.mod(numbers, COUNTS)
    if fault == "held" and column.holds == "setpoint":
        numbers = np.repeat(numbers[::4], 4)[: len(numbers)]
    if fault == "no unit" and name.endswith(("]", ")")) and "[" in name:
        name = name[: name.rindex("[")].rstrip()
    return name, _rounded(numbers, column), Written(axis, column.holds, size, sign)


def _rounded(numbers: np.ndarray, column: Column) -> np.ndarray:
    """As many digits as a recorder prints: of a setpoint one more than of a reading."""
    if column.unit == "counts" and column.holds != "setpoint":
        return np.rint(numbers)
    step = float(np.ptp(numbers)) * (1e-5 if column.holds != "setpoint" else 1e-6)
    return np.round(numbers, max(int(np.ceil(-np.log10(step + 1e-12))), 2))


def _exchange(values: dict[str, np.ndarray], columns: dict[str, Written], axis: str) -> None:
    """Give setpoint and position each the other's name."""
    own = {w.holds: n for n, w in columns.items() if w.axis == axis}
    if {"position", "setpoint"} <= own.keys():
        a, b = own["position"], own["setpoint"]
        values[a], values[b] = values[b], values[a]
        columns[a], columns[b] = columns[b], columns[a]


def _write(path: Path, values: dict[str, np.ndarray], rate: int, rng: np.random.Generator) -> None:
    name, unit, dated = CLOCKS[int(rng.integers(len(CLOCKS)))]
    delimiter, decimal = LOCALES[int(rng.integers(len(LOCALES)))]
    count = len(next(iter(values.values())))
    times = np.arange(count) / rate
    if dated:
        begin = np.datetime64("2026-03-12T10:11:12.000")
        stamps = begin + np.rint(1e6 * times).astype("timedelta64[us]")
        first = np.char.replace(np.datetime_as_string(stamps, "us").astype(str), "T", " ")
    else:
        first = np.array([f"{t:.10g}" for t in times / unit])
    names = list(values)
    cells = [first, *(np.array([f"{v:.10g}" for v in values[n]]) for n in names)]
    if decimal == ",":
        cells = [np.char.replace(c, ".", ",") for c in cells]
    lines = [
        delimiter.join([name, *names]),
        *(delimiter.join(row) for row in zip(*cells, strict=True)),
    ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def recorders() -> tuple[Recorder, ...]:
    """All that there are."""
    return RECORDERS
