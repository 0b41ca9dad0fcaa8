"""Every unit and word of a linear axis has its rotary counterpart."""

from __future__ import annotations

import re

import numpy as np
import pytest
from axis_kinds import CATALOGUE

from twin.model.units import LINEAR, ROTARY, units_of


def test_what_repeats_may_repeat_once_a_turn() -> None:
    for effect in CATALOGUE.values():
        for p in effect.parameters:
            assert not p.period or p.upper > 2.0 * np.pi, f"{effect.name}.{p.name}"


UNITS = {
    "m": "rad", "m/s": "rad/s", "m/s^2": "rad/s^2", "m/s^3": "rad/s^3", "m rms": "rad rms",
    "N": "N m", "N^2": "(N m)^2", "kg": "kg m^2", "N s/m": "N m s/rad", "N/m": "N m/rad",
    "N/m^2": "N m/rad^2", "N/m^3": "N m/rad^3", "N s^2/m^2": "N m s^2/rad^2", "N/A": "N m/A",
    "N/s": "N m/s", "N/(m s)": "N m/(rad s)", "1/m": "1/rad", "1/N": "1/(N m)",
    "s^2/m": "s^2/rad", "A rms": "A rms", "1": "1", "s": "s", "Hz": "Hz", "1/J": "1/J", "": "",
}  # fmt: skip


@pytest.mark.parametrize("linear", UNITS)
def test_a_linear_unit_has_a_rotary_counterpart(linear: str) -> None:
    assert (LINEAR(linear), ROTARY(linear)) == (linear, UNITS[linear])


def test_no_unit_of_the_catalogue_keeps_a_length_a_force_or_a_mass() -> None:
    for effect in CATALOGUE.values():
        for p in effect.parameters:
            told = ROTARY(p.unit)
            rest = told.replace("N m", "").replace("kg m^2", "")
            assert not set(re.findall(r"[A-Za-z]+", rest)) & {"m", "N", "kg"}, (effect.name, told)


def test_words_have_a_rotary_counterpart_and_names_have_none() -> None:
    said = "Force error, free-running position error; forces at two Positions of constant_force"
    turned = "Torque error, free-running angle error; torques at two Angles of constant_force"
    assert (LINEAR.words(said), ROTARY.words(said)) == (said, turned)
    assert [units_of(u).kind for u in ("rad", "rad/s", "N m", "m", "s", None)] == (
        ["rotary"] * 3 + ["linear"] * 3
    )
