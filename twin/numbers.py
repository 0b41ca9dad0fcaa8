"""Numbers that a user gives."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

from twin.errors import InputError


def is_number(value: Any) -> bool:
    """Whether it is a finite number; True is none, nor is an integer beyond every double."""
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        return False
    size: Any = abs(value)
    return bool(size <= sys.float_info.max)


def require_seed(seed: int) -> None:
    """Raise InputError for a seed from which nothing can be drawn."""
    if seed < 0:
        raise InputError(f"seed {seed}: is not allowed; give a whole number of 0 or more")
