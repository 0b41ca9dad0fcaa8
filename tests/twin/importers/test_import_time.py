"""The time base of a file: read in any locale, told where a clock jumps, else asked for."""

from __future__ import annotations

import json
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from import_cases import guess_map, map_of, mapping, write_csv

from twin.errors import InputError
from twin.importers import import_log, import_notes
from twin.importers.stated_rate import stated_rate
from twin.logs import Log

COUNT, STEP = 600, timedelta(milliseconds=4)
T = 4e-3 * np.arange(COUNT)
Q, F = 30.0 * np.sin(9.0 * T), 5.0 * np.cos(9.0 * T)
NOON = datetime(2026, 3, 28, 11, 59, 59)


def rows(stamp, start: datetime = NOON, head: str = "t,q,f") -> str:
    """A table whose rows begin as ``stamp`` writes their times."""
    body = (f"{stamp(start + k * STEP)},{Q[k]:.9g},{F[k]:.9g}" for k in range(COUNT))
    return "\n".join([head, *body]) + "\n"


def imported(folder: Path, text: str, clock: str = "t in s") -> Log:
    (folder / "a.csv").write_text(text, encoding="utf-8")
    return import_log(folder / "a.csv", mapping(folder, map_of("q", "f", clock=clock)))


def milli(time: datetime) -> str:
    return f"{time.microsecond // 1000:03d}"


def twelve(time: datetime, between: str = " ") -> str:
    return f"{time:%I:%M:%S}.{milli(time)}{between}{time:%p}"


STAMPS = {
    "german": lambda t: f"{t:%d.%m.%Y %H:%M:%S}.{milli(t)}",
    "american": lambda t: f"{t:%m/%d/%Y} {twelve(t)}",
    "british": lambda t: f"{t:%d/%m/%Y %H:%M:%S}.{milli(t)}",
    "with letters": lambda t: f"{t:%d-%b-%Y %H:%M:%S}.{milli(t)}",
    "iso": lambda t: t.isoformat(timespec="milliseconds"),
    "iso with a zone": lambda t: t.isoformat(timespec="milliseconds") + "Z",
    "colon before ms": lambda t: f"{t:%Y-%m-%d %H:%M:%S}:{milli(t)}",
    "small letters": lambda t: f"{t:%m/%d/%Y} {twelve(t, '').lower()}",
}


@pytest.mark.parametrize("way", STAMPS)
@pytest.mark.parametrize("start", [NOON, datetime(2026, 3, 31, 23, 59, 59)], ids=["noon", "month"])
def test_stamps_of_any_locale_over_noon_and_over_the_end_of_a_month(tmp_path, way, start):
    log = imported(tmp_path, rows(STAMPS[way], start))
    assert (log.sample_rate, len(log)) == (250.0, COUNT)
    np.testing.assert_allclose(log.axes["x"].position, 1e-3 * Q, atol=1e-9)
    began = np.datetime64(start, "ns").astype(np.int64)
    assert int(log.metadata["start_time_unix_ns"]) == began
    assert not import_notes(log)
    assert 'time = {column = "t", unit = "s"} # rises by 0.004 s' in proposed(tmp_path)


def proposed(folder: Path) -> str:
    return guess_map(folder / "a.csv").text


def test_a_zone_is_taken_off_and_a_date_that_may_be_two_is_no_date(tmp_path):
    log = imported(tmp_path, rows(lambda t: t.isoformat(timespec="milliseconds") + "+02:00"))
    began = np.datetime64(NOON - timedelta(hours=2), "ns").astype(np.int64)
    assert int(log.metadata["start_time_unix_ns"]) == began
    april = datetime(2026, 4, 3, 10)  # or the 4th of March
    log = imported(tmp_path, rows(STAMPS["british"], april))
    assert log.sample_rate == 250.0
    assert "start_time_unix_ns" not in log.metadata


