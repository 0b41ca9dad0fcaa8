"""The JSON of frequency responses."""

from __future__ import annotations

from typing import Any

from identify.frequency.of_logs import AxisFrequency, Bias, Shown
from identify.frequency.plant import Banded, Mode
from identify.output.answers import Answer, Entry, answer_of
from identify.results.frequency import FrequencyResponse
from twin.record import Number


class PlantEntry(Entry):
    """What a response shows, in SI units; delay in s."""

    mass: Banded
    mass_unit: str
    damping: Banded
    stiffness: Banded
    delay: Banded
    modes: list[Mode]
    misfit: Number


class LoopEntry(Entry):
    """The position loop: Hz, rad, and ratios; null where it does not cross in the band."""

    crossover: Number
    phase_margin: Number
    gain_margin: Number
    peak: Number
    by_controller: bool


class ShownEntry(Entry):
    """A response at frequencies in Hz, position over force in ``unit``, and what it shows."""

    unit: str
    frequency: list[Number]
    real: list[Number]
    imaginary: list[Number]
    band_90: list[Number]
    noise: list[Number]
    distortion: list[Number]
    coherence: list[Number]
    plant: PlantEntry | None
    loop: LoopEntry | None


class AxisFrequencyEntry(Entry):
    """One axis as the logs show it, and as the model in their place does.

    bias: null where a known mass comes back; else neither plant nor loop is read off.
    """

    measured: ShownEntry
    modelled: ShownEntry | None
    bias: Bias | None


class FrequencyAnswer(Answer):
    """What `twin frf` prints."""

    logs: list[str]
    axes: dict[str, AxisFrequencyEntry]


@answer_of.register
def _(result: FrequencyResponse, **more: Any) -> FrequencyAnswer:
    axes = {name: _axis(axis) for name, axis in result.axes.items()}
    return FrequencyAnswer.of(result, axes=axes, **more)


def _axis(axis: AxisFrequency) -> AxisFrequencyEntry:
    def shown(one: Shown) -> ShownEntry:
        found = one.response
        plant = one.plant and PlantEntry.of(one.plant, mass_unit=axis.units.mass)
        return ShownEntry.of(
            found, unit=axis.units("m/N"), real=found.plant.real, imaginary=found.plant.imag,
            band_90=found.band, plant=plant, loop=one.loop,
        )  # fmt: skip

    return AxisFrequencyEntry.of(
        axis, measured=shown(axis.measured),
        modelled=shown(axis.modelled) if axis.modelled else None,
    )  # fmt: skip
