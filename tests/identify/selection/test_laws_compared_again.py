"""Ties told again beside all that was added after an effect was compared with its rivals."""

from __future__ import annotations

import importlib
from dataclasses import replace

from built_fits import axis_of, built, built_fit, dataset_stub, fitted, stage, step
from identify.selection.verdict import _compared_again

module = importlib.import_module("identify.selection.verdict")
DATASET = dataset_stub()
HIGH = built_fit(8.0)  # over a floor of 1 N


def test_ties_are_told_again_only_beside_several_effects_or_a_free_curve(monkeypatch):
    fits, ties = [], []
    final = built_fit(1.0, axis=axis_of(fitted("cogging"), fitted("wear"), fitted("end_stop")))

    def refitted(axis, logs):
        fits.append(axis.names[1:])
        return built_fit(1.0, axis=axis)

    def score(base, fit, dataset, effect):
        assert base is HIGH
        return built(effect, fit=fit)

    def tie(dataset, own, rival):
        ties.append((own.effect.name, own.fit is final, rival.effect.name))
        return rival.effect.name == "constant_force"

    monkeypatch.setattr(module, "fit_axis", refitted)
    monkeypatch.setattr(module, "score", score)
    monkeypatch.setattr(module, "tie", tie)
    rivals = (built("constant_force"), built("wear"), built("quadratic_drag"))
    steps = (
        step("cogging", ("quadratic_drag",), rivals=rivals),
        step("wear", ("payload_mass",)),
        step("end_stop", ("payload_mass",), beside="wear", rivals=(built("constant_force"),)),
        step("lugre", ("dahl",)),
        step("gms", (), dropped=("lugre",)),
    )
    again = _compared_again([stage(HIGH), stage(final, *steps)], DATASET)
    assert [s.tied for s in again] == [
        ("constant_force",), (), ("payload_mass", "constant_force"), ("dahl",), (),
    ]  # fmt: skip
    compared = [("cogging", "constant_force"), ("cogging", "quadratic_drag")]
    compared.append(("end_stop", "constant_force"))
    assert ties == [(own, True, rival) for own, rival in compared]
    own = [("wear", "end_stop"), ("wear", "end_stop"), ("cogging", "wear")]
    assert fits == [(*o, rival) for o, (_, rival) in zip(own, compared, strict=True)]
    alone = (steps[0],)
    assert _compared_again([stage(HIGH), stage(final, *alone)], DATASET) == alone
    curved = built_fit(1.0, axis=axis_of(fitted("cogging"), fitted("free_curve")))
    (again,) = _compared_again([stage(HIGH), stage(curved, *alone)], DATASET)
    assert again.tied == ("constant_force",)


def test_a_rival_of_a_friction_goes_beside_that_of_the_base(monkeypatch):
    fits = []
    final = built_fit(1.0, axis=axis_of(fitted("cable_slab")).with_effect(fitted("dahl")))
    final = replace(final, axis=final.axis.with_effect(fitted("free_curve")))

    def refitted(axis, logs):
        fits.append(set(axis.names))
        return built_fit(1.0, axis=axis)

    monkeypatch.setattr(module, "fit_axis", refitted)
    monkeypatch.setattr(module, "score", lambda base, fit, dataset, effect: built(effect, fit=fit))
    monkeypatch.setattr(module, "tie", lambda *_: True)
    rivals = (built("cable_hysteresis"), built("lugre"))
    _compared_again([stage(HIGH), stage(final, step("dahl", rivals=rivals))], DATASET)
    rest = {"cable_slab", "free_curve"}
    assert fits == [rest | {HIGH.axis.names[0], "cable_hysteresis"}, rest | {"lugre"}]
