"""Laws of the checks: each speaks on one side of its threshold only, of the right place and size.

The drive is a closed form, so that a signal may be late by any time and wrong by any factor.
"""

import numpy as np
import pytest
from check_drive import axis_of, drive, findings

from twin.checks import Fault, Severity, check_log
from twin.logs import ROTARY_UNITS

ALL = (
    "setpoint_position", "setpoint_velocity", "setpoint_acceleration", "position", "velocity",
    "current", "force",
)  # fmt: skip


@pytest.mark.parametrize("rate", [500.0, 1000.0, 3000.0])
def test_a_sound_drive_gives_no_finding(rate):
    assert check_log(drive(rate, signals=ALL)).findings == ()


# Units and signs

PAIRS = {
    # signal: what it is compared with, lowest and highest ratio that is left alone
    "position": ("setpoint_position", 0.5, 2.0),
    "velocity": ("the rate of position", 0.95, 1.05),
    "setpoint_velocity": ("the rate of setpoint_position", 0.95, 1.05),
    "setpoint_acceleration": ("the second rate of setpoint_position", 0.9, 1.1),
    "force": ("force constant x current", 0.98, 1.02),
}


@pytest.mark.parametrize("name", PAIRS)
def test_a_ratio_is_told_outside_its_bounds_and_only_there(name):
    other, low, high = PAIRS[name]
    signals = tuple(n for n in ALL if n != "velocity") if name == "position" else ALL
    for ratio in (low + 0.006, high - 0.006):
        log = drive(signals=signals, factor={name: ratio})
        assert not findings(log, Fault.UNIT), ratio
    for ratio, looks in (
        (low - 0.006, "a scale or the sample rate is wrong"),
        (high + 0.006, "a scale or the sample rate is wrong"),
        (1e3, "it looks like a unit a thousand times smaller, as mm for m"),
        (1e-3, "it looks like a unit a thousand times smaller, as mm for m"),
        (1e6, "it looks like a unit a million times smaller, as um for m"),
        (180.0 / np.pi, "it looks like degrees for radians"),
        (750.0, "it looks like a unit a thousand times smaller, as mm for m"),
        (1.0 / 1340.0, "it looks like a unit a thousand times smaller, as mm for m"),
        (1360.0, "a scale or the sample rate is wrong"),
        (7.0, "a scale or the sample rate is wrong"),
    ):
        log = drive(signals=signals, factor={name: ratio})
        found = [f for f in findings(log, Fault.UNIT) if f.what.startswith(f"{name} is ")]
        assert len(found) == 1, ratio
        assert found[0].severity is Severity.ERROR
        stated, said = found[0].what.removeprefix(f"{name} is ").split(f" times {other}: ")
        assert float(stated) == pytest.approx(ratio, rel=4e-3)
        assert said == looks


@pytest.mark.parametrize("name", PAIRS)
def test_a_reversed_signal_is_a_sign_and_not_a_unit(name):
    log = drive(signals=ALL, factor={name: -1.0})
    found = [f for f in findings(log, Fault.SIGN) if f.what.startswith(f"{name} is -")]
    assert [f.what.rpartition(": ")[2] for f in found] == ["one of them is reversed"]
    assert not findings(log, Fault.UNIT)


def test_signals_that_are_not_alike_are_not_compared():
    """A correlation below 0.9 tells nothing of units: here 0.87 and 0.93."""
    rng = np.random.default_rng(3)
    for noise, told in ((0.57, False), (0.40, True)):

        def add(columns, noise=noise):
            column = columns["force"]
            column += noise * np.std(column) * rng.standard_normal(len(column))

        log = drive(signals=ALL, factor={"force": 5.0}, change=add)
        assert bool([f for f in findings(log, Fault.UNIT) if "force constant" in f.what]) == told


