"""Each fault of a recording is called by its name, with the place, the size and what to do.

One axis later than the other in all its columns, the setpoint too, is not among them: no column
shows it.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from check_cases import Columns, clean_log, faults, milliseconds, only, stage, with_axis

from twin.checks import Fault, check_log
from twin.logs import FIELDS, Log
from twin.logs.log import Array
from twin.simulation.simulate import simulate

Plant = Callable[[Log], Log]
DRIVEN = ("force", "current")
CONSTANT = 53.4  # N/A of the stage
COLUMN_SETS = {
    "all": FIELDS,
    "with setpoint": ("setpoint_position", "position", "force"),
    "bare": ("position", "force"),
}


def every(log: Log, change: Callable[[str, Columns], Columns]) -> Log:
    """The log with the columns of each axis changed."""
    axes = {
        name: replace(axis, columns=change(name, {n: c.copy() for n, c in axis.columns.items()}))
        for name, axis in log.axes.items()
    }
    return replace(log, axes=axes, truth={})


def on_x(change: Callable[[Columns], None]) -> Plant:
    """A change of axis x, in place."""

    def plant(log: Log) -> Log:
        def changed(name: str, columns: Columns) -> Columns:
            if name == "x":
                change(columns)
            return columns

        return every(log, changed)

    return plant


def fastest(position: np.ndarray) -> int:
    """A sample of fast motion, away from the ends."""
    speed = np.abs(np.gradient(position))
    speed[:500] = speed[-3000:] = 0.0
    return int(np.argmax(speed))


def missing(log: Log) -> Log:
    lost = slice(len(log) // 2, len(log) // 2 + 40)
    return log.changed(lambda _, column: np.delete(column, lost))


def stuck(c: Columns) -> None:
    at = fastest(c["position"])
    c["position"][at : at + 300] = c["position"][at]


def wrapped(c: Columns) -> None:
    x = c["position"]
    c["position"] = np.mod(x - x.min(), 0.4 * np.ptp(x)) + x.min()


def one_sample(c: Columns) -> None:
    c["position"][fastest(c["position"])] += 2e-3


def lost_counts(c: Columns) -> None:
    c["position"][fastest(c["position"]) :] += 1e-3


def joined(log: Log) -> Log:
    other, at = simulate(stage(), "tracking", seed=77, duration=3.0), len(log) // 3
    return every(
        log, lambda a, c: {n: np.r_[v[:at], other.axes[a].columns[n]] for n, v in c.items()}
    )


def held(count: int, *names: str) -> Plant:
    def change(c: Columns) -> None:
        for name in set(names) & set(c):
            c[name] = np.repeat(c[name][::count], count)[: len(c[name])]

    return on_x(change)


def late(samples: int, *names: str) -> Plant:
    """Some columns of x late (early where negative); the ends of all are cut off."""
    cut = slice(abs(samples), -abs(samples))

    def plant(log: Log) -> Log:
        return every(log, lambda a, c: {
            n: (np.roll(v, samples) if a == "x" and n in names else v)[cut] for n, v in c.items()
        })  # fmt: skip

    return plant


def drifting(c: Columns) -> None:
    k = np.arange(len(c["position"]))
    for name in DRIVEN:
        c[name] = np.interp(k * (1.0 + 200e-6), k, c[name])


def swapped(*names: str) -> Plant:
    def plant(log: Log) -> Log:
        other = {"x": log.axes["y"].columns, "y": log.axes["x"].columns}
        return every(log, lambda a, c: {n: other[a][n] if n in names else v for n, v in c.items()})

    return plant


def force_samples(c: Columns) -> None:
    rng = np.random.default_rng(1)
    at = rng.integers(100, len(c["force"]) - 100, 5)
    c["force"][at] += 30.0 * rng.choice([-1.0, 1.0], 5)
    c["current"] = c["force"] / CONSTANT


def noisy_force(c: Columns) -> None:
    noise = 7.0 * np.random.default_rng(3).standard_normal(len(c["force"]))
    c["force"] += noise
    c["current"] += noise / CONSTANT


def rounded(c: Columns) -> None:
    c["position"] = np.round(c["position"] / 2e-5) * 2e-5


def in_millimetres(c: Columns) -> None:
    c["position"] *= 1e3


def reversed_force(c: Columns) -> None:
    for name in DRIVEN:
        c[name] *= -1.0


def limited(c: Columns) -> None:
    for name in DRIVEN:
        most = np.quantile(np.abs(c[name]), 0.97)
        c[name] = np.clip(c[name], -most, most)


HIDDEN = {("readings 500 samples late", "bare")}  # no column shows it

FAULTS: dict[str, tuple[Plant, Fault]] = {
    "40 samples missing": (missing, Fault.MISSING),
    "a stuck encoder": (on_x(stuck), Fault.STUCK),
    "position held 4 samples": (held(4, "position"), Fault.HELD),
    "a counter that wraps": (on_x(wrapped), Fault.WRAPPED),
    "a sample of the position": (on_x(one_sample), Fault.OUTLIERS),
    "joined logs": (joined, Fault.JOINED),
    "lost counts": (on_x(lost_counts), Fault.STEP),
    "force 5 samples late": (late(5, *DRIVEN), Fault.LAG),
    "force 20 samples late": (late(20, *DRIVEN), Fault.LAG),
    "force 500 samples late": (late(500, *DRIVEN), Fault.LAG),
    "force 20 samples early": (late(-20, *DRIVEN), Fault.LAG),
    "position 5 samples late": (late(5, "position"), Fault.LAG),
    "position 20 samples late": (late(20, "position"), Fault.LAG),
    "readings 500 samples late": (late(500, "position", "velocity", *DRIVEN), Fault.LAG),
    "200 ppm between clocks": (on_x(drifting), Fault.DRIFT),
    "swapped axes": (swapped("position"), Fault.SWAPPED),
    "swapped forces": (swapped(*DRIVEN), Fault.SWAPPED),
    "samples of the force": (on_x(force_samples), Fault.OUTLIERS),
    "force held 2 samples": (held(2, *DRIVEN), Fault.HELD),
    "20 um rounding": (on_x(rounded), Fault.COARSE_POSITION),
    "7 N noise": (on_x(noisy_force), Fault.NOISE),
    "millimetres": (on_x(in_millimetres), Fault.UNIT),
    "a reversed force": (on_x(reversed_force), Fault.SIGN),
    "a limited force": (on_x(limited), Fault.SATURATION),
}


SETS = list(COLUMN_SETS)
SHOWN = {name: [s for s in SETS if (name, s) not in HIDDEN] for name in FAULTS}
ROUNDS = {name: SHOWN[name][i % len(SHOWN[name])] for i, name in enumerate(FAULTS)}


@cache
def recording(experiment: str, seed: int) -> Log:
    return simulate(stage(), experiment, seed=seed, duration=10.0)


def named(log: Log, fault: str, columns: str) -> bool:
    plant, kind = FAULTS[fault]
    found = check_log(plant(log).with_fields(COLUMN_SETS[columns])).findings
    kinds = {kind}
    if columns == "bare" and kind is Fault.STEP:  # forwards, it looks like missing samples
        kinds.add(Fault.MISSING)
    return any(f.fault in kinds and f.remedy and re.search(r"\d", str(f)) for f in found)


@pytest.mark.parametrize("fault", FAULTS)
def test_a_fault_is_named(fault: str) -> None:
    assert named(recording("moves", 1), fault, ROUNDS[fault])


@pytest.mark.slow
@pytest.mark.parametrize(("fault", "columns"), [(f, s) for f in FAULTS for s in SHOWN[f]])
def test_a_fault_is_named_in_nine_of_ten(fault: str, columns: str) -> None:
    logs = [recording(e, s) for e in ("tracking", "moves") for s in (1, 2, 3, 4, 5)]
    assert sum(named(log, fault, columns) for log in logs) >= 0.9 * len(logs)


@pytest.mark.slow
def test_clean_logs_are_called_clean() -> None:
    wrong = []
    for seed in range(50):
        for experiment in ("tracking", "moves"):
            log = simulate(stage(), experiment, seed=200 + seed, duration=8.0)
            for columns in COLUMN_SETS.values():
                wrong += [str(f) for f in check_log(log.with_fields(columns)).findings]
    motions = ("hardly moves", "moves only", "strokes only")  # which tell little, and say so
    assert not [w for w in wrong if not any(m in w for m in motions)]


def burst(shape: Array) -> Callable[[Columns], Columns]:
    """A burst of 10 ms on the position."""

    def plant(columns: Columns) -> Columns:
        columns["position"][30_000:30_100] += shape
        return columns

    return plant


def test_a_burst_of_little_noise_is_told_where_it_is() -> None:
    noise = 1e-6 * np.random.default_rng(0).standard_normal(100)
    finding = only(check_log(with_axis(clean_log(), "y", burst(noise))), Fault.OUTLIERS)
    assert finding.what.startswith("position bends by up to")
    start, end = (float(w) for w in str(finding.where).removesuffix(" s").split(" to "))
    assert (start, end) == (pytest.approx(3.0, abs=0.011), pytest.approx(3.01, abs=0.011))


def test_a_burst_does_not_hide_a_lag() -> None:
    both = with_axis(clean_log(), "x", burst(np.full(100, 1e-3)))
    report = check_log(late(500, *DRIVEN)(both))
    assert faults(report) == {Fault.LAG, Fault.OUTLIERS}
    assert milliseconds(only(report, Fault.LAG)) == pytest.approx(50.0, abs=0.3)
