"""The weak form: forces averaged by test functions, the acceleration integrated by parts.

A test function phi vanishes at its ends, so integral(phi m a) = -integral(phi' m v), and only
the velocity of the log is needed. D. A. Messenger, D. M. Bortz, "Weak SINDy", Multiscale Model.
Simul. 19 (2021). It is (1 - r^2)^2, normalised to unit sum: an averaged force is a mean, N.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from twin.errors import InputError
from twin.signals import Array, between

OVERLAP = 4  # test functions that cover one instant
LEAST_BLOCKS = 8  # that a test function spans
LOOK = 0.1  # s, its length where none is chosen yet
SHORTEST = 0.02  # s, within which no log is looked at more closely


def require_test_function(length: float | None, longest: float) -> None:
    """Raise InputError for a length (s) that is not above zero and below that of the data (s)."""
    if length is not None and not 0.0 < length < longest:
        raise InputError(
            f"a test function of {length:g} s: give a length above 0 s and below that of the data, "
            f"{longest:g} s"
        )


@dataclass(frozen=True, eq=False)
class TestFunction:
    """A smooth weight over blocks of ``period`` (s).

    weights: (w,) 1. slope: (w,) 1/s. stride: from one to the next, in blocks.
    """

    __test__: ClassVar[bool] = False  # pytest: no test, whatever its name

    period: float
    weights: Array
    slope: Array
    stride: int

    @property
    def length(self) -> float:
        """Full length in s."""
        return len(self.weights) * self.period

    @classmethod
    def of_length(cls, length: float, period: float) -> TestFunction:
        """A test function of that length (s); InputError where it spans too few blocks."""
        n = round(length / period)
        if n < LEAST_BLOCKS:
            raise InputError(
                f"a test function of {length:g} s is shorter than {LEAST_BLOCKS} blocks of "
                f"{period:g} s; give at least {LEAST_BLOCKS * period:g} s"
            )
        return cls._of_blocks(n, period, max(n // OVERLAP, 1))

    @classmethod
    def at_least(cls, length: float, period: float) -> TestFunction:
        """The same, but as short as can be where blocks are too long for that length (s)."""
        return cls.of_length(max(length, LEAST_BLOCKS * period), period)

    @classmethod
    def _of_blocks(cls, n: int, period: float, stride: int) -> TestFunction:
        edges = (1.0 - (np.arange(n + 1) / n * 2.0 - 1.0) ** 2) ** 2
        phi = 0.5 * (edges[1:] + edges[:-1])
        return cls(period, phi / phi.sum(), between(edges, period) / phi.sum(), stride)

    def sharpened(self, parts: int) -> TestFunction:
        """The same test function for signals that are means over blocks of ``parts`` samples.

        Block means smooth the signal, and block weights the test function, which ``refined`` does
        not have; the second difference removes that smoothing, to fourth order in the block.
        """
        bend = np.diff(np.pad(self.weights, 1), 2)
        weights = self.weights - (2.0 - 1.0 / parts**2) / 12.0 * bend
        return replace(self, weights=weights / weights.sum())

    def refined(self, parts: int) -> TestFunction:
        """The same test function over blocks ``parts`` times shorter."""
        n = len(self.weights) * parts
        return self._of_blocks(n, self.period / parts, self.stride * parts)

    def mean(self, signals: Array) -> Array:
        """Means of signals (..., n) -> (..., n_test_functions)."""
        return self._apply(signals, self.weights)

    def acceleration(self, velocity: Array) -> Array:
        """Mean acceleration (n_test_functions,) m/s^2 of a velocity (n,) m/s."""
        return -self._apply(velocity, self.slope)

    def _apply(self, signals: Array, kernel: Array) -> Array:
        # In pieces as long as the stride each sample meets every piece of the kernel once, in one
        # product of matrices; windows that overlap in memory would be multiplied one by one.
        count = max((signals.shape[-1] - len(kernel)) // self.stride + 1, 0)
        pieces = -(-len(kernel) // self.stride)
        needed = (count + pieces - 1) * self.stride
        lacking = max(needed - signals.shape[-1], 0)
        if lacking:  # beyond the kernel's end, where it is zero
            more = np.zeros((*signals.shape[:-1], lacking))
            signals = np.concatenate([signals, more], axis=-1)
        blocks = signals[..., :needed].reshape(*signals.shape[:-1], -1, self.stride)
        padded = np.zeros(pieces * self.stride)
        padded[: len(kernel)] = kernel
        products = blocks @ padded.reshape(pieces, self.stride).T
        return np.asarray(sum(products[..., j : j + count, j] for j in range(pieces)))

    def response(self, period: float, segment: int) -> Array:
        """Squared magnitude of the mean's frequency response for samples of ``period`` (s).

        At the frequencies of a Fourier transform over ``segment`` samples, (segment // 2 + 1,).
        """
        weights = TestFunction.of_length(self.length, period).weights
        fold = -(-len(weights) // segment)
        return np.abs(np.fft.rfft(weights, fold * segment)[::fold]) ** 2
