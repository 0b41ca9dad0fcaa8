"""Shares of what was found."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import built_dataset, built_fit, dataset_stub, step

from identify.dataset.given_logs import Role
from identify.estimation.errors import Errors
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from identify.selection.findings import Bend, Finding, FindingKind, share_explained
from identify.selection.found_shape import Drawn, FoundShape
from twin.curve import Coordinate


def test_a_share_is_of_the_squared_error_above_the_noise_floor():
    base = built_fit(0.7)
    base.__dict__["floor"] = 0.3
    without = built_dataset("one", held=())
    fall = Errors(0.6, 0.4, Role.TRAINING)
    assert share_explained(fall, base, without) == pytest.approx(
        (0.6**2 - 0.4**2) / (0.7**2 - 0.3**2)
    )
    # Without one of several effects a fit may leave more than the base did.
    more = Errors(0.9, 0.5, Role.TRAINING)
    assert share_explained(more, base, without) == pytest.approx(
        (0.9**2 - 0.5**2) / (0.9**2 - 0.3**2)
    )
    assert share_explained(replace(more, after=0.1), base, without) == 1.0
    base.__dict__["floor"] = 0.8  # the base is at the floor: nothing is left to share
    assert share_explained(fall, base, without) == 0.0


@pytest.mark.parametrize(("band", "differs"), [(0.9, True), (1.1, False)])
def test_a_curve_whose_band_holds_the_law_is_no_finding_beside_others(band, differs):
    assumed, found = np.array([0.0, 1.0, np.nan]), np.array([0.5, 2.0, np.nan])
    drawn = {"forwards": Drawn(assumed, found, np.full(3, band))}
    shape = FoundShape(Coordinate.POSITION, np.arange(3.0), "m", None, False, "N", drawn)
    assert shape.differs is differs
    errors = Errors(2.0, 1.0, Role.TEST)
    finding = Finding("cable_slab", (), 0.5, errors, errors, "N", {}, None, shape=shape)
    assert replace(finding, kind=FindingKind.WRONG_SHAPE).is_sure is differs
    assert replace(finding, kind=FindingKind.RESEMBLES).is_sure
    bend = Bend("n", 2.0, 0.7, "1")
    assert replace(finding, kind=FindingKind.WRONG_SHAPE, bend=bend).is_sure


def test_what_was_added_in_a_step_of_its_own_is_no_alternative_to_another():
    """Both were needed beside each other then, although a curve replaced one of them later."""
    steps = (
        step("cogging", tied=("end_stop", "wear")),
        step("end_stop", dropped=("end_stop",)),
    )
    fit = built_fit(1.0)
    told = AxisDiagnosis(dataset_stub(), fit, (), steps, fit, Verdict.MISSING_EFFECTS, None)
    assert told.answers == (("cogging", "end_stop", "wear"),)
    curve = SimpleNamespace(shape=SimpleNamespace(effect="cable_slab"))
    told = replace(told, curves=(curve,))
    assert told.answers == (("cogging", "wear"),)
    assert told.ambiguous_with == ("wear",)
