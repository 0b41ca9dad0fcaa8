"""The published identification of the EMPS drive, reproduced to the printed digit.

A. Janot, M. Gautier, M. Brunot, "Data Set and Reference Models of EMPS", Workshop on Nonlinear
System Identification Benchmarks, 2019. The measurements are the authors' and stay outside the
repository; without them these tests skip.
"""

from pathlib import Path

import pytest
from emps_published import (
    Estimate,
    Motion,
    direction_dependent,
    identify,
    load,
    prediction_error,
    symmetric,
)

SYMMETRIC = ["95.1089", "203.5034", "20.3935", "-3.1648"]  # M, Fv, Fc, offset
DIRECTION_DEPENDENT = [
    "95.1540",
    "166.7061",
    "20.1440",
    "240.4236",
    "20.6277",
]  # M, Fv+ Fc+ Fv- Fc-


@pytest.fixture(scope="module")
def run(shared_data: Path) -> Motion:
    return load(shared_data / "emps" / "DATA_EMPS.mat")


@pytest.fixture(scope="module")
def pulses_run(shared_data: Path) -> Motion:
    return load(shared_data / "emps" / "DATA_EMPS_PULSES.mat")


def printed(estimate: Estimate) -> list[str]:
    return [f"{value:.4f}" for value in estimate.parameters]


def percent(ratio: float) -> str:
    return f"{100 * ratio:.4f} %"


def test_symmetric_friction(run: Motion) -> None:
    estimate = identify(run, symmetric)
    assert printed(estimate) == SYMMETRIC
    assert percent(estimate.relative_error) == "4.0834 %"


def test_direction_dependent_friction(run: Motion) -> None:
    estimate = identify(run, direction_dependent)
    assert printed(estimate) == DIRECTION_DEPENDENT
    assert percent(estimate.relative_error) == "3.1117 %"


def test_symmetric_friction_predicts_the_pulses_run(run: Motion, pulses_run: Motion) -> None:
    parameters = identify(run, symmetric).parameters
    assert percent(prediction_error(pulses_run, symmetric, parameters)) == "5.9824 %"


def test_direction_dependent_friction_predicts_the_pulses_run_better(
    run: Motion, pulses_run: Motion
) -> None:
    before, after = (
        prediction_error(pulses_run, model, identify(run, model).parameters)
        for model in (symmetric, direction_dependent)
    )
    assert after < 0.9 * before
