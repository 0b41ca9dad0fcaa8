"""One thread for matrices: those of a fit are too small to share out.

BLAS threads that wait for work cost CPU time, and take it from the candidates that go side by side.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from functools import wraps
from typing import ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")

VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")


def one_for_matrices(job: Callable[P, R]) -> Callable[P, R]:
    """The job with one BLAS thread while it runs, unless the environment says how many."""

    @wraps(job)
    def limited(*arguments: P.args, **options: P.kwargs) -> R:
        if any(name in os.environ for name in VARIABLES):
            return job(*arguments, **options)
        from threadpoolctl import threadpool_limits

        with threadpool_limits(1, user_api="blas"):
            return job(*arguments, **options)

    return limited