@pytest.mark.parametrize("locale", ["german", "american"])
def test_date_and_time_in_two_columns(tmp_path, locale):
    start = datetime(2026, 3, 31, 23, 59, 59)
    day, time = ("%d.%m.%Y", lambda t: f"{t:%H:%M:%S}.{milli(t)}")
    if locale == "american":
        day, time = "%m/%d/%Y", twelve
    text = rows(lambda t: f"{t.strftime(day)},{time(t)}", start, "Datum,Zeit,q,f")
    log = imported(tmp_path, text, "Zeit in s")
    assert log.sample_rate == 250.0
    assert int(log.metadata["start_time_unix_ns"]) == np.datetime64(start, "ns").astype(np.int64)
    assert 'time = {column = "Zeit", unit = "s"}' in proposed(tmp_path)


@pytest.mark.parametrize(
    ("stamp", "start", "said"),
    [
        (lambda t: f"{t:%H:%M:%S}.{milli(t)}", datetime(2026, 3, 31, 23, 59, 59),
         "begins again after 24 h in row 251 .23:59:59.996000 is followed by 0:00:00"),
        (lambda t: f"{t:%I:%M:%S}.{milli(t)}", datetime(2026, 3, 31, 12, 59, 59),
         "begins again after 12 h"),
        (lambda t: STAMPS["german"](t + timedelta(hours=t >= datetime(2026, 3, 29, 2))),
         datetime(2026, 3, 29, 1, 59, 59),
         r"put by 3600 s in row 251 \(01:59:59.996000 is followed by 03:00:00\): summer time"),
        (lambda t: STAMPS["german"](t - timedelta(hours=t >= datetime(2026, 10, 25, 3))),
         datetime(2026, 10, 25, 2, 59, 59), "put by 3600 s in row 251"),
        (lambda t: f"{(2**32 - 10**6 + round((t - NOON) / timedelta(microseconds=1))) % 2**32}",
         NOON, "begins again in row 251 .4294963296 is followed by 0.: the roll-over .* 32 bits"),
        (lambda t: f"{(65_000 + round((t - NOON) / timedelta(milliseconds=1))) % 2**16}",
         NOON, "roll-over of a counter of 16 bits"),
    ],
)  # fmt: skip
def test_a_clock_that_jumps_goes_on_and_that_is_told(tmp_path, stamp, start, said):
    text = rows(stamp, start)
    unit = "us" if "32 bits" in said else "ms" if "16 bits" in said else "s"
    log = imported(tmp_path, text, f"t in {unit}")
    assert (log.sample_rate, len(log)) == (250.0, COUNT)
    (told,) = import_notes(log)
    with pytest.raises(AssertionError, match=said):
        raise AssertionError(told)
    if "bits" not in said:
        assert told in proposed(tmp_path)


def test_one_row_twice_is_left_out_and_told(tmp_path):
    lines = rows(STAMPS["german"]).splitlines()
    log = imported(tmp_path, "\n".join([*lines[:300], lines[299], *lines[300:]]))
    assert (log.sample_rate, len(log)) == (250.0, COUNT)
    assert import_notes(log) == ["row 300: what the row before says, once more; left out"]


def test_a_clock_coarser_than_the_samples_gives_the_rate_by_rows_a_stamp(tmp_path):
    text = rows(lambda t: f"{t:%d.%m.%Y %H:%M:%S}.{milli(t)[0]}")
    with pytest.raises(InputError, match="give sample_rate = 250 "):
        imported(tmp_path, text)
    assert "sample_rate = 250 # Hz: each time of t is that of" in proposed(tmp_path)


@pytest.mark.parametrize(
    "line",
    ["SAMPLE PERIOD,4,ms", "Sample Period: 0.004", "Abtastrate;0,25 kHz", "# fs = 250 Hz",
     "Abtastzeit [ms];4", "sampling frequency: 250"],
)  # fmt: skip
def test_a_rate_that_the_head_states_is_read(tmp_path, line):
    text = f"Recorder 7\n{line}\n\nq,f\n" + "\n".join(
        f"{q:.9g},{f:.9g}" for q, f in zip(Q, F, strict=True)
    )
    assert imported(tmp_path, text, "").sample_rate == pytest.approx(250.0)
    assert "sample_rate = 250 # Hz: the file states" in proposed(tmp_path)
    other = imported(tmp_path, text, "sample_rate = 500.0")
    assert "the file states 250 Hz" in import_notes(other)[0]


