"""Text tables as programs write them."""

from pathlib import Path

import numpy as np
import pytest
from import_cases import COUNT, MAP, guess_map, mapping, table

from twin.errors import InputError
from twin.importers import import_log, import_notes
from twin.importers.importer import table_of
from twin.importers.mapping import EVERY_COLUMN
from twin.logs import Log


def lines(columns: dict[str, np.ndarray]) -> list[str]:
    return [",".join(f"{v:.9g}" for v in row) for row in zip(*columns.values(), strict=True)]


def imported(folder: Path, text: str | bytes, map_text: str = MAP) -> Log:
    path = folder / "log.csv"
    path.write_bytes(text.encode() if isinstance(text, str) else text)
    return import_log(path, mapping(folder, map_text))


HEADER = "t,q,i,unused"
ROWS = lines(table())
PLAIN = "\n".join([HEADER, *ROWS])
GERMAN = PLAIN.replace(",", ";").replace(".", ",")
PROTOCOL = """Messprotokoll Achse Y;;;
Datum;29.03.2026;;
Parameter 1;1,25;;
Parameter 2;2,50;;
Bemerkung;"Lauf mit Last";;

"""
NUMBERED = MAP.replace('"q"', "2").replace('"i"', "3")


@pytest.mark.parametrize(
    ("text", "map_text"),
    [
        (PLAIN, MAP),
        (PLAIN.replace("\n", "\r\n") + "\r\n\r\n", MAP),
        (PLAIN.replace(",", ";"), MAP),
        (PLAIN.replace(",", "\t"), MAP),
        (PLAIN.replace(",", " | "), MAP),
        (PLAIN.replace(",", "   "), MAP),
        (PLAIN.replace(",", ", "), MAP),
        (PLAIN.replace("\n", ",\n") + ",", MAP),
        ("\n".join([HEADER, *(row + "," for row in ROWS)]), MAP),
        (PLAIN.replace("nan", ""), MAP),
        (GERMAN, MAP),
        (GERMAN.replace(";", "\t"), MAP),
        ("# " + PLAIN, MAP),
        ("\ufeff" + PLAIN, MAP),
        (PLAIN.encode("utf-16"), MAP),
        (PLAIN.encode("utf-16-le"), MAP),
        (PLAIN.encode("utf-16-be"), MAP),
        (b"\xfe\xff" + PLAIN.encode("utf-16-be"), MAP),
        (PLAIN.replace("\n", "\r"), MAP),
        (PROTOCOL.replace(";", ",") + PLAIN, MAP),
        (PROTOCOL + GERMAN, MAP),
        ("sep=;\n" + GERMAN, MAP),
        ("\n".join([HEADER, "REAL,REAL,INT,REAL", "s,mm,mA,-", *ROWS]), MAP),
        ("\n".join([HEADER, "----,----,----,----", *ROWS]), MAP),
        (PLAIN + "\nend of recording\n", MAP),
        ("\n".join([HEADER, *ROWS[:50], "# marker 1", *ROWS[50:]]), MAP),
        (PLAIN.replace("unused", "Zählung [µm]").encode("cp1252"), MAP),
        (PLAIN.replace("unused", "Zählung [µm]"), MAP),
        ("Recorder 3\nRate: 2000\n\n" + PLAIN, MAP),
        ("\n".join([HEADER, "s,mm,mA,-", *ROWS]), MAP),
        ("\n".join(ROWS), NUMBERED),
        (PLAIN.replace("t,q,i,unused", '"t","q","i","un,used"'), MAP),
        ("\n".join([HEADER, "s,mm,mA,-", *ROWS]), MAP.replace('"q"', '"q [mm]"')),
        ("a,b,c,d\n1,2,3,4\n" + PLAIN, "header_line = 3\n" + MAP),
        ("\n".join([HEADER, *(row + "," for row in ROWS)]), "header_line = 1\n" + MAP),
        (PLAIN.replace("nan", "idle since noon"), 'delimiter = ","\n' + MAP),
        (GERMAN, 'delimiter = ";"\ndecimal = ","\n' + MAP),
    ],
)
def test_the_layout_is_found(tmp_path: Path, text: str | bytes, map_text: str) -> None:
    axis = imported(tmp_path, text, map_text).axes["x"]
    expected = -1e-3 * (table()["q"] + 2.0)
    np.testing.assert_allclose(axis.position, expected, rtol=0, atol=1e-9)
    np.testing.assert_allclose(axis.columns["current"], 1e-3 * table()["i"], rtol=1e-12)


