"""Stiffness and damping of bristles from an open-loop sine of force, all else being known."""

from __future__ import annotations

from dataclasses import replace

import pytest
from built_fits import axis_of, fitted

import identify
from identify.analysis.dynamic_friction import DYNAMIC, dynamic_part_free
from twin.errors import InputError
from twin.experiments.kinds import OpenLoopSine
from twin.experiments.named import simulate
from twin.model.machine import MachineModel
from twin.model.parameters import free_parameters
from twin.simulator import FineSimulator

LUGRE = fitted("lugre", Fc=0.285, Fs=0.335, v0=0.01, sigma2=0.018, sigma0=260.0, sigma1=0.6)


def test_only_the_dynamic_part_of_a_friction_is_free() -> None:
    axis = dynamic_part_free(axis_of(fitted("constant_force")).with_effect(LUGRE))
    assert [c.label for c in free_parameters(axis)] == [f"lugre.{name}" for name in DYNAMIC]
    with pytest.raises(InputError, match="coulomb_viscous: no friction with a stiffness"):
        dynamic_part_free(axis_of())


def test_both_are_found_from_a_sine_below_the_break_away() -> None:
    axis = axis_of(mass=15.0).with_effect(LUGRE)
    quiet = replace(axis, hardware=replace(axis.hardware, current_noise=0.0))
    machine = MachineModel("slide", {"x": quiet}, 1000.0)
    sine = OpenLoopSine("x", 6.0, amplitude=0.21, period=3.0)
    log = simulate(machine, sine, seed=2, simulator=FineSimulator)
    wrong = machine.with_axis("x", quiet.with_effect(replace(LUGRE, values={
        **LUGRE.values, "sigma0": 90.0, "sigma1": 3.0})))  # fmt: skip
    found = identify.dynamic_friction(wrong, {"sine": log})
    values = found.axis["lugre"].values
    assert values["sigma0"] == pytest.approx(260.0, rel=2e-3)
    assert values["sigma1"] == pytest.approx(0.6, rel=2e-2)
    assert values["Fc"] == 0.285
    assert found.error < 1e-7
