"""Numbers of the report: in a unit of a fitting size, with the digits that they have."""

from __future__ import annotations

import pytest

from identify.output.numbers import Scale, number, spaced, title_case, typeset


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (1.234e-3, "0.00123"),
        (9.87e-4, "9.87×10⁻⁴"),
        (-1.234e7, "−1.23×10⁷"),
        (1234567.0, "1234567"),
    ],
)
def test_very_large_and_small_numbers_have_a_power_of_ten(value, text):
    assert typeset(number(value)) == text


@pytest.mark.parametrize("unit", ["N", "m", "kg"])
def test_a_scale_keeps_the_value(unit):
    for value in (3.21e-8, 4.9e-4, 5.1e-4, 0.49, 0.51, 23.0):
        scale = Scale.of(unit, [value, -value / 3.0])
        assert scale(value) * scale.size == pytest.approx(value)
        prefixed = {1.0: "", 1e-3: "m", 1e-6: "µ", 1e-9: "n"}[scale.size]
        assert scale.unit == prefixed + unit
        assert unit == "kg" or scale(value) >= 0.5
        assert unit == "kg" or scale.size == 1.0 or scale(value) < 500.0
    assert Scale.of(unit, []).size == 1.0


def test_an_interval_has_two_digits_of_its_half_width():
    scale = Scale(1e-3, "mN")
    assert scale.within(0.01, 0.05, -0.0314159) == ["-31"]
    assert scale.within(0.01, 0.014, 0.0123456) == ["12.3"]
    assert scale.within(0.0, 5.0, 1.2345) == ["1234"] or scale.within(0.0, 5.0, 1.2345) == ["1235"]
    assert spaced("a_b_c") == "a b c"
    assert title_case("a_b_c") == "A b c"
