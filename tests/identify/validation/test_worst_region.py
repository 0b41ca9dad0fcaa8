"""Where what a diagnosis leaves is largest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import PLAIN, built_dataset

from identify.estimation.fit import Outcome, finished
from identify.validation.misfit_maps import (worst_region)


@pytest.mark.parametrize("place", [-0.02, 0.015])
def test_it_is_where_the_force_is_that_the_model_lacks(place: float) -> None:
    dataset = built_dataset("one", "two")
    fit = finished(PLAIN, PLAIN, dataset.fit, Outcome.CONVERGED)
    assert worst_region(fit, dataset) is None

    def bumped(log):
        bump = np.exp(-(((log.motion.position - place) / 0.002) ** 2))
        return replace(log, command=log.command + log.test_function.mean(0.5 * bump))

    there = replace(dataset, fit=tuple(map(bumped, dataset.fit)))
    region = worst_region(finished(PLAIN, PLAIN, there.fit, Outcome.CONVERGED), there)
    assert region is not None
    assert (region.coordinate, region.unit) == ("position", "m")
    assert abs(0.5 * (region.low + region.high) - place) < 0.004
    assert region.ratio > 2.0
