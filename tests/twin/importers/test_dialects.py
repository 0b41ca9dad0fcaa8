"""Laws that every dialect obeys: its file is known, read back, refused in one line, and timed."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from dialect_files import COUNT, SAMPLES, STEP, F, Q
from import_cases import mapping

from twin.errors import InputError
from twin.importers.dialects import all_dialects, find_dialect
from twin.importers.importer import import_log, import_notes, table_of
from twin.importers.mapping import EVERY_COLUMN
from twin.importers.stated_time_base import find_time_base
from twin.importers.table import numbers

BAGS = ("mcap",)  # of which whole chunks are read


def written(folder: Path, name: str) -> Path:
    path = folder / SAMPLES[name].file
    SAMPLES[name].write(path)
    return path


def map_of(name: str, clock: str = "sample_rate = 250.0\n") -> str:
    """Its columns as volts, of which any quantity may be."""
    sample = SAMPLES[name]
    entry = '{{column = "{0}", unit = "V", scale = 1.0}}'
    return (
        f"{clock}[axes.x]\nposition = {entry.format(sample.position)}\n"
        f"force = {entry.format(sample.force)}\n"
    )


def test_every_dialect_has_a_sample_and_every_ending_one_that_takes_what_no_other_knows():
    assert SAMPLES.keys() == all_dialects().keys()
    general = Counter(e for d in all_dialects().values() if d.is_its is None for e in d.endings)
    endings = {e for d in all_dialects().values() for e in d.endings}
    assert general.keys() == endings
    assert set(general.values()) == {1}
    assert all(d.summary for d in all_dialects().values())


@pytest.mark.parametrize("name", SAMPLES)
def test_its_file_is_known_and_read_back(tmp_path, name):
    path = written(tmp_path, name)
    assert find_dialect(path, None) == name
    assert find_dialect(path.rename(path.with_suffix(".other")), name) == name
    path = written(tmp_path, name)
    log = import_log(path, mapping(tmp_path, map_of(name)))
    assert (log.sample_rate, len(log)) == (250.0, COUNT)
    np.testing.assert_allclose(log.axes["x"].position, Q, rtol=0, atol=1e-6)
    np.testing.assert_allclose(log.axes["x"].force, F, rtol=0, atol=1e-6)
    assert log.metadata["original_format"] == name


@pytest.mark.parametrize("name", SAMPLES)
def test_its_rate_is_read_or_asked_for_and_never_another(tmp_path, name):
    path = written(tmp_path, name)
    table = table_of(path, EVERY_COLUMN)
    columns = {n: numbers(n, c) for n, c in table.columns.items()
               if len(c) == COUNT and np.asarray(c).dtype.kind != "U"}  # fmt: skip
    clock = find_time_base(table, columns)
    if SAMPLES[name].asks:
        assert clock.missing
        assert not [line for line in clock.lines if not line.startswith("#")]
        return
    assert not clock.missing
    assert clock.step == pytest.approx(STEP, rel=1e-6)
    lines = "\n".join(line for line in clock.lines if not line.startswith("#"))
    log = import_log(path, mapping(tmp_path, map_of(name, f"{lines}\n")))
    assert log.sample_rate == pytest.approx(250.0, rel=1e-6)
    assert not [text for text in import_notes(log) if "states" in text]


@pytest.mark.parametrize("name", [n for n, sample in SAMPLES.items() if sample.is_text])
def test_fifty_bad_cells_are_named_in_one_line(tmp_path, name):
    path = written(tmp_path, name)
    lines = path.read_bytes().split(b"\n")
    at = range(200, 450, 5)
    for k in at:
        lines[k] = spoiled(lines[k])
    path.write_bytes(b"\n".join(lines))
    with pytest.raises(InputError) as refused:
        import_log(path, mapping(tmp_path, map_of(name)))
    said = str(refused.value)
    assert "\n" not in said
    assert all(f"line {k + 1}" in said for k in at), said


def spoiled(line: bytes) -> bytes:
    """A line without its numbers, but for the first, which is a time."""
    delimiter = next(d for d in (b"\t", b';"', b",", b" ") if d in line.rstrip())
    delimiter = b";" if delimiter == b';"' else delimiter
    first, *cells = line.rstrip(b"\r\n").split(delimiter)
    fraction = re.compile(rb"^(\w+:|)-?\d*[.,]\d+$")
    return delimiter.join([first, *(fraction.sub(rb"\1#REF!", c) for c in cells)])


@pytest.mark.parametrize("name", [n for n, sample in SAMPLES.items() if not sample.is_text])
def test_a_torn_file_is_one_line_or_read_as_far_as_it_is_proved(tmp_path, name):
    path = written(tmp_path, name)
    path.write_bytes(path.read_bytes()[: path.stat().st_size * 3 // 5])
    known = mapping(tmp_path, map_of(name))
    if name in BAGS:
        log = import_log(path, known)
        assert 0 < len(log) < COUNT
        assert "cut off" in import_notes(log)[0]
        return
    with pytest.raises(InputError, match=path.name) as refused:
        import_log(path, known)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("count", [100, 103])
def test_lines_within_labelled_values_that_are_none_are_named_up_to_a_hundred(tmp_path, count):
    path = written(tmp_path, "labelled")
    lines = path.read_text().splitlines()
    for k in range(count):
        lines[20 + 2 * k] = "overrun"
    path.write_text("\n".join(lines))
    with pytest.raises(InputError) as refused:
        import_log(path, mapping(tmp_path, map_of("labelled")))
    said = str(refused.value)
    assert f"{path}: line 21, line 23, line 25" in said
    more = " and 3 more" if count > 100 else ""
    assert f"line 219{more}: without a number behind each of t, pos, u; complete or cut" in said


def test_an_attribute_of_hdf5_that_is_one_number_tells_the_rate(tmp_path):
    h5py = pytest.importorskip("h5py")
    path = written(tmp_path, "hdf5")
    with h5py.File(path, "a") as file:
        file.attrs["sample_rate"] = 250.0
        file.attrs["rate"] = np.array([125.0, 500.0])
    log = import_log(path, mapping(tmp_path, map_of("hdf5", "")))
    assert log.sample_rate == 250.0


def test_a_pointer_of_git_lfs_is_called_one(tmp_path):
    for name in ("csv", "mcap", "mat"):
        path = tmp_path / SAMPLES[name].file
        path.write_text("version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 9\n")
        with pytest.raises(InputError, match="is a pointer of Git LFS"):
            import_log(path, mapping(tmp_path, map_of(name)))


def test_a_name_with_a_unit_is_no_entry_of_a_list(tmp_path):
    pyarrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    rows = list(np.stack([Q, F], axis=1))
    parquet.write_table(pyarrow.table({"q [mm]": Q, "state": rows}), tmp_path / "a.parquet")
    entry = '{{column = "{0}", unit = "V", scale = 1.0}}'
    text = (
        f"sample_rate = 250.0\n[axes.x]\nposition = {entry.format('q [mm]')}\n"
        f"force = {entry.format('state[2]')}\n"
    )
    axis = import_log(tmp_path / "a.parquet", mapping(tmp_path, text)).axes["x"]
    np.testing.assert_array_equal(axis.position, Q)
    np.testing.assert_array_equal(axis.force, F)
