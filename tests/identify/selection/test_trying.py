"""A change that somebody asks for is judged as the search judges it, and refused in words."""

from __future__ import annotations

import numpy as np
import pytest
from built_fits import CATALOGUE, axis_of, built_dataset, built_machine, fitted

from identify.estimation.fit import fit_axis
from identify.selection.trying import reshape, try_effect
from twin.errors import InputError

DRAWN = built_dataset("run 1", "run 2", held=("held 1",))


def test_an_effect_that_is_there_is_proved_and_one_that_is_not_is_refused() -> None:
    machine = built_machine(DRAWN, axis_of(fitted("cogging", p=0.02, a1=0.4)))
    base = fit_axis(axis_of(), machine.fit)
    there = try_effect(base, machine, CATALOGUE["cogging"])
    assert (there.supported, there.refused) == (True, None)
    assert there.part > 0.9
    assert there.score.control < there.part
    assert there.fit.axis["cogging"].values["p"] == pytest.approx(0.02, rel=0.01)
    absent = try_effect(base, machine, CATALOGUE["quadratic_drag"])
    assert not absent.supported
    assert absent.refused
    assert "quadratic_drag" in absent.fit.axis.names, "it is refitted, as was asked for"


def test_a_law_of_another_shape_is_given_the_one_that_the_logs_show() -> None:
    def bumps(position, direction):
        return 0.3 * np.sign(np.sin(2.0 * np.pi * position / 0.02))

    machine = built_machine(DRAWN, axis_of(), bumps)
    smooth = axis_of(fitted("cogging", p=0.02, a1=0.4))
    fit = fit_axis(smooth, machine.fit)
    found, change = reshape(CATALOGUE["cogging"], {"x": fit}, {"x": machine})
    assert change.name == "cogging"
    assert found.fit.error < 0.7 * fit.error
    with pytest.raises(InputError, match="show no other shape of"):
        reshape(CATALOGUE["cogging"], {}, {})
