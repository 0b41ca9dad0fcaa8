"""Numbers that a user gives."""

from __future__ import annotations

import math
import sys
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.errors import InputError


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
