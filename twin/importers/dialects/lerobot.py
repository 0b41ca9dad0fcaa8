"""LeRobot's datasets: Parquet with episodes; what its entries are called lies in meta/info.json.

Source: huggingface/lerobot, LeRobotDataset v2 and v3: "timestamp" (s, from the beginning of an
episode), "frame_index", "episode_index", and lists such as "observation.state" and "action". The
rate is ``fps`` of info.json, the names of a list ``features``. Of a file with several episodes a
column is called ``episode_3.observation.state.elbow``.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.importers.dialects import Dialect, parquet
from twin.importers.mapping import ImportMap
from twin.importers.table import SignalTable, chosen, extra, parsing

_EPISODE, _FRAME, _TIME = "episode_index", "frame_index", "timestamp"
_INDICES = (_EPISODE, _FRAME, "index", "task_index")


def is_its(path: Path) -> bool:
    """Whether it has the indices of a dataset."""
    with parsing("Parquet"), extra("pyarrow.parquet").ParquetFile(path) as file:
        return {_EPISODE, _FRAME, _TIME} <= set(file.schema_arrow.names)


def read(path: Path, mapping: ImportMap) -> SignalTable:
    """Columns of a file of a dataset; raises InputError."""
    info = _info(path)
    with parsing("a dataset of LeRobot"), extra("pyarrow.parquet").ParquetFile(path) as file:
        columns = parquet.read_columns(path, file, ())
        notes = parquet.notes_of(file)
    episodes = columns[_EPISODE]
    named = _named({n: c for n, c in columns.items() if n not in _INDICES}, info)
    numbers = np.unique(episodes)
    said: tuple[str, ...] = ()
    if len(numbers) > 1:
        lengths = {int(n): int((episodes == n).sum()) for n in numbers}
        longest = max(lengths, key=lambda n: lengths[n])
        kept = numbers if mapping.axes else [longest]
        named = {f"episode_{n}.{name}": c[episodes == n] for n in kept for name, c in named.items()}
        said = (
            f"has {len(numbers)} episodes, {numbers[0]} to {numbers[-1]}: a column is called "
            f"episode_{longest}.... of the longest, and so on",
        )
    rate = float(info["fps"]) if isinstance(info.get("fps"), int | float) else None
    names = chosen(mapping.column_names(), named)
    return SignalTable({n: named[n] for n in names}, rate, said=said, notes=notes)


def _info(path: Path) -> Mapping[str, Any]:
    """What the dataset says of itself; nothing where the file lies alone."""
    for folder in path.resolve().parents[:4]:
        with suppress(OSError, ValueError):
            found = json.loads((folder / "meta" / "info.json").read_text(encoding="utf-8"))
            if isinstance(found, dict):
                return found
    return {}


def _named(columns: Mapping[str, NDArray], info: Mapping[str, Any]) -> dict[str, NDArray]:
    """The columns with the names of their entries in place of the numbers."""
    features = info.get("features")
    out: dict[str, NDArray] = {}
    for name, column in columns.items():
        base, _, number = name.removesuffix("]").rpartition("[")
        names = _names(features.get(base)) if isinstance(features, dict) and base else ()
        k = int(number) - 1 if number.isdigit() and base else -1
        out[f"{base}.{names[k]}" if 0 <= k < len(names) else name] = column
    return out


def _names(feature: Any) -> Sequence[str]:
    """What the entries of a feature are called; as a list, or as one under any key."""
    names = feature.get("names") if isinstance(feature, dict) else None
    if isinstance(names, dict):
        names = next(iter(names.values()), None)
    if isinstance(names, list) and all(isinstance(name, str) for name in names):
        return names
    return ()


DIALECT = Dialect("datasets of LeRobot", (".parquet", ".pq"), read, is_its)
