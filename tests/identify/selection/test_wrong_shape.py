"""A law of the wrong shape is named, and no other, where a free curve does better in its place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import PLAIN, axis_of, built_dataset, fitted

from identify.estimation.fit import Outcome, finished
from identify.selection.decoys import Proof
from identify.selection.diagnosis import AxisDiagnosis, Verdict
from identify.selection.findings import FindingKind
from identify.selection.residual_dependence import Dependence
from identify.selection.wrong_shape import _Hats, wrong_shape
from twin.effects import load_catalogue

RNG = np.random.default_rng(4)
CATALOGUE = load_catalogue()
CURVED = [e for e in CATALOGUE.values() if e.curve]
CABLE = fitted("cable_slab", k1=1.5)
MODEL = axis_of(CABLE, fitted("cogging", p=0.017, a1=0.1))


def machine(dataset, force):
    """The dataset with a force of position (n,) m -> N, and noise, beyond what the model gives."""

    def moved(log):
        added = log.test_function.mean(force(log.motion.position))
        noise = 1e-3 * RNG.standard_normal(len(log))
        own = finished(MODEL, MODEL, (log,), Outcome.CONVERGED)
        rest = np.zeros(len(log))
        rest[own.kept] = own.residual
        return replace(log, command=log.command - rest + added + noise)

    return replace(
        dataset, fit=tuple(map(moved, dataset.fit)), holdout=tuple(map(moved, dataset.holdout))
    )


@pytest.fixture(scope="module", params=[(), ("held",)], ids=["left out", "held out"])
def dataset(request):
    return built_dataset("one", "two", held=request.param)


def base_of(dataset):
    return finished(MODEL, MODEL, dataset.fit, Outcome.CONVERGED)


@pytest.mark.parametrize(
    ("force", "effect"),
    [
        (lambda x: 0.2 * np.tanh(x / 0.004), "cable_slab"),
        (lambda x: 0.1 * np.exp(-(((np.mod(x / 0.017, 1.0) - 0.5) / 0.06) ** 2)), "cogging"),
        (lambda x: 0.0 * x, None),
    ],
)
def test_the_law_whose_curve_differs_is_told(dataset, force, effect) -> None:
    there = machine(dataset, force)
    found = wrong_shape(base_of(there), there)
    assert (found and found.effect) == effect


@pytest.mark.parametrize("effect", CURVED, ids=lambda e: e.name)
def test_a_curve_is_declared_over_what_the_law_reads(effect) -> None:
    assert effect.curve.period is None or effect.parameter(effect.curve.period).period
    assert not effect.is_nonparametric


def test_hats_are_a_partition_by_direction(dataset) -> None:
    log = dataset.fit[0]
    for name in ("cogging", "cable_slab", "position_dependent_friction", "lugre"):
        hats = _Hats.of(fitted(name), dataset.fit, 12)
        (columns,) = hats.columns([log])
        moving = np.abs(hats._direction(log.motion.velocity)) if hats.curve.by_direction else 1.0
        whole = log.test_function.mean(moving * np.ones(len(log.motion.time)))
        np.testing.assert_allclose(columns.sum(axis=1), whole, atol=1e-9)
        assert columns.shape[1] <= 12 * (2 if hats.curve.by_direction else 1)


def test_at_standstill_a_curve_stays_or_lets_go() -> None:
    velocity = np.array([0.1, 1e-6, -1e-6, 0.0, -0.2, 0.0, 0.1])
    curve = CATALOGUE["roller_spikes"].curve
    held, free = (_Hats(curve, 0.034, np.linspace(0, 1, 3), r) for r in (True, False))
    assert held._direction(velocity).tolist() == [1, 1, 1, 1, -1, -1, 1]
    assert free._direction(velocity).tolist() == [1, 0, 0, 0, -1, 0, 1]


def test_a_shape_is_the_verdict_where_it_is_all_that_is_found(dataset) -> None:
    there = machine(dataset, lambda x: 0.2 * np.tanh(x / 0.004))
    base = base_of(there)
    rest = Dependence(0.5, "position", None, "m", {"position": 0.5})
    lost = AxisDiagnosis(there, base, (), (), base, Verdict.UNEXPLAINED, rest)
    told = lost.with_findings()
    assert told.verdict is Verdict.WRONG_SHAPE
    (finding,) = told.findings
    assert (finding.effect, finding.kind) == ("cable_slab", FindingKind.WRONG_SHAPE)
    assert finding.error_after < 0.5 * finding.error_before
    assert finding.explains > 0.7
    assert isinstance(finding.proof, Proof)
    quiet = replace(lost, verdict=Verdict.NOTHING_MISSING, unexplained=None).with_findings()
    assert (quiet.verdict, quiet.findings) == (Verdict.NOTHING_MISSING, ())
    assert PLAIN.names
