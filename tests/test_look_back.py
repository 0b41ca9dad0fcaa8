"""Whether an earlier choice is still needed, once more has been added."""

from types import SimpleNamespace

from machines import one_axis

from identify.diagnose import _looked_back
from identify.fit import fit_axis
from identify.study import studies
from twin.effects import load_catalogue
from twin.experiments import simulate
from twin.model import Fitted
from twin.model_file import load_model

CATALOGUE = load_catalogue()
STAGE = one_axis(load_model("proton_xy", CATALOGUE))


def test_a_friction_that_another_one_replaced_is_dropped():
    study = studies(STAGE, {"log": simulate(STAGE, "tracking", seed=1, duration=5.0)}, {})["x"]
    base = fit_axis(STAGE.axes["x"], study.fit)
    richer = fit_axis(base.axis.with_effect(Fitted.at_start(CATALOGUE["gms"])), study.fit)
    earlier = [SimpleNamespace(effect=CATALOGUE["stribeck"])]
    fit, dropped = _looked_back(base, richer, study, earlier)
    assert dropped == ("stribeck",)
    assert fit is richer
