"""MuJoCo's warnings. Left alone it resets a bad state to zero, goes on, and writes a text file."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass

import mujoco


@dataclass(frozen=True)
class Warned:
    """A warning: what MuJoCo says, and the simulated time, s."""

    text: str
    time: float


@contextmanager
def collected_warnings(data: mujoco.MjData) -> Iterator[list[Warned]]:
    """The warnings of one simulation while it runs, instead of MUJOCO_LOG.TXT."""
    found: list[Warned] = []
    before = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(
        lambda text: found.append(Warned(" ".join(text.split()), float(data.time)))
    )
    try:
        yield found
    finally:
        mujoco.set_mju_user_warning(before)
