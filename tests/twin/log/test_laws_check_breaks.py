"""Laws of what breaks a position or a command off its course: called by name, placed and sized."""

import numpy as np
import pytest
from check_drive import command, drive, motion

from twin.log import LINEAR_UNITS, ROTARY_UNITS, AxisLog, Log
from twin.log.check import Fault, Severity, breaks, check_log, crossed, timing
from twin.log.check import command as commands
from twin.log.check.axis import Axis, held_samples
from twin.log.check.lag import Trend, find_trend
from twin.log.check.parts import Part, together
from twin.log.check.report import CheckReport, Finding

RATE = 1000.0
BOTH = ("position", "force", "setpoint_position")


def axis_of(log: Log) -> Axis:
    return Axis("x", log.sample_rate, log.axes["x"])


def broken(change, signals=("position", "force"), seconds=4.0, **more) -> list[Finding]:
    return list(breaks.check(axis_of(drive(RATE, seconds, signals=signals, change=change, **more))))


def farther(places, size, *names):
    """From each of these samples on, some signals are farther by a size."""

    def change(columns):
        for name in names:
            for at in places:
                columns[name][at:] += size

    return change


def speed(at: int) -> float:
    return float(motion(10.0 + at / RATE, 1))


def stated(finding: Finding, words: str) -> float:
    """The number behind these words."""
    return float(finding.what.partition(words)[2].split()[0])


FAST = 1000 + int(np.argmax(np.abs(motion(11.0 + np.arange(2000) / RATE, 1))))


# --- the course of a position --------------------------------------------------------------


def test_the_course_around_a_step_is_told_from_ten_samples_each_side():
    x = np.r_[2.0 * np.arange(30), 7.0 + 2.0 * 29 + 3.0 * np.arange(1, 31)]
    step, before, after = breaks._around(x, 30, 30)
    assert (before, after) == (2.0, 3.0)
    # from the last sample before to the first behind it goes 7 + 3 + 3, of which two samples' way
    # at the mean speed is its course
    assert step == pytest.approx((x[31] - x[29]) - 2.5 * 2)
    assert breaks._around(x, 10, 10) is None
    assert breaks._around(x, 11, 11) is not None
    assert breaks._around(x, 48, 48) is not None
    assert breaks._around(x, 49, 49) is None


@pytest.mark.parametrize("lost", [3, 12])
def test_missing_samples_are_counted_by_the_way_that_the_motion_went_on(lost):
    t = 10.0 + np.arange(4000) / RATE
    kept = np.r_[0:1500, 1500 + lost : 4000]
    columns = {"position": motion(t)[kept], "force": command(t)[kept]}
    found = list(breaks.check(axis_of(Log(RATE, {"x": AxisLog(columns)}))))
    assert [f.fault for f in found] == [Fault.MISSING]
    count = int(found[0].what.split()[0])
    assert count == pytest.approx(lost, abs=1 + 0.1 * lost)
    assert found[0].where == "1.499 to 1.5 s"
    assert found[0].severity is Severity.ERROR


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_counts_that_are_lost_are_a_step_where_the_setpoint_goes_on(sign):
    (found,) = broken(farther([2500], sign * 2e-3, "position"), BOTH)
    assert found.fault is Fault.STEP
    assert stated(found, "steps by ") == pytest.approx(0.002, rel=0.02)
    assert found.where == "2.499 to 2.5 s"
    # where the setpoint steps with it, the samples between are missing, or logs were joined
    (found,) = broken(farther([2500], sign * 2e-3, "position", "setpoint_position"), BOTH)
    assert found.fault in (Fault.MISSING, Fault.JOINED, Fault.STEP)
    assert found.fault is Fault.MISSING or sign * speed(2500) < 0.0


def test_two_steps_are_told_once_with_the_larger_size_and_their_number():
    def change(columns):
        farther([1000, 3000], 2e-3, "position")(columns)
        farther([2000], 5e-3, "position")(columns)

    (found,) = broken(change, BOTH)
    assert stated(found, "steps by ") == pytest.approx(0.005, rel=0.02)
    assert found.where == "0.999 to 1 s and 2 more times"


def test_a_step_that_is_taken_back_within_a_twentieth_of_a_second_is_an_offset_between():
    for length, kind in ((45, Fault.OUTLIERS), (60, Fault.STEP)):

        def change(columns, length=length):
            columns["position"][2000 : 2000 + length] += 2e-3

        (found,) = broken(change, BOTH)
        assert found.fault is kind
        words = "off by up to " if kind is Fault.OUTLIERS else "steps by "
        assert stated(found, words) == pytest.approx(0.002, rel=0.02)
    more = broken(lambda c: farther([2000, 2040], 2e-3, "position")(c), BOTH)
    assert [f.fault for f in more] == [Fault.STEP]  # twice the same way is no offset
    assert more[0].where.endswith("1 more times")


