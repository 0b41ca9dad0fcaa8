"""Tables of measurements for the tests of the importers, and maps that fit them."""

from pathlib import Path

import numpy as np

from twin.importers import ImportMap, load_mapping

RATE = 2000.0
COUNT = 300

MAP = """
sample_rate = 2000.0
[axes.x]
force_constant = 53.4
position = {column = "q", unit = "mm", offset = 2.0, sign = -1}
current = {column = "i", unit = "mA"}
"""


def table() -> dict[str, np.ndarray]:
    """Columns t (s), q (mm), i (mA, whole numbers) and one that no map names."""
    t = np.arange(COUNT) / RATE
    return {
        "t": t,
        "q": 1e3 * np.sin(7.0 * t),
        "i": np.arange(COUNT) % 17 - 8,
        "unused": np.full(COUNT, np.nan),
    }


def mapping(folder: Path, text: str = MAP) -> ImportMap:
    """The map of that text."""
    path = folder / "map.toml"
    path.write_text(text, encoding="utf-8")
    return load_mapping(path)


def write_csv(path: Path, columns: dict[str, np.ndarray], delimiter: str = ",") -> None:
    """Names in the first line, every digit of the numbers."""
    rows = zip(*columns.values(), strict=True)
    lines = [delimiter.join(columns), *(delimiter.join(repr(float(v)) for v in r) for r in rows)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
