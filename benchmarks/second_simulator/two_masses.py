"""Two masses on a spring under a position loop without feedforward, and their exact response.

Solved over each sample by the matrix exponential, the command held over a sample and late.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import expm

from identify.frequency.response import Complex, LoopSignals
from twin.signals import Array

CELLS = 2000  # samples of a period of the setpoint


@dataclass(frozen=True)
class TwoMasses:
    """Motor with encoder, and a load; SI units. ratio: of the load's damping, motor held."""

    motor: float = 2.0
    load: float = 1.0
    frequency: float = 60.0
    ratio: float = 0.02
    damping: float = 4.0
    delay: float = 1.3e-3
    period: float = 1e-3
    bandwidth: float = 10.0
    noise: float = 1e-7

    @property
    def mass(self) -> float:
        """kg"""
        return self.motor + self.load

    @property
    def resonance(self) -> tuple[float, float]:
        """Frequency Hz and damping ratio where both are free."""
        apart = float(np.sqrt(self.mass / self.motor))
        return self.frequency * apart, self.ratio * apart

    @cached_property
    def _step(self) -> tuple[Array, Array, Array, int]:
        """State over a sample, by the command before and by that of the sample; whole samples."""
        turn = 2.0 * np.pi * self.frequency
        spring, loss = self.load * turn**2, 2.0 * self.ratio * self.load * turn
        rates = np.zeros((5, 5))
        rates[0, 1] = rates[2, 3] = 1.0
        rates[1, :4] = np.array([-spring, -loss - self.damping, spring, loss]) / self.motor
        rates[3, :4] = np.array([spring, loss, -spring, -loss]) / self.load
        rates[1, 4] = 1.0 / self.motor
        whole = int(self.delay // self.period)
        part = self.delay - whole * self.period
        first, then = expm(rates * part), expm(rates * (self.period - part))
        return (then @ first)[:4, :4], then[:4, :4] @ first[:4, 4], then[:4, 4], whole

    def response(self, frequency: Array) -> Complex:
        """Position over force (k,) m/N of the samples."""
        state, before, now, whole = self._step
        out = []
        for z in np.exp(2j * np.pi * frequency * self.period):
            drive = before / z + now
            out.append(np.linalg.solve(z * np.eye(4) - state, drive)[0] * z**-whole)
        return np.array(out)

    def controller(self, frequency: Array) -> Complex:
        """Force over error (k,) N/m: a gain, and the rate of the reading."""
        late: Complex = np.exp(-2j * np.pi * frequency * self.period)
        stiff, rate = self._gains
        return stiff + rate * (1.0 - late) / self.period

    @property
    def _gains(self) -> tuple[float, float]:
        turn = 2.0 * np.pi * self.bandwidth
        return self.mass * turn**2 / 3.0, self.mass * turn

    def run(self, setpoint: Array, rng: np.random.Generator) -> LoopSignals:
        """The loop along a setpoint (n,) m."""
        state, before, now, whole = self._step
        stiff, rate = self._gains
        n = len(setpoint)
        noise = self.noise * rng.standard_normal(n)
        force, reading = np.zeros((2, n))
        x, sent = np.zeros(4), np.zeros(n + whole + 1)
        for i in range(n):
            reading[i] = x[0] + noise[i]
            error = setpoint[i] - reading[i]
            last = setpoint[i - 1] - reading[i - 1] if i else 0.0
            force[i] = sent[i + whole + 1] = stiff * error + rate * (error - last) / self.period
            x = state @ x + before * sent[i] + now * sent[i + 1]
        return LoopSignals(setpoint, force, reading, self.period)


def multisine(samples: int, rng: np.random.Generator) -> Array:
    """A periodic setpoint (n,) m of all lines, whose amplitude falls with frequency."""
    lines = np.arange(1, CELLS // 2 - 100)
    spectrum = np.zeros(CELLS // 2 + 1, dtype=complex)
    turns = rng.uniform(0.0, 2.0 * np.pi, len(lines))
    spectrum[lines] = 1e-2 * np.exp(1j * turns) / np.maximum(lines / 10.0, 1.0) ** 1.3
    return np.tile(np.fft.irfft(spectrum, CELLS), -(-samples // CELLS))[:samples]


def wandering(samples: int, rng: np.random.Generator) -> Array:
    """A setpoint (n,) m that does not repeat."""
    return np.asarray(1e-5 * np.cumsum(rng.standard_normal(samples)))
