"""The frequency response against two masses whose response is known exactly, over many draws."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.figures import Figure, Target
from benchmarks.second_simulator.servo_axes import MOTIONS, drawn
from benchmarks.second_simulator.two_masses import TwoMasses, multisine, wandering
from identify.frequency.plant import plant_of
from identify.frequency.response import response
from identify.workflow import frequency_response
from twin.errors import InputError
from twin.signals import Array

TITLE = "Frequency response of two masses on a spring, 1 kHz, 16 s, over 100 draws"
DRAWS, SAMPLES = 100, 16_000
MACHINES, SEED = 30, 48  # drives with friction, cogging, encoders and loops of their own


def measure() -> list[Figure]:
    """Errors of what is read off, and how often the 90 % band holds the truth."""
    out = []
    for name, setpoint in (("multisine", multisine), ("without a period", wandering)):
        found = np.array([_draw(setpoint, seed) for seed in range(DRAWS)])
        held, resonance, damping, delay = found.T
        out += [
            Figure(f"{name}: bands that hold the truth", float(held.mean()), "1",
                   Target(0.85, 0.95)),
            Figure(f"{name}: resonance, largest error", float(resonance.max()), "1",
                   Target(high=0.01)),
            Figure(f"{name}: its damping, largest error", float(damping.max()), "1",
                   Target(high=0.1)),
            Figure(f"{name}: delay, largest error", float(delay.max()), "samples",
                   Target(high=0.02)),
        ]  # fmt: skip
    return [*out, *_of_drives()]


def _of_drives() -> list[Figure]:
    """Resonances told of drives that have none, and of drives that have one."""
    false = sum(bool(_resonance_errors(seed, resonant=False)) for seed in range(MACHINES))
    off = [x for seed in range(MACHINES) for x in _resonance_errors(seed, resonant=True)]
    wrong = sum(x > 0.01 for x in off)
    return [
        Figure("drives without a resonance: of these one is told", false / MACHINES, "1",
               Target(high=0.0), f"{false} of {MACHINES}"),
        Figure("drives with one: told, but off by more than 1 %", wrong / max(len(off), 1), "1",
               Target(high=0.0), f"{wrong} of {len(off)} told, over {MACHINES} drives"),
    ]  # fmt: skip


def _resonance_errors(seed: int, *, resonant: bool) -> list[float]:
    """By how much each resonance that is told of a drive is off its own; 1 where it has none."""
    rng = np.random.default_rng([SEED, seed, int(resonant)])
    axis = drawn(rng, resonant, list(MOTIONS)[seed % len(MOTIONS)])
    logs = {f"log {i}": axis.log(rng) for i in range(int(rng.integers(1, 4)))}
    try:
        plant = frequency_response(logs).axes["q"].measured.plant
    except InputError:  # the logs tell no response
        return []
    modes = plant.modes if plant else ()
    own = np.inf if axis.resonance is None else axis.resonance[0]
    return [min(abs(mode.frequency.value / own - 1.0), 1.0) for mode in modes]


def _draw(
    setpoint: Callable[[int, np.random.Generator], Array], seed: int
) -> tuple[float, float, float, float]:
    rng = np.random.default_rng(seed)
    machine = TwoMasses(delay=rng.uniform(0.0, 3e-3), frequency=rng.uniform(40.0, 90.0))
    found = response([machine.run(setpoint(SAMPLES, rng), rng)])
    told = found.tells
    held = np.abs(found.plant - machine.response(found.frequency)) < found.band
    plant = plant_of(found)
    frequency, ratio = machine.resonance
    mode = max(plant.modes, key=lambda m: m.gain.value)
    return (
        float(held[told].mean()),
        abs(mode.frequency.value / frequency - 1.0),
        abs(mode.damping.value / ratio - 1.0),
        abs(plant.delay.value - machine.delay) / machine.period,
    )
