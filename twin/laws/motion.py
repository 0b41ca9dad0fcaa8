"""Motions along which a law is tried."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from twin.signals import Array, rate


@dataclass(frozen=True, eq=False)
class Motion:
    """A motion of one axis: x m, v m/s, u N (n,) every ``dt`` s."""

    dt: float
    x: Array
    v: Array
    u: Array

    def __len__(self) -> int:
        return len(self.x)

    @classmethod
    def cycles(cls, amplitude: float = 0.1, cycles: int = 2, samples: int = 4000) -> Motion:
        """Closed cycles of 1 s over +-amplitude (m), faster and slower, other speeds out than back.

        samples: in a cycle.
        """
        dt = 1.0 / samples
        phase = 2.0 * np.pi * dt * np.arange(cycles * samples)
        bent = phase + 0.4 * np.sin(2.0 * phase + 0.5)
        v = 2.0 * np.pi * amplitude * np.cos(bent) * (1.0 + 0.8 * np.cos(2.0 * phase + 0.5))
        return cls(dt, amplitude * np.sin(bent), v, rate(v, dt))

    @classmethod
    def random(cls, rng: np.random.Generator, samples: int = 400, dt: float = 1e-4) -> Motion:
        """Unrelated random numbers, with some samples at rest and many changes of direction."""
        v = rng.normal(0.0, 0.1, samples) * 10.0 ** rng.uniform(-6.0, 0.0, samples)
        v[rng.random(samples) < 0.1] = 0.0
        return cls(dt, rng.uniform(-0.2, 0.2, samples), v, rng.normal(0.0, 2.0, samples))
