"""Work spread over threads, and how far it is, told by whoever does it to whoever shows it.

The compiled laws, FFTs and linear algebra release Python's lock.
"""

from __future__ import annotations

import itertools
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from threading import Lock
from typing import TYPE_CHECKING, Literal, Protocol, TypeVar

from twin.threads import one_for_matrices

if TYPE_CHECKING:  # a command that only tells of itself needs no pool
    from concurrent.futures import ThreadPoolExecutor

Progress = Callable[[str, int, int], None]  # what is being done, how much of it, of how much
AHEAD = "ahead: "  # begins what is told beside that, of nothing (0 of 0): who is ahead so far


def silent(what: str, done: int, total: int) -> None:
    """Progress that is not shown."""


def within(progress: Progress, where: str) -> Progress:
    """The progress of a part of some work; where: which part."""
    return lambda what, done, total: progress(f"{where}, {what}", done, total)


# --- work -----------------------------------------------------------------------------------------

T = TypeVar("T")
R = TypeVar("R")
Done = Callable[[int, int], None]


class Spread(Protocol):
    """The results of a job for each item, in their order: by ``spread``, or by an engine."""

    def __call__(
        self, job: Callable[[T], R], items: Iterable[T], done: Done | None = None, /
    ) -> list[R]: ...


_POOL: ContextVar[ThreadPoolExecutor | Literal["in a job"] | None] = ContextVar(
    "pool", default=None
)


def cores() -> int:
    """Cores that this process may use; one in a worker of a pool, which shares them out itself."""
    processes = sys.modules.get("multiprocessing")  # which a worker has loaded
    if processes is not None and processes.parent_process() is not None:
        return 1
    known = hasattr(os, "sched_getaffinity")
    return len(os.sched_getaffinity(0)) if known else os.cpu_count() or 1


@contextmanager
def parallel(count: int | None = None) -> Iterator[None]:
    """Let ``spread`` use that many threads, one a core where None; the outermost decides.

    Matrices get one thread meanwhile. One thread is this one: to hand each job to another that is
    waited for takes a tenth of a fit.
    """
    if _POOL.get() is not None:
        yield
        return
    from concurrent.futures import ThreadPoolExecutor

    threads = cores() if count is None else count
    with one_for_matrices(), ThreadPoolExecutor(threads) as pool:  # which starts none by itself
        token = _POOL.set(pool if threads > 1 else "in a job")
        try:
            yield
        finally:
            _POOL.reset(token)


def spread(job: Callable[[T], R], items: Iterable[T], done: Done | None = None) -> list[R]:
    """The results of a job for each item, in their order.

    Outside ``parallel`` it is a loop, and so is what a job spreads in its turn: the parts of parts
    are too short to share. Where jobs fail no other is begun, and the first of them in the order of
    the items is raised. done: told done(0, total) now, and (1, total), (2, total), ... as jobs end,
    one call at a time, from any thread.
    """
    given, pool = list(items), _POOL.get()
    lock, numbers = Lock(), itertools.count()

    def one_more() -> None:
        if done is not None:
            with lock:
                done(next(numbers), len(given))

    def run(item: T) -> R:
        result = job(item)
        one_more()
        return result

    one_more()
    alone = len(given) < 2  # a single job may spread its own parts
    if alone or pool is None or pool == "in a job":
        return [run(item) for item in given]
    from concurrent.futures import FIRST_EXCEPTION, wait

    inside = copy_context()  # NumPy keeps there which warnings to give
    inside.run(_POOL.set, "in a job")
    jobs = [pool.submit(inside.copy().run, run, item) for item in given]
    try:
        wait(jobs, return_when=FIRST_EXCEPTION)
    finally:
        for waiting in jobs:
            waiting.cancel()
    return [ended.result() for ended in jobs if not ended.cancelled()]
