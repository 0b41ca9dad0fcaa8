"""Channels beside the motion of an axis and its force: pressures of chambers, a temperature."""

from __future__ import annotations

import numpy as np

from twin.importers.proposal.courses import TableColumn
from twin.importers.proposal.lexicon import Quantity, SignalRole
from twin.importers.proposal.names import Name
from twin.importers.proposal.signals import Certainty, File, ProposedAxis, Signal

FIELDS = {
    Quantity.PRESSURE: ("pressure", "pressure_2"),
    Quantity.TEMPERATURE: ("temperature",),
}
SI = {"pressure": "Pa", "pressure_2": "Pa", "temperature": "K"}


def with_channels(file: File, axis: ProposedAxis) -> ProposedAxis:
    """The axis with the pressures and the temperature that names tell, as many as a log holds."""
    for quantity, fields in FIELDS.items():
        measured = [n for n in file.some(axis.free, quantity) if _is_measured(n)]
        several = f", the first of {len(measured)}" if len(measured) > len(fields) else ""
        for field, name in zip(fields, measured, strict=False):
            sure = Certainty.LIKELY if several else Certainty.SURE
            axis = axis.having(Signal(field, name, sure, (f"so called{several}",)))
    return axis


def _is_measured(name: Name) -> bool:
    return name.role not in (SignalRole.ASKED, SignalRole.PART)


def channel_unit(signal: Signal, column: TableColumn) -> tuple[str, bool]:
    """The unit of a pressure or temperature, and whether its name states it."""
    if signal.name.unit is not None:
        return signal.name.unit, True
    most = float(np.abs(column.values).max())
    if SI[signal.field] == "K":
        hottest = 200.0  # degC, of anything on an axis; absolute temperatures are above it
        return ("K" if column.values.min() > hottest else "degC"), False
    highest = 1000.0  # bar, of any cylinder
    return ("bar" if most < highest else "Pa"), False
