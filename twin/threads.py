"""What threads share because the whole process has only one of it."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from functools import wraps
from threading import Lock
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def entered_once(
    context: Callable[[], AbstractContextManager[object]],
) -> Callable[[], AbstractContextManager[None]]:
    """The context, entered by the first of all that are within at once, and left by the last.

    Each restoring what it found would leave the process with what another had set meanwhile.
    """
    lock, entered, within = Lock(), ExitStack(), 0

    @contextmanager
    def counted() -> Iterator[None]:
        nonlocal within
        with lock:
            if within == 0:
                entered.enter_context(context())
            within += 1
        try:
            yield
        finally:
            with lock:
                within -= 1
                if within == 0:
                    entered.close()

    return counted


def one_for_matrices(job: Callable[P, R]) -> Callable[P, R]:
    """The job with one BLAS thread while it runs, unless the environment says how many.

    The matrices of a fit are too small to share out, and BLAS threads that wait for work cost CPU
    time, and take it from the candidates that go side by side.
    """

    @wraps(job)
    def limited(*arguments: P.args, **options: P.kwargs) -> R:
        if any(name in os.environ for name in VARIABLES):
            return job(*arguments, **options)
        with _one_blas_thread():
            return job(*arguments, **options)

    return limited


@entered_once
@contextmanager
def _one_blas_thread() -> Iterator[None]:
    from threadpoolctl import ThreadpoolController

    libraries = ThreadpoolController().select(user_api="blas").lib_controllers
    before = [(library, library.num_threads) for library in libraries]
    for library in libraries:
        _set_threads(library, 1)
    try:
        yield
    finally:
        for library, count in before:
            _set_threads(library, count)


def _set_threads(library: Any, count: int) -> None:
    """threadpoolctl 3.8 heeds, without a word, only the first thread that set a count.

    Until that lets go: it does so here before and after, as the last call may end in another.
    """
    let_go = getattr(library, "clear_controlling_thread", lambda force: None)
    let_go(force=True)
    library.set_num_threads(count)
    let_go(force=True)
