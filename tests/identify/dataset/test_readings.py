"""Readings: their resolution, the errors and lines that repeat in them, a velocity beside them."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from types import SimpleNamespace

import numpy as np
import pytest
from constructed import SHORT, log_of, ridden, waves
from machines import CATALOGUE, STAGE, tracked
from scipy.signal import lfilter

from identify.dataset.blocks import Blocks
from identify.dataset.coordinates import ripples
from identify.dataset.dataset import Dataset
from identify.dataset.motion import motion_of
from identify.dataset.noise import noise_of
from identify.dataset.preparation import datasets
from identify.dataset.prepared_log import PreparedLog
from identify.dataset.readings import (
    resolution_of,
    ripple,
    ripple_periods,
    ripples_of_widest,
    together,
)
from identify.dataset.spectrum import (
    MOST_LINES,
    ScatteredSignal,
    find_lines,
    lines_in_time,
    strongest_line,
)
from identify.estimation.fit import fit_axis
from identify.selection.diagnosis import Verdict, diagnose_axis
from twin.effects import Catalogue
from twin.model.machine import AxisModel, Fitted
from twin.signals import between, white_noise

STEP = 2.3e-7  # m
DT = 1e-4  # s


@cache
def dataset_of(step: float) -> Dataset:
    axis = STAGE.axes["x"]
    if step:
        effect = CATALOGUE["encoder_quantization"]
        axis = axis.with_effect(Fitted.at_start(effect, {"step": step}))
    machine = replace(STAGE, axes={"x": axis})
    runs = {s: tracked(machine, s, 8.0) for s in (1, 2, 3)}
    fit = {f"log {s}": runs[s] for s in (1, 2)}
    return datasets(STAGE, fit, {"log 3": runs[3]})["x"]


@pytest.fixture(scope="module")
def coarse() -> Dataset:
    return dataset_of(STEP)


FEW = Catalogue(
    CATALOGUE[name] for name in ("encoder_quantization", "encoder_delay", "quadratic_drag")
)


@pytest.mark.slow
def test_it_is_not_named_where_other_noise_is_larger():
    fine = dataset_of(0.0)
    found = diagnose_axis(fit_axis(STAGE.axes["x"], fine.training), fine, FEW)
    assert found.verdict is Verdict.NOTHING_MISSING


@pytest.mark.slow
def test_it_is_not_named_for_an_error_it_cannot_make(coarse):
    """The resolution is there, but twice the force error that it could pretend."""
    louder = tuple(_with_more_force(log) for log in coarse.training)
    dataset = replace(
        coarse, training=louder, selection=tuple(map(_with_more_force, coarse.selection))
    )
    found = diagnose_axis(fit_axis(STAGE.axes["x"], louder), dataset, FEW)
    assert "encoder_quantization" not in found.named


def _with_more_force(log: PreparedLog) -> PreparedLog:
    beat = 0.03 * np.sign(np.sin(7.0 * np.sqrt(2.0) * log.motion.time) + 0.3)
    signals = log.motion.signals + np.stack([0.0 * beat, 0.0 * beat, beat])
    samples = log.motion.raw.shape[1] // len(beat)
    raw = log.motion.raw + np.stack([np.zeros(log.motion.raw.shape[1]), np.repeat(beat, samples)])
    motion = replace(log.motion, track=Blocks(signals, raw))
    return PreparedLog.of(motion, log.test_function.length)


TIME = DT * np.arange(60_000)
NOISE = 2e-9  # m
ANGLE = 2.0 * np.pi * 0.4 * TIME


def noise():
    return NOISE * np.random.default_rng(3).standard_normal(len(TIME))


WOBBLE = 2e-5 * np.sin(2.0 * np.pi * 11.0 * TIME)  # m, of a controlled axis
PATHS = {  # m; the first two pass several periods of a ripple in a sample
    "turning": 0.1 * np.sin(ANGLE),
    "two speeds": np.where(TIME < 3.0, 0.1 * TIME, 0.3 - 0.02 * (TIME - 3.0)) + WOBBLE,
    "slow": 2e-3 * np.sin(ANGLE),
}


@pytest.mark.parametrize(("path", "period"), [("turning", 7.3e-6), ("two speeds", 2.2e-5)])
def test_a_ripple_is_found_at_any_speed_and_taken_off(path, period):
    turn = 2.0 * np.pi * PATHS[path] / period
    error = 2.3e-8 * np.sin(turn + 1.0)
    readings = PATHS[path] + error + noise()
    found = ripple_periods(readings)
    cycles = np.ptp(PATHS[path]) / period
    assert min(abs(p / period - 1.0) for p in found) < 0.1 / cycles
    assert white_noise(readings) > 1.5 * NOISE
    left = readings - ripple(readings, found)
    assert white_noise(left) == pytest.approx(NOISE, rel=0.1)
    assert np.std(left - PATHS[path] - noise()) < 0.2 * np.std(error)


def test_the_log_with_the_longest_travel_tells_the_ripples_of_all():
    period = 2.2e-5
    paths = (1e-5 * np.sin(ANGLE), PATHS["turning"])
    read = [p + 2.3e-8 * np.sin(2.0 * np.pi * p / period) + noise() for p in paths]
    logs = [SimpleNamespace(axes={"x": SimpleNamespace(position=r)}) for r in read]
    logs.append(SimpleNamespace(axes={"y": SimpleNamespace(position=1e3 * read[0])}))
    assert ripple_periods(read[0]) == ()
    assert ripples_of_widest(logs, "x") == ripple_periods(read[1]) != ()
    assert ripples_of_widest(logs, "z") == ()


def test_a_vibration_at_constant_speed_is_none():
    """It repeats along the track there, but not on the way to that speed."""
    speed = 0.05 * np.clip(TIME / 3.0, 0.0, 1.0)
    path = DT * np.cumsum(speed)
    shaken = path + 2e-8 * np.sin(2.0 * np.pi * 900.0 * TIME) + noise()
    assert ripple_periods(shaken) == ()


@pytest.mark.parametrize("path", PATHS)
@pytest.mark.parametrize("step", [0.0, 3e-6])
def test_noise_and_rounding_are_none(path, step):
    readings = PATHS[path] + noise()
    if step:
        readings = step * np.rint(readings / step)
    assert ripple_periods(readings) == ()


@pytest.mark.parametrize(("fine", "path"), [(2.1e-8, "turning"), (7.7e-8, "slow")])
def test_a_coarse_step_is_found_beside_a_fine_one(path, fine):
    """The encoder rounds, its noise is added, and the log rounds again."""
    step = 3.16e-7
    readings = step * np.rint(PATHS[path] / step) + noise()
    readings = fine * np.rint(readings / fine)
    assert resolution_of(np.diff(readings)) == pytest.approx(step, rel=2e-3)


def test_speeds_that_are_multiples_of_one_are_no_step():
    speed = np.repeat([0.01, 0.02, 0.03, 0.04], len(TIME) // 4)
    assert resolution_of(np.diff(DT * np.cumsum(speed) + noise())) == 0.0


RATE = 1000.0
T = np.arange(8001) / RATE
PLACE = waves((0.1, 0.9, 0.3), (0.02, 2.3, 1.1))
READ, TOLD = 2e-4, 2e-2  # m and m/s RMS


def speed(t):
    return (PLACE(t + 5e-5) - PLACE(t - 5e-5)) / 1e-4


def measured(seed: int, late: float = 0.0, gain: float = 1.0):
    rng = np.random.default_rng(seed)
    x = PLACE(T) + rng.normal(0.0, READ, len(T))
    return x, gain * speed(T - late) + rng.normal(0.0, TOLD, len(T))


@pytest.mark.parametrize("late", [0.0, 4.3e-3])
def test_the_position_that_both_tell_is_nearer_to_the_truth(late):
    x, v = measured(1, late)
    position, weight = together(x, v, RATE**-1)
    # Densities: 2 READ^2/RATE of the readings, 2 TOLD^2/RATE of the velocity.
    assert weight == pytest.approx((READ * RATE / TOLD) ** 2, rel=0.5)
    error = position - PLACE(T)
    assert np.std(error) < 0.5 * READ
    # The rate at one sample is that of the velocity, not of the differenced readings.
    assert np.std(between(error, 1.0 / RATE)) < 1.5 * TOLD
    assert np.std(between(x - PLACE(T), 1.0 / RATE)) > 10.0 * TOLD


def test_a_velocity_that_cannot_be_trusted_is_not_used():
    x, v = measured(2, gain=1.05)
    assert together(x, v, 1.0 / RATE)[1] == 0.0
    x, v = measured(2, late=0.02)
    assert together(x, v, 1.0 / RATE)[1] == 0.0
    x, _ = measured(3)
    copied = np.gradient(x, 1.0 / RATE)  # made of the readings: it holds nothing new
    np.testing.assert_array_equal(together(x, copied, 1.0 / RATE)[0], x)
    assert together(x, None, 1.0 / RATE)[0] is x


def test_the_noise_floor_knows_of_the_velocity():
    x, v = measured(4)
    motion = motion_of(log_of(RATE, x, np.zeros_like(x), velocity=v), "x", "log")
    noise = noise_of(AxisModel(1.0), motion)
    # What m times the rate of the velocity's noise leaves, and what readings alone would.
    k = np.searchsorted(noise.frequency, 60.0)
    turn = (2.0 * np.pi * noise.frequency[k]) ** 2  # 1/s^2
    wanted = 2.0 * TOLD**2 / RATE * turn
    assert noise.power[k] == pytest.approx(wanted, rel=0.5)
    alone = noise_of(AxisModel(1.0), motion_of(log_of(RATE, x, np.zeros_like(x)), "x", "log"))
    assert alone.power[k] == pytest.approx(2.0 * READ**2 / RATE * turn**2, rel=0.5)


# Laws of what repeats: a line is found where it was put and nowhere else, whatever its size and
# the unit of time.


N = 6000


def sines(frequencies, n: int = N, seed: int = 1, size: float = 1.0) -> np.ndarray:
    """Lines (cycles a sample) with heights 1, 1/2, 1/3... in white noise of 0.02."""
    rng = np.random.default_rng(seed)
    k = np.arange(n)
    out = rng.normal(0.0, 0.02, n)
    for i, f in enumerate(frequencies):
        out += np.sin(2.0 * np.pi * (f * k + rng.random())) / (i + 1.0)
    return size * out


@pytest.mark.parametrize(("period", "size"), [(0.017, 1e-7), (4e-4, 3e6)])
def test_lines_are_found_at_their_frequencies_the_highest_first(period, size):
    wanted = np.array([0.0713, 0.2002, 0.0123])
    found = np.array(lines_in_time([(sines(wanted, size=size), period)]))
    np.testing.assert_allclose(found[:3] * period, wanted, atol=0.05 / N)
    assert len(found) == 3  # and nowhere else


def test_a_line_of_several_logs_is_told_once_and_a_near_one_apart():
    logs = [(sines([0.05], seed=s, n=n), 1.0) for s, n in ((2, N), (3, N // 2))]
    found = np.array(lines_in_time(logs))
    assert np.sum(np.abs(found - 0.05) < 0.5 / N) == 1
    apart = np.array(lines_in_time([(sines([0.05, 0.05 + 8.0 / N]), 1.0)]))
    assert np.abs(apart - 0.05).min() < 0.1 / N
    assert np.abs(apart - 0.05 - 8.0 / N).min() < 0.1 / N
    many = [(sines(np.arange(0.01, 0.4, 0.01), seed=s), 1.0) for s in range(2)]
    assert len(lines_in_time(many)) == MOST_LINES


@pytest.mark.short(1)
@pytest.mark.parametrize(("records", "pole"), [(1, 0.95), (3, 0.0)])
def test_noise_of_any_colour_shows_a_line_as_rarely_as_is_said(records, pole):
    """In 100 trials at 10 %: at most 20, which one in a thousand such draws exceeds."""
    rng, told = np.random.default_rng(3), 0
    for _ in range(100):
        noise = lfilter([1.0], [1.0, -pole], rng.normal(size=(records, 1500)))
        parts = [ScatteredSignal(np.arange(1500.0), n) for n in noise]
        told += bool(find_lines(parts, 2.0 / 1500, 0.4, chance=0.1, most=1))
    assert told <= 20


@pytest.mark.parametrize("spacing", ["even", "uneven"])
def test_a_line_has_its_frequency_share_and_a_small_false_alarm(spacing):
    rng = np.random.default_rng(6)
    x = np.linspace(-0.05, 0.1, 3000) if spacing == "even" else rng.uniform(-0.05, 0.1, 3000)
    for frequency in (171.3, 1733.0):
        values = 0.5 * np.sin(2.0 * np.pi * frequency * x + 0.7) + rng.normal(0.0, 0.3, 3000)
        first, *others = find_lines([ScatteredSignal(x, 1e3 * values + 7.0)], 10.0 / 0.15, 5000.0)
        assert first.frequency == pytest.approx(frequency, abs=0.1 / 0.15)
        assert first.share == pytest.approx(0.125 / (0.125 + 0.09), abs=0.04)
        assert first.false_alarm < 1e-12
        assert all(o.false_alarm > 1e-6 for o in others)
    assert find_lines([ScatteredSignal(x, 0.0 * x)], 10.0, 5000.0) == ()
    assert find_lines([ScatteredSignal(0.0 * x, values)], 10.0, 5000.0) == ()


def test_records_share_a_line_whatever_its_phase_in_each():
    rng, t = np.random.default_rng(12), np.arange(2000.0)
    parts = [
        ScatteredSignal(t, 0.13 * np.sin(2.0 * np.pi * 0.0817 * t + k) + rng.normal(size=2000))
        for k in range(5)
    ]
    alone = [find_lines([p], 1e-3, 0.4, chance=1e-3, most=1) for p in parts]
    together = find_lines(parts, 1e-3, 0.4, chance=1e-3, most=1)
    assert sum(map(bool, alone)) <= 1
    assert together[0].frequency == pytest.approx(0.0817, abs=0.2 / 2000)


def test_a_ripple_of_the_reading_is_found_at_its_period():
    """An error A sin(2 pi x/p) pretends m A (2 pi v/p)^2 sin(2 pi x/p)."""
    for pitch in (1.37e-3, 4.1e-4):
        rippled = ridden(
            lambda m, p=pitch: 9e-6 * (m.velocity / p) ** 2 * np.sin(6.2831853 * m.position / p)
        )
        found = ripples([rippled, rippled])
        assert found[0] == pytest.approx(pitch, rel=3e-3)
    # what is loud at low speed, such as friction, does not hide it
    rng = np.random.default_rng(8)
    pitch = 1.37e-3
    loud = ridden(
        lambda m: 9e-6 * (m.velocity / pitch) ** 2 * np.sin(2.0 * np.pi * m.position / pitch)
        + 15.0 * rng.normal(size=len(m.time)) * (np.abs(m.velocity) < 0.03)
    )  # fmt: skip
    assert ripples([loud])[0] == pytest.approx(pitch, rel=3e-3)
    still = replace(SHORT, track=Blocks(SHORT.signals * [[0.0], [1.0], [1.0]], SHORT.raw))
    assert ripples([still]) == ()


@pytest.mark.parametrize("height", [1.0, 0.3, 0.05])
def test_the_strongest_line_has_its_frequency_and_its_share_of_the_variance(height):
    """Of one that is too weak to count, the transform alone tells it."""
    x = np.sort(np.random.default_rng(3).uniform(0.0, 0.4, 4000))
    noise = 0.2 * np.random.default_rng(4).standard_normal(len(x))
    sine = height * np.sin(2.0 * np.pi * 137.0 * x + 0.4)
    frequency, share = strongest_line(ScatteredSignal(x, sine + noise), 20.0, 400.0, 0.5)
    true = np.mean(sine**2) / np.mean((sine + noise) ** 2)
    assert frequency == pytest.approx(137.0, abs=1.5)
    assert true / 2.0 < share + 1e-3 < 1.5 * true + 2e-3


@pytest.mark.parametrize("spacing", ["even", "uneven"])
def test_the_transform_has_the_whole_share_of_a_sine_of_its_own_frequencies(spacing):
    """One each 2.5; between two of them Hann's window passes two thirds of its power."""
    x = np.linspace(0.0, 0.4, 4000)
    if spacing == "uneven":
        x = np.sort(np.random.default_rng(3).uniform(0.0, 0.4, 4000))
    asked = 137.0 + 0.25 * np.arange(10)
    records = [ScatteredSignal(x, 3.0 * np.sin(2.0 * np.pi * f * x + 0.4)) for f in asked]
    found, shares = np.transpose([strongest_line(r, 20.0, 400.0, 100.0) for r in records])
    np.testing.assert_allclose(found, asked, atol=0.075)
    assert shares.max() == pytest.approx(1.0, abs=0.005)
    assert shares.min() == pytest.approx(0.71, abs=0.03)


def test_the_velocity_without_the_encoders_own_periods_is_that_of_the_motion():
    rate, period = 4000.0, 2e-3
    t = np.arange(12_000) / rate
    x = waves((0.03, 1.3, 0.4), (0.004, 3.1, 1.0))(t)
    error = 1.5e-6 * np.sin(2.0 * np.pi * x / period + 0.7)
    log = log_of(rate, x + error, 3.0 * np.sin(9.0 * t))
    motion = motion_of(log, "x", "run", ripples=(period,))
    true = (np.diff(x) * rate)[motion.left_out :][: len(motion.unrippled)]
    of_error = np.std(np.diff(error)) * rate
    assert np.std(motion.raw[0] - true) == pytest.approx(of_error, rel=0.05)
    assert np.std(motion.unrippled - true) < 0.1 * of_error
    plain = replace(motion, ripples=())
    np.testing.assert_array_equal(plain.unrippled, motion.raw[0])
