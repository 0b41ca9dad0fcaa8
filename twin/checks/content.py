"""Whether a log can be checked and fitted at all: signals, finite numbers, motion that excites."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from twin.checks import limits
from twin.checks.axis import Axis
from twin.checks.report import Fault, Finding, Severity
from twin.signals import Array


def check_content(axis: Axis) -> Iterator[Finding]:
    """Findings without which no other check makes sense."""
    yield from _missing(axis)
    yield from _not_finite(axis)
    yield from _flat(axis)
    if axis.duration < limits.SHORTEST:
        yield Finding(
            Severity.ERROR,
            Fault.TOO_SHORT,
            axis.name,
            f"the log lasts {axis.duration:.3g} s, a fit needs {limits.SHORTEST:g} s",
            "whole log",
            "record longer",
        )


def _missing(axis: Axis) -> Iterator[Finding]:
    columns = axis.log.columns
    commanded = "force" in columns or ("current" in columns and axis.log.force_constant)
    lengths = {name: len(column) for name, column in columns.items()}
    faults = {
        "there is no position": ("position" not in columns, "record the encoder"),
        "there is no force, nor a current with a force constant": (
            not commanded,
            f"add the command, or force_constant ({axis.log.kind('N/A')}) to the axis",
        ),
        f"the columns differ in length ({', '.join(f'{n} {k}' for n, k in lengths.items())})": (
            len(set(lengths.values())) > 1,
            "record all with one clock",
        ),
    }
    for what, (faulty, remedy) in faults.items():
        if faulty:
            yield Finding(
                Severity.ERROR, Fault.INCOMPLETE, axis.name, what, "whole log", remedy
            )  # fmt: skip


def _not_finite(axis: Axis) -> Iterator[Finding]:
    for name, column in axis.log.columns.items():
        bad = np.flatnonzero(~np.isfinite(column))
        if len(bad):
            yield Finding(
                Severity.ERROR,
                Fault.NOT_FINITE,
                axis.name,
                f"{name} is not a finite number in {len(bad)} of {len(column)} samples",
                f"from {bad[0] / axis.sample_rate:.6g} s",
                "cut the log there, or leave the signal out if it was not recorded",
            )


def _flat(axis: Axis) -> Iterator[Finding]:
    columns = axis.log.columns
    for name in ("position", "velocity", "current", "force"):
        if not _is_flat(columns.get(name)):
            continue
        idle = name in ("position", "velocity") and _is_flat(columns.get("setpoint_position"))
        yield Finding(
            Severity.WARNING if idle else Severity.ERROR,
            Fault.WEAK_EXCITATION if idle else Fault.FLAT,
            axis.name,
            f"{name} is {columns[name][0]:.6g} {axis.log.units[name]} throughout",
            "whole log",
            "leave the axis out of the fit"
            if idle
            else "check that the channel was connected and mapped",
        )


def _is_flat(column: Array | None) -> bool:
    return column is not None and len(column) > 0 and bool(np.all(column == column[0]))


def check_excitation(axis: Axis) -> Iterator[Finding]:
    """Weak excitation and coarse position."""
    unit = axis.log.units["position"]
    if not (axis.moves and axis.moves_often):
        yield _warning(
            axis,
            Fault.WEAK_EXCITATION,
            f"the axis hardly moves: {np.ptp(axis.log.position):.2g} {unit} in all, most of the "
            f"time too slowly for the noise of its position ({axis.position_noise:.2g} {unit} "
            "rms); a fit leaves this log out",
            "move it, or leave it out of the fit",
        )
        return
    yield from _directions(axis)
    yield from _inertia(axis)
    yield from _coarse(axis)


def _inertia(axis: Axis) -> Iterator[Finding]:
    share = axis.dynamics.inertial_share
    if axis.dynamics.explains and share < limits.INERTIAL:
        mass = axis.log.kind.mass_name
        yield _warning(
            axis,
            Fault.WEAK_EXCITATION,
            f"acceleration makes {100.0 * share:.2g} % of the force that varies, so that the "
            f"{mass} cannot be identified; with it go all forces in proportion to acceleration",
            f"add faster changes of speed, or give the {mass} and hold it (fixed)",
        )


def _directions(axis: Axis) -> Iterator[Finding]:
    unit = axis.log.units["velocity"]
    fastest = float(np.quantile(np.abs(axis.velocity), 0.999))
    moving = axis.velocity[np.abs(axis.velocity) > limits.CREEP * fastest]
    forward = float(np.mean(moving > 0.0))
    one_way = max(forward, 1.0 - forward)
    if one_way > 1.0 - limits.ONE_WAY:
        yield _warning(
            axis,
            Fault.WEAK_EXCITATION,
            f"the axis moves only {'forwards' if forward > 0.5 else 'backwards'} "
            f"({100.0 * one_way:.3g} % of its moving time), so that a constant force "
            "and the Coulomb friction cannot be told apart",
            "move both ways",
        )
    low, middle, high = np.quantile(np.abs(moving), (0.1, 0.5, 0.9))
    if high - low < limits.SAME_SPEED * middle:
        yield _warning(
            axis,
            Fault.WEAK_EXCITATION,
            f"there is one speed only, {middle:.3g} {unit}, so that the Coulomb and the viscous "
            "friction cannot be told apart",
            "add other speeds",
        )


def _coarse(axis: Axis) -> Iterator[Finding]:
    noise = axis.smoother.acceleration_noise(axis.position_noise)
    rms = float(np.sqrt(np.mean(axis.acceleration**2)))
    rounded = axis.position_white < limits.ROUNDING * axis.position_step
    if noise < (limits.ROUNDED if rounded else limits.COARSE) * rms:
        return
    unit = axis.log.units["position"]
    yield _warning(
        axis,
        Fault.COARSE_POSITION,
        f"the position is good to {axis.position_noise:.2g} {unit} rms (its smallest change is "
        f"{axis.position_step:.2g} {unit}), which over {axis.smoother.length * 1e3:.2g} ms makes "
        f"{noise:.2g} of the {rms:.2g} {axis.log.units['setpoint_acceleration']} seen",
        "use a finer encoder or a livelier motion",
    )


def _warning(axis: Axis, fault: Fault, what: str, remedy: str) -> Finding:
    return Finding(Severity.WARNING, fault, axis.name, what, "whole log", remedy)
