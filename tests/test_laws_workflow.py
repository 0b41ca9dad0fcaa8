"""What a loop's functions hand on, and which changes of a refit are told."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import built_results as made
import numpy as np
import pytest
from built_fits import CATALOGUE, PLAIN, axis_of, built, built_fit, built_study, fitted

from identify import demo, explanations, given, workflow
from identify.contest import Explanation
from identify.diagnose import Verdict
from identify.explanations import differing_axis, explained, require_different
from identify.fit import Outcome, finished, rms
from identify.residual import residual
from identify.signature import FORCE, draw, exemplary_motion, signature
from identify.workflow import _addition, add, moved_parameters
from twin.effects import Catalogue
from twin.errors import InputError
from twin.model import StageModel

# The rules as they were decided.
LEAST_FORCE, AT_FLOOR, MOST_TOLD = 0.1, 1.3, 3


# --- the axis of the answer -----------------------------------------------------------------


def axis_with(verdict: Verdict, bic: float = 1.0, ratio: float = 2.0):
    steps = made.diagnosis_of().steps[:1] if verdict.name in ("MISSING_EFFECT", "AMBIGUOUS") else ()
    ranking = (built("wear", bic=bic),)
    return made.diagnosis_of(verdict, steps=steps, ranking=ranking, base=built_fit(ratio, 1.0))


def leading(**axes) -> str:
    found = workflow.Diagnosis(made.MODEL, axes, made.Comparison(made.MODEL, {}))
    return next(name for name, d in axes.items() if d is found.leading)


def test_the_answer_is_about_the_axis_with_the_strongest_verdict():
    order = [
        Verdict.NOTHING_MISSING,
        Verdict.UNEXPLAINED,
        Verdict.AMBIGUOUS,
        Verdict.MISSING_EFFECT,
    ]
    for i, weak in enumerate(order):
        for strong in order[i + 1 :]:
            axes = {"a": axis_with(weak, bic=900.0, ratio=9.0), "b": axis_with(strong)}
            assert leading(**axes) == "b"
            assert leading(**dict(reversed(axes.items()))) == "b"


@pytest.mark.parametrize("verdict", list(Verdict))
def test_of_like_verdicts_evidence_or_else_the_error_decides(verdict):
    named = verdict in (Verdict.MISSING_EFFECT, Verdict.AMBIGUOUS)
    a = axis_with(verdict, bic=90.0, ratio=2.0)
    b = axis_with(verdict, bic=80.0, ratio=3.0)
    assert leading(a=a, b=b) == ("a" if named else "b")
    assert leading(a=a, b=replace(b, ranking=())) == ("a" if named else "b")


# --- parameters that moved ------------------------------------------------------------------


def moved(monkeypatch, old: dict, new: dict, width: float = 0.03):
    before = built_fit(1.0, axis=axis_of(fitted("constant_force", **old)))
    after = built_fit(1.0, axis=axis_of(fitted("wear"), fitted("constant_force", **new)))
    widths = {before: 0.04, after: width}
    monkeypatch.setattr(
        workflow, "half_widths", lambda fit: np.full(len(fit.scaling.where), widths[fit])
    )
    return moved_parameters(before, after)


@pytest.mark.parametrize(("f0", "told"), [(1.049, False), (1.051, True), (0.949, True)])
def test_a_parameter_moved_where_it_leaves_both_intervals(monkeypatch, f0, told):
    found = moved(monkeypatch, {"F0": 1.0}, {"F0": f0})
    assert bool(found) is told
    if told:
        assert found == (
            f"constant_force.F0 moved from 1 to {f0:.4g} N: more than its interval",
        )  # fmt: skip


@pytest.mark.parametrize(("f0", "said"), [(0.29, "collapsed"), (0.31, "moved")])
def test_a_strength_collapsed_where_less_than_a_third_is_left(monkeypatch, f0, said):
    (found,) = moved(monkeypatch, {"F0": 1.0}, {"F0": f0})
    assert found.startswith(f"constant_force.F0 {said} from 1 to {f0} N")
    assert ("stood in for" in found) is (said == "collapsed")
    wide = moved(monkeypatch, {"F0": 1.0}, {"F0": f0}, width=5.0)
    assert bool(wide) is (said == "collapsed")
    assert moved(monkeypatch, {"F0": 0.039}, {"F0": 0.0}) == ()


# --- add ------------------------------------------------------------------------------------


def test_an_effect_is_added_where_it_helps_most(monkeypatch):
    both = SimpleNamespace(
        fits={"x": built_fit(3.0), "y": built_fit(4.0)}, studies={"x": "sx", "y": "sy"}
    )
    tried = []

    def attempt(fit, study, effect):
        tried.append((fit, study, effect.name))
        return built(effect, bic={"sx": 40.0, "sy": 70.0}[study], axis=study[1])

    seen = []
    monkeypatch.setattr(workflow, "fit", lambda *a, **k: seen.append((a, k)) or both)
    monkeypatch.setattr(workflow, "try_effect", attempt)
    monkeypatch.setattr(workflow, "_addition", lambda best, before, logs, given: (best, given))
    wear = CATALOGUE["wear"]
    best, _ = add(wear, made.MODEL, "logs", "held", window=0.07)
    assert best.axis == "y"
    assert [t[1:] for t in tried] == [("sx", "wear"), ("sy", "wear")]
    assert [t[0] for t in tried] == list(both.fits.values())
    assert seen[0][0][1:] == ("logs", "held")
    assert seen[0][1]["window"] == 0.07
    assert add(wear, made.MODEL, "logs", axis="x")[0].axis == "x"
    with pytest.raises(InputError, match="already"):
        add(CATALOGUE["coulomb_viscous"], made.MODEL, "logs")
    with pytest.raises(InputError, match="no axis"):
        add(wear, made.MODEL, "logs", axis="z")
    both.fits.pop("y")
    with pytest.raises(InputError, match="does not move"):
        add(wear, made.MODEL, "logs", axis="y")


@pytest.mark.parametrize("kept", [True, False])
def test_an_addition_records_errors_before_and_after(monkeypatch, kept):
    base = built_fit(7.3)
    best = built("cogging", fit=built_fit(2.9, axis=axis_of(fitted("cogging"))), t=9 if kept else 1)
    study = replace(made.STUDY, holdout=("held",))
    before = SimpleNamespace(
        fits={"x": base}, studies={"x": study},
        model=StageModel("m", {"x": PLAIN, "y": replace(PLAIN, mass=3.0)}),
    )  # fmt: skip
    runs = []

    def run(model, log, stage="reduced"):
        effects = len(model.axes["x"].effects)
        runs.append((tuple(model.axes), effects, log, getattr(stage, "__name__", stage)))
        return effects, stage

    errors = {(1, "reduced"): 5.1, (2, "reduced"): 1.7}
    monkeypatch.setattr(workflow, "free_run", run)
    monkeypatch.setattr(workflow, "rms_error", lambda r, axis: errors.get(r, 1.9))
    monkeypatch.setattr(
        workflow, "holdout_error", lambda fit, s: {7.3: 8.1, 2.9: 3.3}[round(fit.error, 9)]
    )
    monkeypatch.setattr(workflow, "moved_parameters", lambda a, b: (f"{a.error > b.error}",))
    whole = before.model.with_axis("x", axis_of(fitted("empirical_map")))
    found = _addition(best, before, {"first": "log 1", "second": "log 2"}, whole)
    step = found.step
    assert (step.action, step.effect, step.axis) == ("add", "cogging", "x")
    assert (step.fit_error_before, step.fit_error_after) == pytest.approx((7.3, 2.9))
    assert (step.holdout_error_before, step.holdout_error_after) == (8.1, 3.3)
    assert (found.position_error, found.replayed) == ((5.1, 1.7), 1.9)
    assert {r[0] for r in runs} == {("x",)}
    assert {r[2] for r in runs} == {"log 1"}
    assert [r[3] for r in runs].count("MujocoStage") == 1
    assert next(r[1] for r in runs if r[3] == "MujocoStage") == 2
    assert found.notes[0] == "True"
    assert "empirical_map made way" in found.notes[1]
    assert found.model.axes["x"] is best.fit.axis
    assert found.model.history == (step,)
    assert found.kept is kept


# --- what refitting changed -----------------------------------------------------------------


@pytest.fixture(scope="module")
def study():
    return built_study("run")


def refit_of(monkeypatch, study, given_axis, widths=1e-9, floor=1e-3, catalogue=()):
    fit = finished(PLAIN, PLAIN, study.fit, Outcome.CONVERGED)
    fit.__dict__["floor"] = floor
    monkeypatch.setattr(given, "half_widths", lambda f: np.full(len(f.scaling.where), widths))
    return given.refit(given_axis, fit, Catalogue([CATALOGUE[n] for n in catalogue])), fit


def test_a_change_is_told_with_the_force_that_it_makes(monkeypatch, study):
    off = replace(PLAIN, mass=5.8)
    found, fit = refit_of(monkeypatch, study, off, catalogue=("payload_mass", "constant_force"))
    error = rms(residual(off, study.fit)[fit.kept])
    assert (found.given, found.refitted) == (pytest.approx(error), pytest.approx(fit.error))
    (change,) = found.changes
    force = 0.5 * np.concatenate([w.acceleration for w in study.fit])[fit.kept]
    assert change.force == pytest.approx(rms(force), rel=1e-9)
    assert (change.label, change.before, change.after, change.unit) == ("mass", 5.8, 5.3, "kg")
    assert change.alike == ("payload_mass",)
    assert refit_of(monkeypatch, study, off, widths=0.49)[0].changes != ()
    assert refit_of(monkeypatch, study, off, widths=0.51)[0].changes == ()


@pytest.mark.parametrize(("part", "told"), [(0.99, False), (1.01, True)])
def test_only_an_error_above_the_floor_is_complained_of(monkeypatch, study, part, told):
    off = replace(PLAIN, mass=5.8)
    _, fit = refit_of(monkeypatch, study, off)
    error = rms(residual(off, study.fit)[fit.kept])
    found, _ = refit_of(monkeypatch, study, off, floor=error / AT_FLOOR / part)
    assert bool(found.changes) is told


def test_the_changes_that_make_most_force_are_told_first(monkeypatch, study):
    friction = replace(PLAIN.effects[0], values={"Fc": 0.5, "Fs": 0.5, "sigma2": 0.9})
    off = replace(PLAIN, mass=5.8, effects=(friction,))
    found, _ = refit_of(monkeypatch, study, off)
    forces = [c.force for c in found.changes]
    assert forces == sorted(forces, reverse=True)
    assert len(forces) <= MOST_TOLD
    assert all(f > LEAST_FORCE * found.given for f in forces)
    assert found.changes[0].label == "mass"


# --- explanations ---------------------------------------------------------------------------


def test_an_effect_or_a_model_is_an_explanation(monkeypatch, study):
    own = axis_of(fitted("wear"), fitted("cogging", a1=0.7))
    stage = StageModel("stage", {"x": own})
    other = StageModel(
        "other", {"x": replace(axis_of(mass=6.0), hardware=replace(own.hardware, force_limit=7.0))}
    )
    monkeypatch.setattr(
        explanations, "_supposed", lambda effect, axis, study: (effect.name, axis.names)
    )
    rivals = [CATALOGUE["cogging"], CATALOGUE["constant_force"], other]
    first, second, third = explained(rivals, stage, study, False)
    assert first == Explanation("cogging", own)
    base = ("coulomb_viscous", "wear")
    assert second == Explanation("constant_force", ("constant_force", base))
    assert third == Explanation("other", replace(other.axes["x"], hardware=own.hardware))
    monkeypatch.setattr(explanations, "fit_thoroughly", lambda axis, s: built_fit(1.0, axis=axis))
    monkeypatch.setattr(
        explanations, "try_effect", lambda fit, s, e: SimpleNamespace(
            fit=SimpleNamespace(axis=(fit.axis.names, e.name)))
    )  # fmt: skip
    first, second, third = explained(rivals, stage, study, True)
    assert (first.axis, second.axis) == ((base, "cogging"), (base, "constant_force"))
    assert third.axis.mass == 6.0


def test_an_effect_without_data_is_ten_floors_strong(monkeypatch, study):
    found = explanations._supposed(CATALOGUE["constant_force"], PLAIN, study)
    floor = explanations.floor_of(PLAIN, study.fit)
    added = residual(found, study.fit) - residual(PLAIN, study.fit)
    assert rms(added) == pytest.approx(10.0 * floor, rel=1e-6)


def test_models_differ_on_the_axis_where_they_do():
    a = StageModel("a", {"x": PLAIN, "y": PLAIN})
    b = StageModel("b", {"x": PLAIN, "y": replace(PLAIN, mass=6.0)})
    c = StageModel("c", {"x": PLAIN, "y": axis_of(fitted("wear"))})
    assert differing_axis([a, b], a) == "y"
    assert differing_axis([a, c], a) == "y"
    assert differing_axis([a, replace(a, name="d")], a) == "x"
    assert differing_axis([CATALOGUE["wear"]], a) == "x"
    require_different([a, b, CATALOGUE["wear"]])
    with pytest.raises(InputError, match="a against itself"):
        require_different([a, b, a])


# --- signature and demonstration ------------------------------------------------------------


def test_the_signature_of_an_effect_is_drawn_at_its_force(tmp_path):
    motion, force = signature(CATALOGUE["constant_force"], CATALOGUE)
    assert rms(force) == pytest.approx(FORCE, rel=1e-6)
    assert np.ptp(force) == pytest.approx(0.0, abs=1e-12)
    again = exemplary_motion()
    np.testing.assert_array_equal(motion.position, again.position)
    np.testing.assert_allclose(np.gradient(again.position, 1e-3), again.velocity)
    assert np.abs(again.position).max() == pytest.approx(0.15)
    assert len(again.position) == 21_000
    rest = again.command - 10.0 * np.gradient(again.velocity, 1e-3)
    np.testing.assert_allclose(rest, 0.3 * np.sign(again.velocity), atol=1e-12)
    np.testing.assert_array_equal(again.raw, [again.velocity, again.command])
    np.testing.assert_allclose(np.gradient(again.others[0], 1e-3), again.others[1])
    np.testing.assert_allclose(np.gradient(again.others[1], 1e-3), again.others[2])
    peaks = [np.abs(again.velocity[a:b]).max() for a, b in ((0, 3000), (3000, 9000), (9000, 21000))]
    np.testing.assert_allclose(peaks, 0.15 * np.pi / np.array([1.5, 3.0, 6.0]), rtol=1e-2)
    with pytest.raises(InputError, match="end the name"):
        draw(CATALOGUE["constant_force"], CATALOGUE, tmp_path / "f.txt")


@pytest.mark.parametrize(("part", "seen"), [(0.49, True), (0.51, False)])
def test_a_hidden_effect_shows_where_half_of_it_cannot_be_absorbed(monkeypatch, part, seen):
    monkeypatch.setattr(demo, "hidden_part", lambda hidden, base, study: part)
    assert demo.shows(None, None, None) is seen


def test_what_is_hidden_in_a_demonstration_is_physics_that_is_absent():
    machine = StageModel("m", {"x": axis_of(fitted("wear"))})
    hidden = {n for n, e in CATALOGUE.items() if demo._can_hide(e, machine)}
    assert hidden == {
        n
        for n, e in CATALOGUE.items()
        if e.kind.name in ("FORCE", "MODIFIER", "ACTUATION")
        and n not in ("wear", "empirical_map", "learned_residual")
    }


def test_the_fall_of_the_error_is_told_in_its_order():
    found = demo._fallen(made.addition())
    assert "from 7830.00 mN to 4910.00 mN, 2 times; the noise floor is 1030.00 mN" in found
