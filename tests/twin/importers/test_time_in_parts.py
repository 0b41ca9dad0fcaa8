"""Times in two columns, counted since long ago, or those of several recorders in one table."""

from __future__ import annotations

import numpy as np
import pytest

from twin.errors import InputError
from twin.importers import import_log, import_notes
from twin.importers.guess import propose

COUNT = 600
T = 4e-3 * np.arange(COUNT)
Q, F = 30.0 * np.sin(9.0 * T), 5.0 * np.cos(9.0 * T)
EPOCH = 1_780_000_000  # s since 1970


def of_ros(rest: str, a_second: int, columns: str = "q,f") -> str:
    """A table with whole seconds in a column and the rest of each in another."""
    head = f"header.stamp.sec,header.stamp.{rest},{columns}"
    at = [divmod(k * a_second // 250 + a_second // 3, a_second) for k in range(COUNT)]
    body = (f"{EPOCH + s},{r},{Q[k]:.9g},{F[k]:.9g}" for k, (s, r) in enumerate(at))
    return "\n".join([head, *body]) + "\n"


@pytest.mark.parametrize(("rest", "a_second"), [("nanosec", 10**9), ("usec", 10**6)])
def test_whole_seconds_and_the_rest_of_each_in_two_columns(tmp_path, rest, a_second):
    path = tmp_path / "a.csv"
    path.write_text(of_ros(rest, a_second))
    text = propose(path).map_text({})
    assert f'plus = {{column = "header.stamp.{rest}"' in text
    assert "resample" not in text
    clock = next(line for line in text.splitlines() if line.startswith("time"))
    (tmp_path / "map.toml").write_text(
        clock + '\n[axes.x]\nposition = {column = "q", unit = "mm"}\n'
        'force = {column = "f", unit = "N"}\n'
    )
    log = import_log(path, tmp_path / "map.toml")
    assert (log.sample_rate, len(log)) == (250.0, COUNT)
    assert abs(int(log.metadata["start_time_unix_ns"]) - (EPOCH * 10**9 + 10**9 // 3)) < 1000


def test_a_rest_that_is_no_number_is_refused(tmp_path):
    path = tmp_path / "a.parquet"
    table = {"s": [EPOCH] * 3, "ns": ["a", "b", "c"], "q": [1.0, 2.0, 3.0], "f": [1.0, 2.0, 1.0]}
    pytest.importorskip("pyarrow.parquet").write_table(
        pytest.importorskip("pyarrow").table(table), path
    )
    (tmp_path / "map.toml").write_text(
        'time = {column = "s", unit = "s", plus = {column = "ns", unit = "ns"}}\n[axes.x]\n'
        'position = {column = "q", unit = "mm"}\nforce = {column = "f", unit = "N"}\n'
    )
    with pytest.raises(InputError, match="column 'ns' does not hold one real number a row"):
        import_log(path, tmp_path / "map.toml")


def test_a_clock_in_seconds_and_the_same_in_milliseconds_are_no_parts(tmp_path):
    body = "\n".join(
        f"{t:.0f},{1e3 * t:.0f},{q:.6g},{f:.6g}" for t, q, f in zip(T, Q, F, strict=True)
    )
    path = tmp_path / "a.csv"
    path.write_text(f"time_s,time_ms,q,f\n{body}\n")
    assert "plus" not in propose(path).map_text({})


def test_ticks_since_the_year_1_are_no_nanoseconds(tmp_path):
    """As many ns since 1970 were in 1990, before there were such recorders."""
    first = 638_400_000_000_000_000
    stamps = [first + 10_000 * k for k in range(COUNT)]
    body = (f"{s},{q:.6g},{f:.6g}" for s, q, f in zip(stamps, Q, F, strict=True))
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["Ticks,q,f", *body]))
    assert "as many 100 ns since the year 1" in propose(path).map_text({})


def test_columns_with_rows_of_their_own_are_brought_onto_one_clock(tmp_path):
    """As PlotJuggler writes topics that came one after another."""
    lines = []
    for t, q in zip(T, Q, strict=True):
        late = t + 1.1e-3
        lines += [f"{t:.6f},{q:.9g},", f"{late:.6f},,{5.0 * np.cos(9.0 * late):.9g}"]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["__time,q [mm],f [N]", *lines]))
    text = propose(path).map_text({})
    assert "resample = 250 # Hz, because each column has rows of its own" in text
    (tmp_path / "map.toml").write_text(text)
    log = import_log(path, tmp_path / "map.toml")
    axis, (even,) = log.axes["x"], np.where(T[-1] > T)
    times = 1.1e-3 + T[even]  # from where both have begun
    np.testing.assert_allclose(axis.position, 1e-3 * np.interp(times, T, Q), atol=1e-7)
    np.testing.assert_allclose(axis.force, 5.0 * np.cos(9.0 * times), atol=1e-6)
    assert any("600 in all; bridged by a straight line" in note for note in import_notes(log))


def test_a_column_that_stops_for_long_is_not_bridged(tmp_path):
    lines = [
        f"{t:.6f},{q:.9g},{'' if 1.0 < t < 1.5 else f}" for t, q, f in zip(T, Q, F, strict=True)
    ]
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["t,q,f", *lines]))
    text = 'resample = 250\ntime = {column = "t", unit = "s"}\n[axes.x]\n'
    text += 'position = {column = "q", unit = "mm"}\nforce = {column = "f", unit = "N"}\n'
    (tmp_path / "map.toml").write_text(text)
    with pytest.raises(InputError, match="column 'f': there is nothing between 1 s and 1"):
        import_log(path, tmp_path / "map.toml")
