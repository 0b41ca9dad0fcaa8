"""The result of ``frequency_response``: what logs show of each axis, and what a model makes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from identify.frequency.of_logs import AxisFrequency
from identify.results import Printed, figure_of
from twin.files import write_atomically

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

    def __repr__(self) -> str:
        return f"<FrequencyResponse of {', '.join(self.axes)}; print it to read it>"

    def plot(self) -> Figure:
        """The Bode diagram of each axis."""
        return figure_of(self, None, None)

    def to_frd(self, axis: str | None = None) -> Any:
        """The plant of an axis, the first where None, as ``control.FRD`` of python-control.

        In samples, as a digital controller meets it. Raises ModuleNotFoundError without it.
        """
        import control

        found = self.axes[axis or next(iter(self.axes))].measured.response
        return control.FRD(found.plant, 2.0 * np.pi * found.frequency, dt=found.period)

    def write_csv(self, path: Path) -> None:
        """A table: a line for each axis, source and frequency; units are in its first line."""
        names = []
        for name, linear in COLUMNS.items():
            units = dict.fromkeys(axis.units(linear) for axis in self.axes.values())
            names.append(f"{name} ({' or '.join(units)})")
        lines = [",".join(["axis", "source", *names])]
        for name, axis in self.axes.items():
            for source, shown in (("measured", axis.measured), ("model", axis.modelled)):
                if shown is None:
                    continue
                r = shown.response
                columns = (r.frequency, r.plant.real, r.plant.imag, r.band, r.noise, r.distortion,
                           r.coherence)  # fmt: skip
                for row in zip(*columns, strict=True):
                    lines.append(",".join([name, source, *(f"{v:.9g}" for v in row)]))
        write_atomically(path, ("\n".join(lines) + "\n").encode())
