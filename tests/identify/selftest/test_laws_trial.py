"""One trial of the self-test: a machine is built, diagnosed, and held against its truth."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest
from built_fits import PLAIN, built_dataset

from identify.estimation.fit import Outcome, finished
from identify.estimation.intervals import half_widths
from identify.selftest.trial import _held


@pytest.fixture(scope="module")
def dataset():
    return built_dataset("run")


def test_the_truth_lies_so_many_half_widths_from_a_value(dataset):
    fit = finished(PLAIN, PLAIN, dataset.fit, Outcome.CONVERGED)
    half = dict(zip([c.label for c in fit.scaling.where], half_widths(fit), strict=True))
    assert list(half) == ["mass", "coulomb_viscous.Fc", "coulomb_viscous.sigma2"]
    true = replace(fit.axis, mass=fit.axis.mass + 0.5 * half["mass"])
    machine = SimpleNamespace(
        true=SimpleNamespace(axes={"x": true}), reshaped=frozenset({"coulomb_viscous"})
    )
    (mass,) = _held(machine, fit)  # a reshaped law has no true values
    assert mass.label == "mass"
    assert mass.off == pytest.approx(0.5, rel=1e-6)
    machine.reshaped = frozenset()
    assert [h.label for h in _held(machine, fit)] == list(half)
