"""What a model lacks is the same whichever log is given to fit and which to choose."""

from __future__ import annotations

import pytest
from planted_logs import SLIDE, Ride, begun, few, having, logged

from identify.selection.diagnosis import AxisDiagnosis, diagnose_axis

KNOWN = few("cogging", "spring", "quadratic_drag")


def diagnosed(size: float, ride: Ride, *, exchanged: bool) -> AxisDiagnosis:
    """A cogging of so many N, of a good log and a short one with more noise in both roles."""
    true = having(SLIDE, "cogging", p=0.021, a1=size, b1=0.0)
    good, poor = {"good": logged(true, Ride(1))}, {"poor": logged(true, ride, noise=0.05)}
    roles = (poor, good) if exchanged else (good, poor)
    return diagnose_axis(*begun(SLIDE, *roles), KNOWN)


@pytest.mark.parametrize(
    ("size", "ride"), [(0.006, Ride(2, 2.0)), (0.012, Ride(4, 2.0)), (0.1, Ride(2))]
)
def test_the_answer_is_the_same_with_the_roles_exchanged(size: float, ride: Ride) -> None:
    one, other = (diagnosed(size, ride, exchanged=way) for way in (False, True))
    assert one.named == other.named
    for here, there in zip(one.findings, other.findings, strict=True):
        assert here.score.t == pytest.approx(there.score.t, rel=0.01)
        assert here.score.part == pytest.approx(there.score.part, rel=0.01)
