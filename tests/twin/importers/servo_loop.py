"""A mass with friction under a sampled position loop, written down apart from the product."""

from dataclasses import dataclass

import numpy as np

MASS, COULOMB, VISCOUS = 2.0, 3.0, 5.0  # kg, N, N s/m
RATE = 1000.0  # Hz


@dataclass(frozen=True)
class Loop:
    """Signals (n,) of a loop, SI. feedforward and feedback: the two parts of the force."""

    time: np.ndarray
    setpoint: np.ndarray
    position: np.ndarray
    feedforward: np.ndarray
    feedback: np.ndarray

    @property
    def force(self) -> np.ndarray:
        """What the drive makes."""
        return self.feedforward + self.feedback


def loop(friction_fed_forward: float = COULOMB, seconds: float = 4.0, counts: float = 1e-6) -> Loop:
    """A motion of both ways. counts: m, one of the encoder."""
    t = np.arange(0.0, seconds, 1.0 / RATE)
    setpoint = 0.05 * np.sin(5.0 * t) ** 3 + 0.02 * np.sin(13.0 * t)
    speed = np.gradient(setpoint, t)
    forward = MASS * np.gradient(speed, t) + friction_fed_forward * np.sign(speed)
    omega, each = 2.0 * np.pi * 15.0, 5
    x = v = last = 0.0
    read, back = np.zeros((2, len(t)))
    for k in range(len(t)):
        read[k] = counts * np.round(x / counts)
        rate = speed[k] - (read[k] - last) * RATE
        back[k] = MASS * (omega**2 * (setpoint[k] - read[k]) + 1.4 * omega * rate)
        last = read[k]
        for _ in range(each):
            resists = COULOMB * np.tanh(v / 1e-3) + VISCOUS * v
            v += (forward[k] + back[k] - resists) / MASS / RATE / each
            x += v / RATE / each
    return Loop(t, setpoint, read, forward, back)
