"""What each stage of a diagnosis costs in passes, and each effect that it tries."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from functools import wraps
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter, process_time, thread_time
from types import ModuleType
from typing import Any
from unittest.mock import patch

import numpy as np

from benchmarks import workload
from benchmarks.figures import Figure, Target
from benchmarks.workload import AXIS, Workload, saved
from identify import workflow
from identify.estimation.variable_projection import absent_effects
from identify.output.shown.report import write_report
from identify.output.shown.subject import Subject
from identify.selection import doubts
from identify.selection.trying import try_effect
from twin.core.compiled import law_address
from twin.effects import load_catalogue
from twin.logs import Log, read_log
from twin.parallel import parallel

TITLE = "Stages of a diagnosis in passes, and the effects that it tries"
STAGES: tuple[tuple[str, ModuleType, str], ...] = (
    ("prepare", workflow, "datasets"),
    ("fit", workflow, "fit_aligned"),
    ("intervals", workflow, "estimates"),
    ("search", doubts, "search"),
    ("what each finding explains", doubts, "findings_of"),
    ("next experiment", workflow, "next_experiments"),
    ("comparison and free run", workflow, "_compared"),
)
Spent = dict[str, list[float]]


def measure() -> list[Figure]:
    """Stages of both diagnoses; then the effects one by one; then one thread and two."""
    work = workload.make()
    for effect in load_catalogue().values():
        law_address(effect)  # compiled before anything is timed
    with saved(work) as (_, plain, hidden):
        sets = {workload.HIDDEN: hidden, "nothing": plain}
        _diagnosed(work, work.hidden, defaultdict(list))  # fills numba's caches
        stages = [f for name, files in sets.items() for f in _stages(work, name, files)]
    return [*stages, *_candidates(work), _threads(work)]


def _stages(work: Workload, name: str, files: list[Path]) -> list[Figure]:
    spent: Spent = defaultdict(list)
    logs = _timed(spent, "read", lambda: {str(f): read_log(f) for f in files})()
    result = _diagnosed(work, logs, spent)
    with TemporaryDirectory() as folder:
        out = Path(folder, "report.html")
        _timed(spent, "report", write_report)(out, Subject("", result))
    return [
        Figure(
            f"{name} hidden: {stage}", work.in_passes(sum(seconds)), "passes",
            note=", ".join(f"{work.in_passes(s):.1f}" for s in seconds)
            if len(seconds) > 1 else "",
        )
        for stage, seconds in spent.items()
    ]  # fmt: skip


def _diagnosed(work: Workload, logs: dict[str, Log], spent: Spent) -> Any:
    """A diagnosis; ``spent`` collects the CPU time of each stage, and of the others together."""
    with _watched(spent):
        begun = process_time()
        result = workflow.diagnose(work.model, logs, catalogue=load_catalogue())
        whole = process_time() - begun
    staged = sum(sum(spent[name]) for name, _, _ in STAGES)
    spent["the rest of the diagnosis"].append(whole - staged)
    return result


@contextmanager
def _watched(spent: Spent) -> Iterator[None]:
    with ExitStack() as stack:
        for stage, module, function in STAGES:
            timed = _timed(spent, stage, getattr(module, function))
            stack.enter_context(patch.object(module, function, timed))
        yield


def _timed(spent: Spent, stage: str, job: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(job)
    def timed(*arguments: Any, **options: Any) -> Any:
        begun = process_time()
        try:
            return job(*arguments, **options)
        finally:
            spent[stage].append(process_time() - begun)

    return timed


def _candidates(work: Workload) -> list[Figure]:
    """CPU time of each absent effect tried beside the fitted model, with cogging hidden."""
    catalogue = load_catalogue()
    fitted = workflow.fit(work.model, work.hidden)
    base, dataset = fitted.fits[AXIS], fitted.datasets[AXIS]
    seconds = {}
    for effect in absent_effects(base.axis, catalogue):
        begun = thread_time()
        try_effect(base, dataset, effect)
        seconds[effect.name] = thread_time() - begun
    dearest = sorted(seconds, key=lambda name: -seconds[name])
    median, worst = float(np.median(list(seconds.values()))), seconds[dearest[0]]
    told = ", ".join(f"{name} {work.in_passes(seconds[name]):.1f}" for name in dearest[:8])
    return [
        Figure(
            "the dearest effect tried over the median one", worst / median, "1", Target(high=4.0),
            f"passes: median {work.in_passes(median):.2f}; {told}",
        ),
        Figure(
            "all effects tried, one after another", work.in_passes(sum(seconds.values())),
            "passes", note=f"{len(seconds)} effects",
        ),
    ]  # fmt: skip


def _threads(work: Workload) -> Figure:
    """Wall time of a whole diagnosis on one thread over that on two."""
    wall = {}
    for count in (1, 2):
        with parallel(count):
            begun = perf_counter()
            workflow.diagnose(work.model, work.hidden, catalogue=load_catalogue())
            wall[count] = perf_counter() - begun
    return Figure(
        "a whole diagnosis on two threads, times faster than on one", wall[1] / wall[2], "1",
        Target(low=1.9), f"{wall[1]:.1f} s and {wall[2]:.1f} s wall; of meaning on an idle machine",
    )  # fmt: skip
