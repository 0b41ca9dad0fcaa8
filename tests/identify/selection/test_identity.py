"""Whether a law that was found is itself: its exponent, its values at a bound."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from built_fits import CATALOGUE
from planted_logs import SLIDE, Ride, asked, few, having

from identify import diagnose
from identify.selection.diagnosis import AxisDiagnosis
from identify.selection.findings import FindingKind
from twin import load_model, simulate
from twin.model.machine import MachineModel

RIDE = Ride(3, 5.0)


def with_drag(power: float, size: float) -> AxisDiagnosis:
    """A machine with a drag of a power of the speed, size: N at 0.3 m/s."""

    def drag(x: np.ndarray, v: np.ndarray) -> np.ndarray:
        return -size * np.sign(v) * np.abs(v / 0.3) ** power

    return asked(SLIDE, SLIDE, few("quadratic_drag", "wear", "cogging"), drag, RIDE)


@pytest.mark.parametrize("size", [0.02, pytest.param(0.2, marks=pytest.mark.slow)])
def test_a_drag_of_another_power_is_told_as_such_even_where_the_law_reaches_the_noise(size):
    (finding,) = with_drag(3.0, size).findings
    assert (finding.effect, finding.kind) == ("quadratic_drag", FindingKind.RESEMBLES)
    assert finding.bend is not None
    assert finding.bend.found == pytest.approx(3.0, rel=0.2)
    (true,) = with_drag(2.0, size).findings
    assert (true.effect, true.kind, true.bend) == ("quadratic_drag", FindingKind.MISSING, None)


def test_a_hard_current_limit_is_named_with_all_of_the_force_above_it_lost():
    stage = load_model("proton_xy", CATALOGUE)
    stage = MachineModel(stage.name, {"x": stage.axes["x"]}, stage.sample_rate)
    log = partial(simulate, experiment="tracking", duration=4.0)
    most = np.abs(log(stage, seed=1).axes["x"].force).max()
    limited = stage.with_axis(
        "x", having(stage.axes["x"], "actuator_saturation", limit=0.8 * most, loss=1.0)
    )
    one, two = (log(limited, seed=i) for i in (1, 2))
    found = diagnose(stage, one, two, catalogue=few("actuator_saturation", "wear", "cogging"))
    (finding,) = found.leading.findings
    assert finding.effect == "actuator_saturation"
    assert finding.parameters["loss"] == pytest.approx(1.0, abs=0.1)
    assert finding.parameters["limit"] == pytest.approx(0.8 * most, rel=0.02)


def test_an_effect_stands_without_a_strength_that_ended_at_its_bound():
    """Viscous friction that differs by more than the law allows, beside dry friction that does."""

    def beside(x: np.ndarray, v: np.ndarray) -> np.ndarray:
        return -0.15 * (v != 0.0) - 1.2 * 0.53 * np.abs(v)

    found = asked(SLIDE, SLIDE, few("asymmetric_friction", "wear", "cogging"), beside, RIDE)
    assert found.named == ("asymmetric_friction",)
    assert found.findings[0].parameters["viscous"] == 0.0
    assert found.findings[0].parameters["coulomb"] > 0.3
