"""What the commands cost, in passes over the logs.

A pass is the CPU time of the baseline's laws (LuGre, cable, spikes), fused by hand in numba, over
all samples of the logs, before and after each command: what no identification can go below, and a
unit that follows the speed of the machine, though not alike on each. Costs are of whole processes,
less that of `twin effects`, which starts as they do.
"""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

import numpy as np

from benchmarks import workload
from benchmarks.figures import Figure, Target
from benchmarks.timing import Cost, first_line, twin
from benchmarks.workload import MB, Workload, megabytes, saved
from identify.workflow import fit
from twin.logs import write_log
from twin.simulation.simulate import simulate

TITLE = "Commands in passes: CPU of a process, over that of the fused laws over all its samples"
ROUNDS = 3  # of a command
SMALL = 2.0  # s of the small log


def measure() -> list[Figure]:
    """The short commands, then fit and diagnosis in passes, then the demonstration."""
    work = workload.make()
    effects = _least("effects")
    return [*_short(work, effects), *_long(work, effects), _pool(work), *_demo()]


def _least(*arguments: str | Path) -> Cost:
    """The cost of a command whose caches are warm: the least of some runs."""
    return min((twin(*arguments) for _ in range(ROUNDS + 1)), key=lambda cost: cost.cpu)


def _short(work: Workload, effects: Cost) -> list[Figure]:
    with TemporaryDirectory() as folder:
        small = Path(folder, "small.mcap")
        write_log(simulate(work.machine, "tracking", seed=1, duration=SMALL), small)
        check = _least("check", small)
    front = _least("--help")
    return [
        Figure("twin --help", front.cpu, "s CPU", Target(high=0.2)),
        Figure("twin --help, peak memory", front.memory / MB, "MB", Target(high=60.0)),
        Figure("twin effects", effects.cpu, "s CPU", Target(high=0.4), megabytes(effects)),
        Figure(
            f"twin check, log of {SMALL:g} s", check.cpu, "s CPU", Target(high=0.5),
            megabytes(check),
        ),
    ]  # fmt: skip


@dataclass(frozen=True)
class _Round:
    """One run of a command, and what a pass costs then: the mean of before and after, s."""

    cost: Cost
    one_pass: float

    @classmethod
    def of(cls, work: Workload, *arguments: str | Path) -> _Round:
        before = work.timed_pass()
        cost = twin(*arguments)
        return cls(cost, 0.5 * (before + work.timed_pass()))

    def passes(self, effects: Cost) -> float:
        return (self.cost.cpu - effects.cpu) / self.one_pass


def _long(work: Workload, effects: Cost) -> list[Figure]:
    def rounds(*arguments: str | Path) -> list[_Round]:
        """Some runs, by what they cost in passes."""
        found = (_Round.of(work, *arguments) for _ in range(ROUNDS))
        return sorted(found, key=lambda r: r.passes(effects))

    def figure(what: str, found: list[_Round], most: float) -> Figure:
        middle = found[len(found) // 2]
        each = ", ".join(f"{r.passes(effects):.1f}" for r in found)
        note = (
            f"median of {each}; {middle.cost.cpu - effects.cpu:.2f} s CPU at "
            f"{1e3 * middle.one_pass:.0f} ms a pass, {middle.cost.wall:.1f} s wall, "
            f"{megabytes(middle.cost)}"
        )
        return Figure(what, middle.passes(effects), "passes", Target(high=most), note)

    with saved(work) as (model, plain, hidden):
        twin("diagnose", model, *hidden)  # fills numba's caches
        first = min(first_line("diagnose", model, *hidden) for _ in range(ROUNDS))
        fitted = rounds("fit", model, *plain)
        found = rounds("diagnose", model, *hidden)
        nothing = rounds("diagnose", model, *plain)
    one_pass = float(np.median([r.one_pass for r in (*fitted, *found, *nothing)]))
    return [
        Figure("one pass", 1e3 * one_pass, "ms", note=f"{work.samples / 1e6:.2f} M samples"),
        figure(f"twin fit, {len(plain)} logs of one axis", fitted, 40.0),
        figure(f"twin diagnose, {workload.HIDDEN} hidden", found, 250.0),
        figure("twin diagnose, nothing hidden", nothing, 150.0),
        Figure("twin diagnose, its first answer", first, "s", Target(high=3.0), "wall time"),
        workload.memory("", found[0].cost, effects, work),
    ]  # fmt: skip


FITS = 8  # in a row, and in a pool of two processes
GIVEN: list[Workload] = []  # of this process; workers have it from the process that forked them


def _fitted(number: int) -> dict[str, tuple[float, ...]]:
    """The values of the axis, by effect, as one of the logs has them."""
    work = GIVEN[0]
    name, log = [*work.plain.items()][number % len(work.plain)]
    axis = fit(work.model, {name: log}).fits[workload.AXIS].axis
    return {"mass": (axis.mass,), **{f.effect.name: tuple(f.vector()) for f in axis.effects}}


def _pool(work: Workload) -> Figure:
    """Wall time of fits in a pool of two processes over that of the same in a row."""
    GIVEN[:] = [work]
    _fitted(0)  # whatever is loaded first
    with ProcessPoolExecutor(2, get_context("fork")) as pool:
        list(pool.map(_fitted, range(2)))
        begun = perf_counter()
        in_row = [_fitted(i) for i in range(FITS)]
        between = perf_counter()
        in_pool = [*pool.map(_fitted, range(FITS))]
        ended = perf_counter()
    same = "the same numbers" if in_pool == in_row else "OTHER NUMBERS"
    spent = (ended - between) / (between - begun)
    return Figure(f"{FITS} fits in a pool of two over in a row", spent, "1", Target(high=0.6), same)


def _demo() -> list[Figure]:
    with TemporaryDirectory() as folder:
        cost = _least("demo", "--out", Path(folder, "demo"))
    return [Figure("twin demo", cost.cpu, "s CPU", Target(high=15.0), f"{cost.wall:.1f} s wall")]
