"""A copy of a log is known whatever was done to it; two runs of one program are no copies.

One machine has noise that shows, the other hides it below the step of its encoder, so that its runs
have most readings in common.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.signal import decimate

from twin.checks.copies import copies
from twin.checks.same_samples import step_of
from twin.logs import AxisLog, Log
from twin.logs.log import Array, thinned

RATE = 1000.0  # Hz
MASS, FRICTION = 2.0, 3.0  # kg, N
MACHINES = {"fine": (1e-9, 2e-7), "coarse": (1e-5, 1e-7)}  # step and noise of the encoder, m


def program(t: Array) -> Array:
    return 0.05 * (np.sin(4.4 * t) - 0.5 * np.sin(11.9 * t))


@cache
def run(machine: str, seed: int, seconds: float = 6.0, push: float = 0.0) -> Log:
    """The program run with feedback; push: N of noise, in the command as logged alone."""
    step, noise = MACHINES[machine]
    rng, t = np.random.default_rng(seed), np.arange(round(RATE * seconds)) / RATE
    wanted, speed, noises = program(t), np.gradient(program(t), t), rng.normal(0.0, noise, len(t))
    x, v, last, seen, readings, commands = 0.0, float(speed[0]), 0.0, 0.0, [], []
    for goal, rate, error in zip(wanted.tolist(), speed.tolist(), noises.tolist(), strict=True):
        reading = step * round((x + error) / step)
        seen += 0.3 * ((reading - last) * RATE - seen)
        last = reading
        u = 8000.0 * (goal - reading) + 120.0 * (rate - seen)
        readings.append(reading)
        commands.append(u)
        for _ in range(4):
            v += (u - FRICTION * np.tanh(v / 1e-3) - 5.0 * v) / MASS / (4.0 * RATE)
            x += v / (4.0 * RATE)
    return log_of(np.array(readings), np.array(commands) + push * rng.normal(size=len(t)))


def log_of(position: Array, force: Array, rate: float = RATE) -> Log:
    return Log(rate, {"x": AxisLog({"position": position, "force": force})})


def changed(
    position: Callable[[Array], Array], force: Callable[[Array], Array], every: float = 1.0
):
    def change(log: Log) -> Log:
        signals = log.axes["x"]
        return log_of(position(signals.position), force(signals.force), log.sample_rate / every)

    return change


def same(values: Array) -> Array:
    return values


def means(values: Array) -> Array:
    return values[: len(values) // 4 * 4].reshape(-1, 4).mean(axis=1)


def to(step: float) -> Callable[[Array], Array]:
    return lambda values: step * np.round(values / step)


def in_turn(*ways: Callable[[Log], Log]) -> Callable[[Log], Log]:
    def all_of_them(log: Log) -> Log:
        for way in ways:
            log = way(log)
        return log

    return all_of_them


MIRROR = changed(np.negative, np.negative)
AVERAGE = changed(means, means, 4)
ROUND = changed(to(3e-5), to(0.5))
WAYS: dict[str, tuple[Callable[[Log], Log], str]] = {
    "identical": (same, ""),
    "displaced": (changed(lambda x: x + 0.0137, same), "displaced by 0.0137 m"),
    "mirrored": (MIRROR, "position and force mirrored"),
    "force mirrored": (changed(same, np.negative), "force mirrored"),
    "thinned": (changed(lambda x: x[1::3], lambda u: u[1::3], 3), "thinned to 333.333 Hz"),
    "averaged": (AVERAGE, "thinned to 250 Hz"),
    "as a slower recorder": (lambda log: thinned(log, 5), "thinned to 200 Hz"),
    "decimated": (changed(lambda x: decimate(x, 4), lambda u: decimate(u, 4), 4), "250 Hz"),
    "position rounded": (changed(to(2e-4), same), "position rounded"),
    "force rounded": (changed(same, to(5.0)), "force rounded"),
    "rounded": (ROUND, "position and force rounded"),
    "later": (lambda log: log.part(371, len(log)), "its 0.371 to 6 s"),
    "a part": (lambda log: log.part(2000, 4000), "its 2 to 4 s"),
    "averaged, rounded, later, displaced, mirrored": (
        in_turn(lambda log: log.part(123, 6000), AVERAGE, changed(lambda x: 0.01 - x, same), ROUND),
        "thinned to 250 Hz",
    ),
    "thinned, rounded, a part": (
        in_turn(changed(lambda x: x[::2], lambda u: u[::2], 2), ROUND, lambda g: g.part(700, 2400)),
        "its 1.4 to 4.8 s",
    ),
}  # fmt: skip


@pytest.mark.parametrize("machine", MACHINES)
@pytest.mark.parametrize("way", WAYS)
def test_a_copy_is_known_and_another_run_is_none(machine: str, way: str) -> None:
    change, told = WAYS[way]
    (copy,) = copies({"run": run(machine, 1), "other": change(run(machine, 1))})
    assert (copy.copy, copy.original, copy.is_complete) == ("other", "run", True)
    assert told in str(copy)
    assert copies({"run": run(machine, 2), "other": change(run(machine, 1))}) == ()


@pytest.mark.parametrize("machine", MACHINES)
def test_the_original_may_be_given_later(machine: str) -> None:
    for change, _ in (WAYS["averaged"], WAYS["position rounded"], WAYS["a part"]):
        (copy,) = copies({"copy": change(run(machine, 1)), "run": run(machine, 1)})
        assert (copy.copy, copy.original) == ("copy", "run")


def test_a_little_noise_makes_no_recording_of_its_own() -> None:
    rng = np.random.default_rng(8)
    louder = changed(lambda x: x + rng.normal(0.0, 2e-8, len(x)), same)
    assert copies({"run": run("fine", 1), "other": louder(run("fine", 1))})
    assert not copies({"run": run("fine", 1), "other": louder(run("fine", 2))})


def test_logs_that_share_a_part_are_told_by_it() -> None:
    log = run("fine", 1)
    (copy,) = copies({"a": log.part(0, 4000), "b": log.part(3000, 6000)})
    assert str(copy) == "in 33 % a copy of a (its 3 to 4 s)"
    assert copies({"a": log.part(0, 3000), "b": log.part(3000, 6000)}) == ()


# Recordings of their own


def pair_of(first: Log, second: Log) -> dict[str, Log]:
    return {"a": first, "b": second}


def white(seed: int, n: int = 6000) -> Array:
    return np.random.default_rng(seed).normal(size=n)


T = np.arange(6000) / RATE
OTHERS = {
    "six runs of one program": {f"{seed}": run("fine", seed) for seed in range(6)},
    "six runs whose noise is hidden": {f"{seed}": run("coarse", seed) for seed in range(6)},
    "runs of another length": pair_of(run("coarse", 1), run("coarse", 2, 3.0)),
    # of a machine without chance, by an encoder without noise
    "readings alike, commands with noise": pair_of(
        run("coarse", 1), changed(same, lambda u: u + 0.01 * white(3))(run("coarse", 1))
    ),
    "one command without feedback": pair_of(
        log_of(program(T) + 1e-6 * white(1), np.sin(5.0 * T)),
        log_of(program(T) + 1e-6 * white(2), np.sin(5.0 * T)),
    ),
    "one command, coarse readings": pair_of(
        *(log_of(to(1e-5)(program(T) + 1e-7 * white(seed)), np.sin(5.0 * T)) for seed in (1, 2))
    ),
    "one imposed motion": pair_of(
        *(log_of(program(T), np.sin(5.0 * T) + 0.01 * white(seed)) for seed in (1, 2))
    ),
    "a motion that repeats": pair_of(
        *(log_of(np.sin(20.0 * np.pi * T) + 1e-5 * white(i), 0.1 * white(i + 2)) for i in (1, 2))
    ),
    "at rest without noise": pair_of(log_of(0.0 * T, 0.0 * T), log_of(0.0 * T, 0.0 * T)),
    "at rest with a command": pair_of(*(log_of(0.0 * T, np.sin(5.0 * T)) for _ in range(2))),
    "at rest with noise": pair_of(*(log_of(1e-7 * white(i), 0.1 * white(i + 2)) for i in (1, 2))),
    "axes of other names": {
        "a": Log(RATE, {"x": run("fine", 1).axes["x"]}),
        "b": Log(RATE, {"y": run("fine", 1).axes["x"]}),
    },
    "no number": pair_of(
        *(changed(lambda x: np.append(x[1:], np.nan), same)(run("fine", 1)) for _ in range(2))
    ),
    "a few samples": pair_of(run("fine", 1).part(0, 50), run("fine", 1).part(0, 50)),
    "no samples": pair_of(run("fine", 1).part(0, 0), run("fine", 1)),
}


@pytest.mark.parametrize("kind", OTHERS)
def test_recordings_of_their_own(kind: str) -> None:
    assert copies(OTHERS[kind]) == ()


def test_what_holds_of_one_axis_does_not_hold_of_both() -> None:
    both = replace(
        run("fine", 1), axes={"x": run("fine", 1).axes["x"], "y": run("fine", 2).axes["x"]}
    )
    other = replace(both, axes={**both.axes, "y": run("fine", 3).axes["x"]})
    assert copies({"a": both, "b": both})
    assert not copies({"a": both, "b": other})


@pytest.mark.parametrize(("moves", "step"), [(2, 0.0), (30, 0.1)])
def test_a_few_changes_tell_no_step(moves: int, step: float) -> None:
    """By chance they are multiples of the least."""
    places = np.repeat(0.1 * np.arange(moves + 1), 10)
    assert step_of(places) == pytest.approx(step)
