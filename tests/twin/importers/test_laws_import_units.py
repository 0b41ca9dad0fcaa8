"""Laws of units and times of a foreign file: units by their definitions, times on an even grid."""

import math

import numpy as np
import pytest

from twin.errors import InputError
from twin.importers.time_base import rate_of
from twin.importers.units import find_unit

SECONDS = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0}
METRES = {"m": 1.0, "cm": 0.01, "mm": 1e-3, "um": 1e-6, "nm": 1e-9, "in": 25.4e-3}
TURN = 2.0 * math.pi
RADIANS = {
    "rad": 1.0, "mrad": 1e-3, "urad": 1e-6, "rev": TURN, "deg": TURN / 360.0, "°": TURN / 360.0,
    "arcmin": TURN / 21_600.0, "arcsec": TURN / 1_296_000.0,
}  # fmt: skip
OTHERS = {
    "A": {"A": 1.0, "kA": 1e3, "mA": 1e-3, "uA": 1e-6},
    "N": {"N": 1.0, "kN": 1e3, "mN": 1e-3, "uN": 1e-6},
    "N m": {
        "Nm": 1.0, "kNm": 1e3, "mNm": 1e-3, "uNm": 1e-6, "Ncm": 1e-2, "Nmm": 1e-3, "mNmm": 1e-6,
        "N m": 1.0, "N*m": 1.0, "N·m": 1.0, "mN m": 1e-3,
    },
}  # fmt: skip


def all_units() -> list[tuple[str, str, float]]:
    found = [("s", text, size) for text, size in SECONDS.items()]
    found += [("m/s^2", "g", 9.80665), ("rad/s", "rpm", TURN / 60.0)]
    found += [("m", "\N{MICRO SIGN}m", 1e-6), ("m", "\N{GREEK SMALL LETTER MU}m", 1e-6)]
    found += [(si, text, size) for si, units in OTHERS.items() for text, size in units.items()]
    for si, lengths in (("m", METRES), ("rad", RADIANS)):
        for length, size in lengths.items():
            found.append((si, length, size))
            for time, seconds in SECONDS.items():
                found.append((f"{si}/s", f"{length}/{time}", size / seconds))
                for power in ("^2", "²"):
                    found.append((f"{si}/s^2", f"{length}/{time}{power}", size / seconds**2))
            found += [
                (f"{si}/s^2", f"{length}/s2", size),
                (f"{si}/s^2", f"{length}/ms2", size * 1e6),
            ]
    return found


def test_every_unit_has_the_size_of_its_definition():
    for si, text, size in all_units():
        found = find_unit(text, si)
        assert (found.si, found.size) == (si, pytest.approx(size, rel=1e-14)), text


@pytest.mark.parametrize(
    ("unit", "si", "size"),
    [("kip", "N", 4448.2216), ("lbf", "N", 4.4482216), ("ft", "m", 0.3048),
     ("lbf*in", "N m", 0.11298483), ("in/s", "m/s", 0.0254), ("ozf", "N", 0.27801385)],
)  # fmt: skip
def test_rarer_units_are_those_of_a_library(unit, si, size):
    found = find_unit(unit, si)
    assert (found.si, found.size) == (si, pytest.approx(size, rel=1e-6))


def test_a_unit_of_another_quantity_is_refused():
    for unit in ("kip", "lbf*in", "degC", "__import__", "N"):
        with pytest.raises(InputError, match="is not known here"):
            find_unit(unit, "m")
    for si, text, _ in all_units()[::5]:
        for other in {"s", "m", "m/s", "rad/s^2", "A", "N", "N m"} - {si}:
            with pytest.raises(InputError, match="is not known here"):
                find_unit(text, other)


@pytest.mark.parametrize("text", ["V", "counts", "%", "1"])
def test_a_raw_unit_is_of_no_quantity_and_of_size_one(text):
    for si in ("m", "N m", "rad/s"):
        assert (find_unit(text, si).size, find_unit(text, si).si) == (1.0, None)


def test_a_unit_that_two_quantities_know_is_that_of_the_first_allowed():
    assert find_unit("mm", "m", "rad").si == "m"
    assert find_unit("deg", "m", "rad").si == "rad"


def times(rate: float, count: int, late: dict[int, float] | None = None) -> np.ndarray:
    k = np.arange(count, dtype=float)
    for sample, part in (late or {}).items():
        k[sample] += part
    return 12.5 + k / rate


@pytest.mark.parametrize(
    ("rate", "count", "whole"),
    [
        (1000.0, 50, True), (999.9, 50, True), (999.9, 200, False), (100.1, 10, True),
        (100.1, 12, False), (2.5, 6, False), (1e4, 5000, True),
    ],
)  # fmt: skip
def test_a_rate_is_whole_where_that_moves_no_time_by_a_hundredth_of_a_period(rate, count, whole):
    assert whole == (abs(round(rate) / rate - 1.0) * (count - 1) < 0.01)
    expected = float(round(rate)) if whole else rate
    assert rate_of(times(rate, count)) == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize("row", [2, 49])
def test_a_time_may_be_off_the_grid_by_a_hundredth_of_a_period(row):
    for part in (0.009, -0.009):
        assert rate_of(times(1000.0, 50, {row - 1: part})) == 1000.0
    for part in (0.011, -0.011, 0.4, -0.4):
        with pytest.raises(InputError, match=f"off the even grid by up to .* in row {row},"):
            rate_of(times(1000.0, 50, {row - 1: part}))


@pytest.mark.parametrize("row", [2, 50])
def test_times_that_stop_repeat_or_leave_a_gap_name_the_row(row):
    late = dict.fromkeys(range(row - 1, 50), 0.49)
    with pytest.raises(InputError, match="off the even grid"):
        rate_of(times(1000.0, 50, late))
    gap = dict.fromkeys(range(row - 1, 50), 0.51)
    with pytest.raises(InputError, match=f"has a gap: .* in row {row}, usual are 0.001 s"):
        rate_of(times(1000.0, 50, gap))
    for part in (-1.0, -1.5):
        before, at = 12.5 + (row - 2) / 1000.0, 12.5 + (row - 1 + part) / 1000.0
        with pytest.raises(InputError, match="does not increase") as caught:
            rate_of(times(1000.0, 50, {row - 1: part}))
        assert f"{before:.9g} s is followed by {at:.9g} s in row {row}" in str(caught.value)


def test_rows_in_the_reverse_order_are_said_to_be_that() -> None:
    """They were told to be -0.0005 s a sample apart, and to be resampled at 1e+09 Hz."""
    with pytest.raises(InputError, match=r"the time runs backwards, from 0\.004 s .*; sort the r"):
        rate_of(np.arange(5)[::-1] * 1e-3)
