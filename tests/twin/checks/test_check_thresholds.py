"""Laws of the checks: each speaks on one side of its threshold only, of the right place and size.

The drive is a closed form, so that anything may be put into it in any size.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import pytest
from check_drive import axis_of, command, drive, findings, motion

from twin.checks import Fault, Severity
from twin.logs import LINEAR_UNITS, ROTARY_UNITS, AxisLog, Log
from twin.logs.log import Array

BOTH = ("position", "force", "setpoint_position")
T = np.arange(6000) / 1000.0
WHITE = np.random.default_rng(3).standard_normal(6000)


@dataclass(frozen=True)
class Case:
    """Of logs made with a size: those for which nothing is said, and one for which it is.

    words: what is said, with the number behind it, if any, that it must state, near to that part.
    where: the place in words, or its first and last second.
    """

    make: Callable[..., Log]
    quiet: Sequence[object]
    told: object
    fault: Fault
    words: str
    number: float | None = None
    where: str | tuple[float, ...] = ""
    severity: Severity = Severity.WARNING
    near: float = 0.02


def added(name: str, where: object, shape: object = 1.0, **drive_options: object):
    """A drive to whose signal a shape of some size is added."""

    def make(size: float) -> Log:
        def change(columns: dict[str, Array]) -> None:
            columns[name][where] += size * shape

        return drive(change=change, **drive_options)

    return make


def disturbed(offset: float, shape: Array):
    """A command with an offset, and a disturbance of so many tenths of itself.

    Without Coulomb friction, whose steps at every reversal are bends of the command too.
    """
    force = drive(coulomb=0.0).axes["x"].force
    tenth = 0.1 * np.quantile(np.abs(force - np.median(force)), 0.99)

    def make(part: float) -> Log:
        def change(columns: dict[str, Array]) -> None:
            columns["force"] += offset
            columns["force"][2000 : 2000 + len(shape)] += part * tenth * shape

        return drive(change=change, coulomb=0.0)

    return make


def at_speed(velocity: Array) -> Log:
    """A drive without noise that moves at this velocity."""
    position = np.concatenate([[0.0], np.cumsum(velocity)[:-1]]) / 1e3
    force = 2.0 * np.gradient(velocity) * 1e3 + 3.0 * np.tanh(velocity / 1e-3)
    return Log(1000.0, {"x": AxisLog({"position": position, "force": force})})


def back_for(sign: float):
    """Speeds from 0.1 to 0.2 m/s; the way back fills a share of the time."""

    def make(share: float) -> Log:
        velocity = 0.15 + 0.05 * np.sin(5.0 * T)
        velocity[2000 : 2000 + round(share * 6000)] *= -1.0
        return at_speed(sign * velocity)

    return make


def slow(mass: float) -> Log:
    """Slow moves of a mass with friction."""
    t = np.arange(40_000) / 1000.0
    position = 0.05 * np.sin(0.5 * t) + 0.02 * np.sin(0.35 * t + 1.0)
    velocity = 0.025 * np.cos(0.5 * t) + 0.007 * np.cos(0.35 * t + 1.0)
    force = 1.5 * np.tanh(velocity / 1e-4) + 40.0 * velocity + mass * np.gradient(velocity, t)
    noise = 1e-8 * np.random.default_rng(1).standard_normal(len(t))
    return Log(1e3, {"x": AxisLog({"position": position + noise, "force": force})})


def spread(part: float) -> Log:
    """Triangles of speed around 0.2 m/s, both ways: nine tenths less one are 0.8 of the spread."""
    wave = 2.0 * np.abs((T * 0.7) % 1.0 - 0.5) - 0.5  # even from -1/2 to 1/2
    speed = 0.2 * (1.0 + part / 0.8 * wave)
    return at_speed(np.where((T // 1.5) % 2 == 0, speed, -speed))


def moving(share: float) -> Log:
    """Noise of a micrometre all the time, motion of centimetres for a share of it."""
    t = 10.0 + T
    return noisy(motion(np.clip(t, 12.0, 12.0 + 6.0 * share)))


def noisy(position: Array) -> Log:
    """A position beside noise of a micrometre."""
    columns = {"position": position + 1e-6 * WHITE, "force": command(T)}
    return Log(1000.0, {"x": AxisLog(columns)})


def held_at(rate: float, sign: float, fewest: int):
    def make(length: int) -> Log:
        def change(columns: dict[str, Array]) -> None:
            for at, count in ((700, length), (900, length), (1100, fewest - 2)):
                columns["force"][at : at + count] = 31.0 * sign

        return drive(rate, change=change)

    return make


def level(samples: int, droop: float = 0.0) -> Log:
    """A command that is held for some ms, but for noise and a droop of so much noise."""
    down = droop * axis_of(drive()).smoother.held_noise(1e-3)

    def change(columns: dict[str, Array]) -> None:
        ramp = np.linspace(0.0, down, samples)
        columns["force"][1500 : 1500 + samples] = 30.0 - ramp
        columns["force"] += 1e-3 * WHITE[:4000]

    return drive(change=change)


def constant(noise: float, size: float):
    """A force of one value, with noise, beside a part of what a sine may make of it unsaid."""
    n = noise * axis_of(drive()).smoother.held_noise(1.0)
    most = np.sqrt(2.0 * (min(3.0 * n, 0.01 * abs(size)) ** 2 - n**2))

    def make(part: float) -> Log:
        def change(columns: dict[str, Array]) -> None:
            wave = part * most * np.sin(3.0 * T[:4000])
            columns["force"][:] = size + noise * WHITE[:4000] + wave

        return drive(change=change)

    return make


def off_below(floor: float) -> Log:
    def change(columns: dict[str, Array]) -> None:
        columns["force"][:] = np.maximum(columns["force"], 0.0) + floor

    return drive(change=change)


def travelling(name: str):
    travel = np.ptp(drive(signals=BOTH).axes["x"].columns[name])

    def make(given: tuple[float, object]) -> Log:
        metres, units = given
        return drive(signals=BOTH, factor={name: metres / travel}, kind=units)

    return make


def drifted(ppm: float) -> Log:
    t = 10.0 + np.arange(60_000) / 1e3
    columns = {"position": motion(t), "force": command(t - ppm * 1e-6 * (t - t.mean()) + 0.5e-3)}
    return Log(1e3, {"x": AxisLog(columns)})


SOUND = axis_of(drive())
BEND = float(np.abs(np.diff(SOUND.log.position, 2)).max())
COARSE = (
    0.3 * np.sqrt(np.mean(SOUND.acceleration**2)) / SOUND.smoother.acceleration_noise(1.0)
)  # m rms, of which the acceleration has noise of three tenths
SLOWEST = SOUND.smoother.velocity_noise(1e-6)
SINGLE = axis_of(drive(coulomb=0.0)).force_size
NOISY = float(np.std(SOUND.log.force)) / SOUND.smoother.held_noise(1.0)  # N, from which it is all
BURST = np.random.default_rng(2).standard_normal(30)
FRO = 0.25 * (-1.0) ** np.arange(20)  # its second difference is four times as large
ERROR = Severity.ERROR
PUSH = "force and motion contradict each other by up to "

CASES = {
    "a push": Case(added("force", slice(2000, 2030)), [0.4], 60.0, Fault.OUTLIERS, PUSH, 60.0,
                   (2.0, 2.03)),
    **{f"a push with {offset:g} N": Case(disturbed(offset, np.ones(30)), [0.85], 1.2,
                                         Fault.OUTLIERS, PUSH)
       for offset in (0.0, 100.0)},
    **{f"to and fro with {offset:g} N": Case(disturbed(offset, FRO), [0.85], 1.2, Fault.OUTLIERS,
                                             "the force jumps to and fro")
       for offset in (0.0, 100.0)},
    "a burst of noise": Case(added("force", slice(2000, 2030), BURST), [0.05], 20.0, Fault.OUTLIERS,
                             "the force jumps to and fro", None, (2.0, 2.03)),
    "one bend of the force": Case(added("force", slice(2000, None)), [40.0], 0.0, Fault.OUTLIERS,
                                  ""),
    "single samples": Case(added("force", [1200, 2600], coulomb=0.0), [0.25 * SINGLE],
                           0.35 * SINGLE, Fault.OUTLIERS,
                           "single samples of the force are off by up to ", 0.35 * SINGLE,
                           "1.2 s and 1 more times", near=0.04),
    "noise": Case(added("force", slice(None), WHITE[:4000]), [0.024 * NOISY], 0.036 * NOISY,
                  Fault.NOISE, "the force has noise of ", 0.036 * NOISY, "whole log"),
    "steps": Case(added("position", slice(2500, None), signals=BOTH),
                  [0.9 * (SOUND.possible_jump - BEND)], 8.0 * (SOUND.possible_jump + BEND),
                  Fault.STEP, "the position steps by ", 8.0 * (SOUND.possible_jump + BEND),
                  "2.499 to 2.5 s", ERROR),
    "coarse": Case(added("position", slice(None), WHITE[:4000]), [0.8 * COARSE], 1.25 * COARSE,
                   Fault.COARSE_POSITION, "the position is good to ", 1.25 * COARSE, "whole log",
                   near=0.05),
    "idle": Case(moving, [0.16], 0.06, Fault.WEAK_EXCITATION, "the noise of its position (", 1e-6),
    # nine tenths of normal noise stay below 1.28 of its rms, which adds to the speed
    "a speed in its noise": Case(lambda times: noisy(times * SLOWEST * T), [4.2], 3.3,
                                 Fault.WEAK_EXCITATION, "the axis hardly moves", severity=ERROR),
    "forwards": Case(back_for(1.0), [0.03], 0.015, Fault.WEAK_EXCITATION,
                     "the axis moves only forwards (", 98.5),
    "backwards": Case(back_for(-1.0), [0.03], 0.015, Fault.WEAK_EXCITATION,
                      "the axis moves only backwards (", 98.5),
    "slow": Case(slow, [1.6], 0.8, Fault.WEAK_EXCITATION, "the mass cannot be identified"),
    **{f"{size:g} N with noise of {noise:g} N": Case(
        constant(noise, size), [1.06], 0.94, Fault.WEAK_EXCITATION, "force is ", size)
       for noise, size in ((1e-3, 5.0), (0.05, 2.0), (0.05, -2.0))},
    "one speed": Case(spread, [0.06], 0.04, Fault.WEAK_EXCITATION,
                      "there is one speed only, 0.2 m/s, "),
    "too short": Case(lambda s: drive(seconds=s), [0.5, 0.501], 0.499, Fault.TOO_SHORT,
                      "the log lasts 0.499 s, a fit needs 0.5 s", severity=ERROR),
    **{f"at {31 * sign:g} N, {rate:g} Hz": Case(
        held_at(rate, sign, fewest), [fewest - 1], fewest, Fault.SATURATION,
        f"at its extreme of {31 * sign:g} N for {2 * fewest / rate:.3g} s in all", None,
        f"from {700 / rate:.6g} s")
       for rate, fewest, sign in ((500.0, 5, 1.0), (3000.0, 15, -1.0))},
    # half a low-pass is lost at each end
    "a level": Case(level, [12], 60, Fault.SATURATION, "extreme of 30 N for ", 0.04, (1.51,)),
    "a slow top": Case(lambda d: level(80, d), [25.0], 3.0, Fault.SATURATION, "extreme of 30"),
    "a drive that is off": Case(off_below, [0.0], 0.25, Fault.SATURATION, "extreme of 0.25 N"),
    **{f"travel of {name}": Case(
        travelling(name), [(9.9, LINEAR_UNITS), (10.1, ROTARY_UNITS)], (10.1, LINEAR_UNITS),
        Fault.UNIT, f"{name} travels 10.1 m, more than 10 m; in mm it would be 0.0101 m")
       for name in ("position", "setpoint_position")},
    **{f"clocks {way}": Case(
        drifted, [0.4 * ppm], ppm, Fault.DRIFT, f"ms a second {way} against the position (", 90.0)
       for way, ppm in (("later", 90.0), ("earlier", -90.0))},
    **{f"{side} by 0.6 ms": Case(
        lambda late: drive(4000.0, 20.0, late={"force": late}), [0.3 * late], late, Fault.LAG,
        "the force is ", 0.6, "whole log")
       for side, late in (("behind", 0.6e-3), ("ahead", -0.6e-3))},
}  # fmt: skip


@pytest.mark.parametrize("name", CASES)
def test_a_fault_is_told_from_its_threshold_on_with_place_and_size(name):
    case = CASES[name]

    def found(size: object):
        return [f for f in findings(case.make(size), case.fault) if case.words in f.what]

    for size in case.quiet:
        assert not found(size)
    if not case.words:
        return
    (told,) = found(case.told)
    assert told.severity is case.severity
    if case.number is not None:
        stated = float(re.split(r"[^\d.e+-]", told.what.partition(case.words)[2])[0])
        assert stated == pytest.approx(case.number, rel=case.near)
    if isinstance(case.where, str):
        assert case.where in str(told.where)
    else:
        places = [float(word) for word in str(told.where).split() if word[0].isdigit()]
        assert places[: len(case.where)] == pytest.approx(case.where, abs=0.012)


@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_a_jump_is_possible_up_to_what_acceleration_and_noise_explain(noise):
    """Four times the usual acceleration over a sample, and ten times the noise of a bend."""
    axis = axis_of(added("position", slice(None), WHITE[:4000])(noise))
    usual = np.quantile(np.abs(axis.acceleration), 0.99) / 1e6
    bend = 6**0.5 * max(noise, axis.position_step / 12**0.5)
    assert axis.possible_jump == pytest.approx(4.0 * usual + 10.0 * bend, rel=0.06)
    assert not axis.jumps.any()


@pytest.mark.parametrize(("apart", "where"), [(40, "2 to 2.1 s"), (70, "2 to 2.03 s and 1 more")])
def test_bursts_that_are_more_than_fifty_milliseconds_apart_are_two(apart, where):
    twice = np.concatenate([BURST, np.zeros(apart), BURST])
    log = added("force", slice(2000, 2060 + apart), twice)(20.0)
    (found,) = [f for f in findings(log, Fault.OUTLIERS) if "to and fro" in f.what]
    first, last = (float(word) for word in re.findall(r"[\d.]+", str(found.where))[:2])
    wanted = [float(word) for word in re.findall(r"[\d.]+", where)[:2]]
    assert [first, last] == pytest.approx(wanted, abs=0.006)
    assert ("1 more times" in str(found.where)) == ("1 more" in where)
