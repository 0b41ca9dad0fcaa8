"""The product's own path on the ARTS damper: imposed motion, measured force; import, diagnose, add.

D. Coble, P. Huggins, L. Cao, J. Ricles, A. Downey, "Dataset-Friction-Damper-with-Backlash", 2022.
"""

import time

import numpy as np
import pytest
from machines import CATALOGUE
from scipy.optimize import least_squares

from identify.adding import add
from identify.dataset.dataset import Role
from identify.estimation.errors import error_in
from identify.selection.diagnosis import Verdict
from identify.workflow import diagnose
from twin.importers import import_log, load_mapping
from twin.model.file import load_model

pytestmark = pytest.mark.slow

TRAINING, TEST = ("0.25Hz", "0.5Hz"), "1Hz"
HYSTERETIC = {
    "dahl", "lugre", "leuven", "modified_leuven", "gms", "cable_hysteresis",
    "presliding_hysteresis",
}  # fmt: skip
MOST_CPU = 60.0  # s of the whole diagnosis
MAP = """
time = {column = "data[1]", unit = "s"}
[axes.x]
position = {column = "data[2]", unit = "in"}
force = {column = "data[3]", unit = "kip"}
"""
MODEL = """
name = "damper"
sample_rate = 1024.0
[axes.x]
mass = 0.0 # kg: the motion is imposed
[axes.x.effects.coulomb_viscous]
Fc = 1000.0
Fs = 1000.0
[axes.x.effects.constant_force]
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("arts")
    (folder / "map.toml").write_text(MAP)
    (folder / "damper.toml").write_text(MODEL)
    return folder


@pytest.fixture(scope="module")
def logs(shared_data, folder):
    mapping = load_mapping(folder / "map.toml")

    def imported(name):
        return import_log(shared_data / "arts" / f"{name}30lbtension1amplitude.json", mapping)

    return {name: imported(name) for name in TRAINING}, {TEST: imported(TEST)}


@pytest.fixture(scope="module")
def model(folder):
    return load_model(folder / "damper.toml", CATALOGUE)


def own_dahl(prepared, values):
    """Residual (n,) N of Dahl's friction, viscous and constant, averaged by the test functions."""
    level, stiffness, viscous, constant = np.exp(values[0]), np.exp(values[1]), *values[2:]
    out = []
    for log in prepared:
        velocity, force = log.motion.raw
        step = velocity * log.motion.sample_period
        left, state, mean = np.exp(-stiffness / level * np.abs(step)), 0.0, np.empty(len(step))
        towards = np.copysign(level, step)
        for i, to in enumerate(towards):
            after = to + (state - to) * left[i]
            mean[i], state = 0.5 * (state + after), after
        out.append(log.fine.mean(force - mean - viscous * velocity - constant))
    return np.concatenate(out)


@pytest.mark.parametrize("test_function", [None, 0.2], ids=["chosen", "0.2 s"])
def test_a_friction_that_yields_is_named_and_explains_what_it_can(model, logs, test_function):
    begun = time.process_time()
    found = diagnose(model, *logs, catalogue=CATALOGUE, test_function=test_function)
    assert time.process_time() - begun < MOST_CPU
    answer = found.leading
    assert answer.verdict is Verdict.MISSING_EFFECTS
    assert answer.named
    assert set(answer.answers[0]) <= HYSTERETIC
    assert not found.comparison.axes["x"].position_error

    added = add(CATALOGUE["dahl"], found.fitted, *logs, test_function=test_function)
    assert added.kept
    dataset = answer.dataset
    start = np.array([np.log(1e4), np.log(2e6), 0.0, 0.0])
    own = least_squares(lambda p: own_dahl(dataset.training, p), start, x_scale=[1, 1, 1e3, 1e2]).x
    reference = np.sqrt(np.mean(own_dahl(dataset.selection, own) ** 2))
    assert added.step.holdout_error_after < 1.05 * reference
    assert (
        error_in(Role.SELECTION, answer.base, dataset) > 4.0 * reference
    )  # Coulomb, viscous and constant
