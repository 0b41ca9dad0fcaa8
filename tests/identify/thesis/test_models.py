"""Chapter "models" in small: a law fits its own data, and not those of one without its memory."""

from __future__ import annotations

import numpy as np
import pytest

import identify
from identify.output.reproduction import reproduction_json, reproduction_text
from identify.thesis.behaviours import LOOP, behaviours
from identify.thesis.residuals import friction_of
from twin.effects import load_catalogue
from twin.model.file import load_model


@pytest.mark.slow
def test_each_law_fits_its_own_data_and_not_the_other_ones() -> None:
    done = identify.reproduce(["models"], small=True)
    result = done.chapters["models"]
    assert len(result.laws) == 2
    assert (result.own < 1.2).all()
    assert result.overall[0, 1] > 2.0
    assert result.overall[1, 0] > 20.0
    chapter = reproduction_json(done)["chapters"]["models"]
    assert set(chapter["error_over_noise_floor"]) == set(result.laws)
    assert "loop" in reproduction_text(done)


def test_the_behaviours_are_what_they_say() -> None:
    """Loops turn where they should; the small oscillation never reaches the break-away force."""
    model = load_model("thesis_simulation", load_catalogue())
    logs = behaviours(model, np.random.default_rng(0))
    static = friction_of(model.axes["x"]).values["Fs"]
    assert np.abs(logs["drift"].axes["x"].force).max() < static
    assert np.abs(logs["break-away"].axes["x"].force).max() > static
    reached = logs["pre-sliding loops"].axes["x"].position
    assert reached.max() == pytest.approx(LOOP.max(), rel=0.1)
    assert np.diff(logs["frictional lag"].truth["x"]["position"][600:]).min() > 0.0
