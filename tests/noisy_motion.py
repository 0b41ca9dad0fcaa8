"""An exact motion with white noise of known sizes on its force and its place."""

import numpy as np
from constructed import log_of, waves, windowed

from identify.dataset.motion import motion_of

RATE, MASS = 4000.0, 1.7
PLACE = waves((0.03, 1.3, 0.4), (0.004, 3.1, 1.0))
PUSH = waves((-0.03 * (2.6 * np.pi) ** 2, 1.3, 0.4), (-0.004 * (6.2 * np.pi) ** 2, 3.1, 1.0))


def noisy(seed: int, force: float, reading: float = 0.0, duration: float = 8.0, length=0.04):
    """An exact motion, with white noise of these sizes (N, m rms) on the logged force and place."""
    rng = np.random.default_rng(seed)
    t = np.arange(round(duration * RATE)) / RATE
    u = MASS * PUSH(t + 0.5 / RATE) + rng.normal(0.0, force, len(t))
    x = PLACE(t) + rng.normal(0.0, reading, len(t))
    return windowed(motion_of(log_of(RATE, x, u), "x", f"log {seed}", ripples=()), length)
