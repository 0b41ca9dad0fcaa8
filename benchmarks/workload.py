"""What `passes`, `stages` and `kinds` measure: five logs of one axis, and a pass over them.

A pass is the CPU time of the baseline's laws, fused by hand, over every sample of the logs.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from time import thread_time

import numpy as np

from benchmarks import fused
from benchmarks.figures import Figure, Target
from benchmarks.timing import Cost, interleaved
from identify.estimation.force_balance import residual
from identify.experiment_design.planting import added_force, other_machine, strength_for
from identify.workflow import fit
from twin.effect import Effect, Excitation
from twin.effects import load_catalogue
from twin.logs import Log, write_log
from twin.logs.log import Array
from twin.model.file import load_model, save_model
from twin.model.machine import Fitted, MachineModel
from twin.simulation.simulate import simulate

DURATION = 30.8  # s of each log; together 1.54 million samples
LOGS = 5
AXIS = "x"
HIDDEN, FLOORS = "cogging", 4.0  # effect, and its RMS force over the noise floor
PITCH = 0.024  # m
ROUNDS = 9
MEMORY = 2.0  # times the arrays of the logs
MB = 1e6


@dataclass(frozen=True, eq=False)
class Workload:
    """A model of one axis, and the logs of the machine with and without a hidden effect."""

    model: MachineModel
    machine: MachineModel
    plain: dict[str, Log]
    hidden: dict[str, Log]

    @property
    def samples(self) -> int:
        """Samples of all logs together."""
        return sum(map(len, self.plain.values()))

    @property
    def measured_bytes(self) -> int:
        """Bytes of the signals that a machine too would log."""
        return sum(_bytes(a.columns) for log in self.plain.values() for a in log.axes.values())

    @property
    def log_bytes(self) -> int:
        """Bytes of the arrays that the logs hold, those of the truth included."""
        truths = (t for log in self.plain.values() for t in log.truth.values())
        return self.measured_bytes + sum(map(_bytes, truths))

    @cached_property
    def one_pass(self) -> float:
        """CPU time in s of one pass over the logs, when it was first asked for."""
        return self.timed_pass()

    def timed_pass(self, rounds: int = ROUNDS) -> float:
        """The same, measured now: the speed of a shared machine changes from minute to minute."""
        return float(np.median(interleaved([self._job], rounds, thread_time)))

    @cached_property
    def _job(self) -> Callable[[], None]:
        """One pass."""
        period = self.model.period
        c = fused.constants(self.model.axes[AXIS])
        motions = [
            (0.5 * (x[1:] + x[:-1]), np.diff(x) / period, np.empty(len(x) - 1))
            for x in (log.axes[AXIS].position for log in self.plain.values())
        ]

        def job() -> None:
            for position, velocity, out in motions:
                fused.along(c, position, velocity, period, out)

        return job

    def in_passes(self, seconds: float) -> float:
        """CPU time in s as a number of passes."""
        return seconds / self.one_pass


def _bytes(columns: Mapping[str, Array]) -> int:
    return sum(column.nbytes for column in columns.values())


@contextmanager
def saved(work: Workload) -> Iterator[tuple[Path, list[Path], list[Path]]]:
    """Files of the model, of the logs without and of those with the hidden effect."""
    with TemporaryDirectory() as folder:
        model = Path(folder, "one_axis.toml")
        save_model(work.model, model)
        sets: list[list[Path]] = []
        for kind, logs in (("plain", work.plain), ("hidden", work.hidden)):
            sets.append([Path(folder, f"{kind}_{name}.mcap") for name in logs])
            for path, log in zip(sets[-1], logs.values(), strict=True):
                write_log(log, path)
        yield model, sets[0], sets[1]


def make(duration: float = DURATION) -> Workload:
    """Simulate the logs, all with other values than those of the model."""
    whole = load_model("proton_xy", load_catalogue())
    model = replace(whole, axes={AXIS: whole.axes[AXIS]}, mjcf=None, mjcf_name=None)
    machine = model.with_axis(AXIS, other_machine(model.axes[AXIS], np.random.default_rng(1)))
    plain = recorded(machine, duration)
    cogging = planted(model, plain, HIDDEN, FLOORS, lambda e, _: {**e.starts(), "p": PITCH})
    hidden = machine.with_axis(AXIS, machine.axes[AXIS].with_effect(cogging))
    return Workload(model, machine, plain, recorded(hidden, duration))


def recorded(machine: MachineModel, duration: float = DURATION) -> dict[str, Log]:
    """Logs of random moves of a machine, each that long (s)."""
    return {
        f"log_{i}": simulate(machine, "tracking", seed=i, duration=duration) for i in range(LOGS)
    }


def planted(
    model: MachineModel,
    logs: Mapping[str, Log],
    name: str,
    floors: float,
    values: Callable[[Effect, Excitation], Mapping[str, float]],
) -> Fitted:
    """An effect whose force has an RMS of so many noise floors on the first log.

    As the model's fit sees it. values: those of the effect, of what the log excites.
    """
    effect, first = load_catalogue()[name], dict([next(iter(logs.items()))])
    found = fit(model, first)
    base = found.fits[AXIS]
    without = residual(base.axis, base.logs)
    return strength_for(
        effect,
        lambda fitted: added_force(fitted, base.axis, base.logs, without),
        floors * base.floor,
        values(effect, found.datasets[AXIS].excitation),
    )


def memory(what: str, cost: Cost, idle: Cost, work: Workload) -> Figure:
    """Peak memory of a command, less that of one that does nothing, over the arrays of the logs."""
    return Figure(
        f"peak memory of a diagnosis over the arrays of its logs{what}",
        (cost.memory - idle.memory) / work.log_bytes, "1", Target(high=MEMORY),
        f"{megabytes(cost)}, arrays {work.log_bytes / MB:.0f} MB, of which measured "
        f"{work.measured_bytes / MB:.0f} MB",
    )  # fmt: skip


def megabytes(cost: Cost) -> str:
    """The peak memory of a command."""
    return f"{cost.memory / MB:.0f} MB"
