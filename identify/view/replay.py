"""What a log measured, what the model makes of its command and what is left, frame by frame."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from identify.dataset.preparation import datasets, is_informative, telling
from identify.dataset.prepared_log import PreparedLog, sticks
from identify.estimation.alignment import aligned
from identify.estimation.force_balance import effect_forces, unbalanced
from identify.validation.free_run import HORIZON, free_run
from twin.errors import InputError
from twin.logs import AxisLog, Log
from twin.model.machine import AxisModel, MachineModel
from twin.model.units import AxisUnits
from twin.parallel import parallel
from twin.signals import Array


@dataclass(frozen=True, eq=False)
class Strip:
    """A signal as lowest and highest value within each frame: (2, n), so that no spike is lost."""

    label: str
    unit: str
    range: Array


@dataclass(frozen=True, eq=False)
class AxisReplay:
    """One axis at the beginning of each frame: (n,) m; NaN where there is none.

    modelled: of the free run. forces: mean (n,) N over each frame, by effect, as it adds to the
    command.
    """

    units: AxisUnits
    measured: Array
    setpoint: Array
    modelled: Array
    forces: Mapping[str, Array] = field(default_factory=dict)
    strips: tuple[Strip, ...] = ()


@dataclass(frozen=True, eq=False)
class Replay:
    """A log as it is shown. rate: frames a second; start: s, of the log, at the first of them.

    machine: with the axes that are shown. horizon: s between restarts of the free run; 0 where
    there is no model. notes: what a reader should know, one sentence each.
    """

    log: str
    machine: MachineModel
    rate: float
    start: float
    axes: Mapping[str, AxisReplay]
    horizon: float = 0.0
    notes: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(next(iter(self.axes.values())).measured)

    @property
    def title(self) -> str:
        """What it is called: machine and log."""
        return ": ".join(dict.fromkeys((self.machine.name, self.log)))

    @property
    def gain(self) -> float:
        """By how much the differences to the measured motion are drawn larger, so as to be seen.

        1, 2 or 5 times a power of ten; of the model where there is one, else of the setpoint.
        """
        for other in ("modelled", "setpoint"):
            ratios = [
                np.ptp(axis.measured) / usual
                for axis in self.axes.values()
                if (usual := _usual(getattr(axis, other) - axis.measured)) > 0.0
            ]
            seen = 0.1  # of the motion: as far as a difference is drawn, 19 times of 20
            if wanted := seen * min(filter(None, ratios), default=0.0):
                power = 10.0 ** np.floor(np.log10(wanted))
                return max(float(power * max(n for n in (1, 2, 5) if n * power <= wanted)), 1.0)
        return 1.0


def _usual(difference: Array) -> float:
    """What nearly all of a difference stays below; 0 where it is not known."""
    known = np.abs(difference[np.isfinite(difference)])
    return float(np.percentile(known, 95)) if len(known) else 0.0


@parallel()
def replay(model: MachineModel | None, log: Log, name: str) -> Replay:
    """A log with what a model makes of it; without one what was measured. Raises InputError."""
    if model is None:
        plain = {a: AxisModel(1.0, rotary=one.kind.rotary) for a, one in log.axes.items()}
        return _replay(MachineModel(name, plain, log.sample_rate), log, name, {})
    shown = [axis for axis in model.axes if axis in log.axes]
    if not shown:
        raise InputError(
            f"{name}: has the axes {', '.join(log.axes)}, the model {', '.join(model.axes)}; "
            "give the model of this machine, or none"
        )
    found = datasets(model, {name: log}, {})
    told = {a: d for a, d in found.items() if is_informative(d, sticks(model.axes[a]))}
    parts = {}
    for axis, dataset in (told or found).items():
        own = model.axes[axis]
        parts[axis] = aligned(own, telling(dataset, sticks(own))).training[0]
    return _replay(model, log, name, parts)


def _replay(model: MachineModel, log: Log, name: str, parts: Mapping[str, PreparedLog]) -> Replay:
    """parts: the log prepared for each axis that is compared; the others are as measured."""
    run = free_run(model, parts) if parts and not model.is_imposed else None
    begun = max((part.motion.left_out for part in parts.values()), default=0)
    lengths = (part.motion.raw.shape[1] + part.motion.left_out for part in parts.values())
    cut = _Cut.of(model, log, begun, min(lengths, default=len(log)))
    axes = {
        axis: _axis(cut, own, log.axes[axis], parts.get(axis), None if run is None else run.error)
        for axis, own in model.axes.items()
        if axis in log.axes
    }
    still = [f"axis {a}: the log has nothing of it to compare" for a in axes if a not in parts]
    notes = still if parts else []
    if parts and run is None:
        notes.append("the motion is imposed, so that the model has none of its own")
    horizon = HORIZON if run else 0.0
    return Replay(name, model, cut.rate, begun * log.period, axes, horizon, tuple(notes))


def _axis(
    cut: _Cut, own: AxisModel, log: AxisLog, part: PreparedLog | None,
    error: Mapping[str, Array] | None,
) -> AxisReplay:  # fmt: skip
    """One axis; part: where it is compared with the model. error: m, of the free run, by axis."""
    units, nothing = log.kind, np.full(cut.count, np.nan)
    setpoint = log.columns.get("setpoint_position")
    wanted = nothing if setpoint is None else setpoint[cut.begun :][: cut.count]
    if part is None:
        position = log.position[cut.begun :][: cut.count]
        missed = Strip("position - setpoint", units.position, cut.range(position - wanted))
        strips = () if setpoint is None else (missed,)
        return AxisReplay(units, cut.at(position), cut.at(wanted), cut.at(nothing), {}, strips)
    position = part.motion.position_at_samples(0.0)[cut.begun - part.motion.left_out :][: cut.count]
    off = nothing if error is None else error[part.motion.axis]
    left = cut.interpolated(part.time, unbalanced(own, [part]))
    unexplained = Strip(f"{units.words('force')} left over", units.force, cut.range(left))
    drift = Strip("model - measured", units.position, cut.range(off))
    added = {
        name: cut.mean(cut.interpolated(part.time, force))
        for name, force in effect_forces(own, [part]).items()
    }
    return AxisReplay(
        units, cut.at(position), cut.at(wanted), cut.at(position + off), added,
        (unexplained,) if error is None else (unexplained, drift),
    )  # fmt: skip


@dataclass(frozen=True, eq=False)
class _Cut:
    """``count`` samples of a log from ``begun`` on, cut into frames: ``first`` sample of each."""

    begun: int
    count: int
    period: float
    rate: float
    first: NDArray[np.int64]

    @classmethod
    def of(cls, machine: MachineModel, log: Log, begun: int, end: int) -> _Cut:
        of_axis = 8  # signals beside the forces, that which was measured twice as exact
        signals = sum(of_axis + len(axis.effects) for axis in machine.axes.values())
        frames = 60.0  # 1/s, what a screen shows
        most_values = 700_000  # of all signals together: 1.9 MB of a page, which has 3 MB at most
        step = max(log.sample_rate / frames, 1.0, (end - begun) * signals / most_values)
        first = np.arange(int(np.ceil((end - begun) / step))) * step
        return cls(begun, end - begun, log.period, log.sample_rate / step, first.astype(np.int64))

    def at(self, signal: Array) -> Array:
        """A signal at the first sample of each frame."""
        return np.asarray(signal[self.first], dtype=float)

    def range(self, signal: Array) -> Array:
        """Lowest and highest value of a signal in each frame, (2, n)."""
        used = signal[: self.count]
        return np.stack([f.reduceat(used, self.first) for f in (np.fmin, np.fmax)])

    def mean(self, signal: Array) -> Array:
        """Mean of a signal over each frame."""
        return np.add.reduceat(signal, self.first) / np.diff([*self.first, self.count])

    def interpolated(self, time: Array, signal: Array) -> Array:
        """A signal at times (s) of the log, at each sample."""
        return np.interp(self.period * (self.begun + np.arange(self.count)), time, signal)
