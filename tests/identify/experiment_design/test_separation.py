"""Which experiment decides, and what the logs lack: evidence and coverage by direct formulas."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from built_fits import HARDWARE, PLAIN, axis_of, built_motion, fitted
from constructed import SHORT, moved, windowed

from identify.dataset.blocks import Blocks
from identify.dataset.prepared_log import REST_SPEED, PreparedLog, moving
from identify.estimation.evidence import effective_samples, evidence
from identify.estimation.fit import fit_axis
from identify.estimation.force_balance import jacobian, residual
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
from twin.errors import CannotRun
from twin.experiments.kinds import Passes, Rests, Tracking
from twin.logs import AxisLog, Log
from twin.model.machine import MachineModel
from twin.model.parameters import free_parameters, read

STAGE = MachineModel("s", {"x": PLAIN, "y": replace(PLAIN, mass=3.1)}, 2000.0)
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


def test_a_plan_leaves_out_logs_that_refute_a_rival():
    """They would decide whatever the experiment is; a refit of the new log takes the mass over."""
    rivals = Explanation("good", PLAIN), Explanation("bad", replace(PLAIN, mass=6.0))
    found, without = (
        _planned(arena(*rivals, logs=logs), 3.0, 2, False, {}) for logs in ((OLD,), ())
    )
    gains = [t.gain for t in found.ranking]
    assert gains == pytest.approx([t.gain for t in without.ranking])
    assert max(gains) < 1.0
    assert (found.favoured_by_the_logs, without.favoured_by_the_logs) == ("good", None)


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
