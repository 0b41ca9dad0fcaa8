"""When a free curve competes, and beside which effects it is sought: the rules on both sides."""

from __future__ import annotations

import importlib
from dataclasses import replace
from types import SimpleNamespace

import built_results as made
import numpy as np
import pytest
from built_fits import axis_of, built, built_fit, dataset_stub, fitted
from identify.selection.decoys import Proof
from identify.selection.wrong_shape import Shape, WrongShape

from identify.selection.diagnosis import AxisDiagnosis, Verdict
from identify.selection.findings import FindingKind
from twin.curve import Coordinate, Curve

module = importlib.import_module("identify.selection.reshaping")
BASE, CURVED = built_fit(8.0), built_fit(2.0)
DATASET = dataset_stub()


@pytest.mark.parametrize(
    ("bic", "t", "after", "helps"),
    [(10.1, 0.0, 2.1, True), (9.9, 2.9, 1.0, False), (9.9, 3.1, 1.0, True), (9.9, 9.0, 2.1, False)],
)
def test_an_effect_may_help_with_evidence_or_a_clear_fall_of_the_test_error(bic, t, after, helps):
    assert module._may_help(built(bic=bic, t=t, before=2.0, after=after)) is helps


def test_beside_a_curve_those_effects_are_tried_first_that_take_most(monkeypatch):
    tried = []

    def reshaped(fit, dataset, ranking):
        tried.append(fit.error)

    monkeypatch.setattr(module, "_reshaped", reshaped)
    ranking = [
        built("wear", bic=40.0, t=9.0, before=8.0, after=7.0, fit=built_fit(7.0)),
        built("cogging", bic=4.0, t=9.0, before=8.0, after=3.0, fit=built_fit(3.0)),
        built("dahl", bic=4.0, t=1.0, before=8.0, after=2.0, fit=built_fit(2.0)),
        built("gms", bic=40.0, t=9.0, before=8.0, after=5.0, fit=built_fit(5.0)),
    ]
    assert module._beside_an_effect(BASE, DATASET, ranking) is None
    assert tried == [3.0, 5.0, 7.0]
    # And that with most evidence, which may lower no test error before the curve is there.
    tried.clear()
    sure = built("actuator_lag", bic=400.0, t=0.5, before=8.0, after=8.1, fit=built_fit(8.1))
    assert module._beside_an_effect(BASE, DATASET, [*ranking, sure]) is None
    assert tried == [3.0, 5.0, 7.0, 8.1]


@pytest.mark.parametrize(
    ("lessened", "supported", "law", "goes_on"),
    [
        (0.96, False, "cable_slab", True),
        (0.94, False, "cable_slab", False),
        (0.41, True, "cable_slab", True),
        (0.39, True, "cable_slab", False),
        (0.96, True, "cogging", False),  # the law of the effect itself, which the model has not
    ],
)
def test_effect_and_curve_take_nearly_all_or_a_good_part_with_every_support(
    monkeypatch, lessened, supported, law, goes_on
):
    """Where bumps have another form too, an effect and the cable's curve leave their share."""
    effect = built("cogging", bic=40.0, t=9.0, before=8.0, after=3.0, fit=built_fit(3.0))
    found = module.Reshaped(SimpleNamespace(effect=law), effect.fit, CURVED)
    without = built_fit(4.0)

    def score(smaller, fit, dataset, what):
        assert (smaller, fit, what) == (without, CURVED, effect.effect)
        return built(bic=90.0 if supported else 0.0)

    monkeypatch.setattr(module, "_reshaped", lambda fit, dataset, ranking: found)
    monkeypatch.setattr(module, "_lessened", lambda before, after, dataset: lessened)
    monkeypatch.setattr(module, "less", lambda what, fit, base, dataset: without)
    monkeypatch.setattr(module, "score", score)
    answer = module._beside_an_effect(BASE, DATASET, [effect])
    assert (answer is not None and answer.fit is without) is goes_on


@pytest.mark.parametrize(("gain", "refitted"), [(0.58, False), (0.6, True)])
def test_a_curve_is_not_refitted_where_even_a_good_refit_could_not_win(monkeypatch, gain, refitted):
    # A curve may leave as much as the best effect, a refit 0.3 of what a linear step leaves.
    asked = []
    shape = WrongShape(object.__new__(Shape), Proof(gain, 0.0), gain)
    object.__setattr__(shape.shape, "curve", Curve(Coordinate.POSITION))

    def in_place(fit, dataset, shape):
        asked.append(shape)
        return built(before=8.0, after=9.0)

    monkeypatch.setattr(module, "wrong_shapes", lambda fit, dataset: iter([shape]))
    monkeypatch.setattr(module, "error_in", lambda role, fit, dataset: 8.0)
    monkeypatch.setattr(module, "fit_in_place", in_place)
    best = 8.0 * np.sqrt(0.3 * 0.41)
    assert module._reshaped(BASE, DATASET, [built(t=9.0, before=8.0, after=best)]) is None
    assert bool(asked) is refitted


