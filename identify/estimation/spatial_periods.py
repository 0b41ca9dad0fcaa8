"""Spatial periods, at which what a model leaves of the force repeats along the track.

Two looks. The least-squares gain of a sine in position beside the model's own parameters, for
pitches half a cycle over the travel apart, which tells what a smooth remainder or the model itself
would imitate; and spectral lines, which reach to pitches far below.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from identify.dataset.spectrum import ScatteredSignal, find_lines
from identify.estimation.least_squares import orthonormal, unabsorbed
from twin.signals import Array

FEWEST_CYCLES = 3  # over the travel


def spatial_periods(
    position: Array, force: Array, weight: Array, columns: Array
) -> tuple[float, ...]:
    """Periods (m) at which a residual over a weight repeats along the track, likeliest first.

    position (n,) m, force (n,) N: the residual; the repeating part is the weight (n,) times a
    function of position. columns (n, k): forces that the model's parameters can add.
    """
    span = float(np.ptp(position))
    if span == 0.0 or not force.any():
        return ()
    thin = slice(None, None, -(-len(force) // 4000))  # that the first look takes
    peaks = _peaks(position[thin], force[thin], weight[thin], columns[thin], span)
    # 0.25 cycles a sample: half of what the samples can tell where they are even
    highest = 0.25 * len(position) / span
    found = find_lines(
        [ScatteredSignal(position, force * weight)], FEWEST_CYCLES / span, highest,
        most=3, chance=1.0,  # false-alarm probability up to which a line is tried
    )  # fmt: skip
    lines = (line.period for line in found)
    apart = [p for p in lines if all(abs(span / p - span / q) > 0.5 for q in peaks)]
    return (*peaks, *apart)


def _peaks(
    position: Array, force: Array, weight: Array, columns: Array, span: float
) -> tuple[float, ...]:
    """Pitches (m) at which a sine gains more than at those beside, the largest gains first."""
    halves = np.arange(2 * FEWEST_CYCLES, 2 * 120 + 1)  # over the travel, of the first look
    basis = orthonormal(columns)
    left = unabsorbed(force, basis)
    waves = _waves(np.exp(1j * np.pi / span * position), halves[0], len(halves))
    gain = np.concatenate([_gains(weight[:, None] * some, left, basis) for some in waves])
    beside = np.pad(gain, 1)
    tops = np.flatnonzero((gain >= beside[:-2]) & (gain >= beside[2:]))
    best = tops[np.argsort(-gain[tops])][:6]  # as many are tried
    return tuple(float(2.0 * span / k) for k in halves[best])


def _waves(
    turn: NDArray[np.complex128], first: int, count: int
) -> Iterator[NDArray[np.complex128]]:
    """Powers (n, k) of turns (n,) from the first on, some at a time."""
    wave = turn**first
    at_once = 32  # waves that are held; all of them take 45 MB
    for k in range(0, count, at_once):
        out = np.empty((min(at_once, count - k), len(turn)), dtype=complex)
        for row in out:
            row[:], wave = wave, wave * turn
        yield out.T


def _gains(waves: NDArray[np.complex128], left: Array, basis: Array) -> Array:
    """Squared force (k,) that a sine and cosine of each wave (n, k) take of what is left (n,)."""
    sine, cosine = unabsorbed(waves.imag, basis), unabsorbed(waves.real, basis)
    a, b, c = (
        np.einsum("ij,ij->j", *pair) for pair in ((sine, sine), (cosine, cosine), (sine, cosine))
    )
    s, t = sine.T @ left, cosine.T @ left
    free = a * b - c**2
    # 1e-9, below which sine and cosine are one column there
    sure = free > 1e-9 * a * b
    gain = np.where(sure, b * s**2 + a * t**2 - 2.0 * c * s * t, 0.0) / np.where(sure, free, 1.0)
    return np.asarray(gain)
