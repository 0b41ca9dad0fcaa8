"""The published identification of the EMPS drive, reproduced to the printed digit.

A. Janot, M. Gautier, M. Brunot, "Data Set and Reference Models of EMPS", Workshop on Nonlinear
System Identification Benchmarks, 2019. The measurements are the authors' and stay outside the
repository; without them these tests skip.
"""

from pathlib import Path

from emps_published import (
    direction_dependent,
    identify,
    load,
    prediction_error,
    symmetric,
)

PUBLISHED = {  # M, Fv, Fc, offset; M, Fv+, Fc+, Fv-, Fc-
    symmetric: (["95.1089", "203.5034", "20.3935", "-3.1648"], "4.0834 %"),
    direction_dependent: (["95.1540", "166.7061", "20.1440", "240.4236", "20.6277"], "3.1117 %"),
}


def percent(ratio: float) -> str:
    return f"{100 * ratio:.4f} %"


def test_values_and_errors_are_those_published(shared_data: Path) -> None:
    run, pulses = (
        load(shared_data / "emps" / f"{n}.mat") for n in ("DATA_EMPS", "DATA_EMPS_PULSES")
    )
    predicted = []
    for model, (values, error) in PUBLISHED.items():
        estimate = identify(run, model)
        assert [f"{value:.4f}" for value in estimate.parameters] == values
        assert percent(estimate.relative_error) == error
        predicted.append(prediction_error(pulses, model, estimate.parameters))
    assert percent(predicted[0]) == "5.9824 %"
    assert predicted[1] < 0.9 * predicted[0]
