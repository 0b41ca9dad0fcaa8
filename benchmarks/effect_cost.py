"""Cost of every effect of the catalogue, and against the simplest friction."""

from __future__ import annotations

from collections.abc import Callable
from time import thread_time

import numba
import numpy as np

from benchmarks.figures import Figure
from benchmarks.timing import Array, interleaved, ratio
from twin.core.compiled import call_at, law_address
from twin.effect import (
    DRY,
    DT,
    INDEX,
    IO_SIZE,
    MASS,
    READING,
    STATIC,
    VISCOUS,
    WHEN,
    Effect,
    U,
    V,
    X,
)
from twin.effects import load_catalogue

TITLE = "Cost of one effect and sample (CPU time of its compiled law)"
REFERENCE = "coulomb_viscous"
ROUNDS = 7
PERIOD = 1e-4  # s
SAMPLES = 200_000


@numba.njit(cache=True, error_model="numpy")
def _drive(law, p, s, io, motion):
    """Call a law along a motion (3, n): position m, velocity m/s, command N."""
    for k in range(motion.shape[1]):
        io[INDEX] = k
        io[X] = motion[0, k]
        io[V] = motion[1, k]
        io[U] = motion[2, k]
        io[READING] = motion[0, k]
        call_at(law, (p.ctypes.data, s.ctypes.data, io.ctypes.data))


def measure() -> list[Figure]:
    """Nanoseconds a sample of every effect, with its ratio to the reference in the same rounds."""
    catalogue = load_catalogue()
    motion = _motion()
    jobs = [_job(effect, motion) for effect in catalogue.values()]
    seconds = dict(zip(catalogue, interleaved(jobs, ROUNDS, thread_time).T, strict=True))
    return [
        Figure(
            name, float(np.median(t)) / SAMPLES * 1e9, "ns",
            note=f"{ratio(t, seconds[REFERENCE]):.2f} times {REFERENCE}",
        )
        for name, t in seconds.items()
    ]  # fmt: skip


def _motion() -> Array:
    """Two sines over 0.1 m with reversals, and a force to match."""
    t = PERIOD * np.arange(SAMPLES)
    x = 0.06 * np.sin(np.pi * t) + 0.01 * np.sin(9.0 * t)
    v = np.gradient(x, PERIOD)
    return np.stack([x, v, np.gradient(v, PERIOD)])


def _job(effect: Effect, motion: Array) -> Callable[[], None]:
    """The law at its start values, every strength a tenth of a unit where bounds allow it."""
    law = law_address(effect)
    values = {
        p.name: float(np.clip(0.1, p.lower, p.upper)) if p.strength else p.start
        for p in effect.parameters
    }
    p = np.array([*values.values(), 0.0])
    s = np.zeros(len(effect.states) + 1)
    io = np.zeros(IO_SIZE)
    io[DT] = PERIOD
    io[[MASS, DRY, STATIC, VISCOUS, WHEN]] = 1.0

    def job() -> None:
        s[:] = 0.0
        _drive(law, p, s, io, motion)

    return job
