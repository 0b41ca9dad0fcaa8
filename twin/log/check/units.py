"""Wrong units and signs: signals of the same quantity must agree in size and sign."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from twin.log.check.axis import Axis
from twin.log.check.report import Fault, Finding, Severity
from twin.signals import Array

LONGEST_TRAVEL = 10.0  # m
_RELATED = 0.9  # correlation of two signals that state the same
_SLIPS: Mapping[float, str] = {
    1e3: "a unit a thousand times smaller, as mm for m",
    1e6: "a unit a million times smaller, as um for m",
    180.0 / np.pi: "degrees for radians",
}
UNKNOWN_SLIP = "a scale or the sample rate is wrong"


@dataclass(frozen=True)
class _Pair:
    """A signal and the one that states the same; low, high: their allowed ratio.

    follows: whether the one states where the other should be, and not where it is.
    """

    name: str
    signal: Array
    other_name: str
    other: Array
    low: float
    high: float
    follows: bool = False
    zero: bool = False  # whether 0 is the same on both sides, as of speeds and not of positions


def check(axis: Axis) -> Iterator[Finding]:
    """Unit slips and reversed signs."""
    yield from _travel(axis)
    for pair in _pairs(axis):
        yield from _compare(axis, pair)
    yield from _reversed_force(axis)


def _travel(axis: Axis) -> Iterator[Finding]:
    for name in ("position", "setpoint_position"):
        travel = np.ptp(axis.log.columns[name]) if name in axis.log.columns else 0.0
        if travel > LONGEST_TRAVEL and not axis.log.kind.rotary:
            yield Finding(
                Severity.ERROR,
                Fault.UNIT,
                axis.name,
                f"{name} travels {travel:.4g} m, more than {LONGEST_TRAVEL:g} m; "
                f"in mm it would be {travel / 1e3:.4g} m",
                "whole log",
                "correct its unit in the import map",
            )


def _pairs(axis: Axis) -> Iterator[_Pair]:
    columns, smoother = axis.log.columns, axis.smoother
    setpoint, velocity = columns.get("setpoint_position"), columns.get("setpoint_velocity")
    acceleration = columns.get("setpoint_acceleration")
    if setpoint is not None:
        # a controller may follow badly; one that is off by more than 2 does not follow at all
        yield _Pair("position", smoother.position(columns["position"]), "setpoint_position",
                    smoother.position(setpoint), 0.5, 2.0, follows=True)  # fmt: skip
    if "velocity" in columns:
        yield _Pair("velocity", smoother.rate(columns["velocity"]),
                    "the rate of position", axis.velocity, 0.95, 1.05, zero=True)  # fmt: skip
    if setpoint is not None and velocity is not None:
        yield _Pair("setpoint_velocity", smoother.rate(velocity),
                    "the rate of setpoint_position", smoother.velocity(setpoint),
                    0.95, 1.05, zero=True)  # fmt: skip
    if setpoint is not None and acceleration is not None:
        yield _Pair("setpoint_acceleration", smoother.rate(acceleration),
                    "the second rate of setpoint_position", smoother.acceleration(setpoint),
                    0.9, 1.1)  # fmt: skip
    if {"force", "current"} <= set(columns) and axis.log.force_constant is not None:
        yield _Pair("force", columns["force"], "force constant x current",
                    axis.log.force_constant * columns["current"], 0.98, 1.02)  # fmt: skip


def _compare(axis: Axis, pair: _Pair) -> Iterator[Finding]:
    one, other = pair.signal, pair.other
    if not pair.zero:
        one, other = one - one.mean(), other - other.mean()
    power = float(other @ other)
    if power == 0.0 or not axis.moves:
        return
    product = float(one @ other)
    if abs(product) < _RELATED * np.sqrt(power * float(one @ one)):
        return
    ratio = product / power
    if pair.low <= ratio <= pair.high:
        return
    if ratio < 0.0:
        fault, looks = Fault.SIGN, "one of them is reversed"
    else:
        fault, looks = Fault.UNIT, _looks_like(ratio)
        if looks == UNKNOWN_SLIP and pair.follows and axis.soft_loop:
            return
    yield Finding(
        Severity.ERROR,
        fault,
        axis.name,
        f"{pair.name} is {ratio:.4g} times {pair.other_name}: {looks}",
        "whole log",
        "correct unit, scale, sign or sample rate in the import map",
    )


def _looks_like(ratio: float) -> str:
    for size, text in _SLIPS.items():
        if abs(np.log(ratio * size)) < 0.3 or abs(np.log(ratio / size)) < 0.3:
            return f"it looks like {text}"
    return UNKNOWN_SLIP


def _reversed_force(axis: Axis) -> Iterator[Finding]:
    if not axis.moves:
        return
    fit = axis.dynamics
    if fit.explains and fit.mass_matters and fit.mass < 0.0:
        units = axis.log.kind
        yield Finding(
            Severity.ERROR,
            Fault.SIGN,
            axis.name,
            f"the force acts against the acceleration, as if the "
            f"{units.mass_name} were {fit.mass:.3g} {units.mass}",
            "whole log",
            "give the force or the position the sign -1 in the import map",
        )
