"""Faults of the user: one line that says what was given, what is allowed and what to do."""

from dataclasses import replace

import numpy as np
import pytest

from twin.errors import InputError
from twin.experiments.trajectory import (
    Limits,
    concatenate,
    constant_speed_passes,
    micro_reversals,
    open_loop_sine,
    point_to_point,
    random_tracking,
    velocity_staircase,
)

LIMITS = (
    Limits((-0.15, 0.15), velocity=0.25, acceleration=5.0, jerk=500.0),
    Limits((-0.10, 0.12), velocity=0.20, acceleration=3.0, jerk=200.0),
)
ZERO = (0.0, 0.0)
OUT = point_to_point(LIMITS, [ZERO, (0.01, 0.0)]).part(0, 10_000)
BACK = point_to_point(LIMITS, [(0.01, 0.0), ZERO])
NAN, INF = float("nan"), float("inf")

FAULTS = {
    "outside": (lambda: point_to_point(LIMITS, [ZERO, (0.16, 0.0)]), r"0\.16 m of axis x.*-0\.15 "),
    "y outside": (lambda: point_to_point(LIMITS, [ZERO, (0.1, -0.101)]), r"-0\.101 m of axis y"),
    "millimetres": (lambda: point_to_point(LIMITS, [ZERO, (50.0, 0.0)]), "not in mm"),
    "nan waypoint": (lambda: point_to_point(LIMITS, [ZERO, (NAN, 0.0)]), "not finite"),
    "words": (lambda: point_to_point(LIMITS, [["a", "b"], ["c", "d"]]), "not an array of numbers"),
    "one waypoint": (lambda: point_to_point(LIMITS, [ZERO]), "at least two rows"),
    "three axes": (lambda: point_to_point(LIMITS, [[0, 0, 0], [0, 0, 1]]), "do not fit 2 axes"),
    "no axes": (lambda: point_to_point([], [ZERO, ZERO]), "no axis given"),
    "no motion": (lambda: point_to_point(LIMITS, [ZERO, ZERO], dwell=0.0), "duration 0 s"),
    "negative dwell": (lambda: point_to_point(LIMITS, [ZERO, ZERO], dwell=-1), "dwell -1 s"),
    "rate": (lambda: point_to_point(LIMITS, [ZERO, (0.1, 0)], sample_rate=0), "sample rate 0 Hz"),
    "pass outside": (lambda: constant_speed_passes(LIMITS, 0, at=(0.01, 0)), "axis x is outside"),
    "no such axis": (lambda: constant_speed_passes(LIMITS, 2), "no axis 2"),
    "negative speed": (lambda: constant_speed_passes(LIMITS, 0, speed=-0.1), "speed -0.1 m/s"),
    "speed limit": (lambda: constant_speed_passes(LIMITS, 0, speed=0.26), "limit of 0.25 m/s"),
    "nan speed": (lambda: constant_speed_passes(LIMITS, 0, speed=NAN), "speed nan m/s"),
    "no run-up": (lambda: constant_speed_passes(LIMITS, 0, span=0.01, speed=0.2), r"0\.1351 m/s"),
    "no repeats": (lambda: constant_speed_passes(LIMITS, 0, repeats=0), "repeats 0"),
    "half repeats": (
        lambda: constant_speed_passes(LIMITS, 0, repeats=1.5),  # type: ignore[arg-type]
        "whole number",
    ),
    "endless": (lambda: constant_speed_passes(LIMITS, 0, repeats=10**12), "change the duration"),
    "negative dwell 2": (lambda: constant_speed_passes(LIMITS, 0, dwell=-0.1), "dwell -0.1 s"),
    "place": (lambda: constant_speed_passes(LIMITS, 0, at=(0.0,)), "do not fit 2 axes"),
    "no speeds": (lambda: velocity_staircase(LIMITS, 0, []), "no speeds"),
    "zero speed": (lambda: velocity_staircase(LIMITS, 0, [0.0]), "speed 0 m/s"),
    "too fast": (lambda: velocity_staircase(LIMITS, 0, [0.01, 0.2]), "speed 0.2 m/s of axis x"),
    "plateau": (lambda: velocity_staircase(LIMITS, 0, [0.01], longest_plateau=0), "plateau 0 s"),
    "amplitude": (lambda: micro_reversals(LIMITS, 0, amplitude=0.0), "amplitude 0 m"),
    "edge": (lambda: micro_reversals(LIMITS, 0, at=(0.15, 0.0)), r"0\.150004 m of axis x"),
    "sine axis": (lambda: open_loop_sine(-1), "no axis -1"),
    "sine duration": (lambda: open_loop_sine(0, duration=0.0), "duration 0 s"),
    "sine period": (lambda: open_loop_sine(0, period=1e-4), "at least 0.0002 s"),
    "sine offset": (lambda: open_loop_sine(0, offset=INF), "offset inf N"),
    "sine amplitude": (lambda: open_loop_sine(0, amplitude=-0.2), "amplitude -0.2 N"),
    "zero duration": (lambda: random_tracking(LIMITS, 0.0, np.random.default_rng(0)), "duration 0"),
    "no end": (lambda: random_tracking(LIMITS, INF, np.random.default_rng(0)), "duration inf"),
    "slowest": (
        lambda: random_tracking(LIMITS, 1.0, np.random.default_rng(0), slowest=0.22),
        "axis y, 0.2 m/s",
    ),
    "travel": (lambda: Limits((0.1, -0.1), 1, 1, 1), "lowest position first"),
    "velocity limit": (lambda: Limits((-1, 1), 0.0, 1, 1), "velocity limit 0 m/s"),
    "jerk limit": (lambda: Limits((-1, 1), 1, 1, NAN), r"jerk limit nan m/s\^3"),
    "limits apart": (
        lambda: point_to_point([Limits((0, 1), 1, 1e-30, 1e60)], [[0.0], [1.0]]),
        "differ too much in size",
    ),
    "nothing": (lambda: concatenate(), "at least one"),
    "jump": (lambda: concatenate(OUT, OUT), "jumps from 0.01 to 0 m between setpoints 1 and 2"),
    "two rates": (lambda: concatenate(OUT, replace(OUT, sample_rate=5e3)), "10000 and 5000 Hz"),
    "one axis less": (
        lambda: concatenate(OUT, open_loop_sine(0, at=(0.01,))),
        "2 and 1 axes",
    ),
    "moving": (
        lambda: concatenate(replace(OUT, velocity=OUT.velocity + 1e-3), BACK),
        "moves at 0.001 m/s",
    ),
    "shapes": (lambda: replace(OUT, force=OUT.force[:-1]), "do not belong together"),
}  # fmt: skip


@pytest.mark.parametrize("name", FAULTS)
def test_a_fault_of_the_user_is_one_line_that_says_what_to_do(name: str) -> None:
    call, words = FAULTS[name]
    with pytest.raises(InputError, match=words) as caught:
        call()
    assert "\n" not in str(caught.value)
    assert "np.float64" not in str(caught.value)
