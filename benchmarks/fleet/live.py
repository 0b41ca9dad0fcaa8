"""What `twin watch` takes: of a core at 10 kHz and two axes, and of memory over a day."""

from __future__ import annotations

import resource
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory

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
SIGNALS = ("position", "velocity", "current", "force")


def figures() -> Iterator[Figure]:
    """Both."""
    yield _core()
    yield from _day(DAY)


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
