"""Shares and sentences of what was found: each number in its own place."""

from __future__ import annotations

import numpy as np
import pytest
from built_fits import PLAIN, built_dataset, built_fit

from identify.estimation import intervals
from identify.estimation.intervals import Inseparable
from identify.output.words.numbers import Numbers
from identify.output.words.validation import _place
from identify.selection.findings import _share
from identify.validation.misfit_maps import Region


def test_a_share_is_of_the_squared_error_above_the_noise_floor():
    base = built_fit(0.7)
    base.__dict__["floor"] = 0.3
    without = built_dataset("one", held=())
    assert _share(0.2, base, without) == pytest.approx(0.2 / (0.7**2 - 0.3**2))
    base.__dict__["floor"] = 0.8  # the base is at the floor: nothing is left to share
    assert _share(0.2, base, without) == 0.0


@pytest.mark.parametrize(("low", "said"), [(0.0, "in motion"), (1.0, "at standstill")])
def test_standstill_is_told_from_motion(low, said):
    place = Region("standstill", "1", low, low + 1.0, 0.1, 2.0, 0.5)
    numbers = Numbers(*(lambda *_: "" for _ in range(3)))
    assert _place(place, numbers) == said


def test_parameters_that_cannot_be_told_apart_name_each_other(monkeypatch):
    fit = built_fit(0.1, axis=PLAIN)
    labels = [c.label for c in fit.scaling.where]
    monkeypatch.setattr(intervals, "inseparable", lambda _: {labels[0]: labels[1]})
    monkeypatch.setattr(intervals, "open_sides", lambda *_: {})
    found = intervals._undetermined(fit, np.ones(len(labels)))
    assert found == {labels[0]: Inseparable(labels[1])}
