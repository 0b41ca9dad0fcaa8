"""Laws of what breaks a position off its course: called by name, placed and sized."""

import numpy as np
import pytest
from check_drive import axis_of, drive, findings, motion, stated

from twin.checks import Fault, Severity, check_log
from twin.checks.axis import held_samples
from twin.checks.content import off_course
from twin.checks.explain import find_trend
from twin.logs import AxisLog, Log

RATE = 1000.0
ALONE, BOTH = ("position", "force"), ("position", "force", "setpoint_position")
BREAKS = {
    Fault.MISSING, Fault.STUCK, Fault.WRAPPED, Fault.OUTLIERS, Fault.JOINED, Fault.STEP,
    Fault.UNEVEN, Fault.HELD,
}  # fmt: skip
FAST = 1000 + int(np.argmax(np.abs(motion(11.0 + np.arange(2000) / RATE, 1))))
SPEED = abs(float(motion(10.0 + FAST / RATE, 1)))


def broken(change, signals=ALONE, seconds=4.0):
    """What is said of the position of a drive that was changed."""
    found = check_log(drive(RATE, seconds, signals=signals, change=change)).findings
    return [f for f in found if f.fault in BREAKS and "force" not in f.what]


def farther(*names, **places):
    """From each of these samples on, some signals are farther by a size."""

    def change(columns):
        for name in names:
            for place, size in places.items():
                columns[name][int(place[1:]) :] += size

    return change


@pytest.mark.parametrize("lost", [3, 12])
def test_missing_samples_are_counted_by_the_way_that_the_motion_went_on(lost):
    whole = drive(RATE).axes["x"].columns
    columns = {n: np.delete(c, slice(1500, 1500 + lost)) for n, c in whole.items()}
    (found,) = findings(Log(RATE, {"x": AxisLog(columns)}), Fault.MISSING)
    assert int(found.what.split()[0]) == pytest.approx(lost, abs=1 + 0.1 * lost)
    assert (str(found.where), found.severity) == ("1.499 to 1.5 s", Severity.WARNING)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_counts_that_are_lost_are_a_step_where_the_setpoint_goes_on(sign):
    (found,) = broken(farther("position", s2500=sign * 2e-3), BOTH)
    assert found.fault is Fault.STEP
    assert stated(found, "steps by ") == pytest.approx(0.002, rel=0.02)
    assert str(found.where) == "2.499 to 2.5 s"
    # where the setpoint steps with it, the samples between are missing, or logs were joined
    (found,) = broken(farther("position", "setpoint_position", s2500=sign * 2e-3), BOTH)
    forwards = sign * float(motion(12.5, 1)) > 0.0
    assert found.fault in ((Fault.MISSING,) if forwards else (Fault.JOINED, Fault.STEP))


@pytest.mark.parametrize(
    ("places", "fault", "size", "where"),
    [
        # told once, with the larger size and their number
        ({"s1000": 2e-3, "s2000": 5e-3, "s3000": 2e-3}, Fault.STEP, 5e-3,
         "0.999 to 1 s and 2 more times"),
        # a step that is soon taken back is an offset between; twice the same way is none
        ({"s2000": 2e-3, "s2045": -2e-3}, Fault.OUTLIERS, 2e-3, "1.999 to 2.045 s"),
        ({"s2000": 2e-3, "s2060": -2e-3}, Fault.STEP, 2e-3, "1.999 to 2 s and 1 more times"),
        ({"s2000": 2e-3, "s2040": 2e-3}, Fault.STEP, 2e-3, "1.999 to 2 s and 1 more times"),
    ],
)  # fmt: skip
def test_steps_are_told_together(places, fault, size, where):
    (found,) = broken(farther("position", **places), BOTH)
    words = "off by up to " if fault is Fault.OUTLIERS else "steps by "
    assert (found.fault, str(found.where)) == (fault, where)
    assert stated(found, words) == pytest.approx(size, rel=0.02)


@pytest.mark.parametrize(("length", "told"), [(4, False), (5, True), (30, True)])
def test_an_encoder_that_stands_still_is_caught_up_with(length, told):
    def change(columns):
        columns["position"][FAST : FAST + length + 1] = columns["position"][FAST]

    found = [f for f in broken(change) if f.fault is Fault.STUCK]
    assert len(found) == told
    if told:
        at = 10.0 + np.array([FAST, FAST + length + 1]) / RATE
        way = float(np.ptp(motion(at)))
        words = f"stands still for {length / RATE:.3g} s and is {way:.3g} m farther"
        assert words in found[0].what
        assert str(found[0].where) == f"{FAST / RATE:g} to {(FAST + length) / RATE:g} s"
        assert found[0].severity is Severity.ERROR


