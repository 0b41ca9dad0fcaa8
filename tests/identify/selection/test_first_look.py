"""What the beginning of a log makes most likely, before all logs are read."""

from __future__ import annotations

from pathlib import Path

import pytest
from planted_logs import RATE, SLIDE, Ride, few, having, logged

from identify.output.words.first_look import first_look_in_words
from identify.selection.first_look import BEGINNING, Likely, first_look
from twin.logs import write_log
from twin.model.machine import AxisModel, MachineModel

MODEL = MachineModel("slide", {"x": SLIDE}, RATE)
FEW = few("cogging", "quadratic_drag", "spring", "constant_force", "lugre")


def looked(true: AxisModel, folder: Path) -> tuple[Likely, ...]:
    """The first look at a log of a machine."""
    path = folder / "log.mcap"
    write_log(logged(true, Ride(5, BEGINNING)), path)
    return first_look(MODEL, path, catalogue=FEW)


@pytest.mark.parametrize(
    ("effect", "values"),
    [("cogging", {"p": 0.021, "a1": 0.03, "b1": 0.02}), ("quadratic_drag", {"c": 0.8})],
)
def test_the_beginning_of_a_log_names_what_is_missing(effect, values, tmp_path) -> None:
    (found,) = looked(having(SLIDE, effect, **values), tmp_path)
    assert found.effects[0] == effect
    assert found.part > 0.8
    assert f"axis x most likely lacks {effect}" in first_look_in_words("log.mcap", [found])


def test_where_nothing_is_missing_none_is_named(tmp_path) -> None:
    (found,) = looked(SLIDE, tmp_path)
    assert found.effects == ()
    assert "noise floor" in first_look_in_words("log.mcap", [found])
