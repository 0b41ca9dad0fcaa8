"""What is missing is asked at other lengths of the test functions too."""

from __future__ import annotations

import numpy as np
import pytest
from planted_logs import RATE, SLIDE, Ride, few, having, logged

from identify.dataset.dataset import Dataset
from identify.dataset.preparation import datasets
from identify.estimation.fit import fit_axis
from identify.selection.diagnosis import AxisDiagnosis, diagnose_axis
from twin.model.machine import MachineModel

LONG, SHORT = 0.2, 0.02  # s
FAST = having(SLIDE, "cogging", p=0.006, a1=0.4)  # passed at up to 50 Hz


def prepared(length: float) -> Dataset:
    logs = {f"run{i}": logged(FAST, Ride(40 + i, 4.0)) for i in range(3)}
    *fit, held = logs.items()
    model = MachineModel("m", {"x": SLIDE}, RATE)
    return datasets(model, dict(fit), dict([held]), length)["x"]


def found(*lengths: float) -> AxisDiagnosis:
    dataset = prepared(LONG)
    base = fit_axis(SLIDE, dataset.training)
    return diagnose_axis(base, dataset, few("cogging"), lengths=lengths)


def test_a_log_at_another_length_is_as_if_it_was_prepared_so() -> None:
    for now, then in zip(prepared(LONG).at_length(SHORT).logs, prepared(SHORT).logs, strict=True):
        assert now.test_function.length == then.test_function.length
        count = min(len(now), len(then))
        for one, other in ((now.command, then.command), (now.acceleration, then.acceleration)):
            np.testing.assert_allclose(one[:count], other[:count], atol=1e-9 * np.abs(other).max())


@pytest.mark.slow
def test_what_a_long_test_function_averages_away_is_found_by_a_short_one() -> None:
    assert "cogging" not in found().named
    told = found(SHORT)
    assert told.named == ("cogging",)
    assert told.dataset.test_function_length == pytest.approx(SHORT)


def test_what_a_longer_test_function_leaves_more_of_is_asked_of_no_force() -> None:
    """The load that a friction bears is averaged too, and is told badly by long ones."""
    loaded = having(SLIDE, "load_dependent_friction", motor=0.05)
    logs = {f"run{i}": logged(loaded, Ride(40 + i, 8.0), noise=0.01) for i in range(3)}
    *fit, held = logs.items()
    model = MachineModel("m", {"x": SLIDE}, RATE)
    dataset = datasets(model, dict(fit), dict([held]), SHORT)["x"]
    base, asked = fit_axis(SLIDE, dataset.training), set[str]()
    catalogue = few("load_dependent_friction", "spring", "cogging")
    told = diagnose_axis(base, dataset, catalogue, lambda what, *_: asked.add(what), (LONG,))
    assert told.named == ("load_dependent_friction",)
    at_long = fit_axis(told.final.axis, told.dataset.at_length(LONG).training)
    assert at_long.ratio > 3.0 > at_long.error / told.final.error
    assert not any("200 ms" in what for what in asked)
