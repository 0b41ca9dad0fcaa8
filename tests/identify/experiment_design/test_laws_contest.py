"""Which experiment decides: information and evidence against direct formulas."""

from __future__ import annotations

import importlib
import math
from dataclasses import replace
from types import SimpleNamespace

import built_results as made
import numpy as np
import pytest
from built_fits import HARDWARE, PLAIN, axis_of, built_fit, built_motion, fitted

from identify.dataset.prepared_log import PreparedLog, moving
from identify.estimation.evidence import effective_samples, evidence
from identify.estimation.force_balance import jacobian, residual
from identify.experiment_design import discrimination as module
from identify.experiment_design.discrimination import (
    Arena,
    Explanation,
    _discriminating,
    _informative,
    contest,
    favoured,
    refitted,
    require_within_limits,
)
from twin.errors import CannotRun
from twin.experiments.kinds import Tracking
from twin.logs import AxisLog, Log
from twin.model.machine import MachineModel
from twin.model.parameters import free_parameters, read

plans = importlib.import_module("identify.experiment_design.plan")
STAGE = MachineModel("s", {"x": PLAIN, "y": replace(PLAIN, mass=3.1)}, 2000.0)
ONE = axis_of(fitted("quadratic_drag", c=0.9)).with_effect(fitted("lugre", Fc=0.3, Fs=0.3))
TWO = axis_of(fitted("constant_force", F0=0.2)).with_effect(fitted("lugre", Fc=0.3, Fs=0.3))
FIRST, SECOND = Explanation("one", ONE), Explanation("two", TWO)
MOTION, OLD = (
    built_motion("new", 2.0, seed=4),
    PreparedLog.of(built_motion("old", 1.5, seed=5), 0.04),
)


def arena(*explanations: Explanation, logs=(OLD,), test_function=0.04) -> Arena:
    return Arena(STAGE, "x", explanations, logs, test_function)


def absorbed(force, columns):
    """What least squares leaves of a force."""
    scaled = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    return force - scaled @ np.linalg.lstsq(scaled, force, rcond=1e-12)[0]


# --- numbers of one experiment --------------------------------------------------------------


def test_the_evidence_is_what_the_nearest_rival_leaves_in_expectation():
    found = _discriminating(arena(FIRST, SECOND), Tracking(2.0), MOTION)
    logs = arena(FIRST, SECOND).logs_with(MOTION)
    forces = [residual(a, logs) for a in (ONE, TWO)]
    columns = [jacobian(a, logs, free_parameters(a)) for a in (ONE, TWO)]
    noise = absorbed(forces[0], columns[0])
    cases = []
    for truth, rival in ((0, 1), (1, 0)):
        left = absorbed(forces[rival] - forces[truth], columns[rival])
        added = columns[truth].shape[1] - columns[rival].shape[1]
        cases.append((evidence(np.hypot(noise, left), noise, added).delta_bic, left))
    gain, left = min(cases, key=lambda c: c[0])
    new = len(logs[1])
    assert found.gain == pytest.approx(gain, rel=1e-3)
    np.testing.assert_allclose(found.where, left[-new:] ** 2, rtol=1e-2, atol=1e-9)
    assert found.difference == pytest.approx(np.sqrt(np.mean(left[-new:] ** 2)), rel=1e-3)
    assert found.floor == pytest.approx(np.sqrt(np.mean(noise[-new:] ** 2)), rel=1e-3)
    assert found.duration == pytest.approx(2.0)
    assert found.motion.motion is MOTION


def test_the_information_is_half_the_log_determinant_beside_the_prior():
    found = _informative(arena(FIRST), Tracking(2.0), MOTION)
    logs = arena(FIRST).logs_with(MOTION)
    where = free_parameters(ONE)
    noise = residual(ONE, logs)
    sigma = np.sqrt(np.mean(noise**2) * len(noise) / effective_samples(noise))
    starts = [abs(c.parameter.start) for c in where]
    prior = np.maximum(np.abs(read(ONE, where)), starts)
    scaled = jacobian(ONE, logs, where) * prior / sigma
    information = np.eye(len(where)) + scaled.T @ scaled
    eigenvalues = np.linalg.eigvalsh(information)
    assert found.gain == pytest.approx(0.5 * np.sum(np.log(eigenvalues)), rel=1e-6)
    leverage = np.einsum("ij,jk,ik->i", scaled, np.linalg.inv(information), scaled)
    np.testing.assert_allclose(found.where, leverage[-len(logs[1]) :], rtol=1e-4, atol=1e-12)
    assert math.isnan(found.difference)
    assert found.floor == pytest.approx(np.sqrt(np.mean(noise[-len(logs[1]) :] ** 2)))
    alone = _informative(arena(FIRST, logs=()), Tracking(2.0), MOTION)
    assert alone.gain < found.gain  # more logs, more information


