"""What explains next to nothing beside another effect is not named, if others may leave as much."""

from __future__ import annotations

import importlib
from dataclasses import dataclass

import pytest
from built_fits import axis_of, built_fit, dataset_stub, fitted, step
from identify.selection.verdict import _without_small

from identify.dataset.given_logs import Role
from identify.estimation.errors import Errors
from identify.selection.diagnosis import Step

module = importlib.import_module("identify.selection.verdict")
LEAST = 0.01  # of the squared error above the floor, the rule as it was decided
NAMES = ("cogging", "wear", "end_stop")
BASE = built_fit(10.0, 0.1)


@dataclass(frozen=True)
class Named(Errors):
    """Errors without an effect and with it, by the name of the effect."""

    name: str = ""


def selected(monkeypatch, shares: dict[str, float], *steps: Step, before: float = 2.0):
    """The names that stay proved and those in the fit; an effect alone explains all.

    Without any one of them an error of ``before`` N is left, with it 1 N over a floor of 0.1 N.
    """

    def less(effect, fit, base, dataset):
        left = built_fit(1.0, 0.1, fit.axis.without(effect.name))
        left.__dict__["without"] = effect.name
        return left

    def fall(without, final, dataset, on):
        assert on is Role.SELECTION
        return Named(before, 1.0, on, name=without.__dict__["without"])

    dataset = dataset_stub(holdout=("held",))
    monkeypatch.setattr(module, "less", less)
    monkeypatch.setattr(Errors, "of", staticmethod(fall))
    monkeypatch.setattr(module, "share_explained", lambda fall, base, where: shares[fall.name])
    final = built_fit(1.0, 0.1, axis_of(*(fitted(n) for n in NAMES)))
    found, fit = _without_small(steps or tuple(map(step, NAMES)), final, BASE, dataset)
    return [s.candidate.effect.name for s in found if s.proved], fit.axis.names[1:]


@pytest.mark.parametrize(("share", "named"), [(0.9 * LEAST, False), (1.1 * LEAST, True)])
def test_an_effect_of_a_hundredth_beside_others_is_not_named(monkeypatch, share, named):
    found = selected(monkeypatch, {"cogging": 0.6, "wear": share, "end_stop": 0.3})
    kept = NAMES if named else ("cogging", "end_stop")
    assert found == ([*kept], kept)


# 0.99 N^2 above the floor is left with it; that is a twentieth of 19.8 N^2.
@pytest.mark.parametrize(("before", "named"), [(4.44, False), (4.46, True)])
def test_an_effect_that_takes_nearly_all_that_a_large_one_leaves_is_named(
    monkeypatch, before, named
):
    """Cogging of 25 floors beside a drag of 300."""
    shares = {"cogging": 0.6, "wear": 0.5 * LEAST, "end_stop": 0.3}
    found = selected(monkeypatch, shares, before=before)
    kept = NAMES if named else ("cogging", "end_stop")
    assert found == ([*kept], kept)


def test_the_smallest_goes_first_and_the_last_stays(monkeypatch):
    """Two that explain the same each bring back nothing alone: one of them must stay."""
    shares = {"cogging": 0.004, "wear": 0.002, "end_stop": 0.003}
    assert selected(monkeypatch, shares) == (["cogging"], ("cogging",))
    alone = (step("cogging"), step("wear", dropped=("cogging",)))
    assert selected(monkeypatch, shares, *alone)[0] == ["cogging", "wear"]
