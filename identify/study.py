"""The logs of one axis, ready for identification: those to fit on and those held out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from identify.motion import Motion, excitation, motion_of
from identify.noise import noise_floor
from identify.residual import Windowed
from identify.weak import LEAST_BLOCKS, Window
from twin.effect import Excitation
from twin.errors import InputError
from twin.log import Log
from twin.model import AxisModel, StageModel

Array = NDArray[np.float64]

WINDOWS = (0.02, 0.05, 0.1, 0.2)  # s, tried in this order
TRIED = 12.0  # s of motion on which the shapes of an effect are tried before all of it is used
SHORTEST_HEAD = 3.0  # s of each log
QUIET = 0.01  # noise floor wanted, as a part of the force that the inertia does not explain


@dataclass(frozen=True, eq=False)
class Study:
    """One axis: windowed fit logs, windowed held-out logs (may be none), and the motion covered.

    shift: s, by which the logs' force was moved ahead to where it acted.
    """

    axis: str
    fit: tuple[Windowed, ...]
    holdout: tuple[Windowed, ...]
    excitation: Excitation
    shift: float = 0.0

    @cached_property
    def heads(self) -> tuple[Windowed, ...]:
        """The beginnings of the fit logs, together long enough to try shapes on."""
        each = max(TRIED / len(self.fit), SHORTEST_HEAD)
        return tuple(Windowed.of(w.motion.head(each), w.window.length) for w in self.fit)

    @cached_property
    def in_heads(self) -> NDArray[np.bool_]:
        """Which windows of the fit logs are in their heads."""
        pairs = zip(self.heads, self.fit, strict=True)
        return np.concatenate([np.arange(len(w)) < len(h) for h, w in pairs])

    @property
    def window(self) -> float:
        """Window length in s."""
        return self.fit[0].window.length


def studies(
    model: StageModel,
    logs: Mapping[str, Log],
    holdout: Mapping[str, Log],
    window: float | None = None,
) -> dict[str, Study]:
    """A study for each axis of the model that the logs hold and in which it moves.

    logs, holdout: by name, for messages. window: length in s; chosen from the noise where None.
    Raises InputError where no axis of the model moves in any log.
    """
    out: dict[str, Study] = {}
    for name, axis in model.axes.items():
        fit = _moving(logs, name)
        if not fit:
            continue
        held = _moving(holdout, name)
        length = window or choose_window(fit, held)
        out[name] = Study(
            axis=name,
            fit=tuple(Windowed.of(m, length) for m in fit),
            holdout=tuple(Windowed.of(m, length) for m in held),
            excitation=excitation(fit, axis.hardware.travel),
        )
    if not out:
        known = sorted({a for log in logs.values() for a in log.axes})
        raise InputError(
            f"no axis of the model ({', '.join(model.axes)}) moves in the logs, which have "
            f"{', '.join(known)}; name the axes alike, or give a log in which one moves"
        )
    return out


def _moving(logs: Mapping[str, Log], axis: str) -> list[Motion]:
    return [
        motion_of(log, axis, name)
        for name, log in logs.items()
        if axis in log.axes and travels(log, axis)
    ]


def travels(log: Log, axis: str) -> bool:
    """Whether the axis moves by more than a hundred times its noise in this log."""
    position = log.axes[axis].position
    noise = np.median(np.abs(np.diff(position))) + 1e-12
    return bool(np.ptp(position) > 100.0 * noise or _one_way(position))


def _one_way(position: Array) -> bool:
    steps = np.diff(position)
    return bool(np.abs(steps.sum()) > 0.5 * np.abs(steps).sum() > 0)


def choose_window(motions: Sequence[Motion], others: Sequence[Motion] = ()) -> float:
    """The shortest window (s) whose noise floor is small against what is to be explained.

    others: motions that it must suit as well, by the length of their blocks.
    """
    mass = inertia(motions)
    longest_block = max(m.period for m in (*motions, *others))
    for length in WINDOWS:
        if length < LEAST_BLOCKS * longest_block:
            continue
        windows = [Window.of_length(length, m.period) for m in motions]
        rest = np.concatenate(
            [
                w.mean(m.command) - mass * w.acceleration(m.velocity)
                for m, w in zip(motions, windows, strict=True)
            ]
        )
        floor = noise_floor(AxisModel(mass), list(zip(motions, windows, strict=True)))
        if floor < QUIET * np.sqrt(np.mean(rest**2)):
            return length
    return WINDOWS[-1]


def inertia(motions: Sequence[Motion], length: float = 0.1) -> float:
    """Rough moved mass (kg): command regressed on acceleration, direction and speed."""
    rows, forces = [], []
    for m in motions:
        w = Window.of_length(length, m.period)
        direction = w.mean(np.sign(m.velocity))
        rows.append(
            np.stack(
                [w.acceleration(m.velocity), direction, w.mean(m.velocity), np.ones_like(direction)]
            )
        )
        forces.append(w.mean(m.command))
    solution = np.linalg.lstsq(np.hstack(rows).T, np.concatenate(forces), rcond=None)[0]
    return float(max(solution[0], 1e-6))