def test_windows_at_rest_count_for_nothing():
    sticking = Explanation("sticks", PLAIN)
    still = np.where(np.arange(2000) < 700, 0.0, MOTION.velocity)
    rest = replace(MOTION, signals=np.stack([MOTION.position, still, MOTION.command]))
    found = _informative(arena(sticking), Tracking(2.0), rest)
    logs = arena(sticking).logs_with(rest)
    kept = moving(logs, True)[-len(logs[1]) :]
    assert 0 < kept.sum() < len(kept)
    assert not found.where[~kept].any()
    assert found.where[kept].all()
    both = _discriminating(arena(sticking, SECOND), Tracking(2.0), rest)
    assert not both.where[~kept].any()


def test_the_logs_favour_the_explanation_with_the_least_error():
    good, bad = Explanation("good", PLAIN), Explanation("bad", replace(PLAIN, mass=5.4))
    worse = Explanation("worse", replace(PLAIN, mass=6.0))
    kept = moving([OLD], True)
    left = [residual(e.axis, [OLD])[kept] for e in (bad, good)]
    for order in ((good, bad, worse), (worse, bad, good), (bad, worse, good)):
        name, proof = favoured(arena(*order))
        assert name == "good"
        assert proof == pytest.approx(evidence(*left, 0).delta_bic)
        assert proof > 0.0
    assert favoured(arena(bad, good, logs=())) == ("bad", 0.0)
    assert favoured(arena(bad)) == ("bad", 0.0)


def refitted_trial(monkeypatch, gains):
    """refitted where the refits leave a residual whose size is that of the rival by the truth."""
    rng = np.random.default_rng(1)
    noise = rng.standard_normal(len(PreparedLog.of(MOTION, 0.04)) + len(OLD))

    def record(self, truth, experiment):
        return replace(MOTION, name=truth.name)

    def fit(axis, logs):
        rival = 1.0 if logs[-1].motion.name == ("one" if axis is ONE else "two") else None
        made_fit = built_fit(1.0, axis=axis, residual=noise)
        made_fit.__dict__["scale"] = rival or gains[logs[-1].motion.name]
        scales[id(made_fit.axis), logs[-1].motion.name] = made_fit.__dict__["scale"]
        return made_fit

    scales = {}
    monkeypatch.setattr(Arena, "record", record)
    monkeypatch.setattr(module, "fit_axis", fit)
    monkeypatch.setattr(
        module, "residual", lambda axis, logs: noise * scales[id(axis), logs[-1].motion.name]
    )
    return refitted(arena(FIRST, SECOND), made.TRIALS[0]), noise


@pytest.mark.parametrize("worst", ["one", "two"])
def test_the_lesser_gain_of_both_truths_counts(monkeypatch, worst):
    gains = {"one": 1.5, "two": 1.5, worst: 1.2}
    found, noise = refitted_trial(monkeypatch, gains)
    truth, rival = (ONE, TWO) if worst == "one" else (TWO, ONE)
    added = len(free_parameters(truth)) - len(free_parameters(rival))
    assert found.gain == pytest.approx(evidence(1.2 * noise, noise, added).delta_bic)
    new = noise[-len(PreparedLog.of(MOTION, 0.04)) :]
    assert found.difference == pytest.approx(np.sqrt((1.2**2 - 1.0) * np.mean(new**2)))


def test_a_refit_of_one_model_or_of_what_cannot_run(monkeypatch):
    trial = made.TRIALS[0]
    assert refitted(arena(FIRST), trial) is trial

    def refuse(self, truth, experiment):
        raise CannotRun("beyond the travel")

    monkeypatch.setattr(Arena, "record", refuse)
    found = refitted(arena(FIRST, SECOND), trial)
    assert (found.gain, found.difference) == (0.0, 0.0)
    assert "beyond the travel" in found.not_run.reason
    assert found.not_run.truth == "one"


