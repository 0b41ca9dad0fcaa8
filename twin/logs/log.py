"""The log in memory: equally spaced samples of some axes, columns with units."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from html import escape

import numpy as np
from numpy.typing import ArrayLike, NDArray

from twin.errors import InputError
from twin.model.units import AxisUnits, rotary_unit, units_of

Array = NDArray[np.float64]

LINEAR_UNITS = {
    "setpoint_position": "m",
    "setpoint_velocity": "m/s",
    "setpoint_acceleration": "m/s^2",
    "position": "m",
    "velocity": "m/s",
    "current": "A",
    "force": "N",
    "pressure": "Pa",
    "pressure_2": "Pa",
    "temperature": "K",
}
FIELDS = tuple(LINEAR_UNITS)
HELD = ("current", "force")  # held over a sample, so that their mean acts; all others are readings
ROTARY_UNITS = {name: rotary_unit(unit) for name, unit in LINEAR_UNITS.items()}


def _same(one: Mapping[str, Array], other: Mapping[str, Array]) -> bool:
    """Whether columns (n,) of the same names hold the same values."""
    return one.keys() == other.keys() and all(np.array_equal(one[n], other[n]) for n in one)


@dataclass(frozen=True, eq=False)
class AxisLog:
    """Recorded signals of one axis.

    columns: field name -> (n,) samples in SI units; a signal not recorded is absent.
    units: field name -> unit text; force_constant: N/A (N m/A on a rotary axis) or None.
    Sample k of ``position`` is the reading at t_k; sample k of ``force``/``current`` is the
    command held over [t_k, t_k + dt).

    Raises InputError for columns of different length or that are no numbers, and for units that
    are not SI or not all of a linear, or of a rotary, axis.
    """

    columns: Mapping[str, Array]
    units: Mapping[str, str] = field(default_factory=lambda: LINEAR_UNITS)
    force_constant: float | None = None

    def __post_init__(self) -> None:
        columns = {name: _column(name, column) for name, column in self.columns.items()}
        _require_one_length({name: len(column) for name, column in columns.items()}, "columns")
        object.__setattr__(self, "columns", columns)
        complete_units({n: u for n, u in self.units.items() if n in FIELDS})

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, AxisLog):
            return NotImplemented
        mine, its = ((dict(a.units), a.force_constant) for a in (self, other))
        return mine == its and _same(self.columns, other.columns)

    __hash__ = None  # type: ignore[assignment]  # it holds arrays

    def __len__(self) -> int:
        return len(next(iter(self.columns.values()), ()))

    def __repr__(self) -> str:
        signals = ", ".join(f"{n} ({self.units.get(n, '?')})" for n in self.columns)
        return f"<AxisLog of {len(self)} samples: {signals or 'no signals'}>"

    @property
    def kind(self) -> AxisUnits:
        """The units of a linear or of a rotary axis, whichever the log states."""
        return units_of(self.units.get("position"))

    def unit(self, field: str) -> str:
        """The unit of a field: the stated one, else that of such an axis."""
        return self.units.get(field) or (ROTARY_UNITS if self.kind.rotary else LINEAR_UNITS)[field]

    @property
    def position(self) -> Array:
        """(n,) encoder reading in m. Raises InputError where there is none."""
        if "position" not in self.columns:
            has = ", ".join(self.columns) or "nothing"
            raise InputError(f"the log has no position of an axis, but {has}; record the encoder")
        return self.columns["position"]

    @property
    def force(self) -> Array:
        """(n,) commanded force in N: recorded, or force constant x current. Raises InputError."""
        if "force" in self.columns:
            return self.columns["force"]
        if "current" not in self.columns:
            has = ", ".join(self.columns) or "nothing"
            raise InputError(
                f"the log has neither force nor current of an axis, but {has}; record one of them"
            )
        if self.force_constant is None:
            raise InputError(
                f"the log has current (A) but no force and no force constant ({self.kind('N/A')}); "
                "give force_constant in the axis' channel metadata or in the import map"
            )
        return self.force_constant * self.columns["current"]


def _column(name: str, given: ArrayLike) -> Array:
    """Samples (n,) as numbers, of an array, a list or a column of another library."""
    try:
        column = np.asarray(given)
        column = column if column.dtype.kind in "USMmc" else column.astype(float, copy=False)
    except (TypeError, ValueError):
        column = np.empty((0, 0))
    if column.ndim != 1 or column.dtype != np.float64:
        shown = " ".join(f"{given!s:.60}".split())
        raise InputError(f"{name} is no column of numbers ({shown}); give one number a sample")
    return column


def _require_one_length(lengths: Mapping[str, int], of: str) -> None:
    """Raise InputError where there are several."""
    if len({*lengths.values()}) > 1:
        told = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise InputError(f"the {of} differ in length ({told} samples); record all with one clock")


def complete_units(stated: Mapping[str, str]) -> dict[str, str]:
    """Units of all fields from those stated.

    Raises InputError for one that is not SI, and for those of two kinds of axis.
    """
    for name, unit in stated.items():
        if unit not in (LINEAR_UNITS[name], ROTARY_UNITS[name]):
            allowed = " or ".join(dict.fromkeys((LINEAR_UNITS[name], ROTARY_UNITS[name])))
            raise InputError(
                f"unit of {name} is {unit!r}, allowed is {allowed}; convert it with: twin import"
            )
    turning = {n: u for n, u in stated.items() if u != LINEAR_UNITS[n]}
    linear = {n: u for n, u in stated.items() if u != ROTARY_UNITS[n]}
    if turning and linear:
        told = ", ".join(f"{name} in {unit}" for name, unit in {**turning, **linear}.items())
        raise InputError(
            f"{told}: units of a rotary and of a linear axis together; convert all to one kind "
            "with: twin import"
        )
    return {**(ROTARY_UNITS if turning else LINEAR_UNITS), **stated}


@dataclass(frozen=True, eq=False)
class Log:
    """One log: ``axes`` by name ("x", "y"), sampled at ``sample_rate`` (Hz) from t = 0.

    truth: axis -> column name -> (n,) array, simulation only; identification never reads it.
    metadata: the MCAP metadata record "twin"; attachments: file name -> bytes.

    Raises InputError for a rate that is no number above 0, and for axes of different length.
    """

    sample_rate: float
    axes: Mapping[str, AxisLog]
    metadata: Mapping[str, str] = field(default_factory=dict)
    truth: Mapping[str, Mapping[str, Array]] = field(default_factory=dict)
    attachments: Mapping[str, bytes] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not 0.0 < self.sample_rate < np.inf:
            raise InputError(f"sample_rate is {self.sample_rate} Hz; give a number above 0")
        _require_one_length({name: len(axis) for name, axis in self.axes.items()}, "axes")

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Log):
            return NotImplemented
        every = ("sample_rate", "axes", "metadata", "attachments")
        same = all(getattr(self, name) == getattr(other, name) for name in every)
        truth = self.truth.keys() == other.truth.keys()
        return same and truth and all(_same(self.truth[a], other.truth[a]) for a in self.truth)

    __hash__ = None  # type: ignore[assignment]  # it holds arrays

    def __len__(self) -> int:
        return len(next(iter(self.axes.values()), ()))

    def __repr__(self) -> str:
        axes = "; ".join(f"{name}: {', '.join(a.columns)}" for name, a in self.axes.items())
        seconds = len(self) * self.period
        return f"<Log of {seconds:.4g} s at {self.sample_rate:g} Hz, {axes or 'no axes'}>"

    def _repr_html_(self) -> str:
        """In a notebook: the range of each signal."""
        rows = "".join(
            f"<tr><td>{escape(name)}</td><td>{escape(signal)}</td>"
            f"<td>{escape(axis.units.get(signal, ''))}</td>"
            f"<td>{np.fmin.reduce(c):.4g}</td><td>{np.fmax.reduce(c):.4g}</td></tr>\n"
            for name, axis in self.axes.items()
            for signal, c in axis.columns.items()
            if len(c)
        )
        titles = "".join(f"<th>{t}</th>" for t in ("axis", "signal", "unit", "least", "most"))
        extent = f"{len(self) * self.period:.4g} s at {self.sample_rate:g} Hz"
        return f"<p>{extent}</p>\n<table>\n<tr>{titles}</tr>\n{rows}</table>"

    def table(self) -> dict[str, Array]:
        """Columns (n,) by signal and unit, as "x position [m]", the time first; for pandas, say."""
        signals = {
            f"{name} {signal} [{axis.unit(signal)}]": column
            for name, axis in self.axes.items()
            for signal, column in axis.columns.items()
        }
        return {"time [s]": self.time, **signals}

    def part(self, first: int, stop: int) -> Log:
        """Its samples from number ``first`` to before ``stop``."""
        return self.changed(lambda name, column: column[first:stop])

    def changed(self, change: Callable[[str, Array], Array]) -> Log:
        """The same with other columns: ``change`` makes them of a signal's name and its column."""
        axes = {
            name: replace(axis, columns={f: change(f, c) for f, c in axis.columns.items()})
            for name, axis in self.axes.items()
        }
        truth = {a: {f: change(f, c) for f, c in own.items()} for a, own in self.truth.items()}
        return replace(self, axes=axes, truth=truth)

    def copied(self) -> Log:
        """The same in memory of its own, where it is a small part of a large log."""
        return joined([self.part(0, 0), self])

    def with_fields(self, fields: Sequence[str]) -> Log:
        """The same with the signals of these names alone, without truth and attachments."""
        axes = {
            name: replace(axis, columns={f: c for f, c in axis.columns.items() if f in fields})
            for name, axis in self.axes.items()
        }
        return replace(self, axes=axes, truth={}, attachments={})

    @property
    def period(self) -> float:
        """Sample period in s."""
        return 1.0 / self.sample_rate

    @property
    def time(self) -> Array:
        """(n,) sample times in s."""
        return np.arange(len(self)) / self.sample_rate


