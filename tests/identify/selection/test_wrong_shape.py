"""A law of the wrong shape is named, and no other, where a free curve does better in its place."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import PLAIN, axis_of, built, built_dataset, built_machine, fitted
from identify.selection.decoys import Proof
from identify.selection.reshaping import curve_in_place
from identify.selection.wrong_shape import best_shape, gain_on_fit_logs, wrong_shape, wrong_shapes

from identify.dataset.given_logs import Role
from identify.estimation.errors import error_in
from identify.estimation.fit import Outcome, finished, fit_axis
from identify.estimation.force_balance import residual
from identify.output.words.findings import advice, finding_in_words, shape_in_words
from identify.selection.diagnosis import AxisDiagnosis, Step, Verdict
from identify.selection.findings import (
    FindingKind,
    found_reshaped,
    found_wrong,
    share_explained,
    with_shape,
)
from identify.selection.found_shape import AHEAD, BEHIND, BOTH, Drawn, FoundShape, found_shape
from identify.selection.nonparametric import fit_in_place
from identify.selection.residual_dependence import Dependence
from identify.workflow import add_shape
from twin.curve import Coordinate
from twin.effects import load_catalogue
from twin.errors import InputError
from twin.model.machine import MachineModel

CATALOGUE = load_catalogue()
CABLE = fitted("cable_slab", k1=1.5)
MODEL = axis_of(CABLE, fitted("cogging", p=0.017, a1=0.1))
OWN = MODEL.names


def machine(dataset, force, model=MODEL):
    return built_machine(dataset, model, force)


@pytest.fixture(
    scope="module",
    params=[("held",), pytest.param((), marks=pytest.mark.slow)],
    ids=["held out", "left out"],
)
def dataset(request):
    return built_dataset("one", "two", held=request.param)


def base_of(dataset, model=MODEL):
    return finished(model, model, dataset.fit, Outcome.CONVERGED)


def step(x, _):
    return 0.2 * np.tanh(x / 0.004)


def bump(x, _):
    return 0.1 * np.exp(-(((np.mod(x / 0.017, 1.0) - 0.5) / 0.06) ** 2))


def rubs(x, way):
    """More friction at one place forwards, at another backwards."""
    return -0.1 * way * np.exp(-(((x - 0.01 * way) / 0.004) ** 2))


CASES = [(step, "cable_slab", BOTH), (bump, "cogging", BOTH), (rubs, "coulomb_viscous", AHEAD)]


@pytest.mark.parametrize(("force", "effect", "direction"), CASES)
def test_the_law_whose_curve_differs_is_told_and_its_curve_found(
    dataset, force, effect, direction
) -> None:
    there = machine(dataset, force)
    base = base_of(there)
    found = wrong_shape(base, there)
    assert found is not None
    assert found.effect == effect
    drawn = found_shape(found.shape, base, there)
    assert set(drawn.curves) == ({BOTH} if direction == BOTH else {AHEAD, BEHIND})
    for name, curve in drawn.curves.items():
        way = {BOTH: 0.0, AHEAD: 1.0, BEHIND: -1.0}[name]
        missing = force(drawn.coordinate, way)
        visited = np.abs(drawn.coordinate - np.mean(drawn.coordinate)) < 0.3 * np.ptp(
            drawn.coordinate
        )
        # What a cable gives, a cubic of position, belongs as well to the model's own.
        where = drawn.coordinate[visited] - np.mean(drawn.coordinate)
        off = (curve.found - curve.assumed - missing)[visited]
        off = off - np.polynomial.Polynomial.fit(where, off, 3)(where)
        assert np.std(off) < 0.2 * np.std(missing[visited])
        assert (np.abs(off) < 2.0 * curve.band[visited]).mean() > 0.7
    words = shape_in_words(effect, drawn)
    assert f"The law of {effect} is off most at position" in words
    assert " m" in words


def test_each_law_that_is_proved_wrong_is_told_most_first(dataset) -> None:
    there = machine(dataset, lambda x, d: step(x, d) + 3.0 * bump(x, d))
    found = list(wrong_shapes(base_of(there), there))
    assert {w.effect for w in found} >= {"cable_slab", "cogging"}
    assert all(w.proof.holds for w in found)
    first = wrong_shape(base_of(there), there)
    assert first is not None
    assert found[0].effect == first.effect
    taken = [max(w.taken, w.proof.gain) for w in found[:2]]
    assert taken[0] > 0.9 * taken[1]


def test_where_no_shape_is_wrong_none_is_told(dataset) -> None:
    there = machine(dataset, lambda x, _: 0.0 * x)
    assert wrong_shape(base_of(there), there) is None


@pytest.mark.parametrize(("force", "effect"), [case[:2] for case in CASES[:2]])
def test_what_a_shape_explains_is_told_by_the_fit_without_its_curve(dataset, force, effect) -> None:
    there = machine(dataset, force)
    base = base_of(there)
    shape = wrong_shape(base, there)
    assert shape is not None
    final = fit_in_place(base, there, shape.shape).fit
    assert (effect in final.axis.names) is shape.shape.beside  # else its law comes back
    found = found_reshaped(shape, base, base, final, there)
    assert found.chosen.after == error_in(there.chosen_on, final, there)
    alone = fit_axis(base.axis, there.fit)
    assert found.chosen.before == pytest.approx(error_in(there.chosen_on, alone, there), rel=1e-3)
    assert found.explains == share_explained(found.tested, base, there)
    assert found_reshaped(shape, base, base, base, there).chosen == (
        found_wrong(shape, base, base, there).chosen
    )


def test_what_a_curve_takes_is_also_told_of_the_fit_logs(dataset) -> None:
    there, plain = machine(dataset, step), machine(dataset, lambda x, _: 0.0 * x)
    shape = wrong_shape(base_of(there), there)
    assert shape is not None
    assert gain_on_fit_logs(shape, base_of(there), there) > 0.9
    assert gain_on_fit_logs(shape, base_of(plain), plain) < 0.1


@pytest.mark.slow
@pytest.mark.parametrize(("force", "effect"), [case[:2] for case in CASES])
def test_in_the_law_s_place_the_curve_brings_the_error_to_the_noise(dataset, force, effect) -> None:
    there = machine(dataset, force)
    base = base_of(there)
    shape = best_shape(base, there, effect)
    assert shape is not None
    candidate = fit_in_place(base, there, shape.shape)
    assert shape.proof.holds
    assert candidate.fit.error < 0.2 * base.error
    assert candidate.gain.after < 0.3 * candidate.gain.before
    stays = effect != "cogging"  # what does not repeat goes on where the logs have not been
    assert (effect in candidate.fit.axis.names) is stays is shape.shape.beside
    assert candidate.effect.free_shape


def test_a_shape_is_the_verdict_where_it_is_all_that_is_found(dataset) -> None:
    there = machine(dataset, step)
    base = base_of(there)
    rest = Dependence(0.5, "position", None, "m", {"position": 0.5})
    lost = AxisDiagnosis(there, base, (), (), base, Verdict.UNEXPLAINED, rest)
    told = lost.with_findings()
    assert told.verdict is Verdict.WRONG_SHAPE
    (finding,) = told.findings
    assert (finding.effect, finding.kind) == ("cable_slab", FindingKind.WRONG_SHAPE)
    assert finding.tested.after < 0.5 * finding.tested.before
    assert finding.tested is finding.chosen
    assert finding.explains > 0.7
    if there.holdout:  # a test log that is like the selection log has the same errors
        both = replace(there, test=there.holdout)
        same = found_wrong(wrong_shape(base, both), base, base, both)
        assert (same.tested.on, same.chosen) == (Role.TEST, finding.chosen)
        assert same.tested.before == same.chosen.before
        assert same.tested.after == pytest.approx(same.chosen.after, rel=1e-6)
        assert same.explains == pytest.approx(finding.explains, rel=1e-6)
    assert isinstance(finding.proof, Proof)
    assert finding.shape is not None
    quiet = replace(lost, verdict=Verdict.NOTHING_MISSING, unexplained=None).with_findings()
    assert (quiet.verdict, quiet.findings) == (Verdict.NOTHING_MISSING, ())
    assert PLAIN.names


@pytest.mark.parametrize(
    ("effect", "model", "message"),
    [
        ("constant_force", MODEL, "constant_force assumes no curve"),
        ("roller_spikes", MODEL, "no effect 'roller_spikes'; `twin add roller_spikes` adds it"),
    ],
)
def test_what_has_no_shape_to_give_is_one_line(effect, model, message) -> None:
    with pytest.raises(InputError, match=message):
        add_shape(CATALOGUE[effect], MachineModel("m", {"x": model}), {})


def test_a_curve_takes_part_in_the_selection_where_no_effect_leaves_as_little(dataset) -> None:
    there = machine(dataset, step)
    base = base_of(there)
    found = curve_in_place(base, there, (), OWN)
    assert found is not None
    assert found.shape.effect == "cable_slab"
    assert found.fit.error < 0.3 * base.error
    before = float(np.sqrt(np.mean(residual(base.axis, there.holdout or there.fit) ** 2)))
    better = built(before=before, after=1e-4 * before)
    assert curve_in_place(base, there, (better,), OWN) is None
    assert curve_in_place(found.fit, there, (), OWN) is None  # has it already
    nothing = machine(dataset, lambda x, _: 0.0 * x)
    assert curve_in_place(base_of(nothing), nothing, (), OWN) is None


def test_a_stribeck_curve_of_another_exponent_is_told_by_its_exponent(dataset) -> None:
    """And not as the free curve of a speed, beside which the exponent could not be told."""
    values = {"Fc": 0.3, "Fs": 1.2, "v0": 0.03, "sigma2": 0.5}
    held = replace(axis_of(CABLE), effects=(fitted("stribeck", **values), CABLE))
    true = held.with_effect(fitted("stribeck", **values, n=0.7))
    there = machine(dataset, lambda x, _: 0.0 * x, true)
    base = fit_axis(held, there.fit)
    found = curve_in_place(base, there, (), held.names)
    assert found is not None
    assert found.shape.effect == "stribeck"
    assert found.fit.axis["stribeck"].values["n"] == pytest.approx(0.7, abs=0.05)
    assert found.fit.error < 0.2 * base.error
    finding = found_reshaped(found.shape, base, base, found.fit, there)
    assert finding.bend is not None
    assert (finding.bend.parameter, finding.bend.held, finding.bend.unit) == ("n", 2.0, "1")
    assert finding.chosen.after < 0.2 * finding.chosen.before
    assert finding.parameters == dict(found.fit.axis["stribeck"].values)
    drawn = finding.shape
    assert drawn is not None
    assert (drawn.over, drawn.unit, drawn.force_unit) == (Coordinate.SPEED, "m/s", "N")
    own = 0.3 + 0.9 * np.exp(-((drawn.coordinate / 0.03) ** 0.7)) + 0.5 * drawn.coordinate
    for name, way in ((AHEAD, 1.0), (BEHIND, -1.0)):
        curve = drawn.curves[name]
        np.testing.assert_allclose(-way * curve.found, own, rtol=0.01)
        off = np.abs(curve.assumed - curve.found)
        assert off.max() > 0.05
        assert (off > 3.0 * curve.band).mean() > 0.5
        assert (np.abs(-way * curve.found - own) < 2.0 * curve.band).mean() > 0.7
    words = finding_in_words(finding)
    assert "stribeck has another shape, which its law with n = 0.7 has" in words
    assert "with n = 2 the error" in words
    assert advice((finding,)).startswith("fixed = [] for stribeck in the model file")
    assert curve_in_place(found.fit, there, (), held.names) is None
    # A friction that another one replaced since has no exponent to tell.
    gone = found.fit.axis.with_effect(fitted("coulomb_viscous"))
    replaced = finished(gone, gone, there.fit, Outcome.CONVERGED)
    assert found_reshaped(found.shape, base, base, replaced, there).bend is None


def test_each_law_of_a_wrong_shape_gets_a_curve_of_its_own(dataset) -> None:
    there = machine(dataset, lambda x, d: step(x, d) + 9.0 * bump(x, d))
    first = curve_in_place(base_of(there), there, (), OWN)
    assert first is not None
    second = curve_in_place(first.fit, there, (), OWN)
    assert second is not None
    assert {first.shape.effect, second.shape.effect} == {"cable_slab", "cogging"}
    assert {"free_curve", "free_curve_2"} <= set(second.fit.axis.names)
    assert second.fit.ratio < 0.5 * first.fit.ratio
    assert curve_in_place(second.fit, there, (), OWN) is None


def test_a_missing_effect_of_another_shape_is_resembled(dataset) -> None:
    """Cogging with bumps for sines on an axis whose model has none."""
    there = machine(dataset, bump)
    lacking = axis_of(CABLE)
    base = finished(lacking, lacking, there.fit, Outcome.CONVERGED)
    candidate = built("cogging", fit=base_of(there))
    curve = curve_in_place(candidate.fit, there, (), OWN)
    assert curve is not None
    steps = (Step(candidate, (), proved=False),)
    done = AxisDiagnosis(there, base, (), steps, curve.fit, Verdict.UNEXPLAINED, None)
    told = done.beside(base, (curve,)).with_findings()
    assert (told.verdict, told.named) == (Verdict.MISSING_EFFECTS, ("cogging",))
    (finding,) = told.findings
    assert (finding.effect, finding.kind) == ("cogging", FindingKind.RESEMBLES)
    assert finding.shape is not None
    assert "what is missing resembles cogging, in another shape" in finding_in_words(finding)
    assert advice(told.findings).startswith("twin add cogging, then twin add --shape cogging")
    before = with_shape((finding,), replace(finding, kind=FindingKind.WRONG_SHAPE))
    assert before == (finding,)


def test_what_is_found_beside_a_curve_is_told_with_it(dataset) -> None:
    there = machine(dataset, step)
    base = base_of(there)
    curve = curve_in_place(base, there, (), OWN)
    assert curve is not None
    alone = AxisDiagnosis(there, curve.fit, (), (), curve.fit, Verdict.NOTHING_MISSING, None)
    told = alone.beside(base, (curve,)).with_findings()
    assert (told.base, told.verdict) == (base, Verdict.WRONG_SHAPE)
    assert [f.effect for f in told.findings] == ["cable_slab"]
    assert alone.beside(base, ()) is alone


def test_a_curve_is_drawn_where_the_logs_have_been(dataset) -> None:
    there = machine(dataset, step)
    base = base_of(there)
    found = best_shape(base, there, "cable_slab")
    assert found is not None
    drawn = found_shape(found.shape, base, there)
    been = np.concatenate([log.motion.position for log in there.fit])
    low, high = been.min(), been.max()
    apart = np.diff(drawn.coordinate)[0]
    beyond = (drawn.coordinate < low - apart) | (drawn.coordinate > high + apart)
    within = (drawn.coordinate > low + apart) & (drawn.coordinate < high - apart)
    for curve in (drawn.curves[BOTH].assumed, drawn.curves[BOTH].found, drawn.curves[BOTH].band):
        assert beyond.any()
        assert np.isnan(curve[beyond]).all()
        assert np.isfinite(curve[within]).all()
    assert "The law of cable_slab is off most at position" in shape_in_words("cable_slab", drawn)
    gone = "The force is gone at standstill."
    assert gone in shape_in_words("a", replace(drawn, lets_go=True))
    assert gone not in shape_in_words("a", replace(drawn, lets_go=False))


def test_the_place_told_is_where_the_curves_surely_differ_most() -> None:
    """Near standstill a curve is hardly known: what it shows there is no statement."""
    speed, flat = np.array([1e-3, 0.02, 0.1]), np.full(3, -0.3)
    curves = {
        AHEAD: Drawn(flat, flat - [0.5, 0.02, 0.0], np.array([0.6, 1e-3, 1e-3])),
        BEHIND: Drawn(-flat, -flat + [0.0, 0.01, 0.0], np.full(3, 1e-3)),
    }
    shape = FoundShape(Coordinate.SPEED, speed, "m/s", None, False, "N", curves)
    told = shape_in_words("lugre", shape)
    assert "speed 0.02 m/s, forwards: it assumes -0.3, the logs show -0.32 N" in told
