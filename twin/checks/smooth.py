"""Signals of a log on one slow clock: low-passed alike, so that they may be compared.

Blocks of whole samples keep position and held command aligned: over a block the command acts, the
mean velocity is the difference of the positions at its two ends.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from twin.signals import Array, between, rate

BLOCK = 1e-3  # s
WINDOW = 20e-3  # s, full length of the low-pass
_FEWEST_BLOCKS = 8  # in a window


@dataclass(frozen=True)
class Smoother:
    """Low-pass of length WINDOW for signals sampled every ``period`` (s)."""

    period: float

    @cached_property
    def samples(self) -> int:
        """Samples in a block."""
        return max(round(BLOCK / self.period), 1)

    @property
    def block(self) -> float:
        """Length of a block in s."""
        return self.samples * self.period

    @cached_property
    def weights(self) -> Array:
        """(w,) weights (1 - r^2)^2 of the low-pass, of unit sum."""
        count = max(round(WINDOW / self.block), _FEWEST_BLOCKS) | 1
        r = (2.0 * np.arange(count) - (count - 1)) / (count + 1)
        phi = (1.0 - r**2) ** 2
        return np.asarray(phi / phi.sum())

    @property
    def length(self) -> float:
        """Length of the low-pass in s."""
        return len(self.weights) * self.block

    def position(self, x: Array) -> Array:
        """Position (n,) -> low-passed, in the middle of each block (m,)."""
        edges = self._edges(x)
        return self._low_pass(0.5 * (edges[1:] + edges[:-1]))

    def velocity(self, x: Array) -> Array:
        """Position (n,) -> low-passed velocity (m,)."""
        return self._low_pass(self._block_velocity(x))

    def acceleration(self, x: Array) -> Array:
        """Position (n,) -> low-passed acceleration (m,); the ends repeat their neighbours."""
        return self._low_pass(rate(self._block_velocity(x), self.block))

    def direction(self, x: Array, slow: float) -> Array:
        """Position (n,) -> low-passed sign of the velocity (m,), rounded off below ``slow``."""
        return self._low_pass(np.tanh(self._block_velocity(x) / slow))

    def held(self, u: Array) -> Array:
        """Signal held over each sample (n,) -> low-passed (m,)."""
        count = (len(u) - 1) // self.samples
        means = u[: count * self.samples].reshape(count, self.samples).mean(axis=1)
        return self._low_pass(means)

    def rate(self, v: Array) -> Array:
        """Signal read at each sample (n,) -> low-passed mean over each block (m,)."""
        return self.held(0.5 * (v + np.append(v[1:], v[-1])))

    def time(self, index: NDArray[np.intp]) -> Array:
        """Times (k,) in s of the middle of low-passed samples ``index`` (k,)."""
        return np.asarray((index + 0.5 * len(self.weights)) * self.block)

    def held_noise(self, noise: float) -> float:
        """Noise of ``held`` where that of the signal is white, of rms ``noise``."""
        return float(noise / self.samples**0.5 * np.linalg.norm(self.weights))

    def velocity_noise(self, noise: float) -> float:
        """Noise of ``velocity`` where that of the position is white, of rms ``noise``."""
        return float(noise / self.block * np.linalg.norm(np.convolve(self.weights, [1.0, -1.0])))

    def acceleration_noise(self, noise: float) -> float:
        """Noise of ``acceleration``, likewise."""
        kernel = np.convolve(np.convolve(self.weights, [1.0, -1.0]), [0.5, 0.0, -0.5])
        return float(noise / self.block**2 * np.linalg.norm(kernel))

    def _block_velocity(self, x: Array) -> Array:
        return between(self._edges(x), self.block)

    def _edges(self, x: Array) -> Array:
        count = (len(x) - 1) // self.samples
        return x[: count * self.samples + 1 : self.samples]

    def _low_pass(self, signal: Array) -> Array:
        return np.convolve(signal, self.weights, "valid")