def test_an_encoder_that_stands_still_is_caught_up_with():
    for length in (4, 5, 30):

        def change(columns, length=length):
            columns["position"][FAST : FAST + length + 1] = columns["position"][FAST]

        found = [f for f in broken(change) if f.fault is Fault.STUCK]
        assert len(found) == (length >= 5)
    way = abs(float(motion(10.0 + (FAST + 31) / RATE) - motion(10.0 + FAST / RATE)))
    assert f"stands still for {0.03:.3g} s and is {way:.3g} m farther" in found[0].what
    assert found[0].where == f"{FAST / RATE:g} to {(FAST + 30) / RATE:g} s"
    assert found[0].severity is Severity.ERROR


@pytest.mark.parametrize("signals", [("position", "force"), BOTH])
def test_a_counter_that_wraps_goes_back_by_most_of_the_travel(signals):
    """Back and forth at an almost even speed, so that it wraps where it moves."""
    t = np.arange(4000) / RATE
    x = 0.2 * np.sin(1.3 * t) + 0.05 * t
    wrapped = np.mod(x, 0.1)
    columns = {"position": wrapped, "force": np.cos(t), "setpoint_position": x}
    columns = {n: columns[n] for n in signals}
    (found,) = breaks.check(axis_of(Log(RATE, {"x": AxisLog(columns)})))
    assert found.fault is Fault.WRAPPED
    assert "goes back by 0.1 m in one sample" in found.what
    assert "add 0.1 m behind each wrap" in found.remedy
    wraps = np.count_nonzero(np.abs(np.diff(wrapped)) > 0.05)
    assert found.where.endswith(f" and {wraps - 1} more times")


def test_logs_that_were_joined_differ_in_place_and_speed():
    def change(columns):
        later = 10.0 + 0.47 + np.arange(2000) / RATE
        columns["position"][2000:] = 0.3 - 2.0 * motion(later)

    (found,) = broken(change)
    assert found.fault is Fault.JOINED
    assert found.where == "1.999 to 2 s"


@pytest.mark.parametrize(("part", "fault"), [(0.7, Fault.UNEVEN), (1.4, Fault.OUTLIERS)])
def test_a_clock_that_skips_is_less_than_two_samples_motion(part, fault):
    """A sample that is off bends the position by twice as much."""
    size = part * 2.0 * abs(speed(FAST)) / RATE

    def change(columns):
        columns["position"][FAST] += size / 2.0

    (found,) = broken(change)
    assert found.fault is fault
    words = "off by " if fault is Fault.UNEVEN else "off by up to "
    assert stated(found, words) == pytest.approx(size, rel=0.05)
    warned = fault is Fault.UNEVEN
    assert found.severity is (Severity.WARNING if warned else Severity.ERROR)


@pytest.mark.parametrize(("count", "uneven"), [(11, False), (13, True)])
def test_from_twelve_places_on_it_is_the_clock(count, uneven):
    places = np.linspace(300, 3700, count).astype(int)

    def change(columns):
        for at in places:
            columns["position"][at] += 1e-3

    found = broken(change)
    assert breaks.is_uneven(axis_of(drive(RATE, change=change))) is uneven
    if uneven:
        assert [f.fault for f in found] == [Fault.UNEVEN]
        assert f"at {3 * count} samples" in found[0].what
        assert stated(found[0], "bends by up to ") == pytest.approx(2e-3, rel=0.02)
        assert found[0].where == "from 0.298 s"
    else:
        assert [f.fault for f in found] == [Fault.OUTLIERS]
        assert found[0].where.endswith(f"{count - 1} more times")


