"""What explains next to nothing beside another effect is not named."""

from __future__ import annotations

import importlib

import pytest
from built_fits import axis_of, built_fit, dataset_stub, fitted, step

from identify.dataset.given_logs import Role
from identify.estimation.errors import Errors
from identify.selection.diagnosis import Step
from identify.selection.verdict import _without_small

module = importlib.import_module("identify.selection.verdict")
LEAST = 0.01  # of the squared error above the floor, the rule as it was decided
NAMES = ("cogging", "wear", "end_stop")
BASE = built_fit(10.0, 0.1)


def selected(monkeypatch, shares: dict[str, float], *steps: Step):
    """The names that stay proved and those in the fit; an effect alone explains all."""

    def less(effect, fit, base, dataset):
        left = built_fit(1.0, 0.1, fit.axis.without(effect.name))
        left.__dict__["without"] = effect.name
        return left

    def fall(without, final, dataset, on):
        assert on is Role.SELECTION
        return without.__dict__["without"]

    dataset = dataset_stub(holdout=("held",))
    monkeypatch.setattr(module, "less", less)
    monkeypatch.setattr(Errors, "of", staticmethod(fall))
    monkeypatch.setattr(module, "share_explained", lambda name, base, where: shares[name])
    final = built_fit(1.0, 0.1, axis_of(*(fitted(n) for n in NAMES)))
    found, fit = _without_small(steps or tuple(map(step, NAMES)), final, BASE, dataset)
    return [s.candidate.effect.name for s in found if s.proved], fit.axis.names[1:]


@pytest.mark.parametrize(("share", "named"), [(0.9 * LEAST, False), (1.1 * LEAST, True)])
def test_an_effect_of_a_hundredth_beside_others_is_not_named(monkeypatch, share, named):
    found = selected(monkeypatch, {"cogging": 0.6, "wear": share, "end_stop": 0.3})
    kept = NAMES if named else ("cogging", "end_stop")
    assert found == ([*kept], kept)


def test_the_smallest_goes_first_and_the_last_stays(monkeypatch):
    """Two that explain the same each bring back nothing alone: one of them must stay."""
    shares = {"cogging": 0.004, "wear": 0.002, "end_stop": 0.003}
    assert selected(monkeypatch, shares) == (["cogging"], ("cogging",))
    alone = (step("cogging"), step("wear", dropped=("cogging",)))
    assert selected(monkeypatch, shares, *alone)[0] == ["cogging", "wear"]
