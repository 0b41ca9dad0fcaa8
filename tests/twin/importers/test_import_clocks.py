"""Uneven time stamps and several files onto one clock, JSON, and when a recording began."""

import json
from pathlib import Path

import numpy as np
import pytest
from import_cases import MAP as PLAIN
from import_cases import guess_map, map_of, mapping, write_csv

from twin.errors import InputError
from twin.importers import import_log, import_notes
from twin.logs import Log

MAP = "resample = 1000.0\n" + map_of("q", "f", clock="t in s")


def imported(folder: Path, columns: dict[str, np.ndarray], text: str = MAP) -> Log:
    (folder / "a.json").write_text(json.dumps({n: list(map(float, c)) for n, c in columns.items()}))
    return import_log(folder / "a.json", mapping(folder, text))


def recording(jitter: float, start: float = 0.0) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(1)
    t = np.arange(3000) * 1e-3 + jitter * 1e-3 * rng.uniform(-0.5, 0.5, 3000)
    return {"t": start + t, "q": 30.0 * np.sin(9.0 * t), "f": 5.0 * np.cos(9.0 * t)}


def test_jittered_stamps_come_onto_one_clock_and_the_log_says_what_that_cost(tmp_path):
    columns = recording(jitter=0.8)
    columns = {n: np.insert(c, 1000, c[999]) for n, c in columns.items()}  # one row twice
    log = imported(tmp_path, columns)
    t = columns["t"][0] + np.arange(len(log)) / 1000.0
    error = log.axes["x"].position - 0.03 * np.sin(9.0 * t)
    assert np.abs(error).max() < 2e-6
    said = log.metadata["resampled"]
    assert "1 row with a time that does not increase left out" in said
    cost = float(said.partition("x.position ")[2].split()[0])
    rms = float(np.sqrt(np.mean(error**2)))
    assert rms < cost < 10.0 * rms


def test_even_steps_are_told_by_one_number(tmp_path):
    columns = {n: np.insert(c, 1000, c[999]) for n, c in recording(jitter=0.0).items()}
    assert imported(tmp_path, columns).metadata["resampled"].startswith("steps of 1 ms were ")


@pytest.mark.parametrize(
    ("change", "text", "message"),
    [
        (lambda c: c, MAP.replace("resample = 1000.0", ""), r"give resample = \d+"),
        (lambda c: c, MAP.replace("= 1000.0", "= 9000.0"), r"rows come at about \d+"),
        (lambda c: c, MAP.replace('time = {column = "t", unit = "s"}', ""), "needs the times"),
        (
            lambda c: np.where(np.arange(len(c)) > 1500, c + 1.0, c),
            MAP,
            r"nothing between 1\.\d+ s and",
        ),
        (  # and no clock is offered where it would be refused
            lambda c: np.where(np.arange(len(c)) > 1500, c + 1.0, c),
            MAP.replace("resample = 1000.0", ""),
            r"nothing between 1\.\d+ s and",
        ),
        (lambda c: np.zeros(len(c)), MAP, "increases in 1 of 3000 rows only"),
        (lambda c: c * np.nan, MAP, "row 1 is nan|cannot be read"),
    ],
)
def test_times_that_cannot_be_brought_onto_a_clock(tmp_path, change, text, message) -> None:
    columns = recording(jitter=0.8)
    columns["t"] = change(columns["t"])
    with pytest.raises(InputError, match=message):
        imported(tmp_path, columns, text)


def test_even_stamps_cost_nothing_and_times_since_1970_stay_with_the_log(tmp_path: Path) -> None:
    columns = recording(jitter=0.0)
    log = imported(tmp_path, columns)
    np.testing.assert_allclose(log.axes["x"].position, columns["q"] * 1e-3, atol=1e-12)
    assert "start_time_unix_ns" not in log.metadata
    later = imported(tmp_path, recording(jitter=0.0, start=1.7e9))
    assert later.metadata["start_time_unix_ns"] == "1700000000000000000"


