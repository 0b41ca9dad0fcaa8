"""The log in memory: equally spaced samples of some axes, columns with units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from twin.errors import InputError
from twin.model.units import AxisUnits, rotary_unit, units_of

Array = NDArray[np.float64]

FIELDS = (
    "setpoint_position",
    "setpoint_velocity",
    "setpoint_acceleration",
    "position",
    "velocity",
    "current",
    "force",
)
LINEAR_UNITS = dict(zip(FIELDS, ("m", "m/s", "m/s^2", "m", "m/s", "A", "N"), strict=True))
ROTARY_UNITS = {name: rotary_unit(unit) for name, unit in LINEAR_UNITS.items()}


@dataclass(frozen=True)
class AxisLog:
    """Recorded signals of one axis.

    columns: field name -> (n,) samples in SI units; a signal not recorded is absent.
    units: field name -> unit text; force_constant: N/A (N m/A on a rotary axis) or None.
    Sample k of ``position`` is the reading at t_k; sample k of ``force``/``current`` is the
    command held over [t_k, t_k + dt).
    """

    columns: Mapping[str, Array]
    units: Mapping[str, str] = field(default_factory=lambda: LINEAR_UNITS)
    force_constant: float | None = None

    def __len__(self) -> int:
        return len(next(iter(self.columns.values())))

    @property
    def kind(self) -> AxisUnits:
        """The units of a linear or of a rotary axis, whichever the log states."""
        return units_of(self.units.get("position"))

    @property
    def position(self) -> Array:
        """(n,) encoder reading in m."""
        return self.columns["position"]

    @property
    def force(self) -> Array:
        """(n,) commanded actuator force in N: recorded, or force constant x current.

        Raises InputError where neither is possible.
        """
        if "force" in self.columns:
            return self.columns["force"]
        if self.force_constant is None:
            raise InputError(
                f"the log has current (A) but no force and no force constant ({self.kind('N/A')}); "
                "give force_constant in the axis' channel metadata or in the import map"
            )
        return self.force_constant * self.columns["current"]


@dataclass(frozen=True)
class Log:
    """One log: ``axes`` by name ("x", "y"), sampled at ``sample_rate`` (Hz) from t = 0.

    truth: axis -> column name -> (n,) array, simulation only; identification never reads it.
    metadata: the MCAP metadata record "twin"; attachments: file name -> bytes.
    """

    sample_rate: float
    axes: Mapping[str, AxisLog]
    metadata: Mapping[str, str] = field(default_factory=dict)
    truth: Mapping[str, Mapping[str, Array]] = field(default_factory=dict)
    attachments: Mapping[str, bytes] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(next(iter(self.axes.values())))

    @property
    def period(self) -> float:
        """Sample period in s."""
        return 1.0 / self.sample_rate

    @property
    def time(self) -> Array:
        """(n,) sample times in s."""
        return np.arange(len(self)) / self.sample_rate
