"""Force error by frequency in newtons, beside the noise floor in the same bands."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from identify.dataset.noise_floor import Noise, noises_of
from identify.dataset.prepared_log import PreparedLog, moving, sticks
from identify.dataset.spectrum import densities, pieces_of
from identify.estimation.force_balance import residual
from twin.model.machine import AxisModel

Array = NDArray[np.float64]

SHORTEST = 8  # blocks of the test functions used here, the fewest allowed
SEGMENT = 4.0  # s of each part of a log that is transformed
LEAST_PASSED = 0.2  # of the force's power that the test functions must pass
OCTAVE_PARTS = 2  # bands an octave


@dataclass(frozen=True, eq=False)
class Bands:
    """RMS force by frequency band: low, high (k,) Hz; error, noise and to_explain (k,) N.

    to_explain: command less inertia, the force that the effects must explain.
    """

    low: Array
    high: Array
    error: Array
    noise: Array
    to_explain: Array


def bands(axis: AxisModel, logs: Sequence[PreparedLog]) -> Bands:
    """RMS force error of the model by band over some logs, and that of the noise alone.

    The test functions are the shortest possible, and the spectrum is divided by their power
    response, up to the frequency at which they pass a fifth of the power. Where static friction is
    undetermined the error counts as zero.
    """
    noises = noises_of(axis, [log.motion for log in logs])
    spectra = [_spectrum(axis, log, noise) for log, noise in zip(logs, noises, strict=True)]
    weights = [log.motion.time[-1] for log in logs]
    frequency = min((s[0] for s in spectra), key=lambda f: f[-1])
    powers = [
        np.average([np.interp(frequency, s[0], s[i]) for s in spectra], axis=0, weights=weights)
        for i in (1, 2, 3)
    ]
    edges = _edges(frequency)
    width = frequency[1] - frequency[0]
    first = np.searchsorted(frequency, edges[:-1])
    stop = np.searchsorted(frequency, edges[-1])
    sums = [np.sqrt(np.add.reduceat(p[:stop], first) * width) for p in powers]
    return Bands(edges[:-1], edges[1:], *sums)


def _spectrum(axis: AxisModel, log: PreparedLog, noise: Noise) -> tuple[Array, Array, Array, Array]:
    """Of one log: frequencies Hz, power N^2/Hz of error, noise and what is to be explained."""
    motion = log.motion
    short = PreparedLog.of(motion, SHORTEST * motion.period)
    force = np.where(moving([short], sticks(axis)), residual(axis, [short]), 0.0)
    period = short.test_function.stride * motion.period
    segment = min(round(SEGMENT / period), len(force))
    both = np.stack([force, short.command - axis.mass * short.acceleration])
    pieces = pieces_of(both, segment)
    power = densities(pieces - pieces.mean(axis=-1, keepdims=True), period).mean(axis=1)
    frequency = np.asarray(np.fft.rfftfreq(segment, period), dtype=float)
    ratio = round(period / motion.sample_period)
    passed = short.test_function.response(motion.sample_period, segment * ratio)[: len(frequency)]
    passed_band = (passed > LEAST_PASSED) & (frequency > 0.0)
    frequency = frequency[passed_band]
    error, explain = power[:, passed_band] / passed[passed_band]
    return frequency, error, np.interp(frequency, noise.frequency, noise.power), explain


def _edges(frequency: Array) -> Array:
    """Edges (k + 1,) Hz of bands of part octaves, each with a frequency at least."""
    count = int(OCTAVE_PARTS * np.log2(frequency[-1] / frequency[0])) + 1
    top = frequency[-1] + 0.5 * (frequency[1] - frequency[0])
    edges = [top * 2.0 ** (-k / OCTAVE_PARTS) for k in range(count, -1, -1)]
    kept = [0.5 * frequency[0]]
    for edge in edges:
        if ((frequency >= kept[-1]) & (frequency < edge)).any():
            kept.append(edge)
    return np.array(kept)
