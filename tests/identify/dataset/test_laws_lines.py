"""Laws of what repeats: a line is found where it was put and nowhere else, whatever its size and
the unit of time."""

from dataclasses import replace

import numpy as np
import pytest
from constructed import SHORT, ridden
from scipy.signal import lfilter

from identify.dataset.coordinates import lines, ripples
from identify.dataset.motion import Blocks
from identify.dataset.spectrum import MOST_LINES, Record, find_lines, lines_in_time

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


@pytest.mark.parametrize(("records", "pole"), [(1, 0.95), (3, 0.0)])
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
    rng, t = np.random.default_rng(12), np.arange(2000.0)
    parts = [
        Record(t, 0.13 * np.sin(2.0 * np.pi * 0.0817 * t + k) + rng.normal(size=2000))
        for k in range(5)
    ]
    alone = [find_lines([p], 1e-3, 0.4, chance=1e-3, most=1) for p in parts]
    together = find_lines(parts, 1e-3, 0.4, chance=1e-3, most=1)
    assert sum(map(bool, alone)) <= 1
    assert together[0].frequency == pytest.approx(0.0817, abs=0.2 / 2000)


def test_what_a_rough_model_explains_is_no_line():
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
    still = replace(SHORT, track=Blocks(SHORT.signals * [[0.0], [1.0], [1.0]], SHORT.raw))
    assert ripples([still]) == ()
