"""Experiments that a plan may choose, and the one that decides between two explanations."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import pytest
from built_fits import HARDWARE, PLAIN, axis_of, built_motion, fitted
from constructed import SHORT, moved, windowed
from machines import CATALOGUE, PROTON, one_axis

from identify import diagnose, plan
from identify.dataset.blocks import Blocks
from identify.dataset.prepared_log import REST_SPEED, PreparedLog, moving
from identify.estimation.evidence import effective_samples, evidence
from identify.estimation.fit import fit_axis
from identify.estimation.force_balance import jacobian, residual
from identify.experiment_design.candidate_experiments import proposals
from identify.experiment_design.discrimination import (
    Arena,
    Explanation,
    contest,
    favoured,
    refitted,
    require_within_limits,
)
from identify.experiment_design.missing_excitation import UNITS, gap, most_missed, properties
from identify.experiment_design.plan import _planned
from identify.output.as_json import json_of
from identify.output.report import sections
from identify.output.report.subject import Subject
from identify.output.text import diagnose_text, plan_text
from identify.output.words.next_step import not_run_in_words
from identify.rules import RULE
from identify.selection.diagnosis import Verdict
from twin.effects import Catalogue
from twin.errors import CannotRun, InputError
from twin.experiments.experiment import Experiment
from twin.experiments.kinds import KINDS, Moves, Passes, Rests, Staircase, Steps, Sweep, Tracking
from twin.experiments.named import ALLOWED
from twin.logs import AxisLog, Log
from twin.model.file import load_model
from twin.model.machine import AxisModel, Fitted, Hardware, MachineModel
from twin.model.parameters import free_parameters, read
from twin.numbers import neat
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator

Logs = dict[str, Log]
RATE = 2500.0  # Hz, of the machines that are identified: quicker than 10 kHz, and enough
WINDOW = 0.02  # s
DURATION = 8.0  # s of the planned experiments


# Ambiguous pairs: poor motion, then the planned experiment, with each explanation as the truth.


@dataclass(frozen=True)
class Case:
    """Two effects, each with the values of a machine; the model that lacks both; poor motion."""

    stage: MachineModel
    pair: dict[str, dict[str, float]]
    poor: Experiment

    def machine(self, truth: str) -> MachineModel:
        planted = Fitted.at_start(CATALOGUE[truth], self.pair[truth])
        return self.stage.with_axis("x", self.stage.axes["x"].with_effect(planted))


def stage_of(friction: Fitted | None = None, *forces: Fitted) -> MachineModel:
    """One axis of the stage with a friction, its own where None, and some forces."""
    stage = replace(one_axis(PROTON), sample_rate=RATE)
    x = stage.axes["x"]
    quiet = replace(x.hardware, current_noise=0.5 * x.hardware.current_noise)
    return stage.with_axis(
        "x", replace(x, hardware=quiet, effects=(friction or x["lugre"], *forces))
    )


def effect(name: str, **values: float) -> Fitted:
    return Fitted.at_start(CATALOGUE[name], values)


GENTLE = Passes("x", span=0.3, speed=0.05, repeats=1, effort=0.02)
CASES = {
    # The command changes slowly, so that a dead time and a time constant do the same.
    "delay": Case(
        stage_of(),
        {"actuator_delay": {"tau": 2e-4}, "actuator_lag": {"tau": 2e-4}},
        replace(GENTLE, effort=0.05),
    ),
    # Against a load of 100 N the motor force hardly varies at any place.
    "ripple": Case(
        stage_of(None, effect("constant_force", F0=100.0)),
        {"cogging": {"a1": 2.5e-3}, "force_constant_ripple": {"a1": 2.5e-3 / 100.0}},
        GENTLE,
    ),
    # At one high speed the dry friction is one number, and so is its asymmetry.
    "asymmetry": Case(
        stage_of(effect("stribeck", Fc=0.285, Fs=0.335, v0=0.01, sigma2=0.018)),
        {"constant_force": {"F0": 2.6e-3}, "asymmetric_friction": {"coulomb": -0.0091}},
        Passes("x", span=0.3, speed=0.25, repeats=1),
    ),
}
SIMPLER = "constant_force"  # the other's two parameters can make as much of it
TRUTHS = [(name, truth) for name, case in CASES.items() for truth in case.pair]


def logged(machine: MachineModel, experiment: Experiment, seed: int) -> Logs:
    return {f"log {seed}": simulate(machine, experiment, seed=seed, simulator=ReducedSimulator)}


def separation(ranking) -> float:
    return ranking[0].delta_bic - ranking[1].delta_bic


@pytest.mark.slow
@pytest.mark.parametrize(("name", "truth"), TRUTHS)
def test_after_the_planned_experiment_the_ambiguity_is_gone(name, truth):
    case, machine = CASES[name], CASES[name].machine(truth)
    catalogue = Catalogue([CATALOGUE[e] for e in case.pair])
    # With some noises even this motion tells the two apart; where it does so half the time, six
    # logs in a row that do are one case in 64.
    for seed in range(1, 7):
        poor, held = logged(machine, case.poor, seed), logged(machine, case.poor, seed + 10)
        before = diagnose(case.stage, poor, held, catalogue=catalogue, test_function=WINDOW)
        if abs(separation(before.axes["x"].ranking)) < RULE.least_bic:
            break
    else:
        pytest.fail("the poor motion tells the two apart")
    found = before.next_experiments.get("x")
    if before.axes["x"].verdict is not Verdict.MISSING_EFFECTS:
        assert found is None
        found = plan(
            case.stage, poor, between=list(catalogue.values()), catalogue=catalogue,
            duration=DURATION, test_function=WINDOW,
        )  # fmt: skip
    assert found.decides
    assert set(found.between) == set(case.pair)
    logs = {**poor, **logged(machine, found.chosen.experiment, 3)}
    after = diagnose(case.stage, logs, held, catalogue=catalogue, test_function=WINDOW).axes["x"]
    assert after.named == (truth,)
    assert after.ranking[0].effect.name == truth
    assert not after.ambiguous_with or truth == SIMPLER


@pytest.mark.slow
def test_an_ambiguous_diagnosis_gives_the_experiment_that_decides():
    case = CASES["delay"]
    machine = case.machine("actuator_delay")
    logs = [logged(machine, case.poor, seed) for seed in (1, 2)]
    catalogue = Catalogue([CATALOGUE[e] for e in case.pair])
    found = diagnose(case.stage, *logs, catalogue=catalogue, test_function=WINDOW)
    assert found.axes["x"].verdict is Verdict.MISSING_EFFECTS
    following = json_of(found)["next_experiment"]
    assert following["decides"]
    assert following["experiment"]["kind"] in KINDS
    assert "rate of change of the motor force" in following["missing_motion"]
    assert following["expected_difference"] > 0.1 * following["noise_floor"]
    assert "passes" in diagnose_text(found)
    subject = Subject("test", found)
    card = next(s for s in sections(subject) if s.anchor == "answer").blocks[0]
    assert any("twin plan" in remark for remark in card.remarks)


@pytest.mark.slow
def test_what_no_motion_tells_apart_is_said():
    # The cable of this stage has a constant force of its own, which takes over the first.
    rivals = [CATALOGUE["constant_force"], CATALOGUE["asymmetric_friction"]]
    found = plan(one_axis(PROTON), between=rivals, catalogue=CATALOGUE, duration=4.0)
    assert not found.decides
    assert "not decided" in plan_text(found)


@pytest.mark.slow
def test_without_rivals_the_experiment_says_most_about_the_model():
    stage = stage_of()
    with pytest.raises(InputError, match="different"):
        plan(stage, between=[CATALOGUE["cogging"]] * 2, catalogue=CATALOGUE)
    found = plan(stage, catalogue=CATALOGUE, duration=4.0)
    assert found.decides
    assert found.between == (stage.name,)
    assert (found.favoured, found.supposed, found.gap.share) == (None, True, None)
    slow = [t for t in found.ranking if t.motion.motion.velocity.max() < 0.01]
    assert found.chosen.gain > max(t.gain for t in slow) + 1.0


def test_an_axis_that_its_friction_holds_is_one_line():
    """As a geared joint without its rotor, whose controller is as weak as its bodies are light."""
    stage = stage_of(effect("coulomb_viscous", Fc=0.3, Fs=0.3, sigma2=0.01))
    light = stage.with_axis("x", replace(stage.axes["x"], mass=1e-6))
    with pytest.raises(CannotRun, match="axis x: its controller does not move it in a simulation"):
        plan(light, catalogue=CATALOGUE, duration=4.0)


# The experiments among which a plan chooses: each fills its time, within the machine's limits


STAGE = MachineModel("s", {"x": PLAIN, "y": replace(PLAIN, mass=3.1)}, 2000.0)


def with_limits(**changed: float | tuple[float, float] | None) -> MachineModel:
    x = PROTON.axes["x"]
    return PROTON.with_axis("x", replace(x, hardware=replace(x.hardware, **changed)))


WEAK = with_limits(force_limit=2.0, jerk=5.0)
STAGES = {
    "proton": PROTON,
    "short and slow": with_limits(travel=(0.01, 0.04), velocity=0.02, acceleration=0.1),
    "weak": WEAK,
    "emps": load_model("examples/emps.toml", CATALOGUE),
}


@pytest.mark.parametrize("value", [0.1234567, 0.999999, 1234.9, 0.29999999999999999])
def test_a_neat_value_has_three_digits_and_is_no_larger(value):
    found = neat(value)
    assert value * (1.0 - 1e-2) < found <= value * (1.0 + 1e-12)
    assert float(f"{found:.3g}") == neat(found) == found


@pytest.mark.slow
def test_proposals_cover_the_sorts_and_last_as_long_as_asked():
    found, _ = proposals(STAGE, "x", 8.0)
    assert {Tracking, Moves, Passes, Staircase, Steps, Sweep} <= {type(e) for e in found}
    for general in (Tracking(8.0), Moves(80, duration=8.0), Moves(8, dwell=1.0, duration=8.0)):
        assert general in found
    for e in found:
        assert getattr(e, "axis", "x") == "x"
        assert getattr(e, "span", 0.0) <= 0.9 * 0.24 + 1e-12
        lasts = e.setpoint(STAGE, np.random.default_rng(7)).duration
        assert lasts == pytest.approx(8.0, rel=0.05)
    assert any(getattr(e, "other", 0.0) > 0.0 for e in found)
    alone, _ = proposals(MachineModel("s", {"x": PLAIN}, 2000.0), "x", 8.0)
    assert not any(getattr(e, "other", 0.0) for e in alone)


TURNED = Hardware((-3.4, 3.4), velocity=90.0, acceleration=2e3, jerk=1e5)  # rad


@pytest.mark.short(1)
@pytest.mark.parametrize(("noise", "scale"), [(1e-6, 6.8 / 0.34), (1e-4, 50.0 * 1e-4 / 2e-5)])
def test_angles_are_part_of_the_travel_and_seen_by_the_encoder(noise, scale):
    """The lengths of a linear stage, taken for rad, were lost in the noise of a rotary axis."""
    turned = AxisModel(5e-6, replace(TURNED, encoder_noise=noise), rotary=True)
    found, not_run = proposals(MachineModel("r", {"a": turned}, 400.0), "a", 20.0)
    assert not not_run
    short = [e.span for e in found if isinstance(e, Passes)][-4:]
    np.testing.assert_allclose(short, scale * np.array([2e-5, 2e-4, 2e-3, 0.02]), rtol=0.01)
    assert min(short) > 49.0 * noise
    (rests,) = (e for e in found if isinstance(e, Rests))
    assert (rests.span, rests.speed) == pytest.approx((2e-3 * scale, 4e-3 * scale), rel=0.01)
    (stairs,) = (e for e in found if isinstance(e, Staircase))
    assert stairs.speeds[0] == pytest.approx(5e-4 * scale, rel=0.01)


def test_a_slow_axis_is_mapped_as_fast_as_it_can_and_a_weak_motor_moves_gently():
    slow = AxisModel(5e-6, replace(TURNED, velocity=1e-3), rotary=True)
    found, not_run = proposals(MachineModel("r", {"a": slow}, 20.0), "a", 20.0)
    every = [*found, *(n.experiment for n in not_run)]
    (stairs,) = (e for e in every if isinstance(e, Staircase))
    assert (stairs.speeds[0], stairs.speeds[-1]) == (1e-4, 1e-3)
    weak = replace(STAGE, axes={"x": replace(PLAIN, hardware=replace(HARDWARE, force_limit=5.3))})
    efforts = {getattr(e, "effort", 0.2) for e in proposals(weak, "x", 8.0)[0]}
    assert efforts == {0.2, 0.1}  # a fifth of what the limits allow, and half of it under a sweep


@pytest.mark.short(2)
@pytest.mark.parametrize("name", STAGES)
def test_every_proposal_stays_within_the_limits_of_the_stage(name):
    stage = STAGES[name]
    for experiment in proposals(stage, "x", 5.0)[0]:
        assert_within_limits(stage, experiment)


def assert_within_limits(stage: MachineModel, experiment: Experiment) -> None:
    """Position, speed, acceleration and jerk asked for, the force of a sweep included."""
    planned = experiment.setpoint(stage, np.random.default_rng(0))
    setpoint = planned.part(0, len(planned))
    assert setpoint.duration < (1.0 + ALLOWED) * 5.0
    for i, axis in enumerate(stage.axes.values()):
        h = axis.hardware
        low, high = h.travel
        position, velocity = setpoint.position[:, i], setpoint.velocity[:, i]
        pushed = setpoint.acceleration[:, i] + setpoint.force[:, i] / axis.mass
        assert low - 1e-9 <= position.min() <= position.max() <= high + 1e-9
        assert np.abs(velocity).max() <= h.velocity * (1.0 + 1e-6)
        assert np.abs(pushed).max() <= h.acceleration * (1.0 + 1e-6)
        assert np.abs(np.diff(pushed)).max() * stage.sample_rate <= h.jerk * (1.0 + 1e-3)
        assert np.abs(setpoint.force[:, i]).max() <= h.force_limit


def arena_of(stage: MachineModel, **options: float) -> Arena:
    return Arena(stage, "x", (Explanation("as it is", stage.axes["x"]),), **options)


@pytest.mark.slow
def test_what_a_weak_motor_cannot_do_is_not_planned():
    stage = replace(one_axis(WEAK), sample_rate=RATE)
    trials, not_run = contest(arena_of(stage), proposals(stage, "x", 20.0)[0])
    assert len(trials) > 5
    for trial in trials:
        log = simulate(stage, trial.experiment, simulator=ReducedSimulator)
        low, high = stage.axes["x"].hardware.travel
        assert low < log.truth["x"]["position"].min() < log.truth["x"]["position"].max() < high
        assert np.abs(log.axes["x"].force).max() < stage.axes["x"].hardware.force_limit
    assert all(not_run_in_words(n).count(": ") >= 2 for n in not_run)
    wild = Passes("x", span=0.3, speed=0.2, repeats=1)
    with pytest.raises(CannotRun, match=r"axis x (went to|asks for)"):
        require_within_limits(stage, simulate(stage, wild, simulator=ReducedSimulator))


def test_what_cannot_run_is_told_with_its_reason_and_a_mistake_is_not_passed_over():
    """A window too short for slow motion beside a loud encoder, and passes that take too long."""
    stage = replace(one_axis(with_limits(encoder_noise=2e-7)), sample_rate=RATE)
    found = plan(stage, catalogue=CATALOGUE, duration=2.0, test_function=0.02)
    told = [not_run_in_words(n) for n in found.not_run]
    assert {line.split(":")[0] for line in told} <= set(KINDS)
    assert any("too slowly for a test function of 0.02 s" in line for line in told)
    assert json_of(found)["not_run"] == told
    for reason in {n.reason for n in found.not_run}:  # once, however many experiments it is of
        assert plan_text(found).count(reason) == 1
    arena = arena_of(stage, test_function=0.02)
    trials, (first,) = contest(arena, [Passes("x", span=9.0, speed=0.2, repeats=1)])
    assert trials == []
    assert not_run_in_words(first).startswith("passes: axis x, span 9 m")
    assert "outside its travel" in first.reason
    assert "(with" not in not_run_in_words(replace(first, truth=None))
    assert not_run_in_words(replace(first, truth="wear")).endswith("(with wear)")
    with pytest.raises(InputError, match="effort"):
        contest(arena, [Passes("x", span=0.1, speed=0.1, repeats=1, effort=2.0)])


@pytest.mark.parametrize(
    ("stage", "experiment"),
    [
        (with_limits(travel=None), Tracking(2.0)),
        (with_limits(velocity=1e-4), Tracking(2.0)),
        (PROTON, Passes("x", span=0.001, speed=0.2, repeats=1)),
        (one_axis(PROTON), Passes("x", span=0.1, speed=0.1, repeats=1, other=0.3)),
        (PROTON, Sweep("x", 0.1, 0.01, 1, 1e4, 2.0, 60.0, effort=0.5)),
        (PROTON, Sweep("x", 0.1, 0.01, 1, 0.01, 2.0, 6e4, effort=0.5)),
    ],
)
def test_a_motion_beyond_the_machine_is_one_kind_of_error(stage, experiment):
    with pytest.raises(CannotRun):
        experiment.setpoint(stage, np.random.default_rng(0))


# Which experiment decides, and what the logs lack: evidence and coverage by direct formulas


ONE = axis_of(fitted("quadratic_drag", c=0.9)).with_effect(fitted("lugre", Fc=0.3, Fs=0.3))
TWO = axis_of(fitted("constant_force", F0=0.2)).with_effect(fitted("lugre", Fc=0.3, Fs=0.3))
TRACKED = Tracking(2.0)
FIRST, SECOND = Explanation("one", ONE), Explanation("two", TWO)
MOTION = built_motion("new", 2.0, seed=4)
OLD = PreparedLog.of(built_motion("old", 1.5, seed=5), 0.04)


def arena(*explanations: Explanation, logs=(OLD,), test_function=0.04) -> Arena:
    return Arena(STAGE, "x", explanations, logs, test_function)


def judged(among: Arena, experiment=TRACKED):
    (found,), _ = contest(among, [experiment])
    return found, among.logs_with(found.motion.motion)


def absorbed(force, columns):
    scaled = columns / np.maximum(np.linalg.norm(columns, axis=0), 1e-300)
    return force - scaled @ np.linalg.lstsq(scaled, force, rcond=1e-12)[0]


def test_the_evidence_is_what_the_nearest_rival_leaves_in_expectation():
    found, logs = judged(arena(FIRST, SECOND))
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
    assert found.duration == pytest.approx(2.0, abs=2e-3)


def test_the_information_is_half_the_log_determinant_beside_the_prior():
    found, logs = judged(arena(FIRST))
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
    alone, _ = judged(arena(FIRST, logs=()))
    more, _ = judged(arena(FIRST, logs=(found.motion,)))
    assert alone.gain < more.gain  # more logs, more information


def test_windows_at_rest_count_for_nothing():
    sticking, rests = Explanation("sticks", PLAIN), Rests("x", 0.02, 0.05, (0.4, 0.6))
    for explanations in ((sticking,), (sticking, SECOND)):
        found, logs = judged(arena(*explanations), rests)
        kept = moving(logs, True)[-len(logs[1]) :]
        assert 0 < kept.sum() < len(kept)
        assert not found.where[~kept].any()
        assert found.where[kept].all()


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


def test_logs_are_windowed_alike():
    longer = arena(FIRST, test_function=0.08).logs_with(MOTION)
    assert [w.test_function.length for w in longer] == pytest.approx([0.08, 0.08])
    same = arena(FIRST).logs_with(MOTION)
    assert same[0] is OLD
    assert [w.motion.name for w in same] == ["old", "new"]


def test_what_hardly_moves_or_is_too_slow_has_no_record():
    moved = arena(FIRST).record(FIRST, Tracking(2.0))
    assert moved.axis == "x"
    assert arena(FIRST, test_function=0.0081).record(FIRST, Tracking(2.0)).period == moved.period
    with pytest.raises(CannotRun, match="too slowly"):
        arena(FIRST, test_function=0.0079).record(FIRST, Tracking(2.0))
    with pytest.raises(CannotRun, match=r"hardly moves, or for less than 0.5 s"):
        arena(FIRST).record(FIRST, Tracking(0.4))
    resting = Passes("x", 1e-9, 1e-9, 1)
    with pytest.raises(CannotRun, match="hardly moves"):
        arena(FIRST).record(FIRST, resting)


@pytest.mark.slow
def test_trials_come_by_falling_gain_and_a_refit_judges_by_the_truth_told_worst():
    tried, bars = [Tracking(2.0), Tracking(0.4), Tracking(4.0)], []
    every, not_run = contest(arena(FIRST, SECOND), tried, lambda *done: bars.append(done[1:]))
    assert [t.experiment for t in not_run] == [Tracking(0.4)]
    assert [t.experiment for t in every] == [Tracking(4.0), Tracking(2.0)]
    assert bars[:3] == [(0, 3), (1, 3), (2, 3)]
    trial = every[1]
    found = refitted(arena(FIRST, SECOND), trial)
    assert found.gain == pytest.approx(refitted(arena(SECOND, FIRST), trial).gain)
    gains = []
    for truth, rival in ((FIRST, SECOND), (SECOND, FIRST)):
        logs = arena(truth).logs_with(arena(truth).record(truth, trial.experiment))
        own, other = (fit_axis(e.axis, logs) for e in (truth, rival))
        kept = own.kept & other.kept
        left = [residual(f.axis, logs)[kept] for f in (other, own)]
        gains.append(evidence(*left, len(own.scaling.where) - len(other.scaling.where)).delta_bic)
    assert found.gain == pytest.approx(min(gains))
    assert found.gain != pytest.approx(max(gains))
    assert refitted(arena(FIRST), trial) is trial
    short = refitted(arena(FIRST, SECOND), replace(trial, experiment=Tracking(0.4)))
    assert (short.gain, short.difference, short.not_run.truth) == (0.0, 0.0, "one")
    assert "hardly moves" in short.not_run.reason


LOG = windowed(SHORT)


@pytest.mark.slow
def test_a_plan_leaves_out_logs_that_refute_a_rival():
    """They would decide whatever the experiment is; a refit of the new log takes the mass over."""
    rivals = Explanation("good", PLAIN), Explanation("bad", replace(PLAIN, mass=6.0))
    found, without = (
        _planned(arena(*rivals, logs=logs), 3.0, 2, False, {}) for logs in ((OLD,), ())
    )
    gains = [t.gain for t in found.ranking]
    assert gains == pytest.approx([t.gain for t in without.ranking])
    assert max(gains) < 1.0
    assert (found.favoured, without.favoured) == ("good", None)


def test_properties_are_windowed_means_of_the_motion():
    m, w = SHORT, LOG.test_function
    found = properties(LOG)
    assert list(found) == list(UNITS)
    for name, wanted in {
        "speed": np.abs(w.mean(m.velocity)),
        "acceleration": np.abs(LOG.acceleration),
        "motor force": np.abs(LOG.command),
        "rate of change of the motor force": np.abs(w.mean(np.gradient(m.command, m.period))),
        "speed of the other axis": np.abs(w.mean(m.others[1])),
        "acceleration of the other axis": np.abs(w.mean(m.others[2])),
    }.items():
        np.testing.assert_allclose(found[name], wanted, atol=0.01 * np.ptp(wanted))


def test_a_rest_is_the_time_stood_before_the_motion():
    """Walked sample by sample: how long the last standstill was, while it lasts how long so far."""
    for length, rounded in ((84, 0.3), (116, 0.3), (83, 0.2), (117, 0.4)):  # of 3 ms each
        speed = np.full(1000, 0.2)
        speed[100 : 100 + length] = 0.99 * REST_SPEED * 0.2
        speed[600:620] = -0.5 * REST_SPEED * 0.2
        speed[700:900] = 3.0 * REST_SPEED * 0.2
        motion = replace(SHORT, track=Blocks(np.stack([speed] * 3), SHORT.raw), period=3e-3)
        log = replace(LOG, motion=motion)
        stood, last, rest = 0, 0.0, []
        for v in speed:
            stood = stood + 1 if abs(v) < REST_SPEED * 0.2 else 0
            last = stood * motion.period if stood else last
            rest.append(last)
        wanted = np.round(log.test_function.mean(np.array(rest)), 1)
        np.testing.assert_allclose(properties(log)["rest before the motion"], wanted)
        assert wanted.max() == pytest.approx(rounded)


def test_the_gap_is_where_the_difference_is_and_the_data_are_not():
    planned = windowed(moved(np.random.default_rng(2), 2.0, 1000.0))
    speed = properties(planned)["speed"]
    where = (speed > np.quantile(speed, 0.8)).astype(float)
    slow = windowed(replace(SHORT, track=Blocks(SHORT.signals * [[1.0], [1e-3], [1.0]], SHORT.raw)))
    found = gap(planned, where, [slow])
    assert (found.feature, found.share, found.unit) == ("speed", 0.0, "m/s")
    ordered = np.sort(speed[where > 0])
    assert found.low == pytest.approx(np.quantile(ordered, 0.25), rel=0.05)
    assert found.high == pytest.approx(np.quantile(ordered, 0.75), rel=0.05)
    alone = gap(planned, where, [])
    assert (alone.feature, alone.share) == ("speed", None)
    assert gap(planned, np.ones(len(speed)), [planned]).share > 0.4


@pytest.mark.parametrize(("speed", "counts"), [(5e-8, False), (5e-2, True)])
def test_dust_of_an_axis_at_rest_is_no_motion(speed, counts):
    """Its speed alone tells where the difference is; a loop that settles makes one as small."""
    planned = windowed(moved(np.random.default_rng(2), 2.0, 1000.0))
    where = (np.arange(len(planned)) < len(planned) // 2).astype(float)
    rests = replace(planned.motion, others=np.zeros_like(planned.motion.others))
    early = planned.time < np.median(planned.time)
    rests.others[1] = speed * np.interp(rests.time, planned.time, early)
    found = gap(replace(planned, motion=rests), where, [windowed(SHORT)])
    assert (found.feature == "speed of the other axis") is counts


@pytest.mark.parametrize(
    ("inside", "shares", "wanted"),
    [
        ((50, 10), (0, 0), "b"),  # what tells the windows of the difference from the others
        ((20, 30), (10, 2), "b"),  # what the data miss more
        ((10, 90), (3, 1), "a"),  # but not where it tells nothing
        ((10, 20), (1, 0), "a"),
    ],
)
def test_a_gap_weighs_how_much_is_missed_by_how_well_it_tells(inside, shares, wanted):
    """Windows of the difference have 1 to 2 of a property, so have some others, and some data."""

    def values(count, first):
        return np.concatenate([first, np.full(count, 1.5), np.full(100 - count, 9.0)])

    ones = np.tile([1.0, 1.5, 1.5, 1.5, 2.0], 2)
    planned = {"still": np.zeros(110), **{n: values(i - 10, ones) for n, i in zip("ab", inside)}}  # noqa: B905
    data = {n: values(count, np.zeros(0)) for n, count in zip("ab", shares, strict=True)}
    where = np.concatenate([np.ones(10), np.zeros(100)])
    share = shares["ab".index(wanted)] / 100.0
    assert most_missed(planned, where, data) == (wanted, 1.5, 1.5, pytest.approx(share))
