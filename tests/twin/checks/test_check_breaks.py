"""Laws of what breaks a position off its course: called by name, placed and sized."""

import numpy as np
import pytest
from check_drive import axis_of, command, drive, motion, stated

from twin.checks import Fault, Severity, breaks
from twin.checks.report import Finding
from twin.logs import AxisLog, Log

RATE = 1000.0
BOTH = ("position", "force", "setpoint_position")


def broken(change, signals=("position", "force"), seconds=4.0, **more) -> list[Finding]:
    return list(
        breaks.check_breaks(axis_of(drive(RATE, seconds, signals=signals, change=change, **more)))
    )


def farther(places, size, *names):
    """From each of these samples on, some signals are farther by a size."""

    def change(columns):
        for name in names:
            for at in places:
                columns[name][at:] += size

    return change


def speed(at: int) -> float:
    return float(motion(10.0 + at / RATE, 1))


FAST = 1000 + int(np.argmax(np.abs(motion(11.0 + np.arange(2000) / RATE, 1))))


# --- the course of a position --------------------------------------------------------------


@pytest.mark.parametrize("lost", [3, 12])
def test_missing_samples_are_counted_by_the_way_that_the_motion_went_on(lost):
    t = 10.0 + np.arange(4000) / RATE
    kept = np.r_[0:1500, 1500 + lost : 4000]
    columns = {"position": motion(t)[kept], "force": command(t)[kept]}
    found = list(breaks.check_breaks(axis_of(Log(RATE, {"x": AxisLog(columns)}))))
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
    (found,) = breaks.check_breaks(axis_of(Log(RATE, {"x": AxisLog(columns)})))
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

    assert Fault.UNEVEN not in [f.fault for f in broken(change, seconds=30.0)]
