"""Laws of what repeats: lines in time and position, logs' clocks, and a force out of step.

A line is found where it was put and nowhere else, whatever its size and the unit of time; a clock
follows the origin of a log's time; a force moved by some samples is found as moved by them.
"""

from dataclasses import replace

import numpy as np
import pytest
from constructed import SHORT, dataset_of, effect, fit_of, log_of, waves, windowed
from scipy.signal import lfilter

from identify.dataset.excitation import _rest, lines, ripples
from identify.dataset.motion import motion_of
from identify.dataset.spectral_lines import (
    MOST_LINES,
    find_lines,
    lines_in_time,
)
from identify.dataset.spectrum import Record
from identify.estimation.channel_delay import misalignment, realigned
from identify.estimation.time_origin import (
    _amplitude,
    depends_on_time_origin,
    phases_found,
    time_origins,
    with_time_origins,
    without_timed_forces,
)
from identify.output.words.estimation import channel_delay_in_words
from identify.output.words.selection import repeat_in_words
from identify.selection.repeating_force import Repeat, _strongest, _term, not_general
from twin.model.machine import AxisModel

N = 6000


def sines(frequencies, n: int = N, seed: int = 1, size: float = 1.0) -> np.ndarray:
    """Lines (cycles a sample) with heights 1, 1/2, 1/3... in white noise of 0.02."""
    rng = np.random.default_rng(seed)
    k = np.arange(n)
    out = rng.normal(0.0, 0.02, n)
    for i, f in enumerate(frequencies):
        out += np.sin(2.0 * np.pi * (f * k + rng.random())) / (i + 1.0)
    return size * out


# --- lines in time ------------------------------------------------------------------------------


@pytest.mark.parametrize(("period", "size"), [(1e-3, 1.0), (0.017, 1e-7), (4e-4, 3e6)])
def test_lines_are_found_at_their_frequencies_the_highest_first(period, size):
    wanted = np.array([0.0713, 0.2002, 0.0123])
    found = np.array(lines_in_time([(sines(wanted, size=size), period)]))
    np.testing.assert_allclose(found[:3] * period, wanted, atol=0.05 / N)
    assert len(found) == 3  # and nowhere else


def test_no_line_is_told_above_four_tenths_of_the_rate():
    found = np.array(lines_in_time([(sines([0.39, 0.41]), 1.0)]))
    assert np.abs(found - 0.39).min() < 0.05 / N
    assert found.max() < 0.4


