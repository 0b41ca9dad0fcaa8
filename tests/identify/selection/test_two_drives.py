"""Two drives of one beam: each is told that the other pulls on it, by the stiffness of the skew."""

from __future__ import annotations

import numpy as np
import pytest
from planted_logs import RATE, RUBS, SLIDE, Ride, few, having, logged

import identify
from twin.errors import InputError
from twin.logs import AxisLog, Log
from twin.model.machine import AxisModel, MachineModel

STIFFNESS = 4e5  # N/m
MASSES = {"y1": 20.0, "y2": 17.0}  # kg


def log_of_beam(seed: int) -> Log:
    """Both ends follow one ride, but for a skew of some hundredths of a millimetre."""
    rng = np.random.default_rng(seed)
    speed = Ride(seed, seconds=8.0, reach=0.2, fast=0.5).speed()
    t = np.arange(len(speed)) / RATE
    skew = sum(2e-5 * np.sin(2.0 * np.pi * f * t + rng.uniform(0.0, 6.0)) for f in (0.7, 1.9, 3.1))
    level = np.cumsum(speed) / RATE
    places = {"y1": level + 0.5 * skew, "y2": level - 0.5 * skew}
    axes = {}
    for name, x in places.items():
        other = places["y2" if name == "y1" else "y1"]
        v = np.gradient(x, 1.0 / RATE)
        friction = (0.31 * np.sign(v) + 0.53 * v) * (np.abs(v) > 0.0)
        force = MASSES[name] * np.gradient(v, 1.0 / RATE) + friction + STIFFNESS * (x - other)
        read = x + 1e-8 * rng.standard_normal(len(x))
        noisy = force + 0.02 * rng.standard_normal(len(x))
        axes[name] = AxisLog({"position": read, "force": noisy})
    return Log(RATE, axes)


@pytest.mark.short(3)
def test_the_stiffness_against_skew_is_named_on_both_drives() -> None:
    axes = {name: AxisModel(mass, effects=(RUBS,)) for name, mass in MASSES.items()}
    known = few("skew_stiffness", "axis_coupling", "spring", "presliding_hysteresis")
    one, held, test = (log_of_beam(seed) for seed in (1, 2, 3))
    found = identify.diagnose(MachineModel("beam", axes, RATE), one, held, test, catalogue=known)
    for axis in found.axes.values():
        assert axis.named == ("skew_stiffness",)
        law = axis.findings[0].parameters
        assert law["stiffness"] == pytest.approx(STIFFNESS, rel=0.02)


def test_a_force_between_two_axes_is_none_of_one() -> None:
    """Beside nothing the distance to the other axis is the position: it tied with a spring."""
    sprung = having(SLIDE, "spring", k1=60.0)
    one, held, test = (logged(sprung, Ride(seed)) for seed in (1, 2, 3))
    model = MachineModel("m", {"x": SLIDE}, RATE)
    known = few("skew_stiffness", "axis_coupling", "spring")
    found = identify.diagnose(model, one, held, test, catalogue=known).axes["x"]
    assert found.answers == (("spring",),)
    with pytest.raises(InputError, match="other axis of two, and this machine has 1"):
        identify.add("skew_stiffness", model, one, held)
