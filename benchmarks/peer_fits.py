"""Fits against mujoco.sysid on the same logs, from a start 50 % off.

The logs have noise, and positions between the peer's own steps, as those of a machine have. On
noiseless logs of its own steps the peer's scaled solver is exact; its default solver is wrong there
as well.
"""

from __future__ import annotations

import numpy as np

from benchmarks import sysid_fit
from benchmarks.figures import Figure, Target
from benchmarks.slides import DURATION, Recording, Slide, damped_slide, lugre_slide, record
from benchmarks.sysid_fit import DEFAULT, SCALED, Peer, fit_with_sysid
from benchmarks.timing import Array, interleaved
from identify import workflow
from twin.model.parameters import read

TITLE = f"Fits against mujoco.sysid: {DURATION:g} s at 10 kHz, start 50 % off"
START = 0.5  # of the true values
FASTER = Target(low=20.0)
RIGHT = Target(high=0.05)
AS_GOOD = Target(high=1.0)
ROUNDS = 3  # before the peer's fit, and again after it


def measure() -> list[Figure]:
    """Times and largest parameter errors of both, for two parameters and for LuGre."""
    if not sysid_fit.available():
        return [Figure("mujoco.sysid", None, note="its extras are absent: pip install '.[bench]'")]
    damped, lugre = damped_slide(), lugre_slide()
    motion = record(lugre)
    return [
        *_against(DEFAULT, damped, record(damped)),
        *_against(DEFAULT, lugre, motion),
        *_against(SCALED, lugre, motion),
    ]


def _against(peer: Peer, slide: Slide, motion: Recording) -> list[Figure]:
    start = START * slide.true
    found: list[Array] = []

    def fit() -> None:
        result = workflow.fit(slide.model(start), {"log": motion.log})
        found.append(read(result.model.axes["x"], slide.where))

    before = interleaved([fit], ROUNDS)
    theirs = fit_with_sysid(peer, slide, motion, start)
    seconds = float(np.median([before, interleaved([fit], ROUNDS)]))
    error, their_error = slide.largest_error(found[-1]), slide.largest_error(theirs.values)
    stopped = ", where it was stopped" if theirs.stopped else ""
    return [
        Figure(
            f"{slide.name}: times faster than {peer.name}", theirs.seconds / seconds, "1", FASTER,
            f"{seconds:.3f} s against {theirs.seconds:.1f} s{stopped}",
        ),
        Figure(f"{slide.name}: our largest parameter error", error, "1", RIGHT),
        Figure(
            f"{slide.name}: our largest parameter error over that of {peer.name}",
            error / their_error, "1", AS_GOOD, f"{error:.2%} against {their_error:.2%}",
        ),
    ]  # fmt: skip
