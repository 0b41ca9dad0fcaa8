"""Whether an earlier choice is still needed, once more has been added."""

from types import SimpleNamespace

from machines import one_axis

from identify.dataset.dataset import datasets
from identify.estimation.fit import fit_axis
from identify.selection.forward_selection import _eliminated_backwards
from twin.effects import load_catalogue
from twin.experiments.named import simulate
from twin.model.file import load_model
from twin.model.machine import Fitted

CATALOGUE = load_catalogue()
STAGE = one_axis(load_model("proton_xy", CATALOGUE))


def test_a_friction_that_another_one_replaced_is_dropped():
    dataset = datasets(STAGE, {"log": simulate(STAGE, "tracking", seed=1, duration=5.0)}, {})["x"]
    base = fit_axis(STAGE.axes["x"], dataset.fit)
    richer = fit_axis(base.axis.with_effect(Fitted.at_start(CATALOGUE["gms"])), dataset.fit)
    earlier = [SimpleNamespace(effect=CATALOGUE["stribeck"])]
    fit, dropped = _eliminated_backwards(base, richer, dataset, earlier)
    assert dropped == ("stribeck",)
    assert fit is richer
