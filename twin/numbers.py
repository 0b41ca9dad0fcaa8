"""Numbers that a user gives."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.errors import InputError

SINGULAR = 1e-9  # of rows of size 1: what ratios of nine digits leave where they depend on others


def is_number(value: Any) -> bool:
    """Whether it is a finite number; True is none, nor is an integer beyond every double."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        return False
    size: Any = abs(value)
    return bool(size <= sys.float_info.max)


def first_not_finite(values: NDArray[Any]) -> int | None:
    """Index of the first of these values (n,) that is not a finite number; None where all are."""
    finite = np.isfinite(values)
    return None if finite.all() else int(np.argmin(finite))


def independent(rows: NDArray[np.float64]) -> bool:
    """Whether none of these rows (k, n) is a sum of the others, each with a factor."""
    size = np.abs(rows).max(axis=1, keepdims=True)
    scaled = rows / np.where(size > 0.0, size, 1.0)
    return int(np.linalg.matrix_rank(scaled, tol=SINGULAR)) == len(rows)


def require_seed(seed: int) -> None:
    """Raise InputError for a seed from which nothing can be drawn."""
    if seed < 0:
        raise InputError(f"seed {seed}: is not allowed; give a whole number of 0 or more")


def neat(value: float) -> float:
    """The value cut to three digits, so that a file reads well and no limit is passed."""
    if value == 0.0:
        return 0.0
    digits = 2 - math.floor(math.log10(value))
    return float(f"{math.floor(value * 10.0**digits * (1.0 + 1e-12)) / 10.0**digits:.3g}")


def require_number(
    name: str, value: float, unit: str, *, zero: bool = False, most: float = math.inf
) -> None:
    """Raise InputError for what is no number above 0 (``zero``: or 0), and no larger than most."""
    fine = is_number(value) or value == math.inf
    if fine and (value > 0.0 or (zero and value == 0.0)) and value <= most:
        return
    least = "a number from 0" if zero else "a number above 0"
    limit = "" if most == math.inf else f", at most {most:g}"
    raise InputError(f"{name} = {value!s:.60} {unit}: give {least}{limit}")
