"""Machines of one axis or three, linear or rotary, each with one effect that its model lacks."""

from __future__ import annotations

import re
import tomllib
from typing import Any

from twin.effects import load_catalogue
from twin.model.file import parse_model
from twin.model.machine import MachineModel

CATALOGUE = load_catalogue()
ROUNDING = 1e-13  # of the travel, over a log
LINEAR_AXIS = """
[axes.{name}]
mass = {mass}
travel = [-0.2, 0.2]
force_limit = 400.0
encoder_noise = 2e-8
current_noise = 2e-4
velocity = 0.4
acceleration = 4.0
jerk = 200.0
[axes.{name}.effects.coulomb_viscous]
Fc = {dry}
sigma2 = 2.0
"""
ROTARY_AXIS = """
[axes.c]
inertia = 0.02
travel = [-2.0, 2.0]
force_limit = 5.0
encoder_noise = 1e-6
current_noise = 2e-4
velocity = 3.0
acceleration = 40.0
jerk = 2000.0
[axes.c.effects.coulomb_viscous]
Fc = 0.05
sigma2 = 0.01
"""
RATE = "sample_rate = 1000.0\n"
THREE = [("x", 3.0, 1.0), ("y", 5.0, 2.0), ("z", 2.0, 0.5)]
SLIDE = LINEAR_AXIS.format(name="x", mass=3.0, dry=1.0)
MACHINES = {
    "linear": (SLIDE, "x", "[axes.x.effects.cogging]\np = 0.04\na1 = 0.5\n"),
    "rotary": (ROTARY_AXIS, "c", "[axes.c.effects.cogging]\np = 0.7\na1 = 0.02\n"),
    "three": (
        "".join(LINEAR_AXIS.format(name=n, mass=m, dry=f) for n, m, f in THREE),
        "y",
        "[axes.y.effects.quadratic_drag]\nc = 20.0\n",
    ),
}


def machine(toml: str) -> MachineModel:
    return parse_model(tomllib.loads(RATE + toml), CATALOGUE, None, "machine.toml")


def stated_units(value: Any) -> set[str]:
    """Every unit that a JSON object states."""
    if isinstance(value, dict):
        own = {v for k, v in value.items() if k.endswith("unit") and isinstance(v, str)}
        return own.union(*map(stated_units, value.values()))
    return set().union(*map(stated_units, value)) if isinstance(value, list) else set()


# A number, a label or a comment in metres, newtons or kilograms.
OF_A_SLIDE = re.compile(
    r"(?:[\d)] ?|\(|# |\b1/)[mµn]?"
    r"(?:N(?! ?[·m]|\w)|kg(?! ?[·m]|\w)|m(?:/s(?:\^?[23²³])?)?(?![\w·/]))"
)
OF_A_HINGE = re.compile(r"\b[mµn]?rad\b|N·m|N m\b|kg·m|kg m\^")
