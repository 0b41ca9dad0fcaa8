"""Laws of any machine come back with their values, on the axis that each is offered to."""

import pytest
from effect_runs import CATALOGUE

from identify.dataset.preparation import datasets
from identify.estimation.fit import fit_axis
from identify.estimation.variable_projection import absent_effects
from identify.selection.trying import try_effect
from twin.experiments.named import simulate
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel
from twin.simulator import ReducedSimulator

STAGE = Hardware(travel=(-0.17, 0.17), encoder_noise=1e-9, current_noise=2e-4, jerk=100.0)
JOINT = Hardware(
    travel=(-1.7, 1.7), encoder_noise=1e-8, current_noise=2e-4, velocity=2.5, acceleration=20.0,
    jerk=1000.0,
)  # fmt: skip
SLIDES = Fitted.at_start(CATALOGUE["coulomb_viscous"], {"Fc": 0.3, "Fs": 0.3, "sigma2": 0.5})
FREE = AxisModel(15.0, STAGE)
RUBS = AxisModel(15.0, STAGE, (SLIDES,))
TURNS = AxisModel(0.4, JOINT, (SLIDES,), rotary=True)
PLANTED = {
    "viscous_friction": (FREE, {"c": 1.7}),
    "spring": (RUBS, {"middle": 0.0, "offset": 0.3, "k1": 4.0, "k2": -9.0, "k3": 150.0}),
    "presliding_hysteresis": (RUBS, {"reach": 0.006, "f0": 0.2, "f1": 0.1, "f2": 0.1, "f3": 0.05}),
    "gravity": (TURNS, {"sine": 1.3, "cosine": -0.4}),
}


@pytest.mark.parametrize("name", PLANTED)
def test_a_law_of_any_machine_is_found_with_its_values(name: str) -> None:
    axis, values = PLANTED[name]
    effect = CATALOGUE[name]
    true = MachineModel("m", {"x": axis.with_effect(Fitted.at_start(effect, values))}, 2000.0)
    log = simulate(true, "tracking", seed=3, duration=6.0, simulator=ReducedSimulator)
    dataset = datasets(true.with_axis("x", axis), {"log": log}, {})["x"]
    base = fit_axis(axis, dataset.fit)
    assert effect in absent_effects(axis, CATALOGUE)
    found = try_effect(base, dataset, effect)
    assert found.supported
    assert found.fit.ratio < 1.5 < base.ratio
    for key, value in values.items():
        assert found.fit.axis[name].values[key] == pytest.approx(value, rel=0.05, abs=0.02)
