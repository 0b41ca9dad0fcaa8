"""One trial of the self-test: a machine is built, diagnosed, and held against its truth."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import CATALOGUE, PLAIN, built, built_dataset, built_fit, fitted
from built_results import errors, score_of

from identify.estimation.fit import Outcome, finished
from identify.estimation.force_balance import residual
from identify.estimation.intervals import half_widths
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from identify.selection.findings import Finding, FindingKind
from identify.selection.found_shape import FoundShape
from identify.selftest import cases, trial
from identify.selftest.case import Case
from identify.selftest.laws import OUTSIDE
from identify.selftest.trial import Held, _held, _right_coordinates
from twin.curve import Coordinate

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


def over(coordinate: Coordinate) -> FoundShape:
    return FoundShape(coordinate, np.zeros(1), "m", None, False, "N", {})


@pytest.mark.parametrize("known", [True, False])
def test_a_trial_diagnoses_what_was_built(monkeypatch, dataset, known):
    base, final = built_fit(4.0, 0.5), built_fit(1.1, 1.0)
    machine = SimpleNamespace(
        planted=(), model=SimpleNamespace(axes={"x": PLAIN}), reshaped={"lugre"}, right={"gms"},
    )  # fmt: skip
    asked = {}
    finding = Finding(
        "wear", ("cogging",), 0.9, *errors(2.0, 1.0), "N", {}, score_of(0.9, 9.0, 0.1)
    )
    findings = (
        finding, replace(finding, effect="gms"), replace(finding, effect="wear", tied=()),
        replace(
            finding, effect="lugre", kind=FindingKind.WRONG_SHAPE, shape=over(Coordinate.SPEED)
        ),
        replace(
            finding, effect="cable", kind=FindingKind.WRONG_SHAPE, tied=(),
            shape=over(Coordinate.POSITION),
        ),
    )  # fmt: skip
    found = AxisDiagnosis(
        dataset, base, tuple(built(n, bic=b) for n, b in (("wear", 90.0), ("gms", 80.0))), (),
        final, Verdict.UNEXPLAINED, findings, SimpleNamespace(depends_on="time"),
    )  # fmt: skip

    def build(stage, effects, strength, variation, rng):
        asked.update(
            effects=[e.name for e in effects], strength=strength, varied=variation,
            draw=rng.random(),
        )  # fmt: skip
        return machine

    def diagnose(given, where, catalogue):
        asked.update(catalogue=set(catalogue))
        return found

    monkeypatch.setattr(trial, "machine", build)
    monkeypatch.setattr(trial, "prepared", lambda built, strength: "dataset")
    monkeypatch.setattr(trial, "fit_aligned", lambda axis, given: (given, base))
    monkeypatch.setattr(trial, "diagnose_axis", diagnose)
    monkeypatch.setattr(trial, "_tested", lambda found, built: 1.2)
    monkeypatch.setattr(trial, "_held", lambda built, base: (HELD,))
    out = trial.run(Case(("cogging",), 3.0, 7, "bumps", known))
    first = asked["draw"]
    assert (asked["effects"], asked["strength"]) == (["cogging"], 3.0)
    assert asked["varied"] == "bumps"
    assert ("cogging" in asked["catalogue"]) is known
    assert len(asked["catalogue"]) == len(CATALOGUE) - (not known)
    assert (out.verdict, out.ratio, out.left) == ("UNEXPLAINED", 8.0, pytest.approx(1.1))
    assert out.ranking == (("wear", 90.0), ("gms", 80.0))
    assert (out.depends_on, out.held, out.shown) == ("time", (HELD,), True)
    assert out.tested == 1.2
    # Planted; right besides; neither; its law is another; it is not.
    assert [a.right for a in out.answers] == [True, True, False, True, False]
    assert out.answers[0].names == ("wear", "cogging")
    assert (out.answers[0].left, out.answers[0].confidence) == (
        finding.least_left, finding.confidence,
    )  # fmt: skip
    assert [a.coordinate for a in out.answers] == [None, None, None, "velocity", "position"]
    assert out.named_coordinates == {"time", "velocity", "position", None}
    trial.run(Case(("cogging",), 3.0, 7, "bumps", known))
    assert asked["draw"] == first
    trial.run(Case((OUTSIDE_ONE,), 3.0, 8))
    assert asked["effects"] == [OUTSIDE_ONE]
    assert asked["draw"] != first

    def refused(*_):
        raise cases.NotShown("cogging")

    monkeypatch.setattr(trial, "machine", refused)
    assert not trial.run(Case(("cogging",), 3.0, 7)).shown