@pytest.mark.parametrize(
    ("after", "typical", "fitted_to", "found"),
    [
        (3.5, 0.9, 9.0, True),  # 0.77 of the whole squared error that the effect leaves
        (3.7, 0.9, 2.0, False),  # 0.86 of it
        (6.0, 0.19, 2.9, True),  # of a typical block, 0.76 of it
        (6.0, 0.21, 2.9, False),
        (6.0, 0.19, 3.1, False),  # but more than the effect on the fit logs
    ],
)
def test_a_curve_competes_by_the_whole_error_or_by_that_of_a_typical_block(
    monkeypatch, after, typical, fitted_to, found
):
    """A friction with load beside a cable of another form: one end of the test log decides."""
    shape = WrongShape(object.__new__(Shape), Proof(0.9, 0.1), 0.9)
    object.__setattr__(shape.shape, "curve", Curve(Coordinate.POSITION))
    curve = built(before=8.0, after=after, typical=typical, fit=built_fit(fitted_to))
    cogs = built_fit(3.0, axis=axis_of(fitted("cogging")))
    effect = built(t=9.0, before=8.0, after=4.0, typical=0.25, fit=cogs)
    monkeypatch.setattr(module, "wrong_shapes", lambda fit, dataset: iter([shape]))
    monkeypatch.setattr(module, "error_in", lambda role, fit, dataset: 8.0)
    monkeypatch.setattr(module, "fit_in_place", lambda fit, dataset, shape: curve)
    assert bool(module._reshaped(BASE, DATASET, [effect])) is found


@pytest.mark.parametrize(
    ("evidence", "after", "typical", "better"),
    [
        (511.0, 3.9, 0.24, True),
        (509.0, 3.9, 0.24, False),  # the fit logs hardly part them
        (511.0, 4.1, 0.24, False),  # of either it may leave no more
        (511.0, 3.9, 0.26, False),
    ],
)
def test_a_curve_that_leaves_no_more_is_better_where_the_fit_logs_part_them(
    evidence, after, typical, better
):
    """A cable that folds, beside a dead time: a soft stop leaves as much of one test log."""
    curve = built(bic=evidence, before=8.0, after=after, typical=typical)
    effect = built(bic=500.0, t=9.0, before=8.0, after=4.0, typical=0.25)
    assert module._is_better(curve, [effect]) is better


@pytest.mark.parametrize(
    ("bend", "held", "t", "after", "bent"),
    [
        ("n", True, 9.0, 3.0, True),
        (None, True, 9.0, 3.0, False),  # a law without what bends its curve
        ("n", False, 9.0, 3.0, False),  # that is free already
        ("n", True, 1.0, 3.0, False),  # no evidence on the held-out logs
        ("n", True, 9.0, 3.7, False),  # an effect leaves about as little
    ],
)
def test_a_friction_is_bent_where_that_does_clearly_better(monkeypatch, bend, held, t, after, bent):
    """A Stribeck curve of another exponent, which a breakaway force that ages imitates."""
    law = fitted("stribeck")
    law = law if held else replace(law, fixed=law.fixed - {"n"})
    base = built_fit(8.0, axis=replace(axis_of(), effects=(law,)))
    shape = WrongShape(object.__new__(Shape), Proof(0.6, 0.2), 0.6)
    curve = Curve(Coordinate.POSITION, rubs=True, bent_by=bend)
    object.__setattr__(shape.shape, "curve", curve)
    object.__setattr__(shape.shape, "effect", "stribeck")
    asked = []

    def bent_so(fit, dataset, its_law, name):
        assert (fit, its_law) == (base, law)
        asked.append(name)
        return built("stribeck", t=t, before=8.0, after=after)

    monkeypatch.setattr(module, "wrong_shapes", lambda fit, dataset: iter([shape]))
    monkeypatch.setattr(module, "bent", bent_so)
    monkeypatch.setattr(module, "_in_place", lambda *_: None)
    rival = built("wear", t=9.0, before=8.0, after=4.0)
    found = module._reshaped(base, DATASET, [rival])
    assert bool(found) is bent
    assert asked == (["n"] if bend and held else [])


CURVES = {
    "lugre": Curve(Coordinate.SPEED, by_direction=True, rubs=True),
    "along": Curve(Coordinate.POSITION, by_direction=True, rubs=True),
    "cable_slab": Curve(Coordinate.POSITION),
    "cogging": Curve(Coordinate.POSITION, period="p"),
}