@pytest.mark.parametrize(
    "lines",
    [
        ("Sample rate: 8 kHz", "Decimation: 8"),
        ("Sampling factor;4", "Basic sampling time;0.25 ms"),
        ("Current loop cycle time: 62.5 us", "Sampling: every 16th cycle"),
        ("Zykluszeit 0,25 ms", "jeder 4. Takt"),
        ("Downsampling factor 2; fs = 2000",),
        ("Recording gap 10 ms", "fs=1000"),
        ("Samples: 8000", "Sample rate 1 kHz"),
    ],
)
def test_one_of_so_many_samples_is_kept(lines):
    """A cycle beside a factor is a product; a gap in ms is none."""
    stated = stated_rate(lines)
    assert stated is not None
    assert stated.rate == pytest.approx(1000.0)


def test_words_that_state_no_rate():
    for text in ("Baud rate: 115200", "Frequency: 50 Hz", "Feed rate 100 mm/s", "Messzeit;10;s",
                 "recording time: 12:30:00", "Record Length,2500"):  # fmt: skip
        assert stated_rate([text]) is None
    unknown = stated_rate(["SAMPLE PERIOD 2"])
    assert unknown is not None
    assert unknown.rate is None
    assert stated_rate(["Fs: 1,000"]).rate == 1000.0


def test_a_rate_among_the_values_of_a_file_is_read(tmp_path):
    (tmp_path / "a.json").write_text(json.dumps({"fs": 250.0, "q": Q.tolist(), "f": F.tolist()}))
    assert (
        "sample_rate = 250 # Hz: the file states 'fs = 250'" in guess_map(tmp_path / "a.json").text
    )


def test_a_counter_with_gaps_asks_for_its_step_and_no_number_is_in_the_map(tmp_path):
    number = np.delete(np.arange(COUNT + 2.0), [200, 201])
    write_csv(tmp_path / "a.csv", {"n": number, "pos_mm": Q, "force_N": F})
    found = guess_map(tmp_path / "a.csv")
    assert found.missing[0].startswith(
        "'n' counts the samples and lacks 2 of them, the first 200 to 201; give step"
    )
    assert not [line for line in found.text.splitlines() if line.startswith(("time", "sample"))]
    text = map_of("pos_mm", "force_N", clock="n in s").replace('unit = "s"', "step = 0.004", 1)
    log = import_log(tmp_path / "a.csv", mapping(tmp_path, "resample = 250.0\n" + text))
    assert len(log) == COUNT + 2
    with pytest.raises(InputError, match="give unit, such as"):
        mapping(tmp_path, text.replace("step", 'unit = "s", step'))


def test_a_counter_with_gaps_beside_a_rate_that_the_file_states_is_the_time(tmp_path):
    """Its rate alone had put the parts together, 8 ms too short, without a word."""
    number = np.delete(np.arange(COUNT + 2.0), [200, 201])
    write_csv(tmp_path / "b.csv", {"n": number, "pos_mm": Q, "force_N": F})
    (tmp_path / "a.csv").write_text("# rate: 250 Hz\n" + (tmp_path / "b.csv").read_text())
    found = guess_map(tmp_path / "a.csv")
    assert not found.missing
    line = found.text.splitlines()[1]
    assert line.startswith('time = {column = "n", step = 0.004} # s a count: ')
    assert "lacks 2 of them, the first 200 to 201; the file states '# rate: 250 Hz'" in line


def test_times_are_found_by_their_unit_alone_with_repeats(tmp_path):
    late = np.insert(T, 100, T[99])
    columns = {"pos_mm": Q, "force_N": F}
    columns = {n: np.insert(c, 100, c[99] + 1e-6) for n, c in columns.items()}
    for name in ("micros", "t_us", "us"):
        write_csv(tmp_path / "a.csv", {name: 1e6 * late, **columns})
        assert f'time = {{column = "{name}", unit = "us"}}' in proposed(tmp_path)


