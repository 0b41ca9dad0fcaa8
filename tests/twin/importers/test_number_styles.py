"""How numbers are written: decimal signs, grouped thousands, and files in which they look alike."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from import_cases import refusal_of

from twin.errors import InputError
from twin.importers import import_log
from twin.importers.guess import propose
from twin.importers.mapping import parse_mapping

MAP = 'time = {column = "t", unit = "s"}\n[axes.x]\nposition = {column = "x", unit = "m"}\n'
MAP += 'force = {column = "F", unit = "N"}\n'
T = np.arange(0.0, 2.0, 1e-3)  # s
X = np.round(1.7 * np.sin(2.0 * T), 3)  # m
F = np.round(2345.0 * np.cos(2.0 * T), 0)  # N


def comma(text: str) -> str:
    return text.replace(",", "!").replace(".", ",").replace("!", ".")


def quoted(text: str) -> str:
    return f'"{comma(text)}"'


def spaced(sign: str) -> Callable[[str], str]:
    return lambda text: text.replace(",", sign).replace(".", ",")


@pytest.mark.parametrize(
    ("delimiter", "x", "force", "written"),
    [
        (";", ".3f", ".0f", comma),  # each number but the force has three decimals
        ("\t", ".3f", ".3f", comma),
        (",", ".3f", ".3f", quoted),  # one sign for both
        (";", ".3f", ",.0f", comma),  # 1.016 is a thousand and sixteen
        (";", ".3f", ",.0f", str),  # and 1,016 where 0.512 has a point
        (";", ".3f", ",.1f", spaced(" ")),
        (";", ".3f", ",.1f", spaced("\u00a0")),
        (";", ".3f", ",.1f", spaced("\u202f")),  # of France
        (";", ".3f", ",.1f", spaced("’")),
        (";", ".5g", ",.1f", comma),
        (",", ".5g", ".1f", lambda text: text.replace("-", "\u2212")),
    ],
)
def test_a_table_is_read_as_it_was_written(
    tmp_path: Path, delimiter: str, x: str, force: str, written: Callable[[str], str]
) -> None:
    rows = [
        [written(f"{a:.3f}"), written(f"{b:{x}}"), written(f"{c:{force}}")]
        for a, b, c in zip(T, X, F, strict=True)
    ]
    lines = [delimiter.join(row) for row in [["t", "x", "F"], *rows]]
    path = tmp_path / "table.csv"
    path.write_text("\n".join(lines), encoding="utf-8")
    log = import_log(path, parse_mapping(MAP)).axes["x"]
    np.testing.assert_allclose(log.position, X, atol=1e-9)
    np.testing.assert_allclose(log.columns["force"], F, atol=1e-9)


def test_whole_numbers_that_go_from_999_to_1000_are_grouped(tmp_path: Path) -> None:
    """No sign of the file is a decimal one."""
    counts = np.round(1e4 * X)
    rows = [
        f"{comma(f'{a:,.0f}')};{comma(f'{b:,.0f}')};{comma(f'{c:,.0f}')}"
        for a, b, c in zip(1e3 * T, counts, F, strict=True)
    ]
    path = tmp_path / "table.csv"
    path.write_text("\n".join(["t;x;F", *rows]))
    log = import_log(path, parse_mapping(MAP.replace('"s"', '"ms"'))).axes["x"]
    np.testing.assert_allclose(log.position, counts)
    np.testing.assert_allclose(log.columns["force"], F)


def test_points_in_one_column_and_commas_in_another_are_both_decimal_signs(tmp_path: Path) -> None:
    rows = [f"{a:.3f};{comma(f'{b:.4f}')};{c:.0f}" for a, b, c in zip(T, X, F, strict=True)]
    path = tmp_path / "table.csv"
    path.write_text("\n".join(["t;x;F", *rows]))
    log = import_log(path, parse_mapping(MAP))
    assert log.sample_rate == pytest.approx(1e3)
    np.testing.assert_allclose(log.axes["x"].position, X, atol=1e-9)


@pytest.mark.parametrize(
    ("head", "rows", "told"),
    [
        (
            "t,axis,x,F",
            ("{t},X1,{x},{f}", "{t},X2,{x},{f}"),
            "'axis' tells .* is, X1 or X2: a",
        ),
        ("t,joint,x,F", ("{t},1,{x},{f}", "{t},2,{x},{f}"), "'joint' tells .* is, 1 or 2: a"),
        ("t,signal,value", ("{t},x [m],{x}", "{t},F [N],{f}"), r"'signal' tells .* x \[m\] or F"),
    ],
)
def test_rows_of_several_axes_or_signals_are_no_samples(
    tmp_path: Path, head: str, rows: tuple[str, ...], told: str
) -> None:
    """They were woven into one axis at twice the rate, which a check found suitable."""
    body = [r.format(t=t, x=x, f=f) for t, x, f in zip(T, X, F, strict=True) for r in rows]
    path = tmp_path / "table.csv"
    path.write_text("\n".join([head, *body]))
    assert re.search(told, refusal_of(path))


def test_a_heartbeat_tells_no_rows_apart(tmp_path: Path) -> None:
    body = [f"{t},{x},{f},{k % 2 == 0}" for k, (t, x, f) in enumerate(zip(T, X, F, strict=True))]
    path = tmp_path / "table.csv"
    path.write_text("\n".join(["t,x,F,alive", *body]))
    assert len(import_log(path, parse_mapping(MAP))) == len(T)


@pytest.mark.parametrize(
    ("between", "where"), [([], r"row 1001 of 2000 \(line 1002\)"), (["", "# mark"], "row 1001 of")]
)
def test_a_line_is_told_where_its_number_is_known(
    tmp_path: Path, between: list[str], where: str
) -> None:
    """Behind a comment a row has not the number of its line any more: the row is told."""
    rows = [f"{t},{x},{f}" for t, x, f in zip(T, X, F, strict=True)]
    rows[1000] = "1.0,0.1,nan"
    path = tmp_path / "table.csv"
    path.write_text("\n".join(["t,x,F", *rows[:500], *between, *rows[500:]]))
    said = refusal_of(path)
    assert re.search(where, said)
    assert ("line" in said) == (not between)


def test_columns_of_words_are_told_where_a_signal_is_looked_for(tmp_path: Path) -> None:
    rows = [f"{t},{x},{f} parts" for t, x, f in zip(T, X, F, strict=True)]
    path = tmp_path / "table.csv"
    path.write_text("\n".join(["t,x,Torque", *rows]))
    assert "column 'Torque' holds text, such as '2345.0 parts', and no numbers" in refusal_of(path)


def scaled(value: float, unit: str) -> str:
    """A number as Grafana shows it, in a unit that makes it neither large nor small."""
    size, prefix = (1.0, "") if abs(value) >= 1.0 else (1e3, "m")
    return f"{value * size:.4f} {prefix}{unit}"


@pytest.mark.parametrize(
    ("position", "cell"),
    [
        ("x", lambda v: f"{1e3 * v:.1f} mm"),
        ("x", lambda v: f"{1e3 * v:.1f}mm"),
        ("x [m]", lambda v: f"{1e3 * v:.1f} mm"),  # of which one is so many of its name's
        ("x", lambda v: scaled(v, "m")),
        ("x", lambda v: comma(f"{1e3 * v:.3f}") + " mm"),
    ],
)
def test_cells_with_their_units(
    tmp_path: Path, position: str, cell: Callable[[float], str]
) -> None:
    lines = [f"{1e3 * t:.0f} ms;{cell(x)};{f:.0f} N" for t, x, f in zip(T, X, F, strict=True)]
    path = tmp_path / "table.csv"
    path.write_text("\n".join([f"t;{position};F", *lines]))
    log = import_log(path, parse_mapping(propose(path).map_text({})))
    np.testing.assert_allclose(log.axes["x"].position, X, atol=1e-6)
    np.testing.assert_allclose(log.axes["x"].force, F, atol=1e-6)
    assert log.sample_rate == 1000.0


def test_a_cell_in_the_unit_of_another_quantity_is_no_number(tmp_path: Path) -> None:
    lines = [f"{t:.3f} s,{x:.3f} m,{f:.0f} N" for t, x, f in zip(T, X, F, strict=True)]
    lines[700] = lines[700].replace(" m,", " V,")
    path = tmp_path / "table.csv"
    path.write_text("\n".join(["t,x,F", *lines]))
    with pytest.raises(InputError, match=f"line 702, column 'x': '{X[700]:.3f} V' is not a number"):
        import_log(path, parse_mapping(MAP))
