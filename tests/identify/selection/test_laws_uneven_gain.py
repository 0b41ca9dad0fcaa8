"""A held-out gain that is large but uneven over the blocks counts where it beats its decoys."""

from __future__ import annotations

import importlib
from dataclasses import replace

import numpy as np
import pytest
from built_fits import built, built_dataset, built_fit, dataset_stub
from identify.selection.decoys import Proof
from identify.selection.scoring import _beats_decoys

from identify.dataset.given_logs import Role
from identify.estimation.evidence import Gain
from identify.selection.findings import _linear_step

module = importlib.import_module("identify.selection.scoring")
LEAST_T, LEAST_BIC = 3.0, 10.0  # the rules as they were decided


@pytest.mark.parametrize(
    ("t", "beats", "bic", "after", "supported"),
    [
        (LEAST_T + 0.1, False, 50.0, 1.0, True),
        (LEAST_T - 0.1, False, 50.0, 1.0, False),
        (LEAST_T - 0.1, True, 50.0, 1.0, True),
        (LEAST_T - 0.1, True, LEAST_BIC - 0.1, 1.0, False),
        (LEAST_T - 0.1, True, 50.0, 2.1, False),
    ],
)
def test_beating_the_decoys_stands_for_an_even_gain_alone(t, beats, bic, after, supported):
    made = replace(built(bic=bic, t=t, before=2.0, after=after), beats_decoys=beats)
    assert made.supported is supported


@pytest.mark.parametrize(
    ("part", "t", "proof", "beats"),
    [
        (0.99, 0.1, Proof(0.9, 0.1), True),
        (1.01, 0.1, Proof(0.9, 0.1), False),  # not asked
        (0.99, -0.1, Proof(0.9, 0.1), False),  # nor where a typical block loses
        (0.99, 0.1, Proof(0.9, 0.88), False),
        (0.99, 0.1, None, False),  # none are made of what depends on the time alone
    ],
)
@pytest.mark.parametrize("held", [(), ("log",)])
def test_an_effect_must_lower_the_held_out_error_and_hold(monkeypatch, part, t, proof, beats, held):
    base, data = built_fit(5.0), dataset_stub(holdout=held)
    made = replace(built("wear"), gain=Gain(2.0, 2.0 * np.sqrt(part), t))

    def asked(without, fitted, dataset, gain):
        assert (without, fitted, dataset) == (base, made.fit.axis["wear"], data)
        assert gain is (made.gain if held else None)  # what the fit logs give is no refit's gain
        assert part < 1.0
        assert t > 0.0
        return proof

    monkeypatch.setattr(module, "proof", asked)
    assert _beats_decoys(base, made, data) is beats


@pytest.mark.parametrize(
    ("effect", "t", "part", "clear"),
    [
        ("dahl", 2.1, 0.79, True),
        ("dahl", 1.9, 0.79, False),
        ("dahl", 2.1, 0.81, False),
        ("thermal_drift", 2.1, 0.5, False),  # it has none as it depends on the time alone
    ],
)
def test_a_friction_without_decoys_counts_where_it_leaves_clearly_less(
    monkeypatch, effect, t, part, clear
):
    made = replace(built(effect), gain=Gain(2.0, 2.0 * np.sqrt(part), t))
    monkeypatch.setattr(module, "proof", lambda *_: None)
    assert _beats_decoys(built_fit(5.0), made, dataset_stub()) is clear


def test_a_linear_step_takes_none_of_the_noise():
    fit = built_fit(2.0, 0.5)
    data = built_dataset("one", held=())
    assert _linear_step(fit, data, Role.TRAINING, 0.75).after == pytest.approx(1.0)
    assert _linear_step(fit, data, Role.TRAINING, 0.999).after == pytest.approx(0.5)
    quiet = built_fit(0.4, 0.5)
    assert _linear_step(quiet, data, Role.TRAINING, 0.5).after == pytest.approx(0.4)
