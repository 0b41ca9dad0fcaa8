"""The frequency response against two masses whose response is known exactly, over many draws."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from benchmarks.figures import Figure, Target
from benchmarks.second_simulator.two_masses import TwoMasses, multisine, wandering
from identify.frequency.plant import plant_of
from identify.frequency.response import response
from twin.signals import Array

TITLE = "Frequency response of two masses on a spring, 1 kHz, 16 s, over 100 draws"
DRAWS, SAMPLES = 100, 16_000


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
    return out


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
