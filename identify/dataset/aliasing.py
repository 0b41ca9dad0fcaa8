"""What of a command's noise a thinned log folds: every n-th sample of a faster controller.

Such a log holds the command of an instant, but the axis moves by all commands in between. What the
controller makes of the noise and the steps of its readings lies at high frequencies: thinning folds
it down to all others, where it looks like force. Of that, the part with which the logged command
answers the logged reading error e is known: a fraction 1 - 1/n of the gain g, so that the residual
holds -e (g (1 - 1/n) - m w^2), and between its two terms the power has a dip that no independent
noises make. The coherence of the two is sqrt(1 - 1/n), whatever machine and controller, and folded
is the same fraction 1 - 1/n of the command's power near the log's Nyquist frequency. Where the log
has the control rate the axis moves by just what was logged, and there is no dip. The rounding of
readings at even speed can make one; but then the readings that were logged tell the whole command.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.dataset.motion import Motion
from identify.dataset.spectrum import densities, pieces_of
from identify.dataset.whittle import levels_with_dip
from twin.signals import Array

TOP = (0.25, 0.45)  # of the sample rate, where a command holds no motion
COHERENT = 0.6  # least coherence: half of the samples left out make 0.71, chance less than 0.55
SHOWN = 0.25  # of the command's power near Nyquist, that the dip must show in the residual
UNTOLD = 1e-3  # of what is folded, in the command beside what readings made of it; from 0.01
LEAST = 0.5  # of that power is folded, where every other sample is left out


def folded(
    motion: Motion, frequency: Array, power: Array, white: Array, bend: Array
) -> tuple[float, float]:
    """White power (N^2/Hz, one-sided) that thinning folded into a force residual; its rel. error.

    Zero where the residual's spectrum shows no dip. frequency (k,): Hz, of the band above the
    effects. power (k,): N^2/Hz, of the residual there. white, bend (k,): power gains of a white
    force and of a reading, N^2/m^2.
    """
    level, coherence = levels_with_dip(white, bend, power)
    if coherence < COHERENT:
        return 0.0, 0.0
    top = _near_nyquist(motion, float(frequency[1] - frequency[0]))
    if level <= SHOWN * float(np.median(top, axis=0).mean() / np.log(2.0)):
        return 0.0, 0.0
    each = top.mean(axis=1)
    level = max(coherence**2, LEAST) * float(each.mean())
    if motion.command_noise <= UNTOLD * level:
        return 0.0, 0.0
    scatter = float(each.std() / each.mean() / np.sqrt(max(len(each) / 2.0, 1.0)))
    return level, scatter


def _near_nyquist(motion: Motion, step: float) -> Array:
    """Power (pieces, k) N^2/Hz of the command as logged near Nyquist, at frequencies a step apart.

    A command that was moved by a part of a sample was interpolated, which weakened what is fast.
    """
    dt, command = motion.sample_period, motion.raw[1]
    segment = min(max(round(1.0 / (step * dt)), 8), len(command))
    turns = np.fft.rfftfreq(segment)
    part = motion.ahead / dt % 1.0
    kept = np.abs(1.0 - part + part * np.exp(2j * np.pi * turns)) ** 2
    top = (turns > TOP[0]) & (turns < TOP[1])
    return np.asarray(densities(_bent(pieces_of(command, segment)), dt)[:, top] / kept[top])


def _bent(pieces: NDArray[np.float64]) -> Array:
    """Pieces (k, n) less the straight line between their ends."""
    along = np.linspace(0.0, 1.0, pieces.shape[1])
    return np.asarray(pieces - pieces[:, :1] - along * (pieces[:, -1:] - pieces[:, :1]))
