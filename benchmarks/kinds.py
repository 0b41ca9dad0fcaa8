"""What the diagnosis of each of fifteen kinds of hidden effect costs, in passes over the logs.

Five logs, 1.5 million samples, of a machine whose bumps have another form than the model's besides,
so that more than one thing is wrong. The cost is CPU time of `identify.workflow.diagnose` on logs
that are read, over that of a pass (``workload``). On a shared machine a pass costs up to twice as
much from one second to the next; so passes are measured all along a diagnosis, beside its threads.
The memory is that of the process of `twin diagnose` on the files of one kind's logs, as in
``passes``.
"""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter, process_time

import numpy as np

from benchmarks import workload
from benchmarks.figures import Figure, Target
from benchmarks.selftest.laws import BUMPS
from benchmarks.selftest.variations import drawn_values
from benchmarks.timing import twin
from benchmarks.workload import AXIS, HIDDEN, Workload, saved
from identify.workflow import diagnose
from twin.effects import load_catalogue
from twin.logs import Log
from twin.model.machine import Fitted

TITLE = "Diagnosis of fifteen kinds of hidden effect, bumps of another form, in passes"
KINDS = (
    "actuator_deadband", "actuator_lag", "asymmetric_friction", "base_vibration",
    "cable_hysteresis", "cogging", "dwell_stiction", "flexible_mode", "force_constant_ripple",
    "load_dependent_friction", "periodic_disturbance", "position_dependent_friction",
    "quadratic_drag", "thermal_drift", "wear",
)  # fmt: skip
FLOORS = 8.0  # RMS force of the effect over the noise floor
MEDIAN, DEAREST = 200.0, 600.0  # passes
BETWEEN = 0.5  # s at least from a pass that is measured to the next


def measure() -> list[Figure]:
    """The median and the dearest, and whether each is named."""
    work = workload.make()
    costs = {name: _cost(work, name) for name in KINDS}
    each = ", ".join(f"{name} {passes:.0f} ({told})" for name, (passes, told) in costs.items())
    passes = sorted(p for p, _ in costs.values())
    return [
        Figure(
            "median of the kinds", float(np.median(passes)), "passes", Target(high=MEDIAN), each
        ),
        Figure("the dearest kind", passes[-1], "passes", Target(high=DEAREST)),
        _memory(work),
    ]


def _cost(work: Workload, name: str) -> tuple[float, str]:
    """Passes of the diagnosis of a machine with that effect, and what it names."""
    logs, passes = _logs(work, name), [work.timed_pass(1)]
    last = perf_counter()

    def measure_a_pass(*_: object) -> None:
        nonlocal last
        if perf_counter() - last > BETWEEN:
            passes.append(work.timed_pass(1))
            last = perf_counter()

    begun = process_time()
    found = diagnose(work.model, logs, catalogue=load_catalogue(), progress=measure_a_pass)
    # each was made twice, the first time not counted (``interleaved``)
    spent = process_time() - begun - 2.0 * sum(passes[1:])
    named = " and ".join("/".join(answer) for answer in found.leading.answers) or "-"
    return spent / float(np.mean(passes)), named


def _memory(work: Workload) -> Figure:
    """Peak memory of a diagnosis of one kind, in a process of its own."""
    work = replace(work, plain=_logs(work, HIDDEN), hidden={})
    with saved(work) as (model, logs, _):
        twin("diagnose", model, *logs)  # fills numba's caches
        effects, cost = twin("effects"), twin("diagnose", model, *logs)
    return workload.memory(f", {HIDDEN}", cost, effects, work)


def _logs(work: Workload, name: str) -> dict[str, Log]:
    """Logs of the machine with bumps of another form and the effect, some floors large."""
    axis = work.machine.axes[AXIS]
    own, bumps = axis["roller_spikes"].values, BUMPS[0]
    values = {p.name: own[p.name] for p in bumps.parameters if p.name in own}
    axis = axis.without("roller_spikes").with_effect(Fitted.at_start(bumps, values))
    hidden = workload.planted(
        work.model, work.plain, name, FLOORS,
        lambda effect, seen: drawn_values(effect, seen, np.random.default_rng(1)),
    )  # fmt: skip
    return workload.recorded(work.machine.with_axis(AXIS, axis.with_effect(hidden)))
