"""What the commands cost, in passes over the logs.

A pass is the CPU time of the baseline's laws (LuGre, cable, spikes), fused by hand in numba, over
all samples of the logs, in the same run: what no identification can go below, and a unit that holds
for any machine. Costs are of whole processes, less that of `twin effects`, which starts as they do.
"""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from benchmarks import workload
from benchmarks.figures import Figure, Target
from benchmarks.processes import Cost, twin
from benchmarks.workload import Workload, saved
from twin.experiments.named import simulate
from twin.log import write_log

TITLE = "Commands in passes: CPU of a process, over that of the fused laws over all its samples"
ROUNDS = 3  # of the short commands
SMALL = 2.0  # s of the small log
MB = 1e6


def measure() -> list[Figure]:
    """The short commands, then fit and diagnosis in passes, then the demonstration."""
    work = workload.make()
    effects = _least("effects")
    return [*_short(work, effects), *_long(work, effects), *_demo()]


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
        Figure("twin effects", effects.cpu, "s CPU", Target(high=0.4), _megabytes(effects)),
        Figure(
            f"twin check, log of {SMALL:g} s", check.cpu, "s CPU", Target(high=0.5),
            _megabytes(check),
        ),
    ]  # fmt: skip


def _long(work: Workload, effects: Cost) -> list[Figure]:
    def passes(what: str, cost: Cost, most: float) -> Figure:
        seconds = cost.cpu - effects.cpu
        note = f"{seconds:.2f} s CPU, {cost.wall:.1f} s wall, {_megabytes(cost)}"
        return Figure(what, work.in_passes(seconds), "passes", Target(high=most), note)

    with saved(work) as (model, plain, hidden):
        twin("diagnose", model, *hidden)  # fills numba's caches
        fitted = twin("fit", model, *plain)
        found = twin("diagnose", model, *hidden)
        nothing = twin("diagnose", model, *plain)
    return [
        Figure("one pass", 1e3 * work.one_pass, "ms", note=f"{work.samples / 1e6:.2f} M samples"),
        passes(f"twin fit, {len(plain)} logs of one axis", fitted, 40.0),
        passes(f"twin diagnose, {workload.HIDDEN} hidden", found, 250.0),
        passes("twin diagnose, nothing hidden", nothing, 150.0),
        Figure(
            "peak memory of a diagnosis over the arrays of its logs",
            (found.memory - effects.memory) / work.log_bytes, "1", Target(high=2.0),
            f"arrays {work.log_bytes / MB:.0f} MB, of which measured "
            f"{work.measured_bytes / MB:.0f} MB",
        ),
    ]  # fmt: skip


def _demo() -> list[Figure]:
    with TemporaryDirectory() as folder:
        cost = twin("demo", "--out", Path(folder, "demo"))
    return [Figure("twin demo", cost.cpu, "s CPU", Target(high=15.0), f"{cost.wall:.1f} s wall")]


def _megabytes(cost: Cost) -> str:
    return f"{cost.memory / MB:.0f} MB"
