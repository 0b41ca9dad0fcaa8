"""Several files of one recording, on one clock."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from import_cases import MAP, mapping

from twin.errors import InputError
from twin.importers import import_log

TWO = """
resample = 1000.0
[[files]]
time = {column = "t", unit = "s"}
[[files]]
sample_rate = 2000.0
offset = 1.5
[axes.x]
position = {column = "q", unit = "mm"}
force = {column = "q", unit = "N", file = 2}
"""


def write_two(folder: Path) -> list[Path]:
    """A position with uneven times; a force that is sampled twice as fast from 1.5 s on."""
    steps = 1e-3 * (1.0 + 0.2 * np.random.default_rng(1).uniform(-1.0, 1.0, 4000))
    times, late = np.cumsum(steps), 1.5 + np.arange(3000) / 2000.0
    for name, columns in (("a.csv", (times, np.sin(times))), ("b.csv", (late, np.cos(late)))):
        rows = [f"{float(t)!r},{float(q)!r}" for t, q in zip(*columns, strict=True)]
        (folder / name).write_text("\n".join(["t,q", *rows]) + "\n")
    return [folder / "a.csv", folder / "b.csv"]


def test_two_files_on_one_clock(tmp_path):
    paths = write_two(tmp_path)
    log = import_log(paths, mapping(tmp_path, TWO))
    t = 1.5 + np.arange(len(log)) / 1000.0
    assert len(log) == pytest.approx(1500, abs=2)
    np.testing.assert_allclose(log.axes["x"].position, 1e-3 * np.sin(t), atol=2e-10)
    np.testing.assert_allclose(log.axes["x"].force, np.cos(t), atol=1e-9)
    assert log.metadata["original_sha256"].count(",") == 1
    assert "x.position" in log.metadata["resampled_1"]
    assert "x.force" in log.metadata["resampled_2"]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("offset = 1.5", "offset = 15.0"), "no time in common .*a.csv .* s; .*b.csv .* to 16.49"),
        (("resample = 1000.0", ""), "several clocks; give resample"),
        (("file = 2", "file = 1"), "no signal with file = 2"),
        (("file = 2", "file = 3"), r"file = 3: the map has 2 \[\[files\]\]"),
        (("sample_rate = 2000.0", ""), "files 2: give either time or sample_rate"),
        (("resample = 1000.0", "resample = 1000.0\nsample_rate = 5.0"), "give them under"),
    ],
)
def test_what_is_wrong_with_several_files_is_said(tmp_path, change, message):
    paths = write_two(tmp_path)
    with pytest.raises(InputError, match=message):
        import_log(paths, mapping(tmp_path, TWO.replace(*change)))


@pytest.mark.parametrize("stated", ["", 'delimiter = ","\n'])
def test_a_file_may_be_one_column_alone(tmp_path, stated):
    paths = write_two(tmp_path)
    force = [line.partition(",")[2] for line in paths[1].read_text().splitlines()]
    for head in (["F"], []):
        paths[1].write_text("\n".join([*head, *force[1:]]))
        name = head[0] if head else "1"
        text = TWO.replace('force = {column = "q"', f'force = {{column = "{name}"')
        log = import_log(paths, mapping(tmp_path, stated + text))
        t = 1.5 + np.arange(len(log)) / 1000.0
        np.testing.assert_allclose(log.axes["x"].force, np.cos(t), atol=1e-9)


def test_as_many_files_as_tables(tmp_path):
    paths = write_two(tmp_path)
    with pytest.raises(InputError, match=r"1 files are given, the map has 2 \[\[files\]\]"):
        import_log(paths[:1], mapping(tmp_path, TWO))
    with pytest.raises(InputError, match=r"several need a table \[\[files\]\]"):
        import_log(paths, mapping(tmp_path, MAP))
