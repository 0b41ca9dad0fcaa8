"""Faults of the command itself: noise, single samples that are off, held values, saturation."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from twin.checks.axis import Axis, held_samples
from twin.checks.breaks import and_more, held
from twin.checks.report import Fault, Finding
from twin.signals import Array


def check_command(axis: Axis) -> Iterator[Finding]:
    """Held values, noise, and single samples."""
    if not axis.moves:
        return
    force, unit = axis.log.force, axis.log.units["force"]
    if count := held_samples(force):
        yield held(axis, "the force", count)
        return
    least = 0.3 * axis.force_size  # of the command
    steps = np.abs(np.diff(force)).max()  # a sample off its neighbours is off one beside it
    if steps > least and len(single := _single(off := off_course(force), least)):
        what = f"single samples of the force are off by up to {off.max():.3g} {unit}"
        where = f"{single[0] / axis.sample_rate:.6g} s{and_more(len(single))}"
        remedy = "repair these samples, or cut the log there"
        yield axis.error(Fault.OUTLIERS, what, remedy, where)
    # noise that hides what the motion does not explain, even when it is averaged
    noise, averaged = axis.force_noise, axis.smoother.held_noise(axis.force_noise)
    left = float(np.median(np.abs(axis.dynamics.residual)))
    # averaged noise, as a part of what the motion leaves unexplained
    hides = axis.dynamics.explains and averaged >= 0.4 * left
    noisy = 0.03  # averaged noise of the command, as a part of it; 1 % of its rating leaves 0.02
    if hides and averaged > noisy * float(np.std(force)):
        yield axis.warning(
            Fault.NOISE,
            f"the force has noise of {noise:.3g} {unit} rms from sample to sample, {averaged:.2g} "
            f"{unit} over {axis.smoother.length * 1e3:.2g} ms: about all that is left of it beside "
            "the motion",
            "record the command that the controller computed, or shield the cable",
        )


def _single(off: Array, least: float) -> NDArray[np.intp]:
    """Samples (k,) that are off their neighbours by more than ``least``, few of them together."""
    bad = off > least
    if not bad.any():
        return np.flatnonzero(bad)
    # A sample at a steep edge is off by as much as its neighbours.
    single_sample = 60.0  # times what 99 % of the samples are off their neighbours
    bad &= off > single_sample * float(np.quantile(off, 0.99))
    together = np.convolve(bad, np.ones(21), "same")  # samples
    most_together = 3  # in so many; more are a burst, and no single ones
    return np.flatnonzero(bad & (together <= most_together))  # noise is no single sample


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


def check_saturation(axis: Axis) -> Iterator[Finding]:
    """Saturation of the command."""
    force = axis.log.force
    for sign, extreme in ((1.0, force.max()), (-1.0, force.min())):
        if extreme == 0.0:  # a drive that is off
            continue
        stuck = _exactly(axis, force, extreme) or _but_for_noise(axis, sign * axis.force)
        if stuck:
            first, seconds = stuck
            yield axis.warning(
                Fault.SATURATION,
                f"the force stays at its extreme of {extreme:.4g} {axis.log.units['force']} for "
                f"{seconds:.3g} s in all",
                "move more gently if the drive was at its limit, and record its actual force",
                f"from {first:.6g} s",
            )


def _exactly(axis: Axis, force: Array, extreme: float) -> tuple[float, float] | None:
    """Start of the first interval at the extreme and length of all, s."""
    starts, lengths = _runs(np.abs(force - extreme) <= 1e-9 * np.ptp(force))
    # s at one value exactly
    extreme_samples = 5  # at least, where so long is fewer
    stuck = lengths >= max(5e-3 * axis.sample_rate, extreme_samples)
    if not stuck.any():
        return None
    return starts[stuck][0] / axis.sample_rate, lengths[stuck].sum() / axis.sample_rate


def _but_for_noise(axis: Axis, height: Array) -> tuple[float, float] | None:
    """Likewise, of a low-passed command (m,): a level with steep edges at its top."""
    smoother = axis.smoother
    noise = smoother.held_noise(axis.force_noise)
    if np.ptp(height) < 200.0 * noise:  # least range of a command, times the noise
        return None
    starts, near = _runs(height >= height.max() - 10.0 * noise)  # times the noise
    wide_level = 40.0  # the same for the edges beside the level
    wide = _runs(height >= height.max() - wide_level * noise)[1]
    longest = int(np.argmax(near))
    inside = 0 < starts[longest] < len(height) - near[longest]
    # s at one value but for noise, after the low-pass
    level_blocks = 10  # at least, where so long is fewer
    level = max(20e-3 / smoother.block, level_blocks)
    edge_blocks = 3  # a limited command leaves its level at once, a smooth one slowly
    if not inside or near[longest] < level or wide.max() - near[longest] > edge_blocks:
        return None
    return smoother.time(starts[:1])[0], float(near.sum() * smoother.block)


def _runs(mask: NDArray[np.bool_]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Starts and lengths of the intervals of True."""
    edges = np.flatnonzero(np.diff(mask, prepend=False, append=False))
    return edges[::2], edges[1::2] - edges[::2]
