"""The noise floor of drives with encoders of any kind, against the noise that was put in."""

import numpy as np
import pytest

from benchmarks.second_simulator.machine import FORCE_CONSTANT, drawn, run
from identify import workflow
from identify.dataset.dataset import datasets
from identify.dataset.noise_floor import noise_of
from identify.dataset.time_scale import choose_test_function
from twin.effects import load_catalogue
from twin.model.file import load_model

NOMINAL = load_model("proton_xy", load_catalogue())
# rate Hz, encoder's resolution m and noise m, current's noise A
DRIVES = {
    "fine": (10e3, 1e-9, 1e-9, 2e-4),
    "coarse": (2e3, 5e-7, 5e-8, 2e-3),
    "coarse and slow": (1e3, 6e-7, 6e-8, 2e-3),
    "coarse, current known well": (2e3, 1e-6, 1e-7, 2e-4),
    "noisy": (2e3, 0.0, 5e-7, 4e-4),
    "noisy and fast": (10e3, 0.0, 5e-7, 2e-3),
}


@pytest.mark.parametrize("drive", DRIVES)
@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow)])
def test_the_force_noise_that_was_put_in_is_found(drive, seed):
    rate, resolution, encoder, current = DRIVES[drive]
    rng = np.random.default_rng(seed)
    machine = drawn(rng, rate, resolution=resolution, encoder_noise=encoder, current_noise=current)
    fit = workflow.fit(NOMINAL, {"log": run(machine, seed, 6.0)}).fits["x"]
    planted = 2.0 / rate * (FORCE_CONSTANT * current) ** 2  # N^2/Hz
    found = noise_of(fit.axis, fit.logs[0].motion).force
    assert 0.5 * planted < found < 2.0 * planted


def test_the_window_chosen_suits_the_held_out_logs_too():
    """Their blocks are longer where they are slower and the encoder is coarse."""
    coarse = drawn(np.random.default_rng(4), 2e3, resolution=1e-7, current_noise=1e-4)
    fast = run(coarse, 4, 6.0)
    coarse.motion["fastest"] = 0.02
    slow = run(coarse, 4, 6.0)
    dataset = datasets(NOMINAL, {"fast": fast}, {"slow": slow})["x"]
    own, other = (log.motion for log in (*dataset.fit, *dataset.holdout))
    assert other.period > own.period
    assert dataset.test_function_length > choose_test_function([own])