@pytest.mark.parametrize(
    "shape",
    [
        lambda c: {"keys": list(c), "data": np.column_stack(list(c.values())).tolist()},
        lambda c: [
            dict(zip(c, row, strict=True)) for row in zip(*map(list, c.values()), strict=True)
        ],
        lambda c: {"run": {n: list(v) for n, v in c.items()}},
    ],
)
def test_every_shape_of_json(tmp_path: Path, shape) -> None:
    columns = recording(jitter=0.0)
    (tmp_path / "a.json").write_text(json.dumps(shape(columns)))
    text = MAP
    if "run" in shape({"t": []}):
        text = MAP.replace('"t"', '"run.t"').replace('"q"', '"run.q"').replace('"f"', '"run.f"')
    log = import_log(tmp_path / "a.json", mapping(tmp_path, text))
    np.testing.assert_allclose(log.axes["x"].force, columns["f"], atol=1e-9)


RUNS = [recording(jitter=0.0, start=float(k)) for k in range(4)]
ROWS = [np.column_stack([k * c for c in run.values()]).tolist() for k, run in enumerate(RUNS, 1)]


@pytest.mark.parametrize(
    ("content", "names"),
    [
        ({f"run{k}": rows for k, rows in enumerate(ROWS)}, "run0, run1, run2, run3"),
        ([{"name": f"step {k} V", "rows": rows} for k, rows in enumerate(ROWS)], "data.step 0 V"),
        ({"tests": [{"rows": rows} for rows in ROWS]}, r"tests\[1\], tests\[2\]"),
        ({"columns": ["t", "q", "f"], "tests": {f"r{k}": rows for k, rows in enumerate(ROWS)}},
         "tests.r0, tests.r1"),
        ({f"r{k}": [dict(zip("tqf", row, strict=True)) for row in rows]
          for k, rows in enumerate(ROWS)}, "r0, r1, r2, r3"),
        ({f"r{k}": {n: (k + c).tolist() for n, c in run.items()} for k, run in enumerate(RUNS)},
         "r0, r1, r2, r3"),
    ],
)  # fmt: skip
def test_several_recordings_in_one_file_are_named(tmp_path: Path, content, names) -> None:
    (tmp_path / "a.json").write_text(json.dumps(content))
    with pytest.raises(InputError, match=f"holds 4 recordings: {names}") as refused:
        guess_map(tmp_path / "a.json")
    assert "\n" not in str(refused.value)
    column = str(refused.value).rpartition("such as '")[2].rstrip("'")
    text = map_of(column, column)
    assert len(import_log(tmp_path / "a.json", mapping(tmp_path, text))) == 3000


def test_tables_of_axes_with_one_time_are_one_recording(tmp_path: Path) -> None:
    axes = {a: {n: list(map(float, c)) for n, c in recording(0.0).items()} for a in ("x", "y")}
    for k in range(3000):
        axes["y"]["q"][k] *= 2.0
        axes["y"]["f"][k] *= 3.0
    (tmp_path / "a.json").write_text(json.dumps(axes))
    assert "time = " in guess_map(tmp_path / "a.json").text


@pytest.mark.parametrize(
    "text", ["", "[", "3", "[1, [2]]", '{"t": ["a", 1]}', "[" * 5000, '{"t": [1e999]}']
)
def test_a_damaged_json_file_is_one_line(tmp_path: Path, text: str) -> None:
    (tmp_path / "a.json").write_text(text)
    with pytest.raises(InputError) as refused:
        import_log(tmp_path / "a.json", mapping(tmp_path, MAP))
    assert "\n" not in str(refused.value)


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
    write_csv(folder / "a.csv", {"t": times, "q": np.sin(times)})
    write_csv(folder / "b.csv", {"t": late, "q": np.cos(late)})
    return [folder / "a.csv", folder / "b.csv"]


def test_two_files_on_one_clock(tmp_path):
    paths = write_two(tmp_path)
    log = import_log(paths, mapping(tmp_path, TWO))
    (tmp_path / "two.toml").write_text(TWO)
    assert import_log(paths, tmp_path / "two.toml").metadata == log.metadata
    t = 1.5 + np.arange(len(log)) / 1000.0
    assert len(log) == pytest.approx(1500, abs=2)
    np.testing.assert_allclose(log.axes["x"].position, 1e-3 * np.sin(t), atol=2e-10)
    np.testing.assert_allclose(log.axes["x"].force, np.cos(t), atol=1e-9)
    assert log.metadata["original_sha256"].count(",") == 1
    assert "x.position" in log.metadata["resampled_1"]
    assert "x.force" in log.metadata["resampled_2"]


