"""Long logs are searched by their beginnings, and what is told is of the whole of them."""

from __future__ import annotations

import numpy as np
import pytest
from planted_logs import SLIDE, Array, Ride, begun, few, having, logged

from identify.dataset.dataset import ENOUGH
from identify.selection.diagnosis import AxisDiagnosis, diagnose_axis

LONG = 1.6 * ENOUGH  # s
KNOWN = few("cogging", "spring", "thermal_drift")


def diagnosed(size: float, beside=None) -> AxisDiagnosis:
    true = having(SLIDE, "cogging", p=0.021, a1=size, b1=0.0)
    fitted, held = (logged(true, Ride(seed, LONG), beside) for seed in (1, 2))
    return diagnose_axis(*begun(SLIDE, {"fitted": fitted}, {"held": held}), KNOWN)


def test_what_the_beginnings_show_is_fitted_to_the_whole_of_long_logs() -> None:
    found = diagnosed(0.05)
    assert found.in_part
    assert found.named == ("cogging",)
    own = found.final.axis["cogging"].values
    assert np.hypot(own["a1"], own["b1"]) == pytest.approx(0.05, rel=0.03)
    (log,) = found.final.logs
    assert log.motion.time[-1] > 0.98 * LONG
    assert found.final.ratio < 1.4
    assert found.base.error > 3.0 * found.final.error
    assert found.tested.before == pytest.approx(found.base.error, rel=0.1)
    (row,) = (c for c in found.ranking if c.effect.name == "cogging")
    assert row.fit is found.final
    assert row.gain.after == pytest.approx(found.tested.after, rel=1e-6)
    others = [c.gain.before for c in found.ranking]
    assert others == pytest.approx([row.gain.before] * len(others))


@pytest.mark.slow  # 3 s
def test_what_begins_behind_the_beginnings_is_told_of_the_whole_of_long_logs() -> None:
    def later(x: Array, v: Array) -> Array:
        return 5.0 * x * (np.arange(len(x)) > 0.6 * len(x))

    found = diagnosed(0.05, later)
    assert "cogging" in found.named
    assert found.final.ratio > 10.0
    assert found.unexplained is not None
    assert found.unexplained.depends_on == "time"


@pytest.mark.slow  # 3 s
def test_a_rival_that_the_beginnings_leave_level_is_refused_by_the_whole_of_long_logs() -> None:
    true = having(SLIDE, "stribeck", Fc=0.31, Fs=0.5, v0=0.02, sigma2=0.53)
    fitted, held = (logged(true, Ride(seed, LONG)) for seed in (1, 2))
    known = few("stribeck", "lugre")
    found = diagnose_axis(*begun(SLIDE, {"fitted": fitted}, {"held": held}), known)
    assert found.in_part
    assert (found.named, found.ambiguous_with) == (("stribeck",), ())
    assert {"stribeck", "lugre"} <= {c.effect.name for c in found.ranking}
