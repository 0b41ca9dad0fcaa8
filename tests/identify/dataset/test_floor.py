"""The noise floor told before a fit, against what the true model leaves, and its parts."""

import numpy as np
import pytest
from machines import one_axis

from benchmarks.second_simulator.machine import drawn, run
from identify import workflow
from identify.dataset.noise_floor import noise_beside
from identify.dataset.spectrum import fitted_levels
from twin.effects import load_catalogue
from twin.model.file import load_model
from twin.model.machine import Fitted

CATALOGUE = load_catalogue()
STAGE = one_axis(load_model("proton_xy", CATALOGUE))
# log's rate Hz of a control at 10 kHz, encoder's resolution m and noise m, current's noise A
DRIVES = {
    "white": (10e3, 0.0, 5e-8, 2e-3),
    "rounded": (10e3, 5e-7, 5e-8, 2e-3),
    "every 2nd": (5e3, 0.0, 1e-7, 2e-4),
    "every 5th": (2e3, 0.0, 1e-7, 2e-3),
    "every 5th, rounded": (2e3, 5e-7, 1e-7, 2e-3),
    "every 5th, rounded, current known well": (2e3, 5e-7, 1e-7, 0.0),
    "every 10th": (1e3, 0.0, 1e-7, 2e-3),
}
QUICK = ("white", "rounded", "every 5th, rounded", "every 10th")


def log_of(name, seed=2, duration=8.0):
    rate, resolution, encoder, current = DRIVES[name]
    machine = drawn(
        np.random.default_rng(seed), 10e3, rate,
        resolution=resolution, encoder_noise=encoder, current_noise=current,
    )  # fmt: skip
    return run(machine, seed, duration)


@pytest.mark.parametrize("length", [0.1, pytest.param(0.2, marks=pytest.mark.slow)])
@pytest.mark.parametrize(
    "drive",
    [n if n in QUICK else pytest.param(n, marks=pytest.mark.slow) for n in DRIVES],
)
def test_the_floor_is_what_the_true_model_leaves(drive, length):
    fit = workflow.fit(STAGE, {"log": log_of(drive)}, test_function=length).fits["x"]
    floor = noise_beside(fit.axis, fit.logs)
    assert 0.8 * floor.low < fit.error < floor.high
    if length == 0.1 and "known" not in drive:  # else less is sure of so short a log
        assert floor.value == pytest.approx(fit.error, rel=0.2)
    assert fit.floor == fit.noise.value
    assert 0.8 * fit.error < fit.floor <= fit.error * (1.0 + 1e-9)
    assert sum(part**2 for part in floor.parts.values()) == pytest.approx(floor.value**2)
    thinned = floor.parts["aliasing"] > 0.8 * floor.value
    assert thinned is drive.startswith("every")
    assert floor.follows_motion is thinned
    if not thinned:
        assert floor.parts["aliasing"] == 0.0


def test_steps_of_the_readings_are_a_part_where_the_axis_has_them():
    machine = drawn(np.random.default_rng(3), 10e3, resolution=5e-7, encoder_noise=0.0)
    fit = workflow.fit(STAGE, {"log": run(machine, 3, 8.0)}, test_function=0.1).fits["x"]
    steps = Fitted.at_start(CATALOGUE["encoder_quantization"], {"step": 5e-7})
    blind = noise_beside(fit.axis, fit.logs)
    knowing = noise_beside(fit.axis.with_effect(steps), fit.logs)
    assert blind.parts["rounding"] == 0.0
    assert knowing.parts["rounding"] > 0.5 * blind.value
    assert blind.high > knowing.value


def test_the_coherence_of_a_dip_is_found_and_independent_noises_have_none():
    turn = np.linspace(0.05, 1.4, 200)
    white, bend = np.cos(0.5 * turn) ** 2, 1e3 * (2.0 - 2.0 * np.cos(turn)) ** 2
    chance = np.random.default_rng(1).gamma(60.0, 1.0 / 60.0, len(turn))
    for coherence in (0.0, 0.7, 0.9):
        both = 0.7 * white + 0.02 * bend
        both -= 2.0 * coherence * np.sqrt(0.7 * white * 0.02 * bend)
        shapes = np.stack([white, bend, -np.sqrt(white * bend)], axis=1)
        level, reading, dip = fitted_levels(shapes, both * chance)
        assert 0.5 * dip / np.sqrt(level * reading) == pytest.approx(coherence, abs=0.15)
        if coherence:
            assert level == pytest.approx(0.7, rel=0.3)
