"""Numbers that a user gives: which are refused, and what a file is written with."""

import math
import sys

import numpy as np
import pytest

from twin.errors import InputError
from twin.numbers import first_not_finite, independent, is_number, neat, require_seed

GIVEN = [m * 10.0**e for e in (-9, -3, -1, 0, 2, 7) for m in (1.0, 1.239, 9.999) for s in (1,)]


@pytest.mark.parametrize("value", [0, -3, 2.5, np.float64(1.0), np.int32(7), sys.float_info.max])
def test_a_finite_number_is_one(value):
    assert is_number(value)


@pytest.mark.parametrize("value", [True, np.inf, -np.inf, np.nan, 10**400, "1", None, [1.0]])
def test_what_no_double_holds_is_no_number(value):
    assert not is_number(value)


def test_the_first_value_that_is_not_finite_is_told_by_its_place():
    assert first_not_finite(np.array([1.0, 2.0])) is None
    assert first_not_finite(np.array([1.0, np.nan, 2.0, np.inf])) == 1
    assert first_not_finite(np.array([-np.inf, np.nan])) == 0


@pytest.mark.parametrize("size", [1e-12, 1.0, 1e12])
def test_rows_depend_on_each_other_whatever_their_sizes(size):
    rows = np.array([[1.0, 2.0, 1.0], [1.0, 1.0, 1.0]])
    assert independent(rows * [[size], [1.0]])
    assert not independent(np.vstack([rows, size * (rows[0] - 2.0 * rows[1])]))
    assert not independent(np.zeros((1, 3)))


def test_a_seed_below_zero_is_refused():
    require_seed(0)
    with pytest.raises(InputError, match="seed -1: is not allowed; give a whole number of 0"):
        require_seed(-1)


@pytest.mark.parametrize("value", GIVEN)
def test_a_number_is_cut_to_three_digits_and_never_raised(value):
    """So that no limit is passed; what has three digits stays."""
    cut = neat(value)
    assert float(f"{cut:.3g}") == cut
    digit = 10.0 ** (math.floor(math.log10(value)) - 2)
    assert -1e-9 * value <= value - cut < digit
    assert neat(cut) == cut
    assert neat(0.0) == 0.0
