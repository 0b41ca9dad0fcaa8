"""What signals say of each other: wrong units and signs, lags, swapped axes, what is lacking."""

from dataclasses import replace

import numpy as np
import pytest
from check_drive import command, drive, findings, motion, stated

from twin.checks import Fault, Severity, check_log
from twin.logs import FIELDS, LINEAR_UNITS, ROTARY_UNITS, AxisLog, Log

RATE = 1000.0


@pytest.mark.parametrize("rate", [500.0, 3000.0])
def test_a_sound_drive_gives_no_finding(rate):
    found = check_log(drive(rate, signals=FIELDS))
    assert (found.findings, str(found)) == ((), "suitable for identification")


UNKNOWN = "a scale or the sample rate is wrong"
THOUSAND = "it looks like a unit a thousand times smaller, as mm for m"
LOOKS = (
    (1360.0, UNKNOWN), (7.0, UNKNOWN), (1e-3, THOUSAND), (750.0, THOUSAND),
    (1.0 / 1340.0, THOUSAND), (1e6, "it looks like a unit a million times smaller, as um for m"),
    (180.0 / np.pi, "it looks like degrees for radians"),
)  # fmt: skip
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
    signals = tuple(n for n in FIELDS if n != "velocity") if name == "position" else FIELDS
    for ratio in (low + 0.006, high - 0.006):
        log = drive(signals=signals, factor={name: ratio})
        assert not findings(log, Fault.UNIT), ratio
    for ratio, looks in (
        (low - 0.006, UNKNOWN), (high + 0.006, UNKNOWN), (-1.0, "one of them is reversed"),
        *(LOOKS if name == "force" else ()),
    ):  # fmt: skip
        fault = Fault.SIGN if ratio < 0.0 else Fault.UNIT
        log = drive(signals=signals, factor={name: ratio})
        (found,) = [f for f in findings(log, fault) if f.what.startswith(f"{name} is ")]
        assert found.severity is Severity.ERROR
        stated, said = found.what.removeprefix(f"{name} is ").split(f" times {other}: ")
        assert (float(stated), said) == (pytest.approx(ratio, rel=4e-3), looks)
        assert ratio > 0.0 or not findings(log, Fault.UNIT)


@pytest.mark.parametrize(("noise", "told"), [(0.57, False), (0.40, True)])
def test_signals_that_are_not_alike_are_not_compared(noise, told):
    """A correlation below 0.9 tells nothing of units: here 0.87 and 0.93."""

    def add(columns):
        column = columns["force"]
        column += noise * np.std(column) * np.random.default_rng(3).standard_normal(len(column))

    log = drive(signals=FIELDS, factor={"force": 5.0}, change=add)
    assert bool([f for f in findings(log, Fault.UNIT) if "force constant" in f.what]) == told


@pytest.mark.parametrize("factor", [-1.0, 5.0])
def test_signals_of_an_axis_that_stands_are_not_compared(factor):
    """Neither by size nor by sign; it is called idle instead."""

    def stand(columns):
        noise = np.random.default_rng(5).standard_normal(len(columns["position"]))
        columns["position"][:] = 1e-6 * noise

    signals = ("position", "force", "current")
    (found,) = check_log(drive(signals=signals, factor={"force": factor}, change=stand)).findings
    assert found.fault is Fault.WEAK_EXCITATION
    assert "hardly moves" in found.what


@pytest.mark.parametrize(
    ("units", "words"),
    [(LINEAR_UNITS, "the mass were -2.5 kg"), (ROTARY_UNITS, "the inertia were -2.5 kg m^2")],
)
def test_a_force_against_the_acceleration_states_the_mass_it_looks_like(units, words):
    assert not findings(drive(kind=units), Fault.SIGN)
    for late in (0.0, 0.0096, -0.0096, 0.04):  # s, by which the force is moved back first
        log = drive(factor={"force": -1.0}, kind=units, late={"force": late})
        (found,) = findings(log, Fault.SIGN)
        assert found.what.endswith(words)


FORCE, POSITION = ("position", "force"), ("position", "force", "setpoint_position")
SPEED = ("position", "force", "velocity")
WARNING, ERROR = Severity.WARNING, Severity.ERROR


