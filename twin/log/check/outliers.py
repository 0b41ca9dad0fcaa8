"""Outliers: short pieces of a log that no machine can produce."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from twin.log.check.axis import Axis
from twin.log.check.breaks import find_breaks, is_uneven
from twin.log.check.report import Fault, Finding, Severity
from twin.signals import Array

_APART = 0.05  # s without an outlier ends a burst
_UNUSUAL = 5.0  # times the level that 99 % of the samples stay below
_CONTRADICTION = 0.1  # least contradiction, as a part of the command
_ROUGH = 0.1  # least roughness, as a part of the command
_ROUGH_SPAN = 10e-3  # s, in which half of the samples are rough; a commanded step is only a few
_FEWEST_ROUGH = 5


def check(axis: Axis) -> Iterator[Finding]:
    """Outliers in position and command."""
    jumps = _unexplained_jumps(axis)
    if len(jumps):
        unit = axis.log.units["position"]
        yield _outliers(
            axis,
            jumps / axis.sample_rate,
            f"position bends by up to {axis.jumps[jumps - 1].max():.3g} {unit} within a sample, "
            f"its usual motion and noise allow {axis.possible_jump:.2g} {unit}",
            "cut the log there (was the carriage touched?) or repair the samples",
        )
    if not axis.moves:
        return
    rough = _rough_command(axis)
    if len(rough):
        yield _outliers(axis, rough, "the force jumps to and fro from sample to sample")
    else:
        yield from _contradictions(axis)


def _unexplained_jumps(axis: Axis) -> NDArray[np.intp]:
    """Samples (k,) where the position bends, but for those that another check names."""
    if axis.position_held or is_uneven(axis):
        return np.empty(0, dtype=np.intp)
    jumps = axis.bends
    for found in find_breaks(axis):
        jumps = jumps[(jumps < found.first - 2) | (jumps > found.last + 2)]
    return jumps


def _rough_command(axis: Axis) -> Array:
    """Times (k,) in s within bursts of noise on the command."""
    force = axis.log.force
    second = np.abs(np.diff(force, 2))
    rough = second > _ROUGH * axis.force_size
    span = max(round(_ROUGH_SPAN * axis.sample_rate), 2 * _FEWEST_ROUGH)
    if np.count_nonzero(rough) >= span // 2:
        rough &= second > _UNUSUAL * _usual(axis, second)
    if np.count_nonzero(rough) < span // 2:
        return np.empty(0)
    dense = np.convolve(rough, np.ones(span), "same") > span // 2
    return (np.flatnonzero(rough & dense) + 1) / axis.sample_rate


def _contradictions(axis: Axis) -> Iterator[Finding]:
    """Where command and motion contradict each other, except at jumps of the position."""
    if not axis.dynamics.explains:
        return
    fit = axis.dynamics
    error = np.abs(fit.residual) * axis.kept[fit.first : fit.first + len(fit.residual)]
    command = np.quantile(np.abs(axis.force - np.median(axis.force)), 0.99)
    usual = _usual(axis, error)
    bad = np.flatnonzero(error > max(_UNUSUAL * usual, _CONTRADICTION * command))
    if len(bad):
        unit = axis.log.units["force"]
        yield _outliers(
            axis,
            axis.smoother.time(bad + fit.first),
            f"force and motion contradict each other by up to {error.max():.3g} {unit}, "
            f"elsewhere by less than {usual:.2g} {unit}",
        )


def _usual(axis: Axis, values: Array) -> float:
    """What 99 % of the values stay below; fewer in a log so short that a burst is more than 1 %."""
    burst = 3.0 * axis.smoother.length / axis.duration
    return float(np.quantile(values, 1.0 - max(0.01, burst)))


def _outliers(
    axis: Axis,
    times: Array,
    what: str,
    remedy: str = "cut the log there (was an end stop hit, the carriage touched?)",
) -> Finding:
    bursts = np.split(times, np.flatnonzero(np.diff(times) > _APART) + 1)
    more = f" and {len(bursts) - 1} more times" if len(bursts) > 1 else ""
    return Finding(
        Severity.ERROR,
        Fault.OUTLIERS,
        axis.name,
        what,
        f"{bursts[0][0]:.6g} to {bursts[0][-1]:.6g} s{more}",
        remedy,
    )