@pytest.mark.parametrize("rate", [400.0, 800.0, 3200.0])
def test_times_that_are_printed_with_few_digits_are_even(tmp_path, rate):
    printed = np.rint(1e3 * np.arange(COUNT) / rate)
    write_csv(tmp_path / "a.csv", {"ms": printed, "pos_mm": Q, "force_N": F})
    text = map_of("pos_mm", "force_N", clock="ms in ms")
    if rate < 1000.0:
        log = import_log(tmp_path / "a.csv", mapping(tmp_path, text))
        assert (log.sample_rate, len(log)) == (rate, COUNT)
    assert f"sample_rate = {rate:g} # Hz" in proposed(tmp_path)


def test_a_motion_that_rises_is_no_time(tmp_path):
    rising = 30.0 * np.sin(0.5 * T)
    rng = np.random.default_rng(2)
    write_csv(tmp_path / "a.csv", {"q": rising, "f": F})
    assert guess_map(tmp_path / "a.csv").missing[0].startswith("no column rises as times do")
    write_csv(tmp_path / "a.csv", {"n": np.arange(COUNT), "ramp": 1e-4 * T, "q": Q, "f": F})
    assert guess_map(tmp_path / "a.csv").missing[0].startswith("'n' counts the rows")
    uneven = np.cumsum(4.0 + rng.uniform(-0.4, 0.4, COUNT))
    write_csv(tmp_path / "a.csv", {"a": uneven, "q": rising, "f": F})
    assert 'time = {column = "a", unit = "ms"}' in proposed(tmp_path)


def test_stamps_as_text_in_other_formats(tmp_path):
    stamps = [STAMPS["iso"](NOON + k * STEP) for k in range(COUNT)]
    columns = {"t": stamps, "q": Q.tolist(), "f": F.tolist()}
    rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
    for content in (columns, rows):
        (tmp_path / "a.json").write_text(json.dumps(content))
        text = map_of("q", "f", clock="t in s")
        log = import_log(tmp_path / "a.json", mapping(tmp_path, text))
        assert log.sample_rate == 250.0
        assert "start_time_unix_ns" in log.metadata
        assert 'time = {column = "t", unit = "s"}' in guess_map(tmp_path / "a.json").text


def clocked(times: np.ndarray, rows_: np.ndarray) -> str:
    """A table whose rows stand in that order."""
    return "t,q,f\n" + "".join(f"{times[k]:.4f},{Q[k]:.9g},{F[k]:.9g}\n" for k in rows_)


def test_rows_out_of_order_are_put_in_order_and_said(tmp_path):
    order = np.arange(COUNT)
    order[100:102] = [101, 100]
    order[400:403] = [402, 400, 401]
    text = clocked(T, order)
    log = imported(tmp_path, text)
    np.testing.assert_allclose(log.axes["x"].position, 1e-3 * Q, atol=1e-11)
    assert import_notes(log) == ["rows out of order in 2 places, the first row 102; put in order"]
    assert "\nresample" not in guess_map(tmp_path / "a.csv").text


@pytest.mark.parametrize("resample", ["", "resample = 250.0\n"])
def test_every_place_where_the_clock_was_put_back_is_told(tmp_path, resample):
    text = clocked(np.concatenate([T[:250], T[:200], T[:150]]), np.arange(COUNT))
    with pytest.raises(InputError, match=r"falls back in row 251 .* row 451 \(0\.796 s .*: the"):
        imported(tmp_path, text, clock=f'{resample}time = {{column = "t", unit = "s"}}')


def waited() -> np.ndarray:
    """Times in ms of a program that waits for each sample, and for something else twice."""
    late = np.random.default_rng(7).geometric(0.8, COUNT) - 1
    late[[3, 40]] += (215, 280)
    return np.cumsum(10 + late)


def test_times_that_are_late_and_never_early_are_times_though_no_name_says_so(tmp_path):
    table = np.column_stack([waited(), Q, F])
    np.savetxt(tmp_path / "a.csv", table, delimiter="\t", fmt="%.9g")
    text = guess_map(tmp_path / "a.csv").text
    assert 'time = {column = "1", unit = "ms"}' in text
    assert "rows = [41, 600] # the longest of 3 parts; the others: [1, 3] and [4, 40]" in text
    assert "resample = 100 " in text