def test_a_decimal_comma_is_found_above_a_rest_in_whole_numbers(tmp_path: Path) -> None:
    moving = [f"{k};{k / 7:.4f};{k / 3:.4f}".replace(".", ",") for k in range(300)]
    resting = [f"{k};40;90" for k in range(300, 340)]
    axis = imported(tmp_path, "\n".join(["t;q;i", *moving, *resting])).axes["x"]
    expected = -1e-3 * (np.arange(300) / 7.0 + 2.0)
    np.testing.assert_allclose(axis.position[:300], expected, rtol=0, atol=1e-7)


def test_thousands_may_be_grouped(tmp_path: Path) -> None:
    rows = [f"{k};{1000 + k}.{k:03d},5;{k}".replace(str(1000 + k), "1", 1) for k in range(100)]
    log = imported(tmp_path, "\n".join(["t;q;i", *rows]))
    expected = -1e-3 * (1000.5 + np.arange(100) + 2.0)
    np.testing.assert_allclose(log.axes["x"].position, expected, rtol=0, atol=1e-9)


def test_a_last_line_that_was_cut_off_is_left_out_and_told(tmp_path: Path) -> None:
    log = imported(tmp_path, PLAIN[:-12])
    assert len(log) == COUNT - 1
    assert f"line {COUNT + 1} is cut off and left out" in import_notes(log)[0]


def test_a_header_in_the_middle_is_another_recording(tmp_path: Path) -> None:
    text = "\n".join([HEADER, *ROWS, HEADER, *ROWS])
    message = f"line {COUNT + 2} is the header again: two recordings in one file"
    with pytest.raises(InputError, match=message):
        imported(tmp_path, text)
    with pytest.raises(InputError, match=message):
        guess_map(tmp_path / "log.csv")


def test_all_bad_cells_are_in_one_answer(tmp_path: Path) -> None:
    rows = list(ROWS)
    for k in range(20, 270, 5):
        rows[k] = f"0.01,#N/A,{k},0"
    with pytest.raises(InputError) as refused:
        imported(tmp_path, "\n".join([HEADER, *rows]))
    said = str(refused.value)
    assert "50 cells are no numbers: line 22, column 'q': '#N/A' is not" in said
    assert all(f"line {k + 2}, column 'q'" in said for k in range(20, 270, 5))
    assert "\n" not in said


def with_row(number: int, row: str) -> str:
    return "\n".join([HEADER, *ROWS[: number - 1], row, *ROWS[number:]])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (with_row(40, "0.02,abc,1,0"), "line 41, column 'q': 'abc' is not a number"),
        (with_row(40, "0.02,,1,0"), "line 41, column 'q': is empty"),
        (with_row(40, "0.02"), "line 41, column 'q': is empty"),
        (with_row(40, "0.02,nan,1,0"), r"column 'q' is nan in row 40 of 300 \(line 41\), 1 in all"),
        (PLAIN.replace("q,", "qq,"), "no column 'q'; did you mean 'qq'. columns: t, qq, i, unused"),
        (PLAIN.replace("t,", "q,", 1), "no column 'q'; did you mean .*columns: q 1, q 2"),
        (PLAIN.replace(",unused", ""), "line 1 has 3 names, the rows have 4 cells"),
        ("", "no line of text"),
        ("t,q\nsome,words\n", "no rows of numbers"),
        (HEADER, "no rows of numbers"),
        (HEADER + "\n0,1,2,3\n", "has 1 rows; a log has at least 2"),
        (b"\x00\x01" * 500, "no rows of numbers"),
    ],
)
def test_what_cannot_be_read_is_named(tmp_path: Path, text: str | bytes, message: str) -> None:
    with pytest.raises(InputError, match=message) as raised:
        imported(tmp_path, text)
    assert "log.csv" in str(raised.value)
    assert "\n" not in str(raised.value)


CLOCKED = MAP.replace("sample_rate = 2000.0", 'time = {column = "t", unit = "s"}')