def test_what_was_done_to_each_of_two_files_is_said_of_it(tmp_path):
    paths = write_two(tmp_path)
    for path in paths:
        head, first, second, *rows = path.read_text().splitlines()
        path.write_text("\n".join([head, second, first, *rows]))
    late = TWO.replace("sample_rate = 2000.0\noffset = 1.5", 'time = {column = "t", unit = "s"}')
    notes = import_notes(import_log(paths, mapping(tmp_path, late)))
    again = [note for note in notes if "put in order" in note]
    assert [note.partition(":")[0] for note in again] == ["a.csv", "b.csv"]
    assert {note.partition(": ")[2] for note in again} == {
        "rows out of order in 1 places, the first row 2; put in order"
    }


def test_files_of_one_rate_need_no_clock(tmp_path):
    rng = np.random.default_rng(2)
    columns = rng.standard_normal((2, 50))
    for name, column in zip("ab", columns, strict=True):
        write_csv(tmp_path / f"{name}.csv", {"q": column})
    rates = 2 * "[[files]]\nsample_rate = 500.0\n"
    both = mapping(tmp_path, rates + TWO[TWO.index("[axes.x]") :])
    log = import_log([tmp_path / "a.csv", tmp_path / "b.csv"], both)
    assert log.sample_rate == 500.0
    assert not any(name.startswith("resampled") for name in log.metadata)
    np.testing.assert_allclose(log.axes["x"].position, 1e-3 * columns[0], rtol=1e-12)
    np.testing.assert_allclose(log.axes["x"].force, columns[1], rtol=1e-12)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("offset = 1.5", "offset = 15.0"), "no time in common .*a.csv .* s; .*b.csv .* to 16.49"),
        (("resample = 1000.0", ""), "several clocks; give resample"),
        (("file = 2", "file = 1"), "no signal with file = 2"),
        (("file = 2", "file = 3"), r"file = 3: the map has 2 \[\[files\]\]"),
        (("sample_rate = 2000.0", ""), "files 2: give either time or sample_rate"),
        (("resample = 1000.0", "resample = 1000.0\nsample_rate = 5.0"), "give them under"),
        (("[[files]]\nsample_rate = 2000.0\noffset = 1.5", ""), r"files = .*: give tables "),
    ],
)
def test_what_is_wrong_with_several_files_is_said(tmp_path, change, message):
    paths = write_two(tmp_path)
    with pytest.raises(InputError, match=message):
        import_log(paths, mapping(tmp_path, TWO.replace(*change)))


def test_each_file_has_its_own_format_and_rows_or_those_of_the_map(tmp_path):
    columns = {"q": np.arange(9.0)}
    write_csv(tmp_path / "a.one", columns)
    (tmp_path / "b.two").write_text(json.dumps({n: c.tolist() for n, c in columns.items()}))
    files = "[[files]]\nsample_rate = 500.0\nrows = [3, 8]\n"
    files += '[[files]]\nsample_rate = 500.0\nformat = "json"\noffset = 4e-3\n'
    text = 'format = "csv"\n' + files + TWO[TWO.index("[axes.x]") :]
    log = import_log([tmp_path / "a.one", tmp_path / "b.two"], mapping(tmp_path, text))
    assert log.sample_rate == 500.0
    np.testing.assert_allclose(log.axes["x"].position, 1e-3 * np.arange(4.0, 8.0))
    np.testing.assert_allclose(log.axes["x"].force, np.arange(4.0))


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
        import_log(paths, mapping(tmp_path, PLAIN))


def test_a_scale_is_the_scalar_of_its_own_file(tmp_path):
    """Both files call theirs k: 2 and 5."""
    for name, k in (("a", 2.0), ("b", 5.0)):
        (tmp_path / f"{name}.json").write_text(json.dumps({"q": list(range(9)), "k": [k]}))
    rates = 2 * "[[files]]\nsample_rate = 500.0\n"
    text = TWO[TWO.index("[axes.x]") :].replace('column = "q"', 'column = "q", scale = "k"')
    log = import_log([tmp_path / "a.json", tmp_path / "b.json"], mapping(tmp_path, rates + text))
    np.testing.assert_allclose(log.axes["x"].position, 2e-3 * np.arange(9.0))
    np.testing.assert_allclose(log.axes["x"].force, 5.0 * np.arange(9.0))
