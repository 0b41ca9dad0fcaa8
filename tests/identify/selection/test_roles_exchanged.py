"""What only the choice of the logs' roles decides is told, whichever log chooses."""

from __future__ import annotations

import pytest
from planted_logs import SLIDE, Ride, begun, few, having, logged

from identify.selection.diagnosis import AxisDiagnosis, diagnose_axis

KNOWN = few("cogging", "spring", "quadratic_drag")


def diagnosed(size: float, ride: Ride, noise: float = 0.05) -> AxisDiagnosis:
    """A cogging of so many N, fitted to a good log and judged by a short one with more noise."""
    true = having(SLIDE, "cogging", p=0.021, a1=size, b1=0.0)
    good, poor = logged(true, Ride(1)), logged(true, ride, noise=noise)
    return diagnose_axis(*begun(SLIDE, {"good": good}, {"poor": poor}), KNOWN)


@pytest.mark.parametrize(
    ("size", "ride", "named"), [(0.006, Ride(2, 2.0), True), (0.012, Ride(4, 2.0), False)]
)
def test_a_law_that_one_log_alone_proves_is_told_to_depend_on_which_log_chooses(
    size: float, ride: Ride, named: bool
) -> None:
    found = diagnosed(size, ride)
    assert found.named == (("cogging",) if named else ())
    (law,) = found.by_roles
    assert (law.effect, law.named) == ("cogging", named)


def test_of_a_law_that_both_logs_prove_nothing_of_the_kind_is_told() -> None:
    found = diagnosed(0.1, Ride(2))
    assert found.named == ("cogging",)
    assert not found.by_roles
