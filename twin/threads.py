"""What threads share because the whole process has only one of it."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from functools import wraps
from threading import Lock
from typing import TYPE_CHECKING, ParamSpec, TypeVar

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

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

    blas = ThreadpoolController().select(user_api="blas")
    limit = _from_any_thread(blas, lambda: blas.limit(limits=1))
    try:
        yield
    finally:
        _from_any_thread(blas, limit.restore_original_limits)


def _from_any_thread(blas: ThreadpoolController, change: Callable[[], R]) -> R:
    """Change a limit; threadpoolctl 3.8 ignores, without a word, all threads but one.

    That is the first that set a limit, until it lets go. The last call may end in another.
    """

    def let_go() -> None:
        for library in blas.lib_controllers:
            if hasattr(library, "clear_controlling_thread"):
                library.clear_controlling_thread(force=True)

    let_go()
    changed = change()
    let_go()
    return changed