@pytest.mark.parametrize(
    ("rate", "name", "late", "severity", "remedied"),
    [
        # beyond three milliseconds and two samples; what a drive may be slow by, up to ten
        (1000.0, "force", 2.7, WARNING, "force"), (1000.0, "force", 3.3, ERROR, "force"),
        (500.0, "force", 3.7, WARNING, "force"), (500.0, "force", 4.3, ERROR, "force"),
        (1000.0, "force", 9.6, ERROR, "force"), (1000.0, "force", -3.3, WARNING, "position"),
        (1000.0, "force", -9.6, WARNING, "position"), (1000.0, "force", -10.4, ERROR, "position"),
        (1000.0, "velocity", 2.7, None, ""), (1000.0, "velocity", -2.7, None, ""),
        (1000.0, "velocity", 3.3, WARNING, "velocity"),
        (1000.0, "velocity", -3.3, WARNING, "position"),
        # a position that follows its setpoint late is a slow loop, up to 30 ms
        (1000.0, "setpoint_position", 2.7, None, ""),
        (1000.0, "setpoint_position", -29.5, None, ""),
        (1000.0, "setpoint_position", 3.3, WARNING, "setpoint_position"),
        (1000.0, "setpoint_position", -30.5, WARNING, "position and force"),
    ],
)  # fmt: skip
def test_a_channel_that_is_late_is_told_with_the_remedy(rate, name, late, severity, remedied):
    signals = {"force": FORCE, "velocity": SPEED}.get(name, POSITION)
    found = findings(drive(rate, signals=signals, late={name: late / 1e3}), Fault.LAG)
    assert len(found) == (severity is not None)
    if severity is None:
        return
    what = found[0].what
    subject, _, side = what.partition(" ms (")
    samples = float(side.split()[0])
    milliseconds = float(subject.split()[-1]) * (1.0 if " behind " in side else -1.0)
    behind = -late if name == "setpoint_position" else late
    assert milliseconds == pytest.approx(behind, abs=0.15)
    assert samples == pytest.approx(abs(milliseconds) * rate / 1e3, rel=0.01)
    words = {"force": "the motion that it causes", "velocity": "the rate of position"}
    assert what.startswith(
        "position is" if name.startswith("set") else ("the force is", f"{name} is")
    )
    assert words.get(name, "its setpoint") in what
    assert found[0].remedy.startswith(f"give {remedied} delay_samples = {round(samples)} in")
    assert ("dead time" in found[0].remedy) == (name == "force" and severity is WARNING)
    assert found[0].severity is severity


@pytest.mark.parametrize("late", [4e-3, 12e-3])
def test_how_late_a_force_is_is_told_by_motion_that_goes_on(late):
    """Moves of 0.15 s that stop gently, and a force that breaks them loose 20 ms before."""
    rng, velocity, dry = np.random.default_rng(1), [], []
    for size in rng.uniform(0.3, 1.0, 24) * rng.choice([-1.0, 1.0], 24):
        move = np.sin(np.pi * np.arange(150) / 150) ** 2
        velocity += [np.zeros(100), 0.3 * size * move]
        dry.append(np.sign(size) * (np.arange(250) >= 80))
    v = np.concatenate(velocity)
    x = (np.cumsum(v) - 0.5 * v) / RATE + 1e-8 * rng.standard_normal(len(v))
    asked = 2.5 * np.gradient(v) * RATE + 0.5 * np.concatenate(dry) + 2.0 * v
    n = np.arange(len(v))
    force = np.interp(n + 0.5 - late * RATE, n, asked)  # held over the sample
    (found,) = findings(Log(RATE, {"x": AxisLog({"position": x, "force": force})}), Fault.LAG)
    assert stated(found, "the force is ") == pytest.approx(late * 1e3, abs=0.03)


