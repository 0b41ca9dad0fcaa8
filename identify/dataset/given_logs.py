"""The logs as they are given: their roles, and what is refused of them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import combinations

import numpy as np

from identify.dataset.dataset import Role
from identify.dataset.motion import SHORTEST_LOG, other_axes, shortest_log
from twin.checks import moves
from twin.checks.copies import copies
from twin.effect import MOST
from twin.errors import InputError
from twin.logs import LINEAR_UNITS, Log
from twin.model.machine import AxisModel
from twin.signals import Array
from twin.telling import tell

Given = Mapping[Role, Mapping[str, Log]]  # logs by name

READ_IF_LOGGED = ("velocity", "setpoint_position")


def apart(given: Given) -> tuple[Given, dict[str, str]]:
    """The logs less those that are copies of another of their role, and why these are left out.

    Fitted or tested on twice, a recording would count as two. Of logs of one role that share a part
    each has something of its own: both stay, and it is told. Raises InputError where logs of two
    roles are one recording, or share a part, as it cannot test what it decided; and where they have
    one name, by which each is told from then on.
    """
    _require_names(given)
    roles = {name: role for role, logs in given.items() for name in logs}
    left_out: dict[str, str] = {}
    for copy in copies({name: log for logs in given.values() for name, log in logs.items()}):
        names = sorted((copy.original, copy.copy), key=lambda name: [*Role].index(roles[name]))
        busy, free = (roles[name] for name in names)
        if busy is not free:
            tester = "it" if names[1] == copy.copy else names[1]
            raise InputError(
                f"{copy.copy} is {copy}: as a {free.value} log {tester} proves nothing; give "
                "another recording"
            )
        if copy.is_complete:
            left_out[copy.copy] = f"it is {copy}, and would count twice"
        else:
            tell(f"{copy.copy}: is {copy}, which counts twice; cut it off")
    kept = {
        role: {name: log for name, log in logs.items() if name not in left_out}
        for role, logs in given.items()
    }
    return kept, left_out


def _require_names(given: Given) -> None:
    """Raise InputError where two logs of different roles have one name."""
    for busy, free in combinations(Role, 2):
        for name in given[busy].keys() & given[free].keys():
            raise InputError(
                f"{name}: the name of a {busy.value} log and of a {free.value} log; give each log "
                "one role, and a name of its own"
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


def require_channels(logs: Mapping[str, Log], name: str, axis: AxisModel) -> None:
    """Raise InputError where a law of an axis reads what a log does not hold of it."""
    read = {f.effect.name: f.effect.channels[0] for f in axis.effects if f.effect.channels}
    for log_name, log in logs.items():
        for law, field in read.items():
            if name in log.axes and field not in log.axes[name].columns:
                raise InputError(
                    f"{log_name}: has no {field} of axis {name}, which {law} reads; import it, as "
                    f"{field} ({LINEAR_UNITS[field]}) of the axis, or remove {law}"
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


def none_informative(
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
    if (most := float(np.abs(values).max(initial=0.0))) > MOST:
        raise InputError(
            f"{name}: {signal} of axis {axis} reaches {most:.3g}, as of no machine; did a "
            "simulation diverge? give another log"
        )