def test_signals_of_an_axis_that_stands_are_not_compared():
    """Neither by size nor by sign; it is called idle instead."""

    def stand(columns):
        noise = np.random.default_rng(5).standard_normal(len(columns["position"]))
        columns["position"][:] = 1e-6 * noise

    for factor in (-1.0, 5.0):
        signals = ("position", "force", "current")
        log = drive(signals=signals, factor={"force": factor}, change=stand)
        (found,) = check_log(log).findings
        assert found.fault is Fault.WEAK_EXCITATION
        assert "hardly moves" in found.what


@pytest.mark.parametrize("name", ["position", "setpoint_position"])
def test_a_travel_of_more_than_ten_metres_is_told_on_a_linear_axis(name):
    travel = np.ptp(drive(signals=ALL).axes["x"].columns[name])
    for metres, units, told in ((9.9, None, 0), (10.1, None, 1), (10.1, ROTARY_UNITS, 0)):
        options = {"kind": units} if units else {}
        log = drive(signals=ALL, factor={name: metres / travel}, **options)
        found = [f for f in findings(log, Fault.UNIT) if "travels" in f.what]
        assert len(found) == told
        if told:
            assert f"{name} travels 10.1 m, more than 10 m; in mm it would be 0.0101 m" in (
                found[0].what
            )


@pytest.mark.parametrize("units", ["kg", "kg m^2"])
def test_a_force_against_the_acceleration_states_the_mass_it_looks_like(units):
    kind = {"kind": ROTARY_UNITS} if units == "kg m^2" else {}
    assert not findings(drive(**kind), Fault.SIGN)
    (found,) = findings(drive(factor={"force": -1.0}, **kind), Fault.SIGN)
    name = "inertia" if kind else "mass"
    stated, said = found.what.partition(f"the {name} were ")[2].split(" ", 1)
    assert float(stated) == pytest.approx(-2.5, rel=0.02)
    assert said == units


# Channels that are late


def lag(log):
    found = findings(log, Fault.LAG)
    assert len(found) <= 1, [str(f) for f in found]
    if not found:
        return None
    words = found[0].what.split()
    milliseconds = float(words[words.index("ms") - 1]) * (1.0 if "behind" in words else -1.0)
    samples = float(found[0].what.partition("(")[2].split()[0])
    return found[0], milliseconds, samples


@pytest.mark.parametrize(("rate", "allowed"), [(1000.0, 3.0), (500.0, 4.0), (2000.0, 3.0)])
def test_a_late_force_is_an_error_beyond_three_milliseconds_and_two_samples(rate, allowed):
    for sign in (1.0, -1.0):
        below = lag(drive(rate, late={"force": sign * (allowed - 0.3) / 1e3}))
        assert below is not None
        assert below[0].severity is Severity.WARNING  # a drive may have that dead time
        stated = sign * (allowed + 0.3)
        found, milliseconds, samples = lag(drive(rate, late={"force": stated / 1e3}))
        assert milliseconds == pytest.approx(stated, abs=0.1)
        assert samples == pytest.approx(abs(milliseconds) * rate / 1e3, rel=0.01)
        assert found.severity is (Severity.ERROR if sign > 0.0 else Severity.WARNING)
        late = "force" if sign > 0.0 else "position"
        assert found.remedy.startswith(f"give {late} delay_samples = {round(samples)} in")
        assert found.remedy.endswith("dead time") == (sign < 0.0)


@pytest.mark.parametrize(
    ("late", "severity"), [(-9.6, Severity.WARNING), (-10.4, Severity.ERROR), (9.6, Severity.ERROR)]
)
def test_a_drive_may_be_slow_by_ten_milliseconds(late, severity):
    found, milliseconds, _ = lag(drive(late={"force": late / 1e3}))
    assert milliseconds == pytest.approx(late, abs=0.1)
    assert found.severity is severity