def test_trials_come_by_falling_gain_without_those_that_cannot_run(monkeypatch):
    tried = [Tracking(float(i)) for i in (1, 2, 3, 4)]

    def record(self, truth, e):
        if e.duration == 2.0:
            raise CannotRun("beyond the travel")
        return truth.name, e

    monkeypatch.setattr(Arena, "record", record)
    bars = []
    for kind, explanations in (("_informative", (FIRST,)), ("_discriminating", (FIRST, SECOND))):
        monkeypatch.setattr(
            module, kind,
            lambda arena, e, new, k=kind: SimpleNamespace(
                gain=-((e.duration - 3) ** 2), new=new, k=k
            ),
        )  # fmt: skip
        found, not_run = contest(arena(*explanations), tried, lambda *done: bars.append(done[1:]))
        assert len(not_run) == 1
        assert "beyond the travel" in not_run[0].reason
        assert found[0].new[1].duration == 3.0
        assert [t.gain for t in found] == [0.0, -1.0, -4.0]
        assert {(t.k, t.new[0]) for t in found} == {(kind, "one")}
    tried, judged = [(k, 4) for k in range(4)], [(k, 3) for k in range(4)]
    assert bars == (tried + judged) * 2


def test_a_log_keeps_to_travel_and_force_limits():
    limited = replace(PLAIN, hardware=replace(HARDWARE, force_limit=2.0))
    stage = MachineModel("s", {"x": limited, "y": limited})

    def log(force: float, position: float, y_force: float = 0.1) -> Log:
        axes = {
            n: AxisLog({"force": np.array([0.0, -f, 0.3])})
            for n, f in (("x", force), ("y", y_force))
        }
        truth = {n: {"position": np.array([0.0, position])} for n in "xy"}
        return Log(100.0, axes, truth=truth)

    require_within_limits(stage, log(1.99, 0.12))
    for bad in (log(2.0, 0.12), log(0.1, 0.12, 2.1), log(1.99, 0.14), log(1.99, -0.12)):
        with pytest.raises(CannotRun):
            require_within_limits(stage, bad)


def test_what_cannot_run_or_is_too_slow_has_no_record(monkeypatch):
    seen = []
    log = Log(100.0, {"x": AxisLog({"position": np.zeros(300)})})
    monkeypatch.setattr(
        module, "simulate", lambda machine, e, **k: seen.append((machine, e, k)) or log
    )
    monkeypatch.setattr(module, "motion_of", lambda log, axis, name, axes, ripples: MOTION)
    monkeypatch.setattr(module, "moves", lambda log, axis: True)
    monkeypatch.setattr(module, "require_within_limits", lambda stage, log: None)
    assert arena(FIRST).record(FIRST, "e") is MOTION
    (stage, _, keywords), = seen  # fmt: skip
    assert stage.axes["x"] is ONE
    assert (keywords["seed"], stage.axes["y"]) == (0, STAGE.axes["y"])
    assert arena(FIRST, test_function=0.0081).record(FIRST, "e") is MOTION
    with pytest.raises(CannotRun, match="too slowly"):
        arena(FIRST, test_function=0.0079).record(FIRST, "e")
    assert arena(FIRST, test_function=None).record(FIRST, "e") is MOTION
    monkeypatch.setattr(module, "moves", lambda log, axis: False)
    with pytest.raises(CannotRun, match="hardly moves"):
        arena(FIRST).record(FIRST, "e")


@pytest.mark.parametrize(("effects", "sought"), [((), ()), (("encoder_ripple",), None)])
def test_a_ripple_is_sought_where_the_simulated_encoder_may_have_one(monkeypatch, effects, sought):
    asked = []
    log = Log(100.0, {"x": AxisLog({"position": np.zeros(300)})})
    monkeypatch.setattr(module, "simulate", lambda *_, **__: log)
    monkeypatch.setattr(module, "moves", lambda log, axis: True)
    monkeypatch.setattr(module, "require_within_limits", lambda stage, log: None)
    monkeypatch.setattr(module, "motion_of", lambda *_, ripples: asked.append(ripples) or MOTION)
    truth = Explanation("one", axis_of(*map(fitted, effects)))
    arena(truth).record(truth, "e")
    assert asked == [sought]


def test_logs_are_windowed_alike():
    longer = arena(FIRST, test_function=0.08).logs_with(MOTION)
    assert [w.test_function.length for w in longer] == pytest.approx([0.08, 0.08])
    same = arena(FIRST).logs_with(MOTION)
    assert same[0] is OLD
    assert [w.motion.name for w in same] == ["old", "new"]
