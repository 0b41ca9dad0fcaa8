"""Chapter "future" in small, and the drift of a machine that ages."""

from __future__ import annotations

import numpy as np
import pytest

import identify
from identify.output.reproduction import reproduction_json, reproduction_text
from identify.thesis.aging import aging
from twin.effects import load_catalogue
from twin.model.file import load_model


@pytest.mark.slow
def test_elements_are_chosen_and_physics_beats_the_data_driven_residual() -> None:
    done = identify.reproduce(["future"], small=True)
    result = done.chapters["future"]
    assert result.chosen.count == result.planted
    *others, physics = result.beside
    assert physics.test < 1.2 * result.floor
    assert all(b.test > 3.0 * physics.test for b in others)
    slow = result.slow
    assert np.abs(slow.fitted / slow.planted - 1.0).max() < 0.01
    assert slow.mapped[0] < 0.8 * slow.planted[0]
    chapter = reproduction_json(done)["chapters"]["future"]
    assert chapter["elements"]["found"] == chapter["elements"]["planted"]
    assert "noise floor" in reproduction_text(done)


@pytest.mark.slow
def test_a_drift_is_detected_where_one_was_planted_and_not_otherwise() -> None:
    model = load_model("thesis_aging", load_catalogue())
    found = aging(model, 400.0, np.random.default_rng(3), lambda *_: None)
    assert found.level.detected
    assert not found.steady.detected
    off = np.abs(found.level.found - found.level.truth)
    assert np.mean(off <= found.level.half) > 0.7
    assert found.planted["wear.rate"].mean == pytest.approx(0.002, rel=0.1)