def test_a_recording_with_holes_is_imported_part_by_part(tmp_path):
    np.savetxt(tmp_path / "a.csv", np.column_stack([waited(), Q, F]), header="t,q,f",
               delimiter=",", comments="", fmt="%.9g")  # fmt: skip
    text = "resample = 100.0\n" + map_of("q", "f", clock="t in ms")
    with pytest.raises(InputError, match=r"rows = \[1, 3\] or rows = \[4, 40\] or rows = \[41,"):
        import_log(tmp_path / "a.csv", mapping(tmp_path, text))
    log = import_log(tmp_path / "a.csv", mapping(tmp_path, "rows = [41, 600]\n" + text))
    assert log.axes["x"].columns["position"][0] == pytest.approx(1e-3 * Q[40])
    with pytest.raises(InputError, match=r"there are 600 rows; correct the first and the last"):
        import_log(tmp_path / "a.csv", mapping(tmp_path, "rows = [41, 601]\n" + text))


def test_rows_that_are_cut_off_need_hold_no_numbers(tmp_path):
    rows = [f"{4e-3 * k:.3f},{Q[k]},{F[k]}" for k in range(len(Q))]
    rows[500] = "ERR,ERR,0"
    rows[20] = f"{4e-3 * 20:.3f},,1"
    (tmp_path / "a.csv").write_text("\n".join(["t,q,f", *rows]))
    text = map_of("q", "f", clock="sample_rate = 250.0")
    with pytest.raises(InputError, match="'ERR'"):
        import_log(tmp_path / "a.csv", mapping(tmp_path, text))
    log = import_log(tmp_path / "a.csv", mapping(tmp_path, "rows = [31, 480]\n" + text))
    np.testing.assert_allclose(log.axes["x"].position, 1e-3 * Q[30:480])
    with pytest.raises(InputError, match="column 'q' is nan in row 1 of 461"):
        import_log(tmp_path / "a.csv", mapping(tmp_path, "rows = [21, 481]\n" + text))


def test_a_clock_that_was_put_back_names_the_parts(tmp_path):
    times = np.concatenate([4e-3 * np.arange(400), 4e-3 * np.arange(200)])
    np.savetxt(tmp_path / "a.csv", np.column_stack([times, Q, F]), header="t,q,f",
               delimiter=",", comments="", fmt="%.9g")  # fmt: skip
    text = map_of("q", "f", clock="t in s")
    with pytest.raises(InputError, match=r"rows = \[1, 400\] or rows = \[401, 600\] in the map"):
        import_log(tmp_path / "a.csv", mapping(tmp_path, text))
    part = import_log(tmp_path / "a.csv", mapping(tmp_path, "rows = [401, 600]\n" + text))
    assert len(part) == 200