@pytest.mark.parametrize(
    ("name", "other", "quiet", "told"),
    [
        ("velocity", "the rate of position", (-2.7, 2.7), (-3.3, 3.3, 20.0)),
        ("setpoint_position", "its setpoint", (2.7, -29.5), (3.3, -30.5, 50.0)),
    ],
)
def test_another_signal_that_is_late_is_told(name, other, quiet, told):
    """A position that follows its setpoint late is a slow loop, up to 30 ms."""
    for late in quiet:
        assert lag(drive(signals=("position", "force", name), late={name: late / 1e3})) is None
    for late in told:
        log = drive(signals=("position", "force", name), late={name: late / 1e3})
        found, milliseconds, samples = lag(log)
        subject = "velocity" if name == "velocity" else "position"
        behind = late if name == "velocity" else -late
        assert milliseconds == pytest.approx(behind, abs=0.15)
        assert found.what.startswith(f"{subject} is ")
        assert found.what.endswith(f" {other}")
        readings = "position" if name == "velocity" else "position and force"
        remedied = name if late > 0.0 else readings
        assert found.remedy == f"give {remedied} delay_samples = {round(samples)} in the import map"
        assert found.severity is Severity.WARNING


# Saturation


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize(("rate", "fewest"), [(500.0, 5), (1000.0, 5), (2000.0, 10), (3000.0, 15)])
def test_a_command_at_its_extreme_is_told_from_five_milliseconds_and_samples_on(rate, fewest, sign):
    for length in (fewest - 1, fewest):

        def hold(columns, length=length):
            columns["force"][700 : 700 + length] = 31.0 * sign
            columns["force"][900 : 900 + length] = 31.0 * sign
            columns["force"][1100 : 1100 + fewest - 2] = 31.0 * sign

        found = findings(drive(rate, change=hold), Fault.SATURATION)
        assert len(found) == (length == fewest)
    assert f"at its extreme of {31 * sign:g} N for {2 * fewest / rate:.3g} s in all" in (
        found[0].what
    )
    assert found[0].where == f"from {700 / rate:.6g} s"
    assert found[0].severity is Severity.WARNING


def test_a_drive_that_is_off_is_not_at_its_limit():
    def off(columns, floor):
        columns["force"][:] = np.maximum(columns["force"], 0.0) + floor

    assert not findings(drive(change=lambda c: off(c, 0.0)), Fault.SATURATION)
    assert len(findings(drive(change=lambda c: off(c, 0.25)), Fault.SATURATION)) == 1


@pytest.mark.parametrize(("milliseconds", "told"), [(12, False), (60, True)])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_level_under_noise_is_told_where_it_is_as_long_as_the_low_pass(milliseconds, told, sign):
    rng = np.random.default_rng(9)

    def level(columns):
        force = columns["force"]
        force[1500 : 1500 + milliseconds] = sign * 30.0
        force += 1e-3 * rng.standard_normal(len(force))

    found = findings(drive(change=level), Fault.SATURATION)
    assert len(found) == told
    if told:
        assert f"extreme of {30 * sign:g}" in found[0].what
        start = float(found[0].where.removeprefix("from ").removesuffix(" s"))
        length = float(found[0].what.partition(" N for ")[2].split()[0])
        assert start == pytest.approx(1.51, abs=0.003)  # half a low-pass is lost at each end
        assert length == pytest.approx(0.04, abs=0.006)


@pytest.mark.parametrize(("noises", "told"), [(3.0, True), (25.0, False)])
def test_a_level_may_droop_by_ten_times_its_noise(noises, told):
    """What droops farther is no limit, but a motion with a slow top."""
    rng = np.random.default_rng(9)
    smoother = axis_of(drive()).smoother
    droop = noises * smoother.held_noise(1e-3)

    def level(columns):
        force = columns["force"]
        force[1500:1580] = 30.0 - droop * np.linspace(0.0, 1.0, 80)
        force += 1e-3 * rng.standard_normal(len(force))

    assert len(findings(drive(change=level), Fault.SATURATION)) == told


# What every check needs


@pytest.mark.parametrize(("count", "short"), [(999, True), (1000, False), (1001, False)])
def test_a_second_is_long_enough(count, short):
    found = findings(drive(seconds=count / 1000.0), Fault.TOO_SHORT)
    assert len(found) == short
    if short:
        assert "lasts 0.999 s, a fit needs 1 s" in found[0].what
