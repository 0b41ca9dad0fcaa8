"""Inverse-dynamics identification (IDIM-LS) of the EMPS ball-screw drive, as its authors do it.

An independent oracle for the tests: it uses nothing of `twin` or `identify`, so a figure that they
find on the same measurements can be held against one that was published.

Source: A. Janot, M. Gautier, M. Brunot, "Data Set and Reference Models of EMPS", Workshop on
Nonlinear System Identification Benchmarks, 2019.
"""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.io import loadmat
from scipy.signal import butter, cheby1, filtfilt

Array = NDArray[np.float64]

SAMPLE_RATE = 1000.0  # Hz
POSITION_CUTOFF = 100.0  # Hz, of the Butterworth filter of order 4
DECIMATION = 10
EDGE_SAMPLES = 49  # dropped at the start, where the derivatives of the filtered position are poor


@dataclass(frozen=True)
class Motion:
    """One run after filtering: motion and force at the full sample rate, each of shape (samples,).

    `velocity` in m/s, `acceleration` in m/s^2, `force` of the drive in N.
    """

    velocity: Array
    acceleration: Array
    force: Array


@dataclass(frozen=True)
class Estimate:
    """Least-squares parameters in the order of the regressors, and ||residual|| / ||force||."""

    parameters: Array
    relative_error: float


Regressors = Callable[[Motion], Array]


def load(path: Path) -> Motion:
    """Filter the position without lag and differentiate it by central differences.

    The drive signal `vir` is recorded in volts; `gtau` (N/V) turns it into force.
    """
    record = loadmat(path)
    force = record["gtau"].item() * record["vir"].ravel()
    b, a = butter(4, POSITION_CUTOFF, fs=SAMPLE_RATE)
    position = _filter_both_ways(b, a, record["qm"].ravel())
    velocity = np.gradient(position, 1 / SAMPLE_RATE)
    acceleration = np.gradient(velocity, 1 / SAMPLE_RATE)
    return Motion(velocity[EDGE_SAMPLES:], acceleration[EDGE_SAMPLES:], force[EDGE_SAMPLES:])


def symmetric(motion: Motion) -> Array:
    """Columns of mass (kg), viscous (N s/m) and Coulomb friction (N), offset (N)."""
    v = motion.velocity
    return np.column_stack([motion.acceleration, v, np.sign(v), np.ones_like(v)])


def direction_dependent(motion: Motion) -> Array:
    """Columns of mass, then viscous and Coulomb friction forwards, then the same backwards."""
    v = motion.velocity
    friction = np.column_stack([v, np.sign(v)])
    forward = (1 + np.sign(v[:, None])) / 2
    return np.column_stack([motion.acceleration, forward * friction, (1 - forward) * friction])


def identify(motion: Motion, regressors: Regressors) -> Estimate:
    """Least squares on the decimated regressors and force."""
    observation, force = _decimate(regressors(motion)), _decimate(motion.force)
    parameters = np.asarray(np.linalg.lstsq(observation, force)[0], dtype=np.float64)
    return Estimate(parameters, _relative_error(observation, force, parameters))


def prediction_error(motion: Motion, regressors: Regressors, parameters: Array) -> float:
    """||residual|| / ||force|| of parameters that were identified on another run."""
    return _relative_error(_decimate(regressors(motion)), _decimate(motion.force), parameters)


def _relative_error(observation: Array, force: Array, parameters: Array) -> float:
    return float(np.linalg.norm(force - observation @ parameters) / np.linalg.norm(force))


def _decimate(signal: Array) -> Array:
    b, a = cheby1(8, 0.05, 0.8 / DECIMATION)
    # The kept samples are counted from the end, so that the last one is always among them.
    first = (len(signal) - 1) % DECIMATION
    return _filter_both_ways(b, a, signal)[first::DECIMATION]


def _filter_both_ways(b: Array, a: Array, signal: Array) -> Array:
    # The published digits come from MATLAB, which pads by less than SciPy does by default.
    padding = 3 * (max(len(a), len(b)) - 1)
    return np.asarray(filtfilt(b, a, signal, axis=0, padlen=padding))
