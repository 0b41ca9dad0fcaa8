"""Each friction model, as the explanation of its own log, comes back with its own values."""

import numpy as np
import pytest
from effect_runs import CATALOGUE

from identify.dataset.dataset import datasets
from identify.estimation.fit import fit_axis
from identify.selection.trying import try_effect
from twin.experiments.named import simulate
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel
from twin.simulator import ReducedSimulator

TRUTH = {
    "Fc": 0.285, "Fs": 0.335, "v0": 0.01, "sigma2": 0.018, "sigma0": 2600.0, "sigma1": 1.0,
    "b": 2.0, "spread": 20.0,
}  # fmt: skip
WANTED = {"stribeck": 0.03, "dahl": 0.03, "leuven": 0.05, "modified_leuven": 0.05, "gms": 0.05}


def machine(name: str) -> MachineModel:
    known = {p.name: TRUTH[p.name] for p in CATALOGUE[name].parameters if p.name in TRUTH}
    hardware = Hardware(travel=(-0.1, 0.1), encoder_noise=1e-9, acceleration=2.0, jerk=100.0)
    axis = AxisModel(15.0, hardware, (Fitted.at_start(CATALOGUE[name], known),))
    return MachineModel("stage", {"x": axis})


@pytest.mark.parametrize("name", WANTED)
def test_a_friction_is_recovered_from_its_own_start_rules(name: str) -> None:
    """In place of Coulomb friction, from a scan over decades of stiffness."""
    true = machine(name)
    log = simulate(true, "tracking", seed=4, duration=8.0, simulator=ReducedSimulator)
    plain = Fitted.at_start(CATALOGUE["coulomb_viscous"])
    model = true.with_axis("x", true.axes["x"].with_effect(plain))
    dataset = datasets(model, {"log": log}, {})["x"]
    base = fit_axis(model.axes["x"], dataset.fit)
    found = try_effect(base, dataset, CATALOGUE[name])
    assert found.delta_bic > 100.0
    assert found.fit.ratio < 1.5 < base.ratio
    values = found.fit.axis[name].values
    for parameter in ("Fc", "Fs", "v0", "sigma0", "spread", "b"):
        if parameter in values:
            wanted = true.axes["x"][name].values[parameter]
            assert values[parameter] == pytest.approx(wanted, rel=WANTED[name]), parameter
    assert np.isfinite(list(values.values())).all()
