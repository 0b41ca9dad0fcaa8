"""The result of ``frequency_response``: what logs show of each axis, and what a model makes."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from io import BytesIO
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identify.frequency.of_logs import AxisFrequency, Shown
from identify.printed import Printed, figure_of, hooked
from twin.errors import InputError
from twin.files import write_atomically
from twin.signals import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

COLUMNS = {
    "frequency": "Hz", "real": "m/N", "imaginary": "m/N", "band_90": "m/N", "noise": "m/N",
    "distortion": "m/N", "coherence": "1",
}  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class FrequencyResponse(Printed):
    """The frequency responses of a machine's axes, of force to position."""

    logs: tuple[str, ...]
    axes: Mapping[str, AxisFrequency]

    def plot(self) -> Figure:
        """The Bode diagram of each axis."""
        return hooked(figure_of, self, None, None)

    def to_frd(self, axis: str | None = None) -> Any:
        """The plant of an axis, the first where None, as ``control.FRD`` of python-control.

        In samples, as a digital controller meets it. Raises InputError for an axis that has none,
        ModuleNotFoundError without python-control.
        """
        import control

        name = next(iter(self.axes)) if axis is None else axis
        if name not in self.axes:
            raise InputError(f"axis {name} has no response; give one of {', '.join(self.axes)}")
        found = self.axes[name].measured.response
        return control.FRD(found.plant, 2.0 * np.pi * found.frequency, dt=found.period)

    def write(self, path: Path | str) -> None:
        """A table (.csv), or a message an axis and source (.mcap).

        Columns are those of ``COLUMNS``, with units in the first line or in the schema. Raises
        InputError for another ending.
        """
        path = Path(path)
        if path.suffix not in FORMATS:
            raise InputError(f"{path}: a frequency response is {' or '.join(FORMATS)}; name it so")
        write_atomically(path, FORMATS[path.suffix](self))

    def tables(self) -> Iterator[tuple[str, str, Mapping[str, Array]]]:
        """Of each axis and source its columns, (n,) by name."""
        for name, axis in self.axes.items():
            for source, shown in by_source(axis).items():
                r, plant = shown.response, shown.response.plant
                own = (plant.real, plant.imag, r.band, r.noise, r.distortion, r.coherence)
                yield name, source, dict(zip(COLUMNS, (r.frequency, *own), strict=True))


def by_source(axis: AxisFrequency) -> dict[str, Shown]:
    """What is measured, and what the model shows in its place where there is one."""
    model = {} if axis.modelled is None else {"model": axis.modelled}
    return {"measured": axis.measured, **model}


def _csv(found: FrequencyResponse) -> bytes:
    names = []
    for name, linear in COLUMNS.items():
        units = dict.fromkeys(axis.units(linear) for axis in found.axes.values())
        names.append(f"{name} ({' or '.join(units)})")
    lines = [",".join(["axis", "source", *names])]
    for axis, source, columns in found.tables():
        for row in zip(*columns.values(), strict=True):
            lines.append(",".join([axis, source, *(f"{v:.9g}" for v in row)]))
    return ("\n".join(lines) + "\n").encode()


def _mcap(found: FrequencyResponse) -> bytes:
    from mcap.writer import Writer

    stream = BytesIO()
    writer = Writer(stream)
    writer.start(library="proton-twin")
    for axis, source, columns in found.tables():
        units = found.axes[axis].units
        fields = {
            name: {"type": "array", "items": {"type": ["number", "null"]}, "unit": units(linear)}
            for name, linear in COLUMNS.items()
        }
        schema = json.dumps({"type": "object", "properties": fields}).encode()
        known = writer.register_schema("frequency_response", "jsonschema", schema)
        channel = writer.register_channel(f"/{axis}/frequency_response/{source}", "json", known)
        told = {n: [v if isfinite(v) else None for v in c.tolist()] for n, c in columns.items()}
        writer.add_message(channel, log_time=0, publish_time=0, data=json.dumps(told).encode())
    writer.finish()
    return stream.getvalue()


FORMATS = {".csv": _csv, ".mcap": _mcap}
