"""What the model says of the machine's loop: its frequency response, the worth of feedforward."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from identify.frequency.of_logs import AxisFrequency
from identify.output.blocks import (
    Block,
    Chart,
    Drawn,
    Ink,
    LineStyle,
    Listing,
    Row,
    TableBlock,
)
from identify.output.numbers import NOTHING, by_how_much, listed, pretty, quantity
from identify.output.shown.frequency import read_off
from identify.output.shown.subject import AxisView
from identify.results.frequency import by_source


def responses(view: AxisView) -> list[Block]:
    """Magnitude, phase, and what is read off them; nothing where the logs do not tell a mass."""
    response = view.subject.machine.response
    found = response.axes.get(view.name) if response else None
    if response is None or found is None or found.measured.plant is None:
        return []
    return [*_bode(found, response.logs), _table(found)]


def _bode(found: AxisFrequency, logs: Sequence[str]) -> list[Chart]:
    """Magnitude and phase of each response, at the frequencies at which one tells something.

    The model's is of the same frequencies as the measured one. logs: names of those that tell it.
    """
    shown = by_source(found)
    told = np.any([one.response.tells for one in shown.values()], axis=0)
    sizes, phases = [], []
    for (name, one), ink in zip(shown.items(), (Ink.INK, Ink.AFTER), strict=False):
        response, band = one.response, f"{name}, 90 % band"
        plant = np.where(response.tells, response.plant, np.nan)[told]
        size, half = np.abs(plant), response.band[told]
        low, high = np.maximum(size - half, 1e-3 * size), size + half
        curves = (
            (band, low, LineStyle.BAND),
            (band, high, LineStyle.BAND),
            (name, size, LineStyle.LINE),
        )
        sizes += [Drawn(label, 20.0 * np.log10(curve), line, ink) for label, curve, line in curves]
        phases.append(Drawn(name, np.degrees(np.angle(plant)) % -360.0, ink=ink))
    caption = (
        f"Force to position, from {listed(logs)}, as twin frf tells it of the same logs: the best "
        "linear approximation with the setpoint as instrument. The model is simulated on the same "
        "setpoint, so that friction lowers both alike."
    )
    along = ("Frequency (Hz)", found.measured.response.frequency[told])
    level = f"Magnitude (dB of {pretty(found.units('m/N'))})"
    return [
        Chart(along, level, sizes, caption, log_x=True),
        Chart(along, "Phase (degrees)", phases, log_x=True),
    ]


def _table(found: AxisFrequency) -> TableBlock:
    """What is read off each, side by side."""
    told = {name: dict(read_off(shown, found)) for name, shown in by_source(found).items()}
    rows = dict.fromkeys(name for facts in told.values() for name in facts)
    titles = ("Read off, with 90 % band", *(name.capitalize() for name in told))
    cells = [(row, *(facts.get(row, NOTHING) for facts in told.values())) for row in rows]
    return TableBlock(titles, [Row(one) for one in cells])


def worth(view: AxisView) -> list[Block]:
    """The tracking errors with and without feedforward, and by what each named effect lowers them.

    Nothing where no effect was named that feedforward can hold.
    """
    result = view.subject.machine.worth
    found = result.axes.get(view.name) if result else None
    if result is None or found is None or not found.gains:
        return []
    unit = view.units.position
    rows = [
        Row((name.capitalize(), quantity(e.rms, unit), quantity(e.largest, unit)))
        for name, e in found.by_feedforward.items()
    ]
    caption = (
        f"In simulation, on the motion of {', '.join(result.logs)}, of a machine that is as the "
        "final model."
    )
    told = [
        f"With all but {effect} fed forward, the RMS error is {by_how_much(gain, unit)}."
        for effect, gain in found.gains.items()
    ]
    told += [f"Not in it: {effect}, {why}." for effect, why in result.axes[view.name].lost.items()]
    return [TableBlock(("Tracking error", "RMS", "Largest"), rows, caption), Listing(told)]
