"""Jobs at once in one process: the numbers of each are its own, and so is what it says."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from threading import Barrier

import pytest
from planted_logs import RATE, SLIDE, Ride, few, having, logged

from identify import workflow
from identify.output.as_json import json_of
from twin.logs import Log
from twin.model.machine import MachineModel
from twin.parallel import cores
from twin.telling import heard, tell

MODEL = MachineModel("slide", {"x": SLIDE}, RATE)
TRUE = having(SLIDE, "cogging", p=0.021, a1=0.9, b1=0.5)
KNOWN = few("cogging", "spring", "quadratic_drag")
LOGS = {name: logged(TRUE, Ride(seed, 3.0)) for seed, name in enumerate("abc", start=1)}


def diagnosed(copy: str) -> tuple[dict, list[str]]:
    """A diagnosis of logs of which one is a copy, and what was said of that."""
    logs: dict[str, Log] = {"a": LOGS["a"], "b": LOGS["b"], copy: LOGS["a"]}
    with heard() as said:
        found = workflow.diagnose(MODEL, logs, {"c": LOGS["c"]}, catalogue=KNOWN)
    return json_of(found), said


@pytest.mark.slow
def test_two_diagnoses_at_once_are_those_of_one_after_the_other():
    names = ("again", "once more")
    alone = [diagnosed(name) for name in names]
    with ThreadPoolExecutor(2) as pool:
        assert [*pool.map(diagnosed, names)] == alone
    for name, (_, said) in zip(names, alone, strict=True):
        assert [line.split(" is left out")[0] for line in said] == [name]


def test_what_a_job_says_is_heard_by_it_alone():
    both = Barrier(2, timeout=10.0)

    def job(line: str) -> list[str]:
        with heard() as said:
            both.wait()
            tell(line)
            both.wait()
        return said

    with ThreadPoolExecutor(2) as pool:
        assert [*pool.map(job, ("one", "two"))] == [["one"], ["two"]]


def cores_of_a_worker(_: int) -> int:
    return cores()


@pytest.mark.slow
def test_a_worker_of_a_pool_spreads_nothing_as_the_pool_has_the_cores():
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        assert [*pool.map(cores_of_a_worker, [1])] == [1]
