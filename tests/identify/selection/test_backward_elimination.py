"""Whether an earlier choice is still needed, once more has been added."""

import importlib
from types import SimpleNamespace

import pytest
from built_fits import built, built_fit, dataset_stub
from identify.selection.forward_selection import _eliminated_backwards, _in_its_place
from machines import one_axis

from identify.dataset.dataset import datasets
from identify.estimation.fit import Outcome, finished, fit_axis
from twin.effects import load_catalogue
from twin.experiments.named import simulate
from twin.model.file import load_model
from twin.model.machine import Fitted

CATALOGUE = load_catalogue()
STAGE = one_axis(load_model("proton_xy", CATALOGUE))


def test_a_friction_that_another_one_replaced_is_dropped():
    dataset = datasets(STAGE, {"log": simulate(STAGE, "tracking", seed=1, duration=5.0)}, {})["x"]
    base = fit_axis(STAGE.axes["x"], dataset.fit)
    richer = fit_axis(base.axis.with_effect(Fitted.at_start(CATALOGUE["gms"])), dataset.fit)
    earlier = [SimpleNamespace(effect=CATALOGUE["stribeck"])]
    fit, dropped = _eliminated_backwards(base, richer, dataset, earlier)
    assert dropped == ("stribeck",)
    assert fit is richer


def test_a_second_of_several_takes_the_place_of_a_first_that_is_not_needed():
    """A machine whose poles alone are found has one cogging, not a second without a first."""
    dataset = datasets(STAGE, {"log": simulate(STAGE, "tracking", seed=1, duration=3.0)}, {})["x"]
    first, second = (CATALOGUE["cogging"].numbered(n) for n in (1, 2))
    pole = Fitted.at_start(second, {"p": 0.024, "a1": 0.3})
    plain = STAGE.axes["x"]
    only = finished(
        plain.with_effect(pole), plain.with_effect(pole), dataset.fit, Outcome.CONVERGED
    )
    found, gone = _in_its_place(only, first)
    assert gone == "cogging_2"
    for axis in (found.axis, found.begun):
        assert axis.names == (*plain.names, "cogging")
        assert axis["cogging"].values == pole.values
    assert {c.effect for c in found.scaling.where} == {"", *plain.names, "cogging"}
    assert _in_its_place(only, CATALOGUE["wear"]) == (only, "wear")


def test_the_next_of_several_move_up_once_all_needless_ones_are_gone(monkeypatch):
    """Else a second under the first's name would not be asked about."""
    plain = STAGE.axes["x"]
    effects = [CATALOGUE["cogging"].numbered(n) for n in (1, 2, 3)]
    axis = plain
    for n, effect in enumerate(effects):
        axis = axis.with_effect(Fitted.at_start(effect, {"p": 0.01 + 0.01 * n}))
    module = importlib.import_module("identify.selection.forward_selection")
    needless: set[str] = set()

    def score(without, fit, dataset, effect):
        return built(effect, bic=-1e3 if effect.name in needless else 1e3)

    def less(effect, fit, base, dataset):
        return built_fit(1.0, axis=fit.axis.without(effect.name))

    monkeypatch.setattr(module, "score", score)
    monkeypatch.setattr(module, "less", less)
    monkeypatch.setattr(module, "fit_thoroughly", lambda axis, *_: built_fit(1.0, axis=axis))
    full, earlier = built_fit(1.0, axis=axis), [SimpleNamespace(effect=e) for e in effects]
    for gone, left, dropped in (
        (("cogging",), (0.02, 0.03), ("cogging_3",)),
        (("cogging", "cogging_2"), (0.03,), ("cogging_3", "cogging_2")),
        (("cogging_2",), (0.01, 0.03), ("cogging_3",)),
    ):
        needless.clear()
        needless.update(gone)
        fit, names = _eliminated_backwards(full, full, dataset_stub(), earlier)
        kept = [f for f in fit.axis.effects if f.effect.name.startswith("cogging")]
        assert [f.values["p"] for f in kept] == list(left)
        assert [f.effect.name for f in kept] == [e.name for e in effects[: len(left)]]
        assert {*names} == {*dropped}


@pytest.mark.parametrize(
    ("evidence", "error", "kept"),
    [(48.0, 1.4, True), (48.0, 1.2, False), (120.0, 1.2, True)],
)
def test_where_the_fit_without_it_is_at_the_floor_an_effect_needs_far_more_evidence(
    monkeypatch, evidence, error, kept
):
    """As when it is added: a dead time told before the encoder's rounding explains the rest."""
    module = importlib.import_module("identify.selection.forward_selection")
    effect = CATALOGUE["actuator_delay"]
    with_it = built_fit(1.0, 1.0, axis=STAGE.axes["x"].with_effect(Fitted.at_start(effect)))
    without = built_fit(error, 1.0, axis=STAGE.axes["x"])
    needed = built(effect, bic=evidence)
    monkeypatch.setattr(module, "score", lambda *_: needed)
    monkeypatch.setattr(module, "less", lambda *_: without)
    monkeypatch.setattr(module, "fit_thoroughly", lambda *_: without)
    fit, dropped = _eliminated_backwards(
        without, with_it, dataset_stub(), [SimpleNamespace(effect=effect)]
    )
    assert (fit is with_it, dropped) == (kept, () if kept else ("actuator_delay",))
