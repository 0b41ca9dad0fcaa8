"""Recordings of arms that are not what the model needs: `python -m benchmarks recordings`.

Of each simulated arm (``arms``), whatever is changed of it besides, the recording is made another
in one of ten ways; it is right to tell that way by name, and nothing of a recording as it is.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from dataclasses import replace
from time import perf_counter

import numpy as np

from benchmarks.arms import CATALOGUE, machine
from benchmarks.figures import Figure, Target, report
from benchmarks.second_simulator.arms import log_of
from identify.analysis.first_model import first_model
from identify.analysis.recording import SIGNALS, TORQUES, Exchanged, Scaled, misassigned
from twin.logs import Log

TITLE = "Recordings of arms that are not what the model needs"
SEED, MACHINES = 80, 8
GEAR = 64.0
AS_IT_IS, WEIGHTLESS = "as it is", "weight taken out"


def ways(joints: Sequence[str], joint: str) -> dict[str, tuple[Scaled | Exchanged | None, str]]:
    """By name, what is done to a recording, and words of which it is right to tell one."""
    every, other = tuple(joints), next(j for j in reversed(joints) if j != joint)
    return {
        WEIGHTLESS: (None, "weight of the links taken out"),
        "torque reversed": (Scaled((joint,), -1.0, TORQUES), f"axis {joint}: its torque has the"),
        "position reversed": (Scaled((joint,), -1.0), f"axis {joint}: with the other sign"),
        "both reversed": (Scaled((joint,), -1.0, SIGNALS), f"axis {joint}: with the other sign"),
        "other side of the gear": (Scaled((joint,), 1.0 / GEAR, TORQUES), f"axis {joint}: its"),
        "all before their gears": (Scaled(every, 1.0 / GEAR, TORQUES), "before a gear"),
        "amperes": (Scaled(every, 0.08, TORQUES), "or in another unit"),
        "gear and sign": (Scaled((joint,), -1.0 / GEAR, TORQUES), f"axis {joint}: its torque is"),
        "degrees": (Scaled(every, 180.0 / np.pi), "with positions in deg"),
        "exchanged": (Exchanged(joint, other), "exchanged"),
    }


def judged(seed: int, numbers: Sequence[int]) -> tuple[list[tuple[str, bool, float]], int]:
    """Of each way whether it was told, and in how many s; how often nothing was there to tell."""
    told, alarms = list[tuple[str, bool, float]](), 0
    for number in numbers:
        own = machine(seed, number)
        arm = replace(own.arm, slides=(False,) * len(own.arm.mass))
        for weightless in (False, True):
            changed = replace(own.changed, weightless=weightless)
            log = log_of(arm, changed, 1000 * number)
            model = first_model({"log": log}, "arm", CATALOGUE, ("arm.xml", arm.text))
            if not weightless and (found := misassigned(model, log)):
                print(f"{own.case}, as it is: {found.said}", flush=True)
                alarms += 1
            loudest = max(arm.joints, key=lambda j: float(np.std(log.axes[j].columns["force"])))
            for name, (lie, words) in ways(arm.joints, loudest).items():
                if weightless == (name == WEIGHTLESS):
                    lied: Log = lie(log) if lie else log
                    begun = perf_counter()
                    said = misassigned(model, lied)
                    took, right = perf_counter() - begun, said is not None and words in said.said
                    told.append((name, right, took))
                    if not right:
                        print(f"{own.case}, {name}: {said and said.said}", flush=True)
    return told, alarms


def measure() -> list[Figure]:
    """Rates on a seed that decided nothing."""
    return figures(*judged(SEED, range(MACHINES)))


def figures(told: Sequence[tuple[str, bool, float]], alarms: int) -> list[Figure]:
    """How often each is told, and how long it takes."""
    missed = [name for name, right, _ in told if not right]
    return [
        Figure(
            "recordings that are another, told by name", 1.0 - len(missed) / len(told), "1",
            Target(low=0.9), f"of {len(told)}; not told: {', '.join(missed) or 'none'}",
        ),
        Figure("recordings as they are, of which something is told", alarms, "1", Target(high=0.0)),
        Figure("the longest", max(took for *_, took in told), "s", Target(high=5.0)),
    ]  # fmt: skip


def main(arguments: Sequence[str]) -> int:
    """Judge some arms of a seed."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks recordings", description=__doc__)
    parser.add_argument("--machines", type=int, default=MACHINES)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)
    return report(figures(*judged(given.seed, range(given.machines))))
