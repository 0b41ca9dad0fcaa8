"""The proof of an import map: what its signals are, seen as a mass that a force moves."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from identify.analysis.first_model import values_of
from identify.analysis.first_values import FirstValues
from twin.importers.proposal.doubts import motion_of_force
from twin.importers.proposal.motion import Explained
from twin.logs import Log
from twin.model.units import AxisUnits


@dataclass(frozen=True)
class MapProof:
    """motion: what it explains of the force. values: None where they are not told. units: of both.

    has_force: whether there is a force, or a current with its force constant.
    """

    motion: Explained
    values: FirstValues | None
    units: AxisUnits
    has_force: bool

    @property
    def mass(self) -> float | None:
        """The moved mass, kg (kg m^2); None where it is not told."""
        return None if self.values is None else self.values.mass


def proofs_of(log: Log) -> Mapping[str, MapProof]:
    """The proof of each axis that has a position and a force or current."""
    out = {}
    for name, axis in log.axes.items():
        motion = motion_of_force(axis)
        if motion is not None:
            has_force = "force" in axis.columns or axis.force_constant is not None
            out[name] = MapProof(motion, values_of(log, name) if has_force else None, axis.kind,
                                 has_force)  # fmt: skip
    return out
