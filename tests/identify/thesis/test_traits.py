"""What a friction does: the traits that the literature gives LuGre and memory, measured."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from identify.thesis.behaviours import behaviours
from identify.thesis.models import _like, _noisy
from identify.thesis.residuals import friction_of, frictions
from identify.thesis.traits import Traits, traits
from twin.effects import load_catalogue
from twin.model.file import load_model

CATALOGUE = load_catalogue()


def of(law: str) -> Traits:
    model = load_model("thesis_simulation", CATALOGUE)
    name, axis = next(iter(model.axes.items()))
    effect = frictions(CATALOGUE)[law]
    own = replace(axis, effects=(_like(effect, friction_of(axis).values),))
    stage, rng = _noisy(model, name, own), np.random.default_rng(1)
    return traits(stage, behaviours(stage, rng), rng)


@pytest.mark.slow
def test_lugre_drifts_lags_and_breaks_away_earlier_when_pushed_fast() -> None:
    """As Al-Bender, Lampaert, Swevers 2005 have it: GMS does all but drift."""
    lugre, gms, dry = of("lugre"), of("gms"), of("coulomb_viscous")
    assert lugre.drift > 5e-5
    assert abs(gms.drift) < 2e-6
    assert dry.drift == 0.0
    for found in (lugre, gms):
        assert found.lag > 3e-3
        assert found.fall == pytest.approx(0.018, rel=0.05)
        assert found.fast < 0.7 * found.slow
    assert abs(dry.lag) < 1e-4
    assert dry.fall == pytest.approx(0.0, abs=1e-4)
    assert dry.fast == pytest.approx(dry.slow, rel=0.02)
