"""The fuzz in small: no damaged input is silent, none a fault of the program, none a hang."""

from pathlib import Path

import pytest

from benchmarks.fuzz import run


@pytest.mark.slow
def test_damaged_inputs_are_refused_or_read_as_they_are(tmp_path: Path) -> None:
    table = run(180, 5, tmp_path)
    assert {answer for _, answer in table} == {"refused", "read"}, table
    assert sum(table.values()) == 180