def joined(parts: Iterable[Log]) -> Log:
    """One log of parts that follow each other without a gap, which all have the same columns."""
    first, *others = parts
    if not others:
        return first

    def one_after_the_other(columns: Iterable[Mapping[str, Array]]) -> dict[str, Array]:
        head, *more = columns
        return {name: np.concatenate([c, *(m[name] for m in more)]) for name, c in head.items()}

    logs = [first, *others]
    axes = {
        name: replace(axis, columns=one_after_the_other(log.axes[name].columns for log in logs))
        for name, axis in first.axes.items()
    }
    truth = {name: one_after_the_other(log.truth[name] for log in logs) for name in first.truth}
    return replace(first, axes=axes, truth=truth)


def in_multiples(parts: Iterable[Log], count: int) -> Iterator[Log]:
    """Parts that follow each other, as parts of a multiple of ``count``; the last has the rest."""
    held: Log | None = None
    for part in parts:
        whole = part if held is None else joined([held, part])
        stop = len(whole) // count * count
        if stop:
            yield whole.part(0, stop)
        held = whole.part(stop, len(whole)).copied()
    if held is not None and len(held):
        yield held


def thinned(log: Log, every: int) -> Log:
    """The log at 1/``every`` of its rate, less samples that do not fill a last step.

    It is the log that a slower recorder would have written: position, velocity and setpoint at the
    first of each ``every`` samples, current and force as means over them. Truth is left out.
    """
    measured = replace(log, sample_rate=log.sample_rate / every, truth={})
    if every == 1:
        return measured
    count = len(log) // every * every

    def fewer(field: str, column: Array) -> Array:
        kept = column[:count].reshape(-1, every)
        return kept.mean(axis=1) if field in HELD else kept[:, 0].copy()

    return measured.changed(fewer)
