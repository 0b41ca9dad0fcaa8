"""What the model says of the machine's loop: its frequency response, the worth of feedforward."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from identify.frequency.of_logs import AxisFrequency, Shown
from identify.output.frequency import read_off
from identify.output.numbers import NOTHING, pretty, quantity
from identify.output.report.page import Block, Chart, Drawn, Ink, Line, Listing, Row, Table
from identify.output.report.subject import AxisView
from twin.signals import Array


def responses(view: AxisView) -> list[Block]:
    """Magnitude, phase, and what is read off them; nothing where the logs do not tell a mass."""
    response = view.subject.machine.response
    found = response.axes.get(view.name) if response else None
    if found is None or found.measured.plant is None:
        return []
    return [_magnitude(found), _phase(found), _table(found)]


def _of(found: AxisFrequency) -> list[tuple[str, Shown, Ink]]:
    """What is shown: the model's response is of the same frequencies as the measured one."""
    model = [("model", found.modelled, Ink.AFTER)] if found.modelled else []
    return [("measured", found.measured, Ink.INK), *model]


def _magnitude(found: AxisFrequency) -> Chart:
    lines = []
    for name, shown, ink in _of(found):
        response = shown.response
        size = np.abs(response.plant)
        edges = (np.maximum(size - response.band, 1e-3 * size), size + response.band)
        lines += [
            Drawn(f"{name}, 90 % band", _where_told(found, shown, _decibels(edge)), Line.BAND, ink)
            for edge in edges
        ]
        lines.append(Drawn(name, _where_told(found, shown, _decibels(size)), Line.LINE, ink))
    caption = (
        "Force to position, as the best linear approximation with the setpoint as instrument. The "
        "model is simulated on the same setpoint, so that friction lowers both alike."
    )
    unit = pretty(found.units("m/N"))
    return Chart(_frequencies(found), f"Magnitude (dB of {unit})", lines, caption, log_x=True)


def _phase(found: AxisFrequency) -> Chart:
    lines = []
    for name, shown, ink in _of(found):
        turned = np.degrees(np.angle(shown.response.plant)) % -360.0
        lines.append(Drawn(name, _where_told(found, shown, turned), Line.LINE, ink))
    return Chart(_frequencies(found), "Phase (degrees)", lines, log_x=True)


def _decibels(size: Array) -> Array:
    return 20.0 * np.log10(size)


def _frequencies(found: AxisFrequency) -> tuple[str, Array]:
    return "Frequency (Hz)", found.measured.response.frequency[_told(found)]


def _told(found: AxisFrequency) -> NDArray[np.bool_]:
    """At which frequencies one of those shown tells something."""
    return np.any([shown.response.tells for _, shown, _ in _of(found)], axis=0)


def _where_told(found: AxisFrequency, shown: Shown, values: Array) -> Array:
    return np.where(shown.response.tells, values, np.nan)[_told(found)]


def _table(found: AxisFrequency) -> Table:
    """What is read off each, side by side."""
    told = {name: dict(read_off(shown, found.units)) for name, shown, _ in _of(found)}
    rows = dict.fromkeys(name for facts in told.values() for name in facts)
    titles = ("Read off, with 90 % band", *(name.capitalize() for name in told))
    return Table(
        titles,
        [Row((row, *(facts.get(row, NOTHING) for facts in told.values()))) for row in rows],
    )


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
    told = [f"{effect} gains {quantity(gain, unit)}." for effect, gain in found.gains.items()]
    told += [f"Not in it: {effect}, {why}." for effect, why in result.lost[view.name].items()]
    table = Table(("Tracking error", "RMS", "Largest"), rows, caption)
    return [table, *([Listing(told)] if told else [])]
