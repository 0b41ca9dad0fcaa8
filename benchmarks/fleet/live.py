"""What `twin watch` takes of a core and of memory over a day, and how soon it tells wear."""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.figures import Figure, Target
from identify.fleet.floor import STAGE
from identify.fleet.live_diagnosis import Background
from identify.fleet.watch import Watcher
from twin.logs import Log, write_log
from twin.logs.follow import Follower
from twin.logs.log import thinned
from twin.model.file import load_model
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator

MB = 1e6
HOUR, DAY = 3600.0, 86_400.0  # s
STRETCH = 60.0  # s that are simulated, and follow each other with a gap of one second
SLOWER = 4  # 250 Hz, so that a day passes in minutes
PARTS, PART, GROWN = 30, 20.0, 0.1  # stretches, s of each, growth of friction
SIGNALS = ("position", "velocity", "current", "force")


def figures() -> Iterator[Figure]:
    """All of them."""
    yield _core()
    yield from _day(DAY)
    yield from _wear()


def _core() -> Figure:
    """CPU time a second of a log, by a file, once the laws are compiled."""
    model, seconds, first = load_model("proton_xy"), 60.0, 20
    log = simulate(model, "tracking", seed=2, duration=seconds, simulator=ReducedSimulator)
    with TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        write_log(replace(log, truth={}), path)
        watcher, begun = Watcher(model), 0.0
        for i, (start, window) in enumerate(Follower(path, SIGNALS).windows(1.0)):
            if i == first:
                begun = time.process_time()
            watcher.take(start, window)
    share = (time.process_time() - begun) / (seconds - first)
    note = f"{log.sample_rate:g} Hz, {len(log.axes)} axes, windows of 1 s, without a terminal"
    return Figure("a core by `twin watch`", share, "1", Target(high=0.1), note)


def _day(seconds: float) -> Iterator[Figure]:
    model = load_model(STAGE)
    made = simulate(model, "tracking", seed=2, duration=STRETCH, simulator=ReducedSimulator)
    log = thinned(made, SLOWER)
    watcher, used, begun = Watcher(model), list[float](), time.process_time()
    with ThreadPoolExecutor(1) as executor:
        behind = Background(model, executor)
        for start, window in _windows(log, seconds):
            behind.take(watcher.take(start, window))
            if start >= HOUR * (1 + len(used)):
                used.append(_memory())
    used.append(_memory())
    spent = time.process_time() - begun
    note = f"{seconds / HOUR:.0f} h in {watcher.windows} windows, {spent:.0f} s of a core"
    yield Figure("memory beyond that of the first hour", (used[-1] - used[0]) / MB, "MB",
                 Target(high=10.0), f"{note}; {used[-1] / MB:.0f} MB in all")  # fmt: skip


def _wear() -> Iterator[Figure]:
    """Ten minutes of stretches, in whose second half the Coulomb friction grows by a tenth."""
    model, watcher = load_model(STAGE), Watcher(load_model(STAGE))
    axis, friction = model.axes["x"], "coulomb_viscous"
    fitted, early, told, missed = axis[friction].values["Fc"], 0, np.inf, list[float]()
    for i in range(PARTS):
        share = 1.0 + GROWN * max(i - PARTS // 2 + 1, 0) / (PARTS // 2)
        own = replace(axis[friction], values={**axis[friction].values, "Fc": share * fitted})
        worn = model.with_axis("x", axis.without(friction).with_effect(own))
        log = simulate(worn, "tracking", seed=i, duration=PART, simulator=ReducedSimulator)
        size = round(log.sample_rate)
        for j in range(round(PART)):
            window = watcher.take((PART + 1.0) * i + j, log.part(j * size, (j + 1) * size))
            early += len(window.alarms) if share == 1.0 else 0
            told = min([told, *(share for _ in window.alarms if share > 1.0)])
        if window.axes:
            (now,) = (p for p in window.axes[0].parameters if p.name == f"{friction}.Fc")
            missed.append(abs(now.value - share * fitted) / fitted)
    note = f"{PARTS} stretches of {PART:g} s; Coulomb friction grows by {GROWN:.0%}"
    yield Figure("alarms before there is wear", early, "1", Target(high=0.0), note)
    yield Figure("wear at the first alarm", told - 1.0, "1", Target(high=GROWN), note)
    yield Figure("followed friction off the true one, at most", max(missed), "1",
                 note="of it; behind what is true by the memory")  # fmt: skip


def _windows(log: Log, seconds: float) -> Iterator[tuple[float, Log]]:
    """A day of windows of ten seconds: the log again and again, with a gap between."""
    size, start = round(10.0 * log.sample_rate), 0.0
    while start < seconds:
        for i in range(len(log) // size):
            yield start + 10.0 * i, log.part(i * size, (i + 1) * size)
        start += STRETCH + 1.0


def _memory() -> float:
    """Bytes that this process holds: now where that is told, else at most until now."""
    told = Path("/proc/self/statm")
    if told.exists():
        return float(told.read_text().split()[1]) * resource.getpagesize()
    unit = 1 if sys.platform == "darwin" else 1024
    return float(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit)