@pytest.mark.parametrize(
    ("name", "begin", "second", "unit"),
    [
        ("t", 45328.6, 1.0 / 86400.0, "day"),  # of a spreadsheet
        ("datenum", 738920.6, 1.0 / 86400.0, "day"),
        ("t", 1707230038.5, 1.0, "s"),
        ("t", 1707230038500.0, 1e3, "ms"),  # whole numbers, which count no rows
        ("stamp", 1.7072300385e18, 1e9, "ns"),
        ("ticks", 133515432001234560.0, 1e7, "100ns"),  # of Windows
        ("Time [us]", 0.0, 1.0, "s"),  # as its name says what cannot be: 250 MHz
    ],
)
def test_how_large_times_are_tells_their_unit(tmp_path, name, begin, second, unit):
    times = begin + second * np.arange(len(Q)) / 250.0
    lines = [f"{t:.12f},{q:.9g},{f:.9g}" for t, q, f in zip(times, Q, F, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join([f"{name},q,f", *lines]))
    lines = proposed(tmp_path)
    assert f'time = {{column = "{name}", unit = "{unit}"}}' in lines
    assert ("unit ASSUMED: that" in lines) == (name == "Time [us]")


def test_the_step_of_a_clock_that_counts_since_long_ago_is_the_mean_one(tmp_path):
    times = 1707230000123456789 + 1_000_000 * np.arange(len(Q))
    lines = [f"{t},{q:.9g},{f:.9g}" for t, q, f in zip(times, Q, F, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(["stamp_ns,q,f", *lines]))
    assert "rises by 1e+06 ns" in proposed(tmp_path)


def test_of_a_recording_with_a_gap_that_begins_again_the_longest_part_is_taken(tmp_path):
    """The rows of the others are those of the file, so that they can be taken as they are told."""
    times = np.concatenate([T[:100], T[300:450], T[:200]])
    cells = zip(times, Q[: len(times)], F[: len(times)], strict=True)
    lines = [f"{t:.3f},{q:.9g},{f:.9g}" for t, q, f in cells]
    (tmp_path / "a.csv").write_text("\n".join(["time [s],q,f", *lines]))
    told = "rows = [251, 450] # the longest of 3 parts; the others: [1, 100] and [101, 250]"
    assert told in proposed(tmp_path)


def moved(row: int, seconds: float) -> np.ndarray:
    """From a row on later than the even times."""
    return T + seconds * (np.arange(COUNT) >= row)


USUAL = "usual are 0.004 s a sample; give resample = 250 (Hz) in the map, or sample_rate in place "
APART = "import each part as a log of its own, with rows = [1, 150] or rows = [151, "


@pytest.mark.parametrize(
    ("times", "said"),
    [
        (T[::-1], "the time runs backwards, from 2.396 s in the first row to 0 s in the last"),
        (np.delete(T, 100),
         f"the time has a gap: 0.396 s is followed by 0.404 s in row 101, {USUAL}"),
        (np.where(np.arange(COUNT) == 200, T[199], T),
         f"the time does not increase: 0.796 s is followed by 0.796 s in row 201, {USUAL}"),
        (0.02 * (np.arange(COUNT) // 5), "the time is the same in several rows each, 0 s in row 2 "
         "and before; give sample_rate = 250 (Hz) in place of time"),
        (T + 1e-3 * (np.arange(COUNT) == 300), "the time is off the even grid by up to 25 % of a "
         f"sample: 1.196 s is followed by 1.201 s in row 301, {USUAL}"),
        (moved(150, 0.0744), "the time has a gap: 0.596 s is followed by 0.6744 s in row 151, "),
        (moved(150, 0.078), f"there is nothing between 0.596 s and 0.678 s; {APART}600] in "),
        (moved(150, 1.0) + (np.arange(COUNT) >= 400), "there is nothing between 0.596 s and 1.6 s, "
         f"and once more; {APART}400] or rows = [401, 600] in the map"),
        (np.tile(T[:30], 104), "the time falls back in row 31 (0.116 s is followed by 0 s), row 6"),
        (np.where(np.arange(COUNT) == 2, np.nan, T), "the time in row 3 is nan; give every row a "),
    ],
)  # fmt: skip
def test_times_that_are_none_are_refused_with_the_first_row_and_what_to_do(tmp_path, times, said):
    n = len(times)
    write_csv(tmp_path / "a.csv", {"t": times, "q": np.resize(Q, n), "f": np.resize(F, n)})
    known = mapping(tmp_path, map_of("q", "f", clock="t in s"))
    with pytest.raises(InputError) as refused:
        import_log(tmp_path / "a.csv", known)
    assert str(refused.value).startswith(f"{tmp_path / 'a.csv'}: column 't': {said}")
    if n > COUNT:  # of 103 places a hundred are told
        assert str(refused.value).count("is followed by") == 100
        assert "0 s) and 3 more: the clock was put back" in str(refused.value)


@pytest.mark.parametrize("apart", [0.0, 0.1])
def test_two_clocks_in_one_table_are_of_the_columns_behind_them(tmp_path, apart):
    """That the first was taken for all made 9.8 kg of 12."""
    rows = [f"{t},{f:.9g},{t + apart},{q:.9g}" for t, f, q in zip(T, F, Q, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(["Time F [s],F [N],Time X [s],x [mm]", *rows]))
    told = guess_map(tmp_path / "a.csv").missing
    assert any("'Time X [s]' is up to 0.1 s from 'Time F [s]'" in t for t in told) == (apart > 0.0)
