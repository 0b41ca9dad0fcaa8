"""One trial of the self-test: a machine is built, diagnosed, and held against its truth."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import PLAIN, built_dataset, fitted

from identify.estimation.fit import Outcome, finished
from identify.estimation.force_balance import residual
from identify.estimation.intervals import half_widths
from identify.selftest import trial
from identify.selftest.laws import OUTSIDE
from identify.selftest.trial import Held, _held, _right_coordinates

OUTSIDE_ONE = next(iter(OUTSIDE))
HELD = Held("mass", 0.9, True)


@pytest.fixture(scope="module")
def dataset():
    return built_dataset("run")


def test_the_right_coordinates_are_those_near_the_strongest_dependence(monkeypatch, dataset):
    base = finished(PLAIN, PLAIN, dataset.fit, Outcome.CONVERGED)
    planted = (fitted("constant_force", F0=0.7), fitted("quadratic_drag", c=2.0))
    built_machine = SimpleNamespace(planted=planted)
    seen = []

    def shares(force, fit, where):
        seen.append(force)
        return {"time": 0.5, "position": 0.41, "velocity": 0.4, "direction": 0.39}

    monkeypatch.setattr(trial, "dependences", shares)
    found = _right_coordinates(built_machine, base, dataset)
    assert found == ("time", "position", "velocity")
    with_both = base.axis.with_effect(planted[0]).with_effect(planted[1])
    change = base.residual - residual(with_both, dataset.fit)[base.kept]
    columns = base.jacobian / np.linalg.norm(base.jacobian, axis=0)
    left = change - columns @ np.linalg.lstsq(columns, change, rcond=None)[0]
    np.testing.assert_allclose(seen[0], left, atol=1e-6)
    assert _right_coordinates(SimpleNamespace(planted=()), base, dataset) == ()
    silent = SimpleNamespace(planted=(fitted("cogging"),))
    assert _right_coordinates(silent, base, dataset) == ()


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
