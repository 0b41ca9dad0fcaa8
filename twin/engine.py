"""The engine: tasks on the processes of this computer, or on the workers of a Dask cluster.

Both are executors of the standard library, and the code above sees nothing else. No more tasks are
handed over than keep all workers busy, so that neither the driver's memory nor the scheduler's
grows with their number.
"""

from __future__ import annotations

import importlib
import logging
import math
import multiprocessing
import os
import signal
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import (
    FIRST_COMPLETED,
    BrokenExecutor,
    CancelledError,
    Executor,
    Future,
    ProcessPoolExecutor,
    wait,
)
from contextlib import contextmanager
from functools import partial
from itertools import islice
from threading import Thread
from types import ModuleType
from typing import TypeVar

from twin.errors import InputError
from twin.installed import pip_install
from twin.parallel import Done, cores
from twin.threads import VARIABLES

T = TypeVar("T")
R = TypeVar("R")
SHARES = 4  # tasks a worker that work is cut into: at its end one alone has a quarter at most
AHEAD = 4  # tasks a worker has waiting, so that none stands still while an answer travels
TIMEOUT = 10.0  # s for a scheduler to answer
RETRIES = 3  # of a task whose worker was lost


def needed(module: str) -> ModuleType:
    """Import a package of the extra ``fleet``; raises InputError that says how to get it."""
    try:
        return importlib.import_module(module)
    except ImportError as error:
        raise InputError(
            f"this needs the package {module.partition('.')[0]}; "
            f"install it with: {pip_install('fleet')}"
        ) from error


def outcomes(
    executor: Executor, workers: int, job: Callable[[T], R], tasks: Iterable[T]
) -> Iterator[R]:
    """What a job gives of each task, as they end, in any order.

    Raises what a job raises, and InputError where the workers are lost; what is done then is kept
    by whoever did it.
    """
    coming, running = iter(tasks), set[Future[R]]()
    try:
        while True:
            room = AHEAD * workers - len(running)
            running |= {executor.submit(job, task) for task in islice(coming, room)}
            if not running:
                return
            ended, running = wait(running, return_when=FIRST_COMPLETED)
            for one in ended:
                yield one.result()
    except BrokenExecutor as error:
        raise InputError(
            "a worker was lost, by a lack of memory or from outside; what a store holds is kept: "
            "give the same command again"
        ) from error
    finally:
        for waiting in running:
            waiting.cancel()


def in_order(
    executor: Executor,
    workers: int,
    job: Callable[[T], R],
    items: Iterable[T],
    done: Done | None = None,
) -> list[R]:
    """What a job gives of each item, in their order: `twin.parallel.spread` over workers.

    Several items go as one task, for what the job carries is sent with each task. done: told as
    ``spread`` tells it, by this process, as tasks end.
    """
    given = list(items)
    size = math.ceil(len(given) / (workers * SHARES)) or 1
    tasks = [(k, given[k : k + size]) for k in range(0, len(given), size)]
    made: dict[int, list[R]] = {}
    tell = done or (lambda *_: None)
    tell(0, len(given))
    for first, results in outcomes(executor, workers, partial(_share, job), tasks):
        made[first] = results
        tell(sum(map(len, made.values())), len(given))
    return [one for first, _ in tasks for one in made[first]]


def _share(job: Callable[[T], R], task: tuple[int, list[T]]) -> tuple[int, list[R]]:
    first, items = task
    return first, [job(item) for item in items]


@contextmanager
def local(workers: int | None = None) -> Iterator[tuple[Executor, int]]:
    """Processes of this computer, one thread each; one a core where None."""
    count = workers or cores()
    # Neither threads nor locks of this process go into a worker, as a fork would take them.
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(count, context, initializer=_worker) as pool:
        yield pool, count


@contextmanager
def cluster(address: str) -> Iterator[tuple[Executor, int]]:
    """The workers of a Dask scheduler. Raises InputError where none answers or it is lost."""
    distributed = needed("distributed")
    logging.getLogger("distributed").setLevel(logging.CRITICAL)  # what it says is told below
    try:
        client = distributed.Client(address, timeout=TIMEOUT, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            f"scheduler {address}: none answers there; start one with `dask scheduler`, and "
            "workers of one thread with `dask worker`"
        ) from error
    try:
        count = sum(client.nthreads().values())
        if not count:
            raise InputError(
                f"scheduler {address}: has no workers; start some of one thread with "
                f"`dask worker {address}`"
            )
        yield client.get_executor(retries=RETRIES), count
    except distributed.KilledWorker as error:
        raise InputError(
            f"scheduler {address}: a task has ended several workers, by a lack of memory or from "
            "outside; what a store holds is kept: give the workers more memory"
        ) from error
    except (OSError, TimeoutError, CancelledError) as error:
        raise InputError(
            f"scheduler {address}: was lost; what a store holds is kept: start it and give "
            "the same command again"
        ) from error
    finally:
        client.close(timeout=1.0)


@contextmanager
def engine(
    scheduler: str | None = None, workers: int | None = None
) -> Iterator[tuple[Executor, int]]:
    """The cluster of a scheduler, or this computer; with how many workers it has."""
    with cluster(scheduler) if scheduler else local(workers) as made:
        yield made


def _worker() -> None:
    """A process that works for this one: on one thread, and never for longer than this one lives.

    Ctrl-C goes to all processes of a terminal, but only the driver answers it.
    """
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    for name in VARIABLES:  # as `twin` sets them for itself
        os.environ.setdefault(name, "1")
    Thread(target=_end_with_parent, name="parent", daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
