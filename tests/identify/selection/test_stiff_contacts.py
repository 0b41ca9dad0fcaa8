"""An asymmetric friction on a stiff contact is named, whatever imitates its bristle meanwhile."""

from dataclasses import replace

import numpy as np
import pytest
from machines import CATALOGUE

from benchmarks.second_simulator.contacts import DAHL, drawn, log_of
from identify.analysis.first_model import first_model
from identify.workflow import diagnose

# What imitates it while the asymmetry is missing: a free curve of the friction, which was taken as
# the selection logs ask for it; layers beside a dry friction, beside which no asymmetry helps.
IMITATED = {"by a free curve": (0.003, 0.21, 400.0, 1), "by layers": (0.02, 0.29, 0.0, 5),
            "by nothing": (0.003, -0.27, 57.0, 13)}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("imitated", IMITATED)
def test_an_asymmetry_is_named_beside_the_bristle_that_it_bends(imitated):
    noise, asymmetry, weight, seed = IMITATED[imitated]
    rng = np.random.default_rng([5, seed])
    contact = replace(drawn(DAHL, noise, rng), asymmetry=asymmetry, weight=weight)
    training, selection, test = (log_of(contact, rng) for _ in range(3))
    model = first_model({"training": training}, "contact", CATALOGUE)
    found = diagnose(model, training, selection, test, catalogue=CATALOGUE).axes["q"]
    values = found.final.axis["asymmetric_friction"].values
    assert values["coulomb"] == pytest.approx(asymmetry, rel=0.1)
    assert {f.effect for f in found.findings} == {"asymmetric_friction", "dahl"}
    assert all(f.tied in ((), ("lugre",)) for f in found.findings)
    assert found.final.ratio < 1.5
