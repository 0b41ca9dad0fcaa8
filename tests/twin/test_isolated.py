"""Work in an isolated process gives its answer, its refusal, or why there is none."""

import os

import pytest

from twin.errors import InputError
from twin.isolated import NoAnswer, isolated


def doubled(value):
    return 2 * value


def refused(value):
    raise InputError(f"{value} is refused")


def endless():
    while True:
        pass


def exits(code):
    os._exit(code)


def leaves():
    raise SystemExit(3)


def fails():
    raise KeyError("damaged\n  table")


def not_sent():
    return lambda: None


def hungry(size):
    return len(bytearray(size))


def test_isolated_work_gives_its_answer_its_refusal_or_none():
    assert isolated(doubled, 21, seconds=20.0) == 42
    with pytest.raises(InputError, match="7 is refused") as told:
        isolated(refused, 7, seconds=20.0)
    assert not isinstance(told.value, NoAnswer)
    with pytest.raises(NoAnswer, match=r"does not come to an end within 0.2 s"):
        isolated(endless, seconds=0.2)
    with pytest.raises(NoAnswer, match="ended the program"):
        isolated(exits, 0, seconds=20.0)
    assert isolated(hungry, 10**6, seconds=20.0, memory=10**8) == 10**6
    with pytest.raises(InputError, match="takes more memory"):
        isolated(hungry, 3 * 10**8, seconds=20.0, memory=10**8)


def test_an_error_in_isolated_work_is_told_and_an_exit_as_an_exit():
    with pytest.raises(NoAnswer, match=r"^failed while it was loaded \(KeyError: .damaged.* table"):
        isolated(fails, seconds=20.0)
    with pytest.raises(NoAnswer, match=r"failed while it was loaded .*pickle"):
        isolated(not_sent, seconds=20.0)
    with pytest.raises(NoAnswer, match="ended the program while it was loaded; remove the exit"):
        isolated(leaves, seconds=20.0)