def test_a_long_log_needs_a_bend_a_second():
    def change(columns):
        columns["position"][np.linspace(300, 29_000, 20).astype(int)] += 1e-3

    assert not breaks.is_uneven(axis_of(drive(RATE, 30.0, change=change)))


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

    (found,) = breaks.check(hold("position"))
    assert "the position changes at every 4th sample only: it was sampled at 250 Hz" in found.what
    assert found.remedy == "record it at 1000 Hz, or the log at 250 Hz"
    assert breaks.find_breaks(hold("position")) == []
    (found,) = commands.check(hold("force"))
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
def test_a_single_sample_is_off_by_three_tenths_of_the_command(part, told, monkeypatch):
    monkeypatch.setattr("check_drive.COULOMB", 0.0)  # no edges
    size = part * axis_of(drive(RATE)).force_size

    def change(columns):
        columns["force"][[1200, 2600]] += size

    found = list(commands.check(axis_of(drive(RATE, change=change))))
    assert len(found) == told
    if told:
        assert found[0].fault is Fault.OUTLIERS
        assert stated(found[0], "off by up to ") == pytest.approx(size, rel=0.05)
        assert found[0].where == "1.2 s and 1 more times"


def test_four_samples_together_are_a_burst_and_no_single_ones():
    off = np.zeros(3000)
    off[[100, 109, 120]] = 5.0
    np.testing.assert_array_equal(commands._single(off, 1.0), [100, 109, 120])
    off[[103, 106]] = 5.0
    np.testing.assert_array_equal(commands._single(off, 1.0), [120])
    assert len(commands._single(off, 6.0)) == 0


