"""Motions and logs built from closed forms, for tests that know the answer without the product."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from identify.dataset.blocks import Blocks
from identify.dataset.dataset import Dataset
from identify.dataset.motion import Motion, motion_of
from identify.dataset.prepared_log import PreparedLog
from identify.estimation.fit import Fit, finished
from identify.estimation.fit import Outcome as Ended
from twin.effect import Excitation
from twin.effects import load_catalogue
from twin.experiments.trajectory import Setpoint
from twin.laws.trials import companion
from twin.logs import AxisLog, Log
from twin.model.machine import AxisModel, Fitted

Array = NDArray[np.float64]
CATALOGUE = load_catalogue()
COVERED = Excitation(-0.031, 0.083, 0.7, 0.9, 3.0, 1e-3, force_max=4.0)


def log_of(rate: float, x: Array, force: Array, other: Array | None = None, **more: Array) -> Log:
    """A log of axis x, of axis y too where its positions are given, at that rate (Hz)."""
    axes = {"x": AxisLog({"position": x, "force": force, **more})}
    if other is not None:
        axes["y"] = AxisLog({"position": other, "force": np.zeros_like(other)})
    return Log(rate, axes)


def waves(*terms: tuple[float, float, float]) -> Callable[[Array], Array]:
    """Sum of amplitude x sin(2 pi frequency t + phase)."""
    return lambda t: sum(a * np.sin(2.0 * np.pi * f * t + p) for a, f, p in terms)


def held(force: Array, mass: float, dt: float, x: float = 0.0, v: float = 0.0) -> Array:
    """Positions (n,) m of a free mass under forces (n,) N, each held over its sample: exact."""
    out = np.empty(len(force))
    for k, u in enumerate(force):
        out[k] = x
        x, v = x + dt * v + 0.5 * dt**2 * u / mass, v + dt * u / mass
    return out


def moved(
    rng: np.random.Generator, duration: float = 1.0, rate: float = 2000.0, name: str = "log"
) -> Motion:
    """A smooth motion of two axes that turns often, with a command that is no function of it."""
    t = np.arange(round(duration * rate) + 1) / rate
    phase = rng.uniform(0.0, 6.0, 4)
    x = 0.02 + waves((0.03, 2.3, phase[0]), (0.004, 9.1, phase[1]))(t)
    force = waves((3.0, 3.7, phase[2]), (1.1, 17.0, phase[3]))(t)
    other = 0.05 + waves((0.02, 3.1, phase[3]), (0.003, 7.9, phase[2]))(t)
    return motion_of(log_of(rate, x, force, other), "x", name, ripples=())


def ridden(command: Callable[[Motion], Array], duration: float = 6.0) -> Motion:
    """A motion with all of dry, viscous and position dependent force, and a command added to it."""
    t = (np.arange(round(duration * 1000.0))) / 1000.0
    x = waves((0.04, 0.4, 0.3), (0.02, 0.9, 1.0))
    motion = motion_of(log_of(1000.0, x(t), t), "x", "log")
    m, v = motion.position, motion.velocity
    force = 1.3 * np.gradient(v, 1e-3) + 0.7 * np.sign(v) + 0.9 * v + 0.2 - 3.0 * m + 40.0 * m**3
    u = force + command(motion)
    return replace(motion, track=Blocks(np.stack([m, v, u]), np.stack([motion.raw[0], u])))


def two_waves(samples: int, rate: float = 1000.0) -> Setpoint:
    """Two axes that swing from rest, each in its own way."""
    t = np.arange(samples)[:, None] / rate
    w, size = np.array([[9.0, 23.0]]), np.array([[0.05, 0.02]])
    x, v, a = size * (1.0 - np.cos(w * t)), size * w * np.sin(w * t), size * w**2 * np.cos(w * t)
    return Setpoint(x, v, a, np.zeros_like(x), rate)


def windowed(motion: Motion, length: float = 0.05) -> PreparedLog:
    """The motion in windows of that length (s)."""
    return PreparedLog.of(motion, length)


def effect(name: str, values: Mapping[str, float] | None = None) -> Fitted:
    """An effect of the catalogue at its start values, or those given."""
    return Fitted.at_start(CATALOGUE[name], values)


def fit_of(axis: AxisModel, *logs: PreparedLog) -> Fit:
    """The fit that an axis is at its present values."""
    return finished(axis, axis, logs, Ended.CONVERGED)


def dataset_of(
    *fit: PreparedLog, holdout: tuple[PreparedLog, ...] = (), channel_delay: float = 0.0
) -> Dataset:
    """A dataset of some logs of axis x."""
    return Dataset("x", fit, holdout, lambda: COVERED, channel_delay)


SHORT = moved(np.random.default_rng(1), 1.0).head(0.4)
SHORT = replace(SHORT, time_origin=0.137)
SENSING = (
    effect("encoder_delay", {"tau": 7.3e-4}),
    effect("encoder_ripple", {"period": 3.1e-3, "a1": 2e-5, "b1": -1.3e-5, "a2": 7e-6, "b2": 3e-6}),
)
STICKY = companion(CATALOGUE["lugre"])
LAG = effect("actuator_lag", {"tau": 1.7e-3})
RIPPLE = effect("force_constant_ripple", {"p": 0.013, "a1": 0.05, "b1": 0.03})
PAYLOAD = effect("payload_mass", {"ratio": 0.31})
