"""The experiments among which a plan chooses: each fills its time, within the machine's limits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import HARDWARE, PLAIN
from machines import CATALOGUE, PROTON, one_axis

from identify import plan
from identify.experiment_design.candidate_experiments import proposals
from identify.experiment_design.discrimination import (
    Arena,
    Explanation,
    contest,
    require_within_limits,
)
from identify.output.as_json import json_of
from identify.output.words.next_step import all_not_run_in_words, not_run_in_words
from twin.errors import CannotRun, InputError
from twin.experiments.experiment import Experiment
from twin.experiments.kinds import (
    KINDS,
    Moves,
    Multisine,
    Passes,
    Rests,
    Staircase,
    Steps,
    Sweep,
    Tracking,
)
from twin.experiments.named import ALLOWED
from twin.model.file import load_model
from twin.model.machine import AxisModel, Hardware, MachineModel
from twin.numbers import neat
from twin.simulation.simulate import simulate
from twin.simulation.simulators import ReducedSimulator

RATE = 2500.0  # Hz, of the machines that are identified: quicker than 10 kHz, and enough
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


@pytest.fixture(scope="module")
def eight() -> list[Experiment]:
    """For 8 s of the stage, whose x has 0.24 m, 0.2 m/s, 2 m/s^2 and 100 m/s^3."""
    found, not_run = proposals(STAGE, "x", 8.0)
    return [*found, *(n.experiment for n in not_run)]


def test_passes_are_slow_fast_and_between_with_the_other_axis_at_rest_and_moving(eight):
    passes = [e for e in eight if isinstance(e, Passes)]
    whole = [e for e in passes if e.span == pytest.approx(0.9 * 0.24)]
    slow, fast = 2.0 * 0.216 / 8.0, 0.2
    wanted = np.repeat([1.1 * slow, np.sqrt(slow * fast), fast], 2)
    np.testing.assert_allclose([e.speed for e in whole], wanted, rtol=0.01)
    np.testing.assert_allclose([e.other for e in whole], [0.0, 0.216] * 3)
    # ramps of 0.2 m/s take 0.12 s, and a rest at each end 0.1 s
    assert [e.repeats for e in whole[4:]] == [int(8.0 / (0.216 / 0.2 + 0.12 + 0.1) / 2.0)] * 2
    *short, still = (e for e in passes if e.span < 0.2)
    held = np.sqrt(0.02**2 + 2.0 * 0.01) - 0.02  # m/s, over half of 20 mm within 2 m/s^2
    np.testing.assert_allclose([e.span for e in short], [2e-5, 2e-4, 2e-3, 0.02])
    np.testing.assert_allclose([e.speed for e in short], [5e-5, 1e-3, 4e-3, held], rtol=0.01)
    assert not any(e.other for e in short)
    assert (still.span, still.speed, still.other) == (0.01, 2e-3, 0.216)


def test_a_velocity_map_has_ten_speeds_in_equal_ratios(eight):
    (stairs,) = (e for e in eight if isinstance(e, Staircase))
    assert stairs.span == pytest.approx(0.3 * 0.216, rel=0.01)
    assert stairs.longest_plateau in (0.2, 0.1, 0.05)  # a fortieth, halved until it fits
    ratios = np.divide(stairs.speeds[1:], stairs.speeds[:-1])
    np.testing.assert_allclose(ratios, (0.2 / 5e-4) ** (1.0 / 9.0), rtol=0.02)


def test_rests_grow_in_equal_ratios_and_steps_are_long_and_short(eight):
    (rests,) = (e for e in eight if isinstance(e, Rests))
    ratios = np.divide(rests.rests[1:], rests.rests[:-1])
    np.testing.assert_allclose(ratios, (8.0 / 3.0 / 0.1) ** 0.25, rtol=0.02)
    steps = [e for e in eight if isinstance(e, Steps)]
    found = [(round(e.span, 4), round(e.span / e.step)) for e in steps]
    assert found == [(0.216, 15), (0.216, 3), (0.0648, 15), (0.0648, 3)]  # 60 take too long
    assert [e.efforts for e in steps] == [(1.0,), (1.0, 0.3), (1.0,), (1.0, 0.3, 1.0)]


def test_a_sweep_and_a_multisine_use_a_known_part_of_the_limits(eight):
    sweeps = [e for e in eight if isinstance(e, Sweep)]
    assert [(e.lowest, e.highest, e.effort) for e in sweeps] == [
        (2.0, 60.0, 0.5), (2.0, 120.0, 0.5)
    ] * 2  # fmt: skip
    np.testing.assert_allclose([e.span for e in sweeps], [0.216] * 2 + [0.0216] * 2, rtol=0.01)
    for e in sweeps:
        assert e.speed == pytest.approx(2.4 * e.span / 8.0, rel=0.01)
        # half of what half the limits leave: of 2 m/s^2, or of 100 m/s^3 at the highest frequency
        steepest = min(2.0, 100.0 / (2.0 * np.pi * e.highest))
        assert e.amplitude == pytest.approx(0.5 * 0.5 * 5.3 * steepest, rel=0.01)
    (sines,) = (e for e in eight if isinstance(e, Multisine))
    assert (sines.lowest, sines.highest, sines.repeats) == (2.0, 120.0, 4)
    assert (sines.period, sines.span) == pytest.approx((8.0 / 6.0, 0.0216), rel=0.01)
    slow, _ = proposals(replace(STAGE, sample_rate=200.0), "x", 8.0)
    assert [e.highest for e in slow if isinstance(e, Multisine)] == [80.0]


def test_what_takes_too_long_is_told_with_both_times():
    _, not_run = proposals(STAGE, "x", 1.0)
    takes = [n.reason for n in not_run if isinstance(n.experiment, Passes)]
    moves = 2.0 * (0.216 / 0.2 + 0.12) + 3.0 * 0.02  # s, with the shortest rests
    assert f"takes {moves:.3g} s, more than the 1 s planned; give a longer duration (s)" in takes
    (other,) = (r for r in dict.fromkeys(takes) if r.startswith("other = 0.216 m: one round takes"))
    assert f"the experiment lasts {moves:.3g} s" in other


TURNED = Hardware((-3.4, 3.4), velocity=90.0, acceleration=2e3, jerk=1e5)  # rad


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
        assert str(found).count(reason) == 1
    arena = arena_of(stage, test_function=0.02)
    trials, (first,) = contest(arena, [Passes("x", span=9.0, speed=0.2, repeats=1)])
    assert trials == []
    assert not_run_in_words(first).startswith("passes: axis x, span 9 m")
    assert "outside its travel" in first.reason
    assert all_not_run_in_words([first]) == [not_run_in_words(first)]
    (both,) = all_not_run_in_words([first, first])
    assert both.startswith("2 passes: ")
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