@pytest.mark.parametrize(
    ("laws", "succeeds", "tried", "found"),
    [
        (("lugre",), ["bent lugre"], ["bent lugre"], "lugre"),
        (("lugre",), ["lugre"], ["bent lugre", "lugre"], "lugre"),
        (
            ("lugre", "along", "cable_slab"), ["along", "cable_slab"],
            ["bent lugre", "lugre", "bent along", "along"], "along",
        ),
        (
            ("lugre", "along", "cable_slab"), ["cable_slab"],
            ["bent lugre", "lugre", "bent along", "along", "bent cable_slab", "cable_slab"],
            "cable_slab",
        ),
        (
            ("cable_slab", "cogging"), ["cogging"],
            ["bent cable_slab", "cable_slab"], None,  # the foremost is none
        ),
        (("cable_slab",), ["bent cable_slab"], ["bent cable_slab"], "cable_slab"),
    ],
)  # fmt: skip
def test_a_friction_that_is_not_clearly_better_leaves_the_place_to_the_next(
    monkeypatch, laws, succeeds, tried, found
):
    """A cable that folds, beside hysteresis: what the friction's curve takes is no exponent's."""
    asked = []

    def shape_of(name):
        shape = WrongShape(object.__new__(Shape), Proof(0.6, 0.1), 0.6)
        object.__setattr__(shape.shape, "curve", CURVES[name])
        object.__setattr__(shape.shape, "effect", name)
        return shape

    def attempt(how):
        def try_it(shape, fit, dataset, rivals):
            asked.append(how + shape.effect)
            return shape if asked[-1] in succeeds else None

        return try_it

    monkeypatch.setattr(module, "wrong_shapes", lambda fit, dataset: map(shape_of, laws))
    monkeypatch.setattr(module, "_bent", attempt("bent "))
    monkeypatch.setattr(module, "_in_place", attempt(""))
    answer = module._reshaped(BASE, DATASET, [])
    assert asked == tried
    assert (answer and answer.effect) == found


# --- a finding against the curve of a law that the model has ---------------------------------


def against(monkeypatch, proof, *, left, before=8.0, fitted_to=0.9):
    """What is found after a missing effect, which leaves 2 N, competed with the cable's curve.

    fitted_to: part that the curve takes of the squared error of 8 N on the fit logs, where the
    effect leaves 2.5 N.
    """
    diagnoses = importlib.import_module("identify.selection.diagnosis")
    missing = replace(made.FOUND[0], tied=())
    missing = replace(missing, chosen=replace(missing.chosen, before=before, after=2.0))
    wrong = replace(missing, effect="cable_slab", kind=FindingKind.WRONG_SHAPE, proof=proof)
    wrong = replace(wrong, chosen=replace(wrong.chosen, after=left))
    shape = SimpleNamespace(
        shape=SimpleNamespace(curve=SimpleNamespace(rubs=False)), effect="cable_slab", proof=proof
    )
    monkeypatch.setattr(diagnoses, "likely_shape", lambda fit, dataset: shape)
    monkeypatch.setattr(diagnoses, "found_wrong", lambda *_: wrong)
    monkeypatch.setattr(diagnoses, "gain_on_fit_logs", lambda *_: fitted_to)
    base = built_fit(8.0, axis=axis_of(fitted("cable_slab")))
    final = built_fit(2.5, axis=base.axis)
    monkeypatch.setattr(AxisDiagnosis, "with_named", final)
    whole = AxisDiagnosis(DATASET, base, (), (), final, Verdict.MISSING_EFFECTS, None)
    return whole._against_shapes(missing, base, (missing,))


@pytest.mark.parametrize(
    ("left", "decoy", "kinds"),
    [
        (2.04, 0.01, ["missing", "wrong_shape"]),  # 0.81 of what the effect takes
        (2.05, 0.01, ["missing"]),
        (2.04, 0.16, ["missing"]),  # no more than a decoy
        (1.0, 0.01, ["missing", "wrong_shape"]),  # clearly less, but it replaces no proved finding
    ],
)
def test_a_curve_that_is_not_proved_must_take_as_much_as_the_effect(
    monkeypatch, left, decoy, kinds
):
    """In coloured noise both take little of the error, and the curve's proof falls just short."""
    found = against(monkeypatch, Proof(0.15, decoy), left=left, before=2.2)
    assert [f.kind.value for f in found] == kinds


@pytest.mark.parametrize(
    ("left", "kinds", "ties"),
    [
        (2.6, ["missing"], [()]),  # the curve leaves far more error
        (2.2, ["missing", "wrong_shape"], [("cable_slab",), ("cogging",)]),  # about as much
        (1.5, ["wrong_shape"], [()]),  # clearly less
    ],
)
def test_a_curve_that_leaves_as_little_is_an_ambiguity_on_both_sides(
    monkeypatch, left, kinds, ties
):
    found = against(monkeypatch, Proof(0.5, 0.0), left=left)
    assert [f.kind.value for f in found] == kinds
    assert [f.tied for f in found] == ties


@pytest.mark.parametrize(("part", "rivals"), [(0.877, False), (0.879, True)])
def test_a_curve_takes_the_place_of_a_finding_only_where_it_does_as_well_on_the_fit_logs(
    monkeypatch, part, rivals
):
    """8 N there without the effect and 2.5 N with it: the curve may leave 2.5^2 / 0.8."""
    found = against(monkeypatch, Proof(0.9, 0.0), left=1.5, fitted_to=part)
    assert [f.kind.value for f in found] == (["wrong_shape"] if rivals else ["missing"])
