"""MuJoCo's warnings. Left alone it resets a bad state to zero, goes on, and writes a text file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

import mujoco

from twin.threads import entered_once


@dataclass(frozen=True)
class Warned:
    """A warning: what MuJoCo says, and the simulated time, s."""

    text: str
    time: float


Keep = Callable[[str], None]

_KEEP: ContextVar[Keep | None] = ContextVar("keep", default=None)  # of this thread's simulation


@contextmanager
def collected_warnings(data: mujoco.MjData) -> Iterator[list[Warned]]:
    """The warnings of one simulation while it runs, instead of MUJOCO_LOG.TXT."""
    found: list[Warned] = []

    def keep(text: str) -> None:
        found.append(Warned(" ".join(text.split()), float(data.time)))

    with _handler():
        token = _KEEP.set(keep)
        try:
            yield found
        finally:
            _KEEP.reset(token)


@entered_once
@contextmanager
def _handler() -> Iterator[None]:
    """Hand each warning to the simulation of its thread; MuJoCo has one handler for all.

    One of a thread that simulates nothing of ours goes to the handler that was there before.
    """
    before = mujoco.get_mju_user_warning()

    def hand_on(text: str) -> None:
        keep = _KEEP.get() or before
        if keep is not None:
            keep(text)

    mujoco.set_mju_user_warning(hand_on)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(before)
