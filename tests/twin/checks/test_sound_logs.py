"""Sound logs give no findings: of the twin, of a public drive, of machines in a few lines of NumPy.

Beside each of these machines the fault that it looks like is still found.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from check_cases import clean_log, faults, milliseconds, stage

from twin.checks import Fault, check_log
from twin.importers import import_log, load_mapping
from twin.logs import ROTARY_UNITS, AxisLog, Log
from twin.logs.log import Array
from twin.simulation.simulate import simulate

EMPS_MAP = Path(__file__).parents[3] / "examples" / "import_emps.toml"


@pytest.mark.parametrize(
    "seed", [0, *(pytest.param(s, marks=pytest.mark.slow) for s in range(1, 5))]
)
def test_tracking_is_clean(seed: int) -> None:
    assert check_log(simulate(stage(), "tracking", seed=seed, duration=10.0)).findings == ()


@pytest.mark.slow
@pytest.mark.parametrize("experiment", ["moves", "open_loop_sine"])
def test_experiments_of_both_axes_are_clean(experiment: str) -> None:
    assert check_log(simulate(stage(), experiment, seed=1, duration=10.0)).findings == ()


@pytest.mark.short(1)
@pytest.mark.parametrize("experiment", ["cable_pass", "reversals"])
def test_experiments_of_one_axis_have_no_errors(experiment: str) -> None:
    report = check_log(simulate(stage(), experiment, duration=10.0))
    assert report.ok
    assert faults(report) == {Fault.WEAK_EXCITATION}
    idle = [f for f in report.findings if f.axis == "y"]
    assert len(idle) == 1
    assert "hardly moves" in idle[0].what


@pytest.mark.parametrize("rate", [1000.0, 200.0])
def test_a_slower_log_is_clean(rate: float) -> None:
    clean = clean_log()
    every = round(clean.sample_rate / rate)
    axes = {
        name: replace(axis, columns={n: c[::every] for n, c in axis.columns.items()})
        for name, axis in clean.axes.items()
    }
    assert check_log(replace(clean, sample_rate=rate, axes=axes)).findings == ()


@pytest.mark.parametrize("file", ["DATA_EMPS.mat", "DATA_EMPS_PULSES.mat"])
def test_the_emps_drive_is_clean(shared_data: Path, file: str) -> None:
    """Commanded force pulses and a position loop 6 ms behind are no faults."""
    assert check_log(import_log(shared_data / "emps" / file, load_mapping(EMPS_MAP))).findings == ()


RATE, FINER = 1000.0, 4  # Hz, of the loop; steps of the integration a sample
INERTIA, VISCOUS = 0.02, 0.02  # kg m^2, N m s/rad
COUNT = 2.0 * np.pi / 4096  # rad
Elements = tuple[tuple[float, float], ...]


@cache
def joint(
    motion: Callable[[], Array],
    gain: float,
    damping: float,
    *,
    gravity: float = 0.0,
    elements: Elements = ((50.0, 0.05),),
    count: float = 0.0,
) -> tuple[Array, Array]:
    """Position (n,) rad and torque (n,) N m of a joint whose P loop with damping follows a motion.

    gain: N m/rad. elements: stiffness N m/rad and strength N m of springs that slip (W. D. Iwan,
    J. Appl. Mech. 33, 1966), its friction. count: rad, to which the reading is rounded.
    """
    rng, dt, goal = np.random.default_rng(1), 1.0 / RATE / FINER, motion()
    reading, torque = np.empty(len(goal)), np.empty(len(goal))
    q, v, held = float(goal[0]), 0.0, [0.0] * len(elements)
    for k, wanted in enumerate(goal.tolist()):
        seen = q + 1e-7 * rng.standard_normal()
        seen = count * round(seen / count) if count else seen
        u = gain * (wanted - seen) - damping * v
        reading[k], torque[k] = seen, u
        for _ in range(FINER):
            held = [
                min(max(z + stiff * v * dt, -most), most)
                for z, (stiff, most) in zip(held, elements, strict=True)
            ]
            v += (u - sum(held) - VISCOUS * v - gravity * np.sin(q)) / INERTIA * dt
            q += v * dt
    return reading, torque


def log(goal: Array, reading: Array, torque: Array, rate: float = RATE) -> Log:
    columns = {"position": reading, "force": torque, "setpoint_position": goal}
    return Log(rate, {"x": AxisLog(columns, ROTARY_UNITS)})


def waves(size: float, slow: float, fast: float, seconds: float = 8.0) -> Array:
    t = np.arange(round(seconds * RATE)) / RATE
    return size * (np.sin(2.0 * np.pi * slow * t + 0.3) + 0.5 * np.sin(2.0 * np.pi * fast * t))


def swing() -> Array:
    return waves(0.6, 0.23, 0.61)


SWING = swing()


def test_a_soft_loop_under_gravity_has_no_wrong_scale() -> None:
    """It reaches a fifth of where it should be, and the torque says why."""
    found = joint(swing, 1.0, 0.15, gravity=4.0)
    assert np.std(found[0]) < 0.4 * np.std(SWING)
    assert check_log(log(SWING, *found)).findings == ()


@pytest.mark.parametrize(("scale", "gravity"), [(0.35, 0.0), (0.35, 4.0), (3.0, 4.0), (1e-3, 0.0)])
def test_a_wrong_scale_of_a_stiff_loop_is_found(scale: float, gravity: float) -> None:
    reading, torque = joint(swing, 60.0, 2.0, gravity=gravity)
    assert Fault.UNIT not in faults(check_log(log(SWING, reading, torque)))
    assert Fault.UNIT in faults(check_log(log(SWING, scale * reading, torque)))


SLIPS: Elements = ((300.0, 0.05),)  # full after 0.17 mrad


def slow() -> Array:
    return waves(0.1, 0.5, 1.3)


def tiny() -> Array:
    return waves(1e-2, 2.0, 5.1)


@pytest.mark.parametrize(
    ("motion", "gain", "late"),
    [(slow, 10.0, 0), (slow, 10.0, 60), (slow, 10.0, -60), (tiny, 60.0, 20)],
)
def test_friction_with_a_memory_is_no_lag_and_hides_none(motion, gain, late):
    """What it lags by is a distance: another time at each speed."""
    reading, torque = joint(motion, gain, 0.1 * gain**0.5, elements=SLIPS)
    columns = {"position": reading[100:], "force": np.roll(torque, late)[100:]}
    found = faults(check_log(Log(RATE, {"x": AxisLog(columns, ROTARY_UNITS)})))
    assert (Fault.LAG in found) == (late != 0)


CART, DRY, LOOP = 8.0, 5.0, 100.0  # kg, N, rad/s


def sticking(
    goal: Array, ripple: float, noise: float = 0.2, pump: float = 0.0
) -> tuple[Array, Array]:
    """Position (n,) m and force (n,) N of a cart with dry friction under a PID loop.

    ripple: N, of a force that repeats every 5 mm. pump: N, of one that repeats 25 times a second.
    """
    dt = 1.0 / RATE / FINER
    rates = np.gradient(goal) * RATE
    x, v, total = float(goal[0]), 0.0, 0.0
    reading, force = np.empty(len(goal)), np.empty(len(goal))
    for k, (wanted, rate) in enumerate(zip(goal.tolist(), rates.tolist(), strict=True)):
        reading[k] = 1e-6 * round(x / 1e-6)
        total += (wanted - reading[k]) / RATE
        springs = LOOP**2 * (wanted - reading[k] + LOOP / 8.0 * total)
        force[k] = u = CART * (springs + 1.6 * LOOP * (rate - v))
        beside = pump * math.sin(50.0 * math.pi * k / RATE)
        for _ in range(FINER):
            free = v + dt / CART * (u + beside - 30.0 * v - ripple * math.sin(x / 8e-4))
            v = math.copysign(max(abs(free) - dt / CART * DRY, 0.0), free)
            x += v * dt
    return reading, force + noise * np.random.default_rng(1).standard_normal(len(goal))


def three_waves(*rates: float, slower: float = 0.0) -> Array:
    """(n,) m of these frequencies (Hz), which fall by 2 ``slower`` a second."""
    t = np.arange(10_000) / RATE
    t *= 1.0 - slower * t
    return np.sum([0.03 / f * np.sin(2.0 * np.pi * f * t + 3.0 * f) for f in rates], axis=0)


@pytest.mark.parametrize(("late", "ripple"), [(0, 0.0), (3, 0.0), (-3, 0.0), (0, 1.0), (0, 5.0)])
def test_what_stops_gently_and_breaks_loose_at_once_is_no_lag_and_hides_none(late, ripple):
    """Nor is a ripple that the loop answers."""
    reading, force = sticking(three_waves(0.3, 0.9, 2.1), ripple)
    columns = {"position": reading[10:-10], "force": np.roll(force, late)[10:-10]}
    found = check_log(Log(RATE, {"x": AxisLog(columns)})).findings
    assert [f.fault for f in found] == [Fault.LAG] * (late != 0)
    assert [milliseconds(f) for f in found] == pytest.approx([late] * (late != 0), abs=0.2)


@pytest.mark.parametrize("pump", [3.0, 8.0])
def test_what_a_loop_answers_to_a_disturbance_is_no_lag(pump: float) -> None:
    """It is late at 25 Hz alone: the slower motion, of which most is made, has no part in it."""
    reading, force = sticking(three_waves(0.3, 0.9, 2.1), 0.0, pump=pump)
    columns = {"position": reading[10:-10], "force": force[10:-10]}
    assert not faults(check_log(Log(RATE, {"x": AxisLog(columns)})))


@pytest.mark.parametrize(
    ("rates", "slower", "ripple"), [((0.2, 0.5, 1.3), 0.04, 2.0), ((0.3, 0.9, 2.1), 0.02, 1.0)]
)
def test_what_the_loop_answers_later_as_it_slows_is_no_other_clock(rates, slower, ripple):
    reading, force = sticking(three_waves(*rates, slower=slower), ripple)
    assert not faults(check_log(Log(RATE, {"x": AxisLog({"position": reading, "force": force})})))


def test_constant_speeds_contradict_no_acceleration_that_is_rare() -> None:
    """Seven in a thousand samples accelerate: to leave out the worst is to leave out them all."""
    t = np.arange(0.0, 40.0, 1.0 / RATE)
    legs = np.array([0.0, 0.1, -0.15, 0.2, -0.25, 0.3, -0.3, 0.15, -0.1, 0.0])
    begun = 4.2 * np.arange(len(legs))
    plan = np.interp(t, np.ravel([begun, begun + 4.17], "F"), np.repeat(legs, 2))
    position = 1e-5 * np.round(np.cumsum(plan) / RATE / 1e-5)
    force = CART * np.gradient(plan) * RATE + DRY * np.sign(plan) + 20.0 * plan
    force += 0.1 * np.random.default_rng(1).standard_normal(len(t))
    found = check_log(Log(RATE, {"x": AxisLog({"position": position, "force": force})}))
    assert not faults(found) & {Fault.OUTLIERS, Fault.WEAK_EXCITATION}


def steps_and_rests(seconds: float = 16.0) -> Array:
    t = np.arange(round(seconds * RATE)) / RATE
    return 0.5 * np.clip(1.5 * np.sin(0.2 * np.pi * t), -1.0, 1.0)


BROKEN = {
    Fault.STUCK, Fault.STEP, Fault.MISSING, Fault.OUTLIERS, Fault.JOINED, Fault.WRAPPED,
}  # fmt: skip


def resampled(x: Array, every: int) -> Array:
    """Read at a clock that jitters by a tenth of a sample, between the readings."""
    t = np.arange(len(x)) / RATE
    jitter = 1e-4 * np.random.default_rng(0).uniform(-1.0, 1.0, len(x))
    return np.interp(t[::every], (t + jitter)[::every], x[::every])


@pytest.mark.parametrize("every", [1, 5])
def test_one_count_is_neither_stuck_nor_lost(every: int) -> None:
    goal = steps_and_rests()
    reading, torque = joint(steps_and_rests, 20.0, 0.5, count=COUNT)
    rate, goal, torque = RATE / every, goal[::every], torque[::every]
    for seen in (reading[::every], resampled(reading, every)):
        assert not faults(check_log(log(goal, seen, torque, rate))) & BROKEN
    at = int(np.argmax(np.abs(np.gradient(seen))))
    lost, stuck = seen.copy(), seen.copy()
    lost[at:] += 100.0 * COUNT
    stuck[at : at + round(0.3 * rate)] = seen[at]
    for broken in (lost, stuck):
        assert faults(check_log(log(goal, broken, torque, rate))) & BROKEN


def test_text_of_few_digits_is_neither_stuck_nor_lost() -> None:
    """A motor behind a gear, written with four digits: far from 0 a step is a hundred times one."""
    goal = steps_and_rests()
    reading, torque = joint(steps_and_rests, 20.0, 0.5)
    text = np.array([float(f"{24.0 * q:.4g}") for q in reading]) / 24.0
    assert not faults(check_log(log(goal, text, torque))) & BROKEN