@pytest.mark.parametrize(("part", "told"), [(0.04, False), (0.06, True)])
def test_noise_of_a_twentieth_of_the_command_is_told(part, told):
    log = drive(RATE)
    size = part * float(np.std(log.axes["x"].force))
    white = size * np.random.default_rng(3).standard_normal(4000)

    def change(columns):
        columns["force"] += white

    found = [f for f in commands.check(axis_of(drive(RATE, change=change)))
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
    (found,) = timing.check(axis_of(drive(rate, seconds, late={"force": late})))
    assert (found.fault, found.severity) == (Fault.LAG, Severity.WARNING)
    assert stated(found, "the force is ") == pytest.approx(abs(late) * 1e3, abs=0.05)
    assert ("behind" in found.what) == (late > 0.0)
    side = "force" if late > 0.0 else "position"
    assert found.remedy.startswith(f"give {side} delay_samples = 2 in the import map, unless")
    small = drive(rate, seconds, late={"force": 0.3 * late})
    assert not list(timing.check(axis_of(small)))


@pytest.mark.parametrize(("ppm", "told"), [(40.0, 0), (90.0, 1), (-90.0, 1)])
def test_two_clocks_that_drift_by_sixty_millionths_are_told(ppm, told):
    rate, seconds = 1000.0, 60.0
    t = 10.0 + np.arange(round(rate * seconds)) / rate
    drifted = t - ppm * 1e-6 * (t - t.mean())
    columns = {"position": motion(t), "force": command(drifted + 0.5 / rate)}
    found = list(timing.check(axis_of(Log(rate, {"x": AxisLog(columns)}))))
    assert [f.fault for f in found] == [Fault.DRIFT] * told
    if told:
        assert ("later" in found[0].what) == (ppm > 0.0)
        assert float(found[0].what.partition("(")[2].split()[0]) == pytest.approx(90.0, abs=9.0)
        assert float(found[0].what.split()[3]) == pytest.approx(0.09, abs=0.011)  # ms a second


def test_a_trend_is_the_median_and_the_median_slope_of_the_parts(monkeypatch):
    """Eight parts of 1 s; the lags of seven go on evenly, that of one is far off."""
    from twin.log.check import lag as module

    lags = iter(1e-3 * np.array([1.0, 1.2, 1.4, 9.0, 1.8, 2.0, 2.2, 2.4]))
    monkeypatch.setattr(module, "find_lag", lambda *_: module.Lag(next(lags), True))
    signal = np.sin(np.arange(8000.0))
    found = find_trend(signal, signal[:, None], np.ones(8000), 1e-3)
    assert isinstance(found, Trend)
    assert found.seconds == pytest.approx(1.9e-3)
    assert found.drift == pytest.approx(0.2e-3, rel=1e-6)
    lags = 1e-3 * np.array([1.0, 1.2, 1.4, 9.0, 1.8, 2.0, 2.2, 2.4])
    times = np.arange(8.0) - 3.5
    spread = 1.4826 * np.median(np.abs(lags - 1.9e-3))
    left = 1.4826 * np.median(np.abs(lags - 1.9e-3 - 0.2e-3 * times))
    assert found.error == pytest.approx(1.25 * spread / 8**0.5)
    assert found.drift_error == pytest.approx(1.25 * left / np.linalg.norm(times))


@pytest.mark.parametrize(("parts", "enough"), [(4, False), (5, True)])
def test_a_trend_needs_five_lively_parts(parts, enough):
    rng = np.random.default_rng(1)
    signal = rng.standard_normal(8000)
    signal[parts * 1000 :] *= 0.01
    assert (find_trend(signal, signal[:, None], np.ones(8000), 1e-3) is not None) is enough
    kept = np.r_[np.ones(parts * 1000), np.zeros(8000 - parts * 1000)]
    lively = rng.standard_normal(8000)
    assert (find_trend(lively, lively[:, None], kept, 1e-3) is not None) is enough


# --- two axes ------------------------------------------------------------------------------


def two_axes(swapped: tuple[str, ...] = (), kind=None) -> Log:
    t = 10.0 + np.arange(4000) / RATE
    made = {
        "a": {"position": motion(t), "force": command(t + 0.5 / RATE), "setpoint_position":
              motion(t)},
        "b": {"position": motion(1.7 * t + 3.0), "setpoint_position": motion(1.7 * t + 3.0)},
    }  # fmt: skip
    v, a = 1.7 * motion(1.7 * t + 3.0, 1), 1.7**2 * motion(1.7 * t + 3.0, 2)
    made["b"]["force"] = 4.0 * a + 9.0 * np.tanh(v / 1e-3) + 2.0 * v
    for name in swapped:
        made["a"][name], made["b"][name] = made["b"][name], made["a"][name]
    kinds = {"a": LINEAR_UNITS, "b": kind or LINEAR_UNITS}
    return Log(RATE, {n: AxisLog(c, kinds[n]) for n, c in made.items()})


@pytest.mark.parametrize("what", ["force", "position"])
def test_channels_that_are_swapped_are_told_by_what_was(what):
    def found(log):
        return list(crossed.check([Axis(n, RATE, axis) for n, axis in log.axes.items()]))

    assert found(two_axes()) == []
    (told,) = found(two_axes((what,)))
    assert (told.fault, told.severity, told.axis) == (Fault.SWAPPED, Severity.ERROR, "a")
    assert told.what.startswith("the motion of axis b leaves ")
    assert told.what.endswith(f"{what}s of axes a and b are swapped")
    crossing, own = (float(word) for word in told.what.split() if word[0].isdigit())
    assert crossing < 10.0 < 50.0 < own
    assert told.remedy == f"exchange the columns of the {what}s of both axes in the import map"
    assert found(two_axes((what,), ROTARY_UNITS)) == []  # newtons are no newton metres


# --- a long log in parts -------------------------------------------------------------------


def finding(fault=Fault.LAG, where="whole log", severity=Severity.WARNING, what="w") -> Finding:
    return Finding(severity, fault, "x", what, where, "r")


def parts_of(*reports: tuple[Finding, ...]) -> list[Part]:
    return [Part(10.0 * i, 10.0 * i + 10.0, CheckReport(r)) for i, r in enumerate(reports)]


def test_a_fault_is_said_once_with_its_first_place_and_in_how_many_parts():
    one, two = finding(where="from 3 s", what="first"), finding(where="from 4 s", what="second")
    (said,) = together(parts_of((), (one, two), (two,))).findings
    assert (said.what, said.where) == (
        "first", "from 3 s into the part from 10 to 20 s, and in 1 other parts"
    )  # fmt: skip
    (said,) = together(parts_of((), (finding(),))).findings
    assert said.where == "10 to 20 s"
    (said,) = together(parts_of((finding(),), (finding(),))).findings
    assert said.where == "whole log"
    alone = parts_of((one, two))
    assert together(alone) is alone[0].report


def test_the_worst_of_a_fault_is_said():
    error = finding(severity=Severity.ERROR, what="worse", where="from 1 s")
    (said,) = together(parts_of((finding(),), (error,))).findings
    assert (said.what, said.severity) == ("worse", Severity.ERROR)
    assert said.where == "from 1 s into the part from 10 to 20 s, and in 1 other parts"


@pytest.mark.parametrize("fault", [Fault.FLAT, Fault.WEAK_EXCITATION, Fault.COARSE_POSITION])
def test_what_is_of_the_whole_counts_where_all_parts_say_so(fault):
    dull = finding(fault)
    assert together(parts_of((dull,), ())).findings == ()
    assert [f.fault for f in together(parts_of((dull,), (dull,))).findings] == [fault]


def test_a_log_may_be_fitted_where_no_finding_is_an_error():
    warning, error = finding(), finding(severity=Severity.ERROR)
    assert CheckReport((warning,)).ok
    assert not CheckReport((warning, error)).ok
    assert check_log(two_axes()).ok
