"""Saturation: a command that stays at its extreme, the limit of the drive."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from twin.log.check.axis import Axis
from twin.log.check.report import Fault, Finding, Severity
from twin.signals import Array

_STUCK = 5e-3  # s at one value exactly
_STUCK_SAMPLES = 5
_LEVEL = 20e-3  # s at one value but for noise, after the low-pass
_LEVEL_BLOCKS = 10
_NEAR = 10.0  # times the noise
_WIDE = 40.0
_EDGE_BLOCKS = 3  # a limited command leaves its level at once, a smooth one slowly
_LIVELY = 200.0  # least range of a command, times the noise


def check(axis: Axis) -> Iterator[Finding]:
    """Saturation of the command."""
    force = axis.log.force
    for sign, extreme in ((1.0, force.max()), (-1.0, force.min())):
        if extreme == 0.0:  # a drive that is off
            continue
        stuck = _exactly(axis, force, extreme) or _but_for_noise(axis, sign * axis.force)
        if stuck:
            first, seconds = stuck
            yield Finding(
                Severity.WARNING,
                Fault.SATURATION,
                axis.name,
                f"the force stays at its extreme of {extreme:.4g} {axis.log.units['force']} for "
                f"{seconds:.3g} s in all",
                f"from {first:.6g} s",
                "move more gently if the drive was at its limit, and record its actual force",
            )


def _exactly(axis: Axis, force: Array, extreme: float) -> tuple[float, float] | None:
    """Start of the first interval at the extreme and length of all, s."""
    starts, lengths = _runs(np.abs(force - extreme) <= 1e-9 * np.ptp(force))
    stuck = lengths >= max(_STUCK * axis.sample_rate, _STUCK_SAMPLES)
    if not stuck.any():
        return None
    return starts[stuck][0] / axis.sample_rate, lengths[stuck].sum() / axis.sample_rate


def _but_for_noise(axis: Axis, height: Array) -> tuple[float, float] | None:
    """Likewise, of a low-passed command (m,): a level with steep edges at its top."""
    smoother = axis.smoother
    noise = smoother.held_noise(axis.force_noise)
    if np.ptp(height) < _LIVELY * noise:
        return None
    starts, near = _runs(height >= height.max() - _NEAR * noise)
    wide = _runs(height >= height.max() - _WIDE * noise)[1]
    longest = int(np.argmax(near))
    inside = 0 < starts[longest] < len(height) - near[longest]
    level = max(_LEVEL / smoother.block, _LEVEL_BLOCKS)
    if not inside or near[longest] < level or wide.max() - near[longest] > _EDGE_BLOCKS:
        return None
    return smoother.time(starts[:1])[0], float(near.sum() * smoother.block)


def _runs(mask: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Starts and lengths of the intervals of True."""
    edges = np.flatnonzero(np.diff(mask, prepend=False, append=False))
    return edges[::2], edges[1::2] - edges[::2]