def test_a_line_of_several_logs_is_told_once_and_a_near_one_apart():
    logs = [(sines([0.05], seed=s, n=n), 1.0) for s, n in ((2, N), (3, N // 2))]
    found = np.array(lines_in_time(logs))
    assert np.sum(np.abs(found - 0.05) < 0.5 / N) == 1
    apart = np.array(lines_in_time([(sines([0.05, 0.05 + 8.0 / N]), 1.0)]))
    assert np.abs(apart - 0.05).min() < 0.1 / N
    assert np.abs(apart - 0.05 - 8.0 / N).min() < 0.1 / N
    many = [(sines(np.arange(0.01, 0.4, 0.01), seed=s), 1.0) for s in range(2)]
    assert len(lines_in_time(many)) == MOST_LINES


@pytest.mark.parametrize("records", [1, 3])
@pytest.mark.parametrize("pole", [0.0, 0.95])
def test_noise_of_any_colour_shows_a_line_as_rarely_as_is_said(records, pole):
    """In 100 trials at 10 %: at most 20, which one in a thousand such draws exceeds."""
    rng, told = np.random.default_rng(3), 0
    for _ in range(100):
        noise = lfilter([1.0], [1.0, -pole], rng.normal(size=(records, 1500)))
        parts = [Record(np.arange(1500.0), n) for n in noise]
        told += bool(find_lines(parts, 2.0 / 1500, 0.4, chance=0.1, most=1))
    assert told <= 20


@pytest.mark.parametrize("spacing", ["even", "uneven"])
def test_a_line_has_its_frequency_share_and_a_small_false_alarm(spacing):
    rng = np.random.default_rng(6)
    x = np.linspace(-0.05, 0.1, 3000) if spacing == "even" else rng.uniform(-0.05, 0.1, 3000)
    for frequency in (171.3, 1733.0):
        values = 0.5 * np.sin(2.0 * np.pi * frequency * x + 0.7) + rng.normal(0.0, 0.3, 3000)
        first, *others = find_lines([Record(x, 1e3 * values + 7.0)], 10.0 / 0.15, 5000.0)
        assert first.frequency == pytest.approx(frequency, abs=0.1 / 0.15)
        assert first.share == pytest.approx(0.125 / (0.125 + 0.09), abs=0.04)
        assert first.false_alarm < 1e-12
        assert all(o.false_alarm > 1e-6 for o in others)
    assert find_lines([Record(x, 0.0 * x)], 10.0, 5000.0) == ()
    assert find_lines([Record(0.0 * x, values)], 10.0, 5000.0) == ()


def test_records_share_a_line_whatever_its_phase_in_each():
    """A line too weak for one record alone is told by several."""
    rng, t = np.random.default_rng(12), np.arange(2000.0)
    parts = [
        Record(t, 0.13 * np.sin(2.0 * np.pi * 0.0817 * t + k) + rng.normal(size=2000))
        for k in range(5)
    ]
    alone = [find_lines([p], 1e-3, 0.4, chance=1e-3, most=1) for p in parts]
    together = find_lines(parts, 1e-3, 0.4, chance=1e-3, most=1)
    assert sum(map(bool, alone)) <= 1
    assert together[0].frequency == pytest.approx(0.0817, abs=0.2 / 2000)


def ridden(command, duration: float = 6.0):
    """A motion with all of dry, viscous and position dependent force, and a command added to it."""
    t = (np.arange(round(duration * 1000.0))) / 1000.0
    x = waves((0.04, 0.4, 0.3), (0.02, 0.9, 1.0))
    motion = motion_of(log_of(1000.0, x(t), t), "x", "log")
    m, v = motion.position, motion.velocity
    force = 1.3 * np.gradient(v, 1e-3) + 0.7 * np.sign(v) + 0.9 * v + 0.2 - 3.0 * m + 40.0 * m**3
    u = force + command(motion)
    return replace(motion, signals=np.stack([m, v, u]), raw=np.stack([motion.raw[0], u]))


def test_what_a_rough_model_explains_is_no_line():
    assert np.abs(_rest(ridden(lambda m: 0.0 * m.time))).max() < 1e-9
    pumped = ridden(lambda m: 0.1 * np.sin(2.0 * np.pi * 31.7 * m.time))
    found = lines([pumped])
    assert found[0] == pytest.approx(31.7, abs=0.02)


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
    still = replace(SHORT, signals=SHORT.signals * [[0.0], [1.0], [1.0]])
    assert ripples([still]) == ()


# --- lines in position --------------------------------------------------------------------------


def test_a_force_of_position_has_its_period_and_term():
    m = ridden(lambda m: 0.0 * m.time)
    x = m.position
    for pitch in (2.3e-3, 5.7e-3):
        force = 0.4 * np.cos(2.0 * np.pi * x / pitch - 1.1) + 0.7
        found = _strongest([Record(x, force)])
        assert found.period == pytest.approx(pitch, rel=0.1 * pitch / np.ptp(x))
        term = _term(force, x, pitch)
        # force ~ Re(term exp(2 pi i x / period))
        assert abs(term - 0.4 * np.exp(-1.1j)) < 1e-9
    assert _strongest([Record(0.0 * x, force)]) is None
    assert _strongest([Record(x, np.random.default_rng(4).normal(size=len(x)))]) is None


def test_a_repeat_is_general_where_its_terms_are_alike():
    def repeat(phase, height=1.0):
        return Repeat(2.5e-3, {"a": 1.0, "b": height}, {"a": 0.3, "b": 0.3 + phase})

    turned = 2.0 * np.arcsin(0.25)  # of a unit vector, which moves its end by 1/2
    assert repeat(0.99 * turned).general
    assert not repeat(1.01 * turned).general
    assert repeat(0.0, 0.51).general
    assert not repeat(0.0, 0.49).general
    assert repeat(2.0 * np.pi).general
    words = repeat_in_words(repeat(1.0))
    assert "repeats every 2.5 mm of travel (1 N in a, 1 N in b)" in words
    assert "by 57 degrees" in words


def test_a_force_with_another_phase_in_each_log_is_told():
    def log(phase, name, pitch=2.3e-3, size=0.3):
        m = ridden(lambda m: size * np.sin(2.0 * np.pi * m.position / pitch + phase))
        return windowed(replace(m, name=name))

    coulomb = effect("coulomb_viscous", {"Fc": 0.7, "Fs": 0.7, "sigma2": 0.9})
    cable = effect("cable_slab", {"offset": 0.2, "k1": -3.0, "k3": 40.0})
    fit = fit_of(AxisModel(1.3, effects=(coulomb, cable)), log(0.3, "a"))
    found = not_general(fit, dataset_of(log(0.3, "a"), holdout=(log(1.8, "b"),)))
    assert found.period == pytest.approx(2.3e-3, rel=5e-3)
    assert found.amplitude == pytest.approx({"a": 0.3, "b": 0.3}, rel=0.1)
    turn = found.phase["b"] - found.phase["a"]
    assert np.mod(turn + np.pi, 2.0 * np.pi) - np.pi == pytest.approx(1.5, abs=0.1)
    same = dataset_of(log(0.3, "a"), log(0.3, "b"))
    assert not_general(fit, same) is None
    assert not_general(fit, dataset_of(log(0.3, "a"))) is None
    other = dataset_of(log(0.3, "a"), log(1.8, "b", 2.6e-3))
    assert not_general(fit, other) is None
    none = dataset_of(log(0.3, "a"), log(1.8, "b", size=0.0))
    assert not_general(fit, none) is None


# --- clocks -------------------------------------------------------------------------------------

PUMP = effect("periodic_disturbance", {"f": 23.7, "a": 0.05, "b": 0.02})
STAGE = AxisModel(1.3, effects=(effect("coulomb_viscous", {"Fc": 0.7, "Fs": 0.7, "sigma2": 0.9}),))
REST = effect("cable_slab", {"offset": 0.2, "k1": -3.0, "k3": 40.0})


def started(late: float, seed: int = 0, f: float = 23.7):
    """A log that began so long after the pump; the pump pushes, so the command has to hold."""
    turn = lambda t: 2.0 * np.pi * f * (t + late)  # noqa: E731
    rng = np.random.default_rng(seed)
    motion = ridden(
        lambda m: -0.05 * np.sin(turn(m.time)) - 0.02 * np.cos(turn(m.time))
        + rng.normal(0.0, 0.01, len(m.time))
    )  # fmt: skip
    return windowed(replace(motion, name=f"{late}"), 0.02)


def turns(found, f=23.7):
    return np.mod(time_origins(found) * f + 0.5, 1.0) - 0.5


LATE = np.array([0.0, 0.0131, 0.0347])


@pytest.fixture(scope="module")
def dataset():
    logs = [started(late, seed) for seed, late in enumerate(LATE)]
    return dataset_of(*logs[:2], holdout=(logs[2],))


def test_a_log_begun_later_has_its_clock_later_modulo_the_period(dataset):
    axis = STAGE.with_effect(REST)
    wanted = np.mod(LATE * 23.7 + 0.5, 1.0) - 0.5
    np.testing.assert_allclose(turns(with_time_origins(axis, dataset)), wanted, atol=0.01)
    # by the model's own pump: the clock of the first is zero too, for it began with the pump
    np.testing.assert_allclose(
        turns(with_time_origins(axis.with_effect(PUMP), dataset)), wanted, atol=0.01
    )
    early = {**PUMP.values, "a": -0.02, "b": 0.05}  # a quarter of a turn ahead
    ahead = axis.with_effect(effect("periodic_disturbance", early))
    shifted = np.mod(wanted - 0.25 + 0.5, 1.0) - 0.5
    np.testing.assert_allclose(turns(with_time_origins(ahead, dataset)), shifted, atol=0.01)
    late = (
        time_origins(with_time_origins(ahead, dataset_of(*dataset.fit, started(0.0211, 3)))) * 23.7
    )
    assert (np.abs(late) <= 0.5).all()  # the nearest of all turns alike
    near = dataset_of(started(0.0), started(0.015 / 23.7, 1))
    assert not time_origins(with_time_origins(axis, near)).any()  # within two hundredths of a turn


def test_a_clock_is_set_by_no_line_that_may_be_chance(dataset):
    axis = STAGE.with_effect(REST)
    assert with_time_origins(axis, dataset_of(dataset.fit[0])) is not None
    assert not time_origins(with_time_origins(axis, dataset_of(dataset.fit[0]))).any()
    quiet = [
        windowed(
            replace(
                ridden(lambda m, s=s: np.random.default_rng(s).normal(0, 0.01, len(m.time))),
                name=f"{s}",
            ),
            0.02,
        )
        for s in (1, 2)
    ]
    assert not time_origins(with_time_origins(axis, dataset_of(*quiet))).any()


def test_the_effects_that_read_the_clock_are_told(dataset):
    axis = STAGE.with_effect(PUMP)
    assert without_timed_forces(axis, dataset.fit[0]).names == STAGE.names
    assert without_timed_forces(STAGE, dataset.fit[0]) == STAGE
    assert depends_on_time_origin(axis, dataset)
    assert not depends_on_time_origin(STAGE, dataset)
    assert phases_found(axis, "periodic_disturbance", dataset) == 0
    known = with_time_origins(axis, dataset)
    set_ = sum(log.motion.time_origin != 0.0 for log in known.fit)
    assert phases_found(axis, "periodic_disturbance", known) == set_ == 1
    assert phases_found(axis, "coulomb_viscous", known) == 0


def test_an_amplitude_is_that_of_its_line():
    t = np.arange(4000) * 1e-3
    force = 0.7 * np.cos(2.0 * np.pi * 12.5 * t + 0.4) + 3.0
    assert abs(_amplitude(t, force, 12.5) - 0.7 * np.exp(0.4j)) < 1e-9


# --- alignment ----------------------------------------------------------------------------------


def aligned(samples: float, noise: float = 1e-3):
    """A log whose force channel was stamped so many samples late."""
    rate, shift = 1000.0, samples / 1000.0
    t = np.arange(5000) / rate
    x = waves((0.03, 1.3, 0.4), (0.006, 5.1, 1.0), (0.0007, 19.0, 2.0))
    u = lambda s: 1.7 * (x(s + 1e-4) - 2.0 * x(s) + x(s - 1e-4)) / 1e-8  # noqa: E731
    rng = np.random.default_rng(5)
    force = u(t + 0.5 / rate - shift) + rng.normal(0.0, noise, len(t))
    return windowed(motion_of(log_of(rate, x(t), force), "x", "log"), 0.02)


@pytest.mark.parametrize("samples", [0.3, 1.0, 2.4])
def test_a_force_that_acts_before_its_stamp_is_found_by_so_many_samples(samples):
    log = aligned(samples)
    axis = AxisModel(1.7)
    found = misalignment(fit_of(axis, log), dataset_of(log))
    assert found == pytest.approx(samples * 1e-3, rel=0.05)
    dataset = realigned(dataset_of(log, holdout=(log,)), found)
    assert dataset.channel_delay == found
    left = [fit_of(axis, *logs).error for logs in ((log,), dataset.fit, dataset.holdout)]
    assert left[1] < 0.15 * left[0]
    assert left[1] == left[2]
    assert dataset.test_function_length == pytest.approx(0.02)
    back = realigned(dataset, 0.0)
    assert back.channel_delay == 0.0
    np.testing.assert_allclose(back.fit[0].command[9:-9], log.command[9:-9], atol=0.1)


def test_a_force_that_acts_late_or_hardly_early_is_no_fault_of_the_log():
    axis = AxisModel(1.7)
    for samples, told in ((0.0, 0), (-1.0, 0), (0.042, 0), (0.058, 1), (2.7, 1), (3.6, 0)):
        log = aligned(samples, noise=1e-4)
        found = misalignment(fit_of(axis, log), dataset_of(log))
        assert (found > 0.0) == bool(told), samples
    log = aligned(0.058, noise=3.0)  # lost in the noise
    assert misalignment(fit_of(axis, log), dataset_of(log)) == 0.0


def test_a_shift_is_said_in_samples():
    log = aligned(0.0)
    assert channel_delay_in_words(dataset_of(log)) is None
    said = channel_delay_in_words(dataset_of(log, channel_delay=1.5e-3))
    assert said.startswith("axis x: the force acts 1500 us (1.50 samples) before")
