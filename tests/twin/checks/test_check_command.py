"""Laws of values that are held and of the command: noise, single samples, small lags, clocks."""

import numpy as np
import pytest
from check_drive import axis_of, command, drive, motion, stated

from twin.checks import Fault, Severity, breaks
from twin.checks import channels as timing
from twin.checks import command as commands
from twin.checks.axis import held_samples
from twin.checks.explain import find_trend
from twin.logs import AxisLog, Log

RATE = 1000.0


# --- held values ---------------------------------------------------------------------------


@pytest.mark.parametrize("count", [2, 5, 20])
def test_a_signal_that_is_held_changes_at_every_few_samples(count):
    signal = np.sin(0.01 * np.arange(4000.0))
    assert held_samples(signal) == 0
    assert held_samples(np.repeat(signal[::count], count)) == count
    assert held_samples(np.repeat(signal[:49], count)) == 0  # too few changes to tell
    jittered = np.repeat(signal[:400], 3 + (np.arange(400) % 7 == 0))
    assert held_samples(jittered) == 0  # it drifts against the samples
    assert held_samples(np.repeat(signal[:200], 21)) == 0


def test_a_held_position_or_force_is_told_with_the_rate_it_was_sampled_at():
    def hold(name):
        def change(columns):
            columns[name][:] = np.repeat(columns[name][::4], 4)

        return axis_of(drive(RATE, change=change))

    (found,) = breaks.check_breaks(hold("position"))
    assert "the position changes at every 4th sample only: it was sampled at 250 Hz" in found.what
    assert found.remedy == "record it at 1000 Hz, or the log at 250 Hz"
    assert breaks.find_breaks(hold("position")) == []
    (found,) = commands.check_command(hold("force"))
    assert "the force changes at every 4th sample only" in found.what


# --- the command ---------------------------------------------------------------------------


def test_a_sample_is_off_the_median_of_five():
    signal = np.array([1.0, 2.0, 9.0, 4.0, 5.0, 3.0, 7.0])
    expected = [0, 0, abs(9.0 - 4.0), abs(4.0 - 4.0), abs(5.0 - 5.0), 0, 0]
    np.testing.assert_allclose(commands.off_course(signal), expected)
    rng = np.random.default_rng(8)
    signal = rng.standard_normal(200)
    wanted = [abs(signal[k] - np.median(signal[k - 2 : k + 3])) for k in range(2, 198)]
    np.testing.assert_allclose(commands.off_course(signal)[2:-2], wanted)
    assert not commands.off_course(signal[:5]).any()


@pytest.mark.parametrize(("part", "told"), [(0.25, False), (0.35, True)])
def test_a_single_sample_is_off_by_three_tenths_of_the_command(part, told):
    size = part * axis_of(drive(RATE, coulomb=0.0)).force_size

    def change(columns):
        columns["force"][[1200, 2600]] += size

    found = list(commands.check_command(axis_of(drive(RATE, change=change, coulomb=0.0))))
    assert len(found) == told
    if told:
        assert found[0].fault is Fault.OUTLIERS
        assert stated(found[0], "off by up to ") == pytest.approx(size, rel=0.05)
        assert found[0].where == "1.2 s and 1 more times"


@pytest.mark.parametrize(("part", "told"), [(0.04, False), (0.06, True)])
def test_noise_of_a_twentieth_of_the_command_is_told(part, told):
    log = drive(RATE)
    size = part * float(np.std(log.axes["x"].force))
    white = size * np.random.default_rng(3).standard_normal(4000)

    def change(columns):
        columns["force"] += white

    found = [f for f in commands.check_command(axis_of(drive(RATE, change=change)))
             if f.fault is Fault.NOISE]  # fmt: skip
    assert len(found) == told
    if told:
        assert float(found[0].what.split(" rms")[0].split()[-2]) == pytest.approx(size, rel=0.1)
        weights = axis_of(log).smoother.weights
        averaged = float(found[0].what.partition("sample, ")[2].split()[0])
        assert averaged == pytest.approx(size * np.linalg.norm(weights), rel=0.1)
        assert "over 21 ms" in found[0].what


# --- small lags and clocks -----------------------------------------------------------------


@pytest.mark.parametrize("late", [0.6e-3, -0.6e-3])
def test_a_small_steady_lag_is_told_with_its_error(late):
    """Beyond a quarter of a millisecond and one and a half samples, in every part of the log."""
    rate, seconds = 4000.0, 20.0
    (found,) = timing.check_timing(axis_of(drive(rate, seconds, late={"force": late})))
    assert (found.fault, found.severity) == (Fault.LAG, Severity.WARNING)
    assert stated(found, "the force is ") == pytest.approx(abs(late) * 1e3, abs=0.05)
    assert ("behind" in found.what) == (late > 0.0)
    side = "force" if late > 0.0 else "position"
    assert found.remedy.startswith(f"give {side} delay_samples = 2 in the import map, unless")
    small = drive(rate, seconds, late={"force": 0.3 * late})
    assert not list(timing.check_timing(axis_of(small)))


@pytest.mark.parametrize(("ppm", "told"), [(40.0, 0), (90.0, 1), (-90.0, 1)])
def test_two_clocks_that_drift_by_sixty_millionths_are_told(ppm, told):
    rate, seconds = 1000.0, 60.0
    t = 10.0 + np.arange(round(rate * seconds)) / rate
    drifted = t - ppm * 1e-6 * (t - t.mean())
    columns = {"position": motion(t), "force": command(drifted + 0.5 / rate)}
    found = list(timing.check_timing(axis_of(Log(rate, {"x": AxisLog(columns)}))))
    assert [f.fault for f in found] == [Fault.DRIFT] * told
    if told:
        assert ("later" in found[0].what) == (ppm > 0.0)
        assert float(found[0].what.partition("(")[2].split()[0]) == pytest.approx(90.0, abs=9.0)
        assert float(found[0].what.split()[3]) == pytest.approx(0.09, abs=0.011)  # ms a second


@pytest.mark.parametrize(("parts", "enough"), [(4, False), (5, True)])
def test_a_trend_needs_five_lively_parts(parts, enough):
    rng = np.random.default_rng(1)
    signal = rng.standard_normal(8000)
    signal[parts * 1000 :] *= 0.01
    assert (find_trend(signal, signal[:, None], np.ones(8000), 1e-3) is not None) is enough
    kept = np.r_[np.ones(parts * 1000), np.zeros(8000 - parts * 1000)]
    lively = rng.standard_normal(8000)
    assert (find_trend(lively, lively[:, None], kept, 1e-3) is not None) is enough
