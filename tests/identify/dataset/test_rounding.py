"""The encoder's resolution: found in the readings, and the noise that it makes."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from machines import one_axis

from identify.dataset.dataset import Dataset
from identify.dataset.noise import noise_of
from identify.dataset.preparation import datasets
from identify.dataset.prepared_log import PreparedLog
from identify.estimation.fit import fit_axis
from identify.selection.diagnosis import Verdict, diagnose_axis
from twin.effects import Catalogue, load_catalogue
from twin.experiments.named import simulate
from twin.model.file import load_model
from twin.model.machine import Fitted
from twin.simulator import ReducedSimulator

CATALOGUE = load_catalogue()
STAGE = one_axis(load_model("proton_xy", CATALOGUE))
STEP = 2.3e-7  # m
DT = 1e-4  # s


@cache
def dataset_of(step: float) -> Dataset:
    """Two logs and a held-out one of a machine whose encoder has that resolution."""
    axis = STAGE.axes["x"]
    if step:
        effect = CATALOGUE["encoder_quantization"]
        axis = axis.with_effect(Fitted.at_start(effect, {"step": step}))
    machine = replace(STAGE, axes={"x": axis})
    runs = {
        s: simulate(machine, "tracking", seed=s, duration=8.0, simulator=ReducedSimulator)
        for s in (1, 2, 3)
    }
    fit = {f"log {s}": runs[s] for s in (1, 2)}
    return datasets(STAGE, fit, {"log 3": runs[3]})["x"]


@pytest.fixture(scope="module")
def coarse() -> Dataset:
    return dataset_of(STEP)


@pytest.mark.parametrize("step", [0.0, STEP])
def test_the_noise_of_the_force_is_seen_behind_any_rounding(step):
    """What the controller makes of the steps is not noise: it reads them off the same log."""
    hardware = STAGE.axes["x"].hardware
    planted = 2.0 * DT * (hardware.force_constant * hardware.current_noise) ** 2  # N^2/Hz
    for log in dataset_of(step).fit:
        assert log.motion.command_noise == pytest.approx(planted, rel=0.1)
        assert noise_of(STAGE.axes["x"], log.motion).force == pytest.approx(planted, rel=0.25)


FEW = Catalogue(
    CATALOGUE[name] for name in ("encoder_quantization", "encoder_delay", "quadratic_drag")
)


def test_it_is_named_where_it_makes_the_error_noise(coarse):
    found = diagnose_axis(fit_axis(STAGE.axes["x"], coarse.fit), coarse, FEW)
    assert found.named == ("encoder_quantization",)
    assert found.verdict is Verdict.MISSING_EFFECTS
    assert found.best.is_noise
    step = found.final.axis["encoder_quantization"].values["step"]
    assert step == pytest.approx(STEP, rel=1e-3)


@pytest.mark.slow
def test_it_is_named_beside_a_ripple_of_the_encoder(coarse):
    """Rounding is a tone at constant speed; the search for a ripple's period takes its time."""
    near = Catalogue([*FEW.values(), CATALOGUE["encoder_ripple"]])
    found = diagnose_axis(fit_axis(STAGE.axes["x"], coarse.fit), coarse, near)
    assert found.named == ("encoder_quantization",)


def test_it_is_not_named_where_other_noise_is_larger():
    fine = dataset_of(0.0)
    found = diagnose_axis(fit_axis(STAGE.axes["x"], fine.fit), fine, FEW)
    assert found.verdict is Verdict.NOTHING_MISSING


def test_it_is_not_named_for_an_error_it_cannot_make(coarse):
    """The resolution is there, but twice the force error that it could pretend."""
    louder = tuple(_with_more_force(log) for log in coarse.fit)
    dataset = replace(coarse, fit=louder, holdout=tuple(map(_with_more_force, coarse.holdout)))
    found = diagnose_axis(fit_axis(STAGE.axes["x"], louder), dataset, FEW)
    assert "encoder_quantization" not in found.named


def _with_more_force(log: PreparedLog) -> PreparedLog:
    beat = 0.03 * np.sign(np.sin(7.0 * np.sqrt(2.0) * log.motion.time) + 0.3)
    signals = log.motion.signals + np.stack([0.0 * beat, 0.0 * beat, beat])
    samples = log.motion.raw.shape[1] // len(beat)
    raw = log.motion.raw + np.stack([np.zeros(log.motion.raw.shape[1]), np.repeat(beat, samples)])
    return PreparedLog.of(replace(log.motion, signals=signals, raw=raw), log.test_function.length)
