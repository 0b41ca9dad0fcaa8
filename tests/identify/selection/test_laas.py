"""Cogging named on the LAAS measurements, from the files as they were published.

H. Andrade, laas_anti_cogging, public repository, BSD 3-Clause. A motor of 12 slots and 14 poles:
its cogging has 12, 18, 24, ..., 72 periods a turn, no three of which are harmonics of one pitch.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from machines import CATALOGUE

from identify.estimation.evidence import rms
from identify.estimation.least_squares import orthonormal, unabsorbed
from identify.workflow import diagnose, fit
from twin.effects import Catalogue
from twin.importers import import_log, load_mapping
from twin.model.file import load_model

EXAMPLES = Path(__file__).parents[3] / "examples"
# What else could repeat, and what a motor may have.
RIVALS = Catalogue(
    CATALOGUE[n]
    for n in (
        "cogging", "varying_inertia", "force_constant_ripple", "periodic_disturbance",
        "quadratic_drag", "asymmetric_friction", "actuator_lag", "roller_spikes",
    )
)  # fmt: skip
A_TURN = (12, 18, 24, 36, 54, 60, 72, 144)


@pytest.fixture(scope="module")
def logs(shared_data):
    mapping = load_mapping(EXAMPLES / "import_laas.toml")
    return {
        name: import_log(shared_data / "laas" / f"{name}.txt", mapping)
        for name in ("speed_test", "acc_current")
    }


@pytest.fixture(scope="module")
def found(logs):
    model = load_model(EXAMPLES / "laas.toml", CATALOGUE)
    speed = {"speed_test": logs["speed_test"]}
    return diagnose(model, speed, catalogue=RIVALS).axes["motor"]


def test_the_drives_velocity_tells_the_inertia(logs):
    model = load_model(EXAMPLES / "laas.toml", CATALOGUE)
    found = fit(model, {"acc": logs["acc_current"]}).fits["motor"]
    # Published fits of these data: 4.8e-6 kg m^2, Coulomb friction 2.0 mN m.
    assert found.axis.mass == pytest.approx(4.8e-6, rel=0.02)
    assert found.axis["coulomb_viscous"].values["Fc"] == pytest.approx(2.0e-3, rel=0.15)
    assert found.ratio < 2.0


@pytest.mark.slow
def test_cogging_is_named_and_nothing_else(found):
    assert found.named
    assert {name.split("_")[0] for name in found.named} == {"cogging"}


@pytest.mark.slow
def test_it_leaves_as_little_as_least_squares_of_eight_harmonics(found):
    last = found.final
    (log,) = last.logs
    at = log.motion.position
    waves = [log.test_function.mean(g(n * at))[last.kept] for n in A_TURN for g in (np.sin, np.cos)]
    base = found.base
    columns = np.column_stack([base.jacobian, *waves])
    least = rms(unabsorbed(base.residual, orthonormal(columns)))
    assert last.error < 1.1 * least
