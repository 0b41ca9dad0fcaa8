"""Faults of the command itself: noise, single samples that are off, values that are held."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from twin.log.check.axis import Axis
from twin.log.check.breaks import held
from twin.log.check.report import Fault, Finding, Severity
from twin.signals import Array

_NOISY = 0.05  # noise of the command, as a part of it
_HIDES = 0.4  # averaged noise, as a part of what the motion leaves unexplained
_ALONE = 60.0  # times what 99 % of the samples are off their neighbours
_LARGE = 0.3  # of the command
_BURST, _MOST_TOGETHER = 21, 3  # more in so many samples are a burst, and no single ones


def check(axis: Axis) -> Iterator[Finding]:
    """Held values, noise, and single samples."""
    if not axis.moves:
        return
    force, unit = axis.log.force, axis.log.units["force"]
    if count := axis.force_held:
        yield held(axis, "the force", count)
        return
    least = _LARGE * axis.force_size
    steps = np.abs(np.diff(force)).max()  # a sample off its neighbours is off one beside it
    if steps > least and len(single := _single(off := off_course(force), least)):
        first = single[0] / axis.sample_rate
        more = f" and {len(single) - 1} more times" if len(single) > 1 else ""
        yield Finding(
            Severity.ERROR, Fault.OUTLIERS, axis.name,
            f"single samples of the force are off by up to {off.max():.3g} {unit}",
            f"{first:.6g} s{more}", "repair these samples, or cut the log there",
        )  # fmt: skip
    yield from _noise(axis)


def _single(off: Array, least: float) -> NDArray[np.intp]:
    """Samples (k,) that are off their neighbours by more than ``least``, few of them together."""
    bad = off > least
    if not bad.any():
        return np.flatnonzero(bad)
    bad &= off > _ALONE * float(np.quantile(off, 0.99))  # one at a steep edge is off by as much
    together = np.convolve(bad, np.ones(_BURST), "same")
    return np.flatnonzero(bad & (together <= _MOST_TOGETHER))  # noise is no single sample


def _noise(axis: Axis) -> Iterator[Finding]:
    """Noise that hides what the motion does not explain, even when it is averaged."""
    noise, unit = axis.force_noise, axis.log.units["force"]
    left = float(np.median(np.abs(axis.dynamics.residual)))
    averaged = axis.smoother.held_noise(noise)
    if not axis.dynamics.explains or averaged < _HIDES * left:
        return
    if noise > _NOISY * float(np.std(axis.log.force)):
        yield Finding(
            Severity.WARNING, Fault.NOISE, axis.name,
            f"the force has noise of {noise:.3g} {unit} rms from sample to sample, {averaged:.2g} "
            f"{unit} over {axis.smoother.length * 1e3:.2g} ms: about all that is left of it beside "
            "the motion",
            "whole log", "record the command that the controller computed, or shield the cable",
        )  # fmt: skip


def off_course(signal: Array) -> Array:
    """(n,) by how much each sample is off the median of the five around it; 0 at the ends."""
    off = np.zeros(len(signal))
    if len(signal) > 5:
        a, b, c, d = signal[:-4], signal[1:-3], signal[3:-1], signal[4:]
        # The median of five is that of one and of the middle two of the other four.
        low = np.maximum(np.minimum(a, b), np.minimum(c, d))
        high = np.minimum(np.maximum(a, b), np.maximum(c, d))
        low, high = np.minimum(low, high), np.maximum(low, high)
        off[2:-2] = np.abs(signal[2:-2] - np.clip(signal[2:-2], low, high))
    return off
