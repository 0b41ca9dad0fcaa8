"""A held-out log tests a fit where its logs have been; beyond, a force of position is a guess."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import axis_of, fitted
from constructed import log_of, waves

from identify.dataset.dataset import Dataset
from identify.dataset.preparation import datasets
from identify.dataset.prepared_log import moving
from identify.estimation.alignment import realigned
from identify.estimation.evidence import rms
from identify.estimation.fit import error_on, fit_axis
from identify.output.words.fit import prepared_in_words
from twin.model.machine import MachineModel

RATE, SECONDS = 1000.0, 6.0
MODEL = axis_of(fitted("cable_slab", k1=1.0))


def step_beyond(x):
    """A force (N) where the logs to fit do not go: x > 40 mm."""
    return np.where(x > 0.04, 0.5, 0.0)


def log(centre: float, phase: float, force=step_beyond):
    """Two waves of 30 mm in all about a centre (m), under a mass, friction and a force of place."""
    t = np.arange(round(SECONDS * RATE)) / RATE
    wave = waves((0.02, 0.5, phase), (0.01, 1.3, 2.0 * phase))
    x, h = centre + wave(t), 1e-5
    v = (wave(t + h) - wave(t - h)) / (2.0 * h)
    a = (wave(t + h) - 2.0 * wave(t) + wave(t - h)) / h**2
    noise = 1e-3 * np.random.default_rng(round(1e3 * phase)).standard_normal(len(t))
    return log_of(RATE, x, 5.3 * a + 0.31 * np.sign(v) + 0.53 * v + force(x) + noise)


def dataset_of(*centres: float) -> Dataset:
    fit = {"one": log(0.0, 0.3), "two": log(0.0, 1.1)}
    held = {f"held {i}": log(c, 2.0 + i) for i, c in enumerate(centres)}
    return datasets(MachineModel("m", {"x": MODEL}), fit, held, test_function=0.05)["x"]


def test_what_lies_beyond_the_fit_logs_tests_nothing() -> None:
    inside, beyond = dataset_of(0.0), dataset_of(0.02)
    assert inside.beyond == {}
    errors = [rms(error_on(fit_axis(MODEL, d.fit).axis, d.holdout)) for d in (inside, beyond)]
    assert errors[1] == pytest.approx(errors[0], rel=0.5)  # the step of 0.5 N is not met
    (part,) = beyond.beyond.values()
    (held,) = beyond.holdout
    assert part == pytest.approx(1.0 - np.mean(moving([held], sticks=False)))
    position = held.test_function.mean(held.motion.position)
    assert position[~held.reached].min() > 0.03
    assert 0.2 < part < 0.6
    (told,) = [text for text in prepared_in_words(beyond) if "selection log" in text]
    assert told.startswith(f"held 0: {100 * part:.0f} % of this selection log is left out: it lies")
    tested = replace(beyond, holdout=(), test=beyond.holdout)
    (told,) = [text for text in prepared_in_words(tested) if "no training log has been" in text]
    assert "of this test log is left out" in told
    assert realigned(beyond, 1e-4).beyond == pytest.approx(beyond.beyond, abs=0.02)


def test_held_out_logs_that_share_little_test_all_the_same() -> None:
    """Otherwise nothing would be left to test with."""
    assert dataset_of(0.2).beyond == {}
    assert set(dataset_of(0.2, 0.0).beyond) == {"held 0"}  # together they share half
