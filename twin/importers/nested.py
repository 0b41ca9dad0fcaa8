"""Columns in arrays, lists and tables within tables, as JSON and MATLAB have them."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.importers.table import split_columns

ROWS = "data"  # what the rows of a bare list are called


def flat(prefix: str, content: Mapping[str, Any]) -> dict[str, NDArray]:
    """The columns in arrays, lists and tables within tables, called ``prefix`` and a name."""
    columns: dict[str, NDArray] = {}
    names: list[str] = next((v for v in content.values() if _are_all(str, v)), [])
    for key, value in content.items():
        name = f"{prefix}{key}"
        if isinstance(value, Mapping):
            columns |= flat(f"{name}.", value)
        elif _are_all(dict, value):
            columns |= {k: np.array([row.get(k, np.nan) for row in value]) for k in value[0]}
        elif isinstance(value, list) and not _are_all(str, value):
            split = split_columns(name, _numeric(value))
            named = len(names) == len(split) > 1
            columns |= dict(zip(names, split.values(), strict=True)) if named else split
        elif isinstance(value, np.ndarray | np.generic | int | float | str):
            columns |= split_columns(name, np.asarray(value))
    return columns


def _are_all(kind: type, value: Any) -> bool:
    return isinstance(value, list) and bool(value) and all(isinstance(v, kind) for v in value)


def _numeric(value: list[Any]) -> NDArray:
    """Rows as an array; what is no number, or is ragged, stays as it is and is refused later."""
    try:
        return np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        return np.array([str(v) for v in value], dtype=object)