@pytest.mark.parametrize("signals", [ALONE, BOTH])
def test_a_counter_that_wraps_goes_back_by_most_of_the_travel(signals):
    """Back and forth at an almost even speed, so that it wraps where it moves."""
    t = np.arange(4000) / RATE
    x = 0.2 * np.sin(1.3 * t) + 0.05 * t
    columns = {"position": np.mod(x, 0.1), "force": np.cos(t), "setpoint_position": x}
    log = Log(RATE, {"x": AxisLog({n: columns[n] for n in signals})})
    (found,) = findings(log, Fault.WRAPPED)
    assert "goes back by 0.1 m in one sample" in found.what
    assert "add 0.1 m behind each wrap" in found.remedy
    wraps = np.count_nonzero(np.abs(np.diff(columns["position"])) > 0.05)
    assert str(found.where).endswith(f" and {wraps - 1} more times")


@pytest.mark.parametrize(
    ("places", "part", "fault", "words", "severity"),
    [([FAST], 0.7, Fault.UNEVEN, "off by ", Severity.WARNING),
     ([FAST - 10, FAST + 10], 0.7, Fault.UNEVEN, "off by ", Severity.WARNING),
     ([FAST], 1.4, Fault.OUTLIERS, "off by up to ", Severity.WARNING)],
)  # fmt: skip
def test_a_clock_that_skips_is_less_than_a_samples_motion(places, part, fault, words, severity):
    size = part * SPEED / RATE

    def change(columns):
        columns["position"][places] += size

    (found,) = broken(change)
    assert (found.fault, found.severity) == (fault, severity)
    assert stated(found, words) == pytest.approx(size, rel=0.05)


@pytest.mark.parametrize(
    ("count", "seconds", "uneven"), [(11, 4.0, False), (13, 8.0, True), (20, 30.0, False)]
)
def test_from_twelve_places_and_one_a_second_on_it_is_the_clock(count, seconds, uneven):
    def change(columns):
        at = np.linspace(300, 1000 * seconds - 300, count).astype(int)
        columns["position"][at] += 1e-3

    (found,) = broken(change, seconds=seconds)
    assert found.fault is (Fault.UNEVEN if uneven else Fault.OUTLIERS)
    if uneven:
        assert f"at {3 * count} samples" in found.what
        assert stated(found, "bends by up to ") == pytest.approx(2e-3, rel=0.02)
        assert str(found.where) == "from 0.298 s"
    else:
        assert str(found.where).endswith(f"{count - 1} more times")


@pytest.mark.parametrize("count", [2, 20])
def test_a_signal_that_is_held_changes_at_every_few_samples(count):
    signal = np.sin(0.01 * np.arange(4000.0))
    assert held_samples(signal) == 0
    assert held_samples(np.repeat(signal[::count], count)) == count
    assert held_samples(np.repeat(signal[:49], count)) == 0  # too few changes to tell
    jittered = np.repeat(signal[:400], 3 + (np.arange(400) % 7 == 0))
    assert held_samples(jittered) == 0  # it drifts against the samples
    assert held_samples(np.repeat(signal[:200], 21)) == 0


@pytest.mark.parametrize("name", ["position", "force"])
def test_a_held_signal_is_told_with_the_rate_it_was_sampled_at(name):
    def hold(columns):
        columns[name][:] = np.repeat(columns[name][::4], 4)

    (found,) = findings(drive(RATE, change=hold), Fault.HELD)
    assert found.what.startswith(f"the {name} changes at every 4th sample only")
    assert found.what.endswith("it was sampled at 250 Hz and held")
    assert found.remedy == "record it at 1000 Hz, or the log at 250 Hz"


def test_a_sample_is_off_the_median_of_five():
    signal = np.random.default_rng(8).standard_normal(200)
    wanted = [abs(signal[k] - np.median(signal[k - 2 : k + 3])) for k in range(2, 198)]
    np.testing.assert_allclose(off_course(signal), [0.0, 0.0, *wanted, 0.0, 0.0])
    assert not off_course(signal[:5]).any()


@pytest.mark.parametrize(("parts", "enough"), [(4, False), (5, True)])
def test_a_trend_needs_five_lively_parts(parts, enough):
    lively, ones = np.random.default_rng(1).standard_normal(8000), np.ones(8000)
    mask = np.arange(8000) < parts * 1000
    for signal, kept in ((np.where(mask, 1.0, 0.01) * lively, ones), (lively, mask.astype(float))):
        assert (find_trend(signal, signal[:, None], kept, 1e-3) is not None) is enough


@pytest.mark.parametrize("at", [1200, 2700])
def test_motion_near_a_jump_is_not_believed_and_all_other_is(at):
    """Two samples each side of the jump, reached by the low-pass of 21 blocks."""
    axis = axis_of(drive(change=farther("position", **{f"s{at}": 0.01})))
    spoilt = np.flatnonzero(axis.kept == 0.0)
    assert abs((axis.smoother.time(spoilt) * 1e3).mean() - at) < 1.5
    assert np.all(np.diff(spoilt) == 1)
    assert 21 <= len(spoilt) <= 28
