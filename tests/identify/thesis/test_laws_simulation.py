"""The simulation study against closed forms: a trial, the sensitivities, how results are put in."""

from __future__ import annotations

from dataclasses import astuple, replace
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import CATALOGUE

from identify.estimation.stribeck_curve import StribeckCurve
from identify.estimation.velocity_map import VelocityMap
from identify.thesis import cable, dynamic, simulation, track
from identify.thesis.residuals import friction_of
from twin.model.file import load_model

STUDY = load_model("thesis_simulation", CATALOGUE)
NAMES = ("Fc", "Fs", "v0", "sigma2")
CURVE = StribeckCurve(0.285, 0.335, 0.01, 0.018)
SPEEDS = np.array([0.001, 0.003, 0.006, 0.01, 0.015, 0.03, 0.06, 0.1, 0.2])


def map_of(ahead: StribeckCurve, back: StribeckCurve, samples: float = 100.0) -> VelocityMap:
    friction = np.r_[ahead(SPEEDS), back(SPEEDS)]
    return VelocityMap(
        np.r_[SPEEDS, -SPEEDS], friction, 0.0 * friction, np.full(len(friction), samples)
    )


@pytest.mark.parametrize("noise", [0.0, 0.2])
def test_a_trial_averages_both_directions_under_the_noise_of_a_plateau(monkeypatch, noise):
    """White noise of a part of the friction, averaged over 100 samples, is a tenth of it."""
    seen = {}

    class Fit:
        def __init__(self, *where):
            seen["where"] = [c.label for c in where]

        def fit(self, axis, logs, static, rng):
            seen.update(axis=axis, logs=logs, static=static)
            return axis.with_effect(replace(friction_of(axis), values={
                **friction_of(axis).values, "sigma0": 271.0, "sigma1": 0.7}))  # fmt: skip

    monkeypatch.setattr(simulation, "Presliding", Fit)
    monkeypatch.setattr(simulation, "_prepared", lambda model, name, signals: signals)
    clean = SimpleNamespace(noisy=lambda part, rng: ("noisy", part))
    double = replace(CURVE, Fc=0.485, Fs=0.535)
    rng = SimpleNamespace(standard_normal=np.ones)
    found = simulation._trial(
        STUDY, "x", friction_of(STUDY.axes["x"]), map_of(CURVE, double), clean, noise, rng
    )
    more = 1.0 + noise / 10.0
    expected = [0.385 * more, 0.435 * more, 0.01, 0.018 * more, 271.0, 0.7]
    assert found == pytest.approx(expected, rel=1e-5)
    assert seen["where"] == ["lugre.sigma0", "lugre.sigma1"]
    assert seen["static"] == pytest.approx(expected[1], rel=1e-5)
    assert seen["logs"] == ("noisy", noise)
    values = friction_of(seen["axis"]).values
    assert [values[n] for n in NAMES] == pytest.approx(expected[:4], rel=1e-5)


def test_sensitivity_is_of_one_parameter_off_by_a_factor_on_its_own_record(monkeypatch):
    friction = friction_of(STUDY.axes["x"])
    monkeypatch.setattr(
        simulation,
        "residual",
        lambda axis, logs: np.array(
            [friction_of(axis).values["sigma0"] + 3.0 * friction_of(axis).values["sigma1"]]
        ),
    )
    found = simulation._sensitivity(
        STUDY.axes["x"], friction, map_of(CURVE, CURVE), CURVE, ()
    )  # fmt: skip
    factors = found.factors
    np.testing.assert_allclose(factors[[0, 20, -1]], [0.5, 1.0, 1.5])
    both = np.r_[SPEEDS, SPEEDS]
    np.testing.assert_allclose(
        found.force["sigma2"],
        np.abs(factors - 1.0) * 0.018 * np.sqrt(np.mean(both**2)), atol=1e-12,
    )  # fmt: skip
    fall = np.exp(-((both / 0.01) ** 2))
    np.testing.assert_allclose(
        found.force["Fs"], np.abs(factors - 1.0) * 0.335 * np.sqrt(np.mean(fall**2)), atol=1e-12
    )
    np.testing.assert_allclose(found.force["sigma0"], factors * 260.0 + 1.8)
    np.testing.assert_allclose(found.force["sigma1"], 260.0 + factors * 1.8)


def test_each_noise_is_tried_as_often_and_what_is_found_stands_under_its_name(monkeypatch):
    trials = []

    def trial(model, name, friction, found, clean, noise, rng):
        trials.append(noise)
        return [len(trials) + 0.1 * i for i in range(6)]

    n = np.arange(5.0)
    log = SimpleNamespace(
        axes={"x": SimpleNamespace(position=n, force=2 * n)}, truth={"x": {"lugre": 3 * n}}
    )
    monkeypatch.setattr(simulation, "_map", lambda *_: map_of(CURVE, CURVE))
    monkeypatch.setattr(simulation, "simulate", lambda model, kind, **_: log)
    monkeypatch.setattr(simulation, "_trial", trial)
    monkeypatch.setattr(simulation, "_prepared", lambda model, name, signals: signals)
    monkeypatch.setattr(simulation, "_sensitivity", lambda *given: given[3:])
    size = replace(simulation.SMALL, trials=2, snr=(60.0, 20.0))
    found = simulation.run([STUDY], CATALOGUE, size, np.random.default_rng(0), lambda *_: None)
    assert trials == pytest.approx([1e-3, 1e-3, 0.1, 0.1])
    assert (found.snr, found.trials) == (60.0, 2)
    values = friction_of(STUDY.axes["x"]).values
    for i, (name, r) in enumerate(found.by_snr[20.0].items()):
        np.testing.assert_allclose(r.values, [3 + 0.1 * i, 4 + 0.1 * i])
        assert r.true == values[name]
    assert list(found.parameters) == [*NAMES, "sigma0", "sigma1"]
    assert astuple(found.true)[:4] == tuple(values[n] for n in NAMES)
    true, signals = found.sensitivity
    assert true is found.true
    np.testing.assert_array_equal(signals, (n, 2 * n))  # without noise


def test_a_whole_study_has_the_sizes_of_the_thesis():
    """100 trials at 80 dB, 50 speeds, 20 reversals; 10 passes; nine places; sines of 30 s."""
    study = simulation.FULL
    assert (study.trials, study.snr[0], len(study.speeds), study.repeats) == (100, 80.0, 50, 20)
    assert (min(study.speeds), max(study.speeds), study.span) == (0.001, 0.41, 0.2)
    assert len(set(study.speeds)) == 50
    assert cable.FULL.repeats == 10
    assert (cable.SPEED, cable.SPAN) == (0.1, 0.3)
    assert (track.FULL.places, dynamic.FULL.places, dynamic.FULL.duration) == (9, 9, 30.0)
    assert (dynamic.AMPLITUDE, dynamic.PERIOD) == (0.21, 3.0)
    assert (track.FIRST, track.APART, track.SPAN) == (-0.136, 0.034, 0.01)
