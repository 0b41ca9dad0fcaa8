"""The logs as they are given: their roles, and what is refused of them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np

from identify.dataset.dataset import Role
from identify.dataset.motion import SHORTEST_LOG, other_axes, shortest_log
from twin.checks import moves
from twin.errors import InputError
from twin.logs import AxisLog, Log
from twin.model.machine import AxisModel
from twin.signals import Array

Given = Mapping[Role, Mapping[str, Log]]  # logs by name


WINDOWS = 8  # of the shorter of two logs, evenly spaced, that are sought in the longer one
READ_IF_LOGGED = ("velocity", "setpoint_position")
BUSY = {Role.TRAINING: "is fitted", Role.SELECTION: "chooses effects"}


def require_apart(given: Given) -> None:
    """Raise InputError where a log that is to test a fit has samples that took part in it.

    Also where two of different roles have one name, by which each is told from then on.
    """
    for busy, free in combinations(Role, 2):
        for name in given[busy].keys() & given[free].keys():
            raise InputError(
                f"{name}: the name of a {busy.value} log and of a {free.value} log; give each log "
                "one role, and a name of its own"
            )
        for held, other in given[free].items():
            for name, log in given[busy].items():
                if share_samples(log, other):
                    what = "held out" if free is Role.SELECTION else "a test log"
                    raise InputError(
                        f"{held}: {what}, but has samples of {name}, which {BUSY[busy]}, "
                        "and so cannot test the fit; give a log of another experiment"
                    )


def require_samples(logs: Mapping[str, Log]) -> None:
    """Raise InputError where a log holds none."""
    for name, log in logs.items():
        if not log.axes or not len(log):
            raise InputError(
                f"{name}: has no samples; identification needs {SHORTEST_LOG:g} s in which an axis "
                "moves; give another log"
            )


def require_one_kind(logs: Mapping[str, Log], name: str, axis: AxisModel) -> None:
    """Raise InputError where an axis is rotary in a log and linear in the model, or vice versa."""
    units = axis.units
    for log_name, log in logs.items():
        if name in log.axes and (logged := log.axes[name].kind) != units:
            raise InputError(
                f"{log_name}: axis {name} is {logged.kind} (position in {logged.position}), but in "
                f"the model it is {units.kind} (position in {units.position}); give the model "
                f"{logged.mass_name} in {logged.mass}, or correct the units in the import map"
            )


def is_driven(axis: AxisModel | None) -> bool:
    """Whether an axis, None where nothing is known of it, tells its mass by a force alone."""
    return axis is None or axis.is_imposed or not axis.mass_fixed


def shortness(log: Log) -> str | None:
    """That a log is too short for any motion to be told by it; None where it is not."""
    least = shortest_log(log.period)
    if len(log) * log.period >= least:
        return None
    return (
        f"it lasts {len(log) * log.period:.3g} s, and identification needs {least:.3g} s at "
        f"{log.sample_rate:g} Hz; give a longer one"
    )


def silence(log: Log, axis: str, *, driven: bool = True) -> str | None:
    """Why a log says nothing of one of its axes, and what to give; None where it says something.

    driven: whether there must be a force, without which no mass shows; of a mass that is held a
    motion without force shows the friction.
    """
    if short := shortness(log):
        return short
    if not moves(log, axis):
        return f"axis {axis} stands still in it; give one in which it moves"
    if driven and not log.axes[axis].force.any():
        units = log.axes[axis].kind
        return (
            f"the {units.words('force')} of axis {axis} is 0 {units.force} throughout; give one "
            f"with that channel connected, or hold the {units.mass_name} (fixed) where the axis "
            "coasts"
        )
    return None


def telling_in(
    logs: Mapping[str, Log], axis: str, machine: Sequence[str] = (), *, driven: bool = True
) -> tuple[dict[str, Log], dict[str, str]]:
    """The logs that say something of an axis, by name, and why others that hold it say nothing.

    machine: the axes of the machine. driven: as ``silence`` has it. Raises InputError where what is
    read is not a number.
    """
    held = {name: log for name, log in logs.items() if axis in log.axes}
    for name, log in held.items():
        _require_numbers(name, log, axis, "position", log.axes[axis].position)
    why = {name: silence(log, axis, driven=driven) for name, log in held.items()}
    going = {name: log for name, log in held.items() if why[name] is None}
    for name, log in going.items():
        _require_numbers(name, log, axis, "force", log.axes[axis].force)
        for signal in filter(log.axes[axis].columns.__contains__, READ_IF_LOGGED):
            _require_numbers(name, log, axis, signal, log.axes[axis].columns[signal])
        for other in other_axes(log, axis, machine):
            _require_numbers(name, log, other, "position", log.axes[other].position)
    return going, {name: reason for name, reason in why.items() if reason is not None}


def require_moving(axis: str, moving: Collection[str]) -> None:
    """Raise InputError unless an axis is among those that move in the logs."""
    if axis not in moving:
        raise InputError(f"axis {axis} does not move in the logs; give a log in which it does")


def nothing_told(
    axes: Collection[str], logs: Collection[Log], silent: Iterable[Mapping[str, str]]
) -> InputError:
    """Why no training log says anything of an axis of a model, and what to do.

    silent: of each axis of the model why logs say nothing of it, by name.
    """
    known = sorted({a for log in logs for a in log.axes})
    names = ", ".join(axes)
    if not set(axes) & set(known):
        return InputError(
            f"no axis of the model ({names}) is in the logs, which have {', '.join(known)}; name "
            "the axes alike"
        )
    first, *others = (f"{name}: {why}" for own in silent for name, why in own.items())
    more = f" ({len(others)} more say nothing either)" if others else ""
    return InputError(f"no training log says anything of axis {names}; {first}{more}")


def _require_numbers(name: str, log: Log, axis: str, signal: str, values: Array) -> None:
    """Raise InputError where a signal (n,) is not a number somewhere."""
    bad = np.flatnonzero(~np.isfinite(values))
    if len(bad):
        raise InputError(
            f"{name}: {signal} of axis {axis} is not a finite number in {len(bad)} of {len(log)} "
            f"samples, from {bad[0] * log.period:.6g} s; cut the log there, or give another"
        )


def share_samples(one: Log, other: Log) -> bool:
    """Whether a stretch of one log, in which an axis moves, is in the other sample by sample.

    Be it at another place in each. Of distinct runs not even the same program and a coarse encoder
    give the same readings and commands for long while an axis moves. At rest they may, so that
    windows with motion are compared. A log of an axis at rest, with the noise of its encoder, is
    not used for that axis.
    """
    shorter, longer = sorted((one, other), key=len)
    return any(
        _share(shorter.axes[axis], longer.axes[axis]) and moves(shorter, axis)
        for axis in shorter.axes
        if axis in longer.axes
    )


def _share(shorter: AxisLog, longer: AxisLog) -> bool:
    """The same of one axis."""
    both = shorter.columns.keys() & longer.columns.keys()
    command = next((name for name in ("force", "current") if name in both), None)
    if command is None:
        return False
    sought, given = ((signals.position, signals.columns[command]) for signals in (shorter, longer))
    return any(
        _is_in((sought[0][window], sought[1][window]), moving - window.start, given)
        for window, moving in _with_motion(shorter.position)
    )


def _with_motion(position: Array) -> Iterator[tuple[slice, int]]:
    """Windows of positions (n,) m in which the axis moves, and a sample of each at which it does.

    They are as long as the motion asks for, but a part of the log at least.
    """
    span, least = float(np.ptp(position)), len(position) // WINDOWS
    if not 0.0 < span < np.inf:
        return
    # 1000 cells, into which the range of positions is divided
    entered = np.flatnonzero(np.diff(np.floor(position * (1000.0 / span)))) + 1
    starts = np.linspace(0, len(position) - least, WINDOWS).astype(int)
    ends = np.searchsorted(entered, starts) + 32 - 1  # of which so many are entered within a window
    for start, end in zip(starts, ends, strict=True):
        if end < len(entered):
            moving = int(entered[end])
            yield slice(int(start), max(int(start) + least, moving + 1)), moving


def _is_in(window: tuple[Array, Array], moving: int, signals: tuple[Array, Array]) -> bool:
    """Whether position and command of a window are somewhere in longer signals.

    moving: number of a sample at which it moves, which so is at few places of the signals.
    """
    n = len(window[0])
    begins = np.flatnonzero(signals[0] == window[0][moving]) - moving
    begins = begins[(begins >= 0) & (begins + n <= len(signals[0]))]
    for k in (moving, *np.linspace(0, n - 1, WINDOWS).astype(int)):  # before all are compared
        for values, wanted in zip(signals, window, strict=True):
            begins = begins[values[begins + k] == wanted[k]]
    return any(
        all(np.array_equal(s[b : b + n], w) for s, w in zip(signals, window, strict=True))
        for b in begins
    )