@pytest.mark.parametrize(("what", "beside"), [("force", 4), ("position", 0)])
def test_channels_that_are_swapped_are_told_by_what_was(what, beside):
    """And no pair of other axes with them."""

    def found(*names, kind=LINEAR_UNITS):
        t = 10.0 + np.arange(4000) / RATE
        s = 1.7 * t + 3.0
        v, a = 1.7 * motion(s, 1), 1.7**2 * motion(s, 2)
        other = {"position": motion(s), "setpoint_position": motion(s)}
        other["force"] = 4.0 * a + 9.0 * np.tanh(v / 1e-3) + 2.0 * v
        one = {"position": motion(t), "force": command(t + 0.5 / RATE)}
        one["setpoint_position"] = motion(t)
        for name in names:
            one[name], other[name] = other[name], one[name]
        sound = {}
        for k in range(beside):
            rate = 1.13 + 0.17 * k
            s = rate * t + k
            sound[f"s{k}"] = AxisLog({"position": motion(s), "force": rate**2 * motion(s, 2)})
        axes = {**sound, "a": AxisLog(one), "b": AxisLog(other, kind)}
        return findings(Log(RATE, axes), Fault.SWAPPED)

    assert found() == []
    (told,) = found(what)
    assert (told.severity, told.axis) == (Severity.ERROR, "a")
    assert told.what.startswith("the motion of axis b leaves ")
    assert told.what.endswith(f"{what}s of axes a and b are swapped")
    crossing, own = (float(word) for word in told.what.split() if word[0].isdigit())
    assert crossing < 10.0 < 50.0 < own
    assert told.remedy == f"exchange the columns of the {what}s of both axes in the import map"
    assert found(what, kind=ROTARY_UNITS) == []  # newtons are no newton metres


@pytest.mark.parametrize("name", ["position", "force"])
def test_a_signal_that_never_changes_is_told_with_its_value(name):
    def of(last=0.0, setpoint=None):
        def change(columns):
            columns[name][:] = 0.375
            columns[name][-1] += last
            if setpoint is not None:
                columns["setpoint_position"][:] = setpoint

        return drive(signals=("setpoint_position", "position", "velocity", "current", "force"),
                     change=change)  # fmt: skip

    (found,) = check_log(of()).findings
    constant = name == "force"  # which is an experiment, of which only ratios are told
    assert (found.fault, found.severity) == (Fault.FLAT, WARNING if constant else ERROR)
    assert found.what.startswith(f"{name} is 0.375 {LINEAR_UNITS[name]} throughout")
    assert not findings(of(last=1e-9), Fault.FLAT)
    (found,) = check_log(of(setpoint=0.1)).findings
    assert found.fault is (Fault.FLAT if constant else Fault.WEAK_EXCITATION)


def test_a_log_in_which_nothing_moves_is_refused_and_one_axis_at_rest_is_not():
    def still(columns):
        columns["position"][:] = 0.375

    def dead(columns):
        columns["force"][:] = 0.0

    moving, at_rest = (drive(change=c).axes["x"] for c in (None, still))
    (found,) = check_log(Log(1000.0, {"a": at_rest, "b": at_rest})).findings[:1]
    assert found.severity is ERROR
    report = check_log(Log(1000.0, {"a": at_rest, "b": moving}))
    assert [(f.axis, f.severity) for f in report.findings] == [("a", WARNING)]
    (found,) = check_log(drive(change=dead)).findings
    assert (found.fault, found.severity) == (Fault.FLAT, ERROR)


@pytest.mark.parametrize(
    ("name", "places"), [("position", (0,)), ("setpoint_velocity", (17, 400, 3999))]
)
def test_numbers_that_are_none_are_counted_and_placed(name, places):
    def spoil(columns):
        columns[name][list(places)] = np.nan

    log = drive(signals=("position", "force", "setpoint_velocity"), change=spoil)
    (found,) = check_log(log).findings
    assert found.fault is Fault.NOT_FINITE
    assert found.what == (f"{name} is not a finite number in {len(places)} of 4000 samples")
    assert str(found.where) == f"from {places[0] / 1000.0:g} s"


@pytest.mark.parametrize(
    ("signals", "complete"),
    [(("position", "force"), True), (("position", "current"), True), (("force",), False),
     (("position",), False), (("position", "velocity"), False)],
)  # fmt: skip
def test_a_log_needs_a_position_and_a_command(signals, complete):
    assert len(findings(drive(signals=signals), Fault.INCOMPLETE)) == (not complete)
    one = check_log(drive(seconds=0.001, signals=signals)).findings
    assert "lasts 0.001 s" in next(f.what for f in one if f.fault is Fault.TOO_SHORT)


def test_an_axis_lacking_something_is_told_that_alone_and_the_other_axis_is_checked():
    good = drive().axes["x"]
    late = drive(late={"force": 0.02}).axes["x"]
    bad = replace(good, columns={"position": good.position})
    report = check_log(Log(1000.0, {"a": bad, "b": late, "c": good}))
    assert [(f.axis, f.fault) for f in report.findings] == [
        ("a", Fault.INCOMPLETE), ("b", Fault.LAG)
    ]  # fmt: skip
    assert str(report.findings[0]).startswith("axis a, whole log: there is no force")
    assert not report.ok