def stamped(day: str, start: int = 0) -> str:
    """The table with stamps of 0.5 ms in place of its times, the first so many ms in a minute."""
    halves = (start * 1000 + 500 * k for k in range(len(ROWS)))
    stamps = (f"{day} 12:00:{micro // 10**6:02d}.{micro % 10**6:06d}" for micro in halves)
    rows = (f"{t},{row.partition(',')[2]}" for t, row in zip(stamps, ROWS, strict=True))
    return "\n".join([HEADER, *rows])


@pytest.mark.parametrize("day", ["2024-05-01", "1999-12-31"])
def test_stamps_with_a_date_are_times(tmp_path: Path, day: str) -> None:
    log = imported(tmp_path, stamped(day, 1900), CLOCKED)
    assert log.sample_rate == 2000.0
    expected = np.datetime64(f"{day}T12:00:01.900", "ns").astype(np.int64)
    assert int(log.metadata["start_time_unix_ns"]) == expected
    assert 'time = {column = "t", unit = "s"}' in guess_map(tmp_path / "log.csv").text


def test_stamps_of_no_kind_ask_for_the_rate_and_hinder_no_proposal(tmp_path: Path) -> None:
    text = stamped("2024-05-01").replace("2024-05-01 12", "at noon 12")
    with pytest.raises(InputError, match=r"'t' holds text, such as 'at noon .* sample_rate \(Hz\)"):
        imported(tmp_path, text, CLOCKED)
    assert "# sample_rate = ? # Hz: NOT KNOWN" in guess_map(tmp_path / "log.csv").text


def test_bad_cells_far_apart_are_told_at_once_by_line_and_blocks_between_are_read(tmp_path):
    rows = [f"{0.001 * k:.3f},{k % 97},{k % 7}.5,0" for k in range(5000)]
    for k, cell in ((10, "x"), (2500, "nan"), (4990, "?")):
        t, _, i, unused = rows[k].split(",")
        rows[k] = f"{t},{cell},{i},{unused}"
    with pytest.raises(InputError, match=r"^.*3 cells .* line 12, .* line 2502, .* line 4992"):
        imported(tmp_path, "\n".join([HEADER, *rows]))
    rows[10], rows[2500], rows[4990] = rows[11], "# a pause", rows[4991]
    log = imported(tmp_path, "\n".join([HEADER, *rows]))
    assert len(log) == 4999
    assert import_notes(log) == ["line 2502 is a comment and left out: '# a pause'"]


def test_counts_in_hexadecimals_are_read(tmp_path):
    counts = np.arange(-50, 50)
    rows = [f"0x{k & 0xFFFF:04X},{0.5 * k}" for k in counts]
    log = imported(
        tmp_path, "\n".join(["q,i", *rows]),
        'sample_rate = 1e3\n[axes.x]\nposition = {column = "q", unit = "um", wraps = 65536}\n'
        'force = {column = "i", unit = "N"}\n',
    )  # fmt: skip
    np.testing.assert_allclose(log.axes["x"].position, 1e-6 * counts, atol=1e-12)


@pytest.mark.parametrize(
    ("above", "names"),
    [
        (
            ",Axis X,,Axis Y,\n",
            ("t", "Axis X q [mm]", "Axis X f [N]", "Axis Y q [mm]", "Axis Y f [N]"),
        ),
        ("", ("t", "q 1 [mm]", "f 1 [N]", "q 2 [mm]", "f 2 [N]")),
        ("Oscilloscope,,,,\n", ("t", "q 1 [mm]", "f 1 [N]", "q 2 [mm]", "f 2 [N]")),
    ],
)
def test_columns_of_one_name_are_told_apart(
    tmp_path: Path, above: str, names: tuple[str, ...]
) -> None:
    """By the groups above them, else by a number: none is lost."""
    rows = "".join(f"{k},{k + 1},{k + 2},{k + 3},{k + 4}\n" for k in range(20))
    path = tmp_path / "a.csv"
    path.write_text(f"{above}t,q [mm],f [N],q [mm],f [N]\n{rows}")
    columns = table_of(path, EVERY_COLUMN).columns
    assert tuple(columns) == names
    assert [column[0] for column in columns.values()] == [0.0, 1.0, 2.0, 3.0, 4.0]
