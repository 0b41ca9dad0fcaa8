"""Two explanations are a tie unless a held-out gain worth having parts them."""

from types import SimpleNamespace

import numpy as np
import pytest

from identify.estimation.decision import RULE
from identify.estimation.evidence import Evidence, Gain
from identify.selection import ranking
from identify.selection.candidates import Candidate
from twin.effects import load_catalogue


def candidate(scale: float, gain: float):
    """A candidate with this log gain, whose held-out residual is a noise times ``scale``."""
    fit = SimpleNamespace(axis=scale, floor=1e-3)
    return SimpleNamespace(
        is_noise=False, effect=load_catalogue()["wear"], fit=fit, evidence=Evidence(gain, 1, 1000.0)
    )


@pytest.mark.parametrize(
    ("scale", "gain", "tied"),
    [
        (1.0002, 1.0, True),  # lower in every block, and next to nothing
        (1.2, 1.0, False),
        (0.8, 1.0, True),
        (1.0, 0.98, True),
    ],
    ids=["a trace held out", "much held out", "worse held out", "evidence of the fit logs"],
)
def test_tie(scale, gain, tied, monkeypatch):
    noise = 1e-3 * np.random.default_rng(1).standard_normal(3000)
    monkeypatch.setattr(ranking, "residual", lambda axis, logs: axis * noise)
    monkeypatch.setattr(ranking, "moving", lambda logs, either: slice(None))
    monkeypatch.setattr(ranking, "sticks", lambda axis: False)
    dataset = SimpleNamespace(holdout=("held out",), fit=())
    assert ranking.tie(dataset, candidate(1.0, 1.0), candidate(scale, gain)) is tied


@pytest.mark.parametrize(
    ("bic", "t", "after", "supported"),
    [
        (1.01 * RULE.least_bic, 1.01 * RULE.least_t, 0.9, True),
        (0.99 * RULE.least_bic, 1.01 * RULE.least_t, 0.9, False),
        (1.01 * RULE.least_bic, 0.99 * RULE.least_t, 0.9, False),
        (1.01 * RULE.least_bic, 1.01 * RULE.least_t, 1.1, False),
    ],
    ids=["both", "little evidence", "held out by chance", "a larger error held out"],
)
def test_an_effect_is_supported_by_the_evidence_and_the_held_out_logs_together(
    bic, t, after, supported
):
    samples = 500.0
    evidence = Evidence((bic + 2.0 * np.log(samples)) / samples, 2, samples)
    assert evidence.delta_bic == pytest.approx(bic)
    effect = load_catalogue()["cogging"]
    found = Candidate(effect, "x", SimpleNamespace(), evidence, Gain(1.0, after, t))
    assert found.supported is supported
