"""What is shown of a frequency response: what is read off it, and its Bode diagram."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from identify.frequency.of_logs import AxisFrequency, Shown
from identify.frequency.plant import Banded, Plant
from identify.output import INKS
from identify.output.blocks import Block, Sentence, blocks_of, sentences
from identify.output.numbers import listed, number, percent, pretty, with_band
from identify.printed import figure_of
from identify.results.frequency import FrequencyResponse, by_source
from twin.model.units import AxisUnits

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_NO_SETPOINT = (
    "none logged, so that the loop is taken as open: what noise makes of the force in a closed "
    "one counts as response; log the setpoint"
)
MORE = "a multisine excites more, as `twin simulate multisine --model MODEL` runs"


@blocks_of.register
def frequency_blocks(result: FrequencyResponse) -> list[Block]:
    """By axis what the logs show, and the model in their place."""
    blocks = sentences([f"force to position, from {listed(result.logs)}"])
    for name, axis in result.axes.items():
        below: list[str | Block] = []
        for source, shown in by_source(axis).items():
            how = ", in simulation on the same setpoint" if source == "model" else ""
            facts = (f"{what}: {value}" for what, value in read_off(shown, axis))
            below.append(Sentence.over(f"{source}{how}", facts))
        blocks.append(Sentence.over(f"axis {name}", [*below, _caution(axis)]))
    return blocks


def _caution(axis: AxisFrequency) -> str:
    """What friction does to values that are read off a response."""
    mass, bias = axis.units.mass_name, axis.bias
    if bias is None:
        known = f"; the model's own {mass} comes back from its simulation"
        asked = "; with MODEL, whose simulation shows how much"
        return f"friction adds to these values{known if axis.modelled else asked}"
    own = f"{number(bias.own)} {axis.units.mass}"
    back = "none" if bias.back is None else _with_band(bias.back, axis.units.mass)
    of = f"of the {own} that least squares with friction find this response shows {back}"
    if axis.modelled:
        of = f"of the model's own {own} its simulation on this motion shows {back}"
    return (
        f"{mass}, delay and loop are not read off: {of}, as friction is too much of the force; "
        f"{MORE}"
    )


def read_off(shown: Shown, axis: AxisFrequency) -> list[tuple[str, str]]:
    """What a response tells, each by name in words, with its 90 % band."""
    found, kept, units = shown.response, shown.response.tells, axis.units
    if not kept.any():
        return [("frequencies", "none tells; the band of the response reaches zero at each")]
    low, high = found.frequency[kept][[0, -1]]
    part = f"{np.count_nonzero(kept)} of {len(kept)} usable"
    facts = [("frequencies", f"{part}, {number(low)} to {number(high)} Hz")]
    if np.isfinite(found.noise).any():
        share = float(np.nanmedian((found.distortion / found.spread)[kept] ** 2))
        wide = float(np.median(found.spread[kept] / np.abs(found.plant[kept])))
        facts.append(("spread", f"{percent(wide)} of the response, of whose variance "
                      f"{percent(share)} repeats and so is no noise (medians)"))  # fmt: skip
    if not np.isfinite(found.closed).any():
        facts.append(("setpoint", _NO_SETPOINT))
    if axis.bias is not None:
        return facts
    if shown.plant is None:
        few = f"too few frequencies to read it off; {MORE}"
        return [*facts, (units.mass_name, few), _loop(shown)]
    return [*facts, *_plant(shown.plant, found.period, units), _loop(shown)]


def _plant(plant: Plant, period: float, units: AxisUnits) -> list[tuple[str, str]]:
    told = math.isfinite(plant.mass.band)
    facts = [(units.mass_name, _with_band(plant.mass, units.mass) if told else "not told")]
    if _is_there(plant.damping):
        facts.append(("viscous damping", _with_band(plant.damping, units("N s/m"))))
    if _is_there(plant.stiffness):
        facts.append(("stiffness", _with_band(plant.stiffness, units("N/m"))))
    delay = f"{_with_band(plant.delay, 's')}, {plant.delay.value / period:.2f} samples"
    if plant.delay.value + 2.0 * plant.delay.band < 0.0:  # surely
        delay += ": none can be; the force is logged late, or its sign is reversed"
    facts.append(("delay", delay if math.isfinite(plant.delay.band) else "not told"))
    for i, mode in enumerate(plant.modes, start=1):
        frequency, ratio = _with_band(mode.frequency, "Hz"), _with_band(mode.damping, "1")
        side = "motor and encoder on one side" if mode.gain.value > 0.0 else "beyond the spring"
        name = "resonance" if len(plant.modes) == 1 else f"resonance {i}"
        facts.append((name, f"{frequency}, damping ratio {ratio}, {side}"))
    return facts


def _is_there(one: Banded) -> bool:
    """Whether a band twice as wide would not reach zero, as of a response that tells."""
    return 2.0 * one.band < one.value


def _loop(shown: Shown) -> tuple[str, str]:
    loop = shown.loop
    if loop is None:
        return "loop", "not told, as the setpoint is fed forward, or there is none"
    by = "by the setpoint, if nothing is fed forward"
    by = "of the model's controller" if loop.by_controller else by
    crossing = "no crossover in the band"
    if math.isfinite(loop.crossover):
        crossing = (
            f"crossover {number(loop.crossover)} Hz, phase margin "
            f"{math.degrees(loop.phase_margin):.0f} degrees"
        )
    gain = f", gain margin {number(loop.gain_margin)}" if math.isfinite(loop.gain_margin) else ""
    return f"loop {by}", f"{crossing}{gain}, largest sensitivity {number(loop.peak)}"


def _with_band(one: Banded, unit: str) -> str:
    return with_band(one.value, one.band, unit)


@figure_of.register(FrequencyResponse)
def bode(result: FrequencyResponse, *_: None) -> Figure:
    """Magnitude with its 90 % band, phase, and coherence of each axis; a column an axis."""
    import matplotlib.pyplot as plt

    count = len(result.axes)
    figure, places = plt.subplots(
        3, count, sharex="col", squeeze=False, height_ratios=(3, 2, 1),
        figsize=(6.4 * count, 7.2), layout="constrained",
    )  # fmt: skip
    plt.close(figure)  # a notebook shows what is returned, once
    for column, (name, axis) in zip(places.T, result.axes.items(), strict=True):
        _draw(column, axis)
        column[0].set_title(f"axis {name}: force to position")
    return figure


def _draw(places: list[Axes], axis: AxisFrequency) -> None:
    level, turn, share = places
    unit = pretty(axis.units("m/N"))
    for (name, shown), ink in zip(by_source(axis).items(), INKS, strict=False):
        kept = shown.response.tells
        found = shown.response.at(kept)
        size = np.abs(found.plant)
        low = np.maximum(size - found.band, 1e-3 * size)
        level.fill_between(found.frequency, low, size + found.band, color=ink, alpha=0.2, lw=0)
        curves = [(found.plant, "90 % band", {"marker": ".", "ms": 4, "ls": ""})]
        if shown.plant is not None:
            curves.append((shown.plant.fitted[kept], "read off", {"lw": 1}))
        for plant, what, style in curves:
            phase = np.degrees(np.angle(plant)) % -360.0
            level.loglog(
                found.frequency, np.abs(plant), color=ink, label=f"{name}, {what}", **style
            )
            turn.semilogx(found.frequency, phase, color=ink, **style)
        share.semilogx(shown.response.frequency, shown.response.coherence, lw=1, color=ink)
    level.set_ylabel(f"Magnitude ({unit})")
    turn.set_ylabel("Phase (degrees)")
    share.set(ylabel="Coherence (1)", xlabel="Frequency (Hz)", ylim=(0.0, 1.05))
    for place in places:
        place.grid(True, which="both", alpha=0.25)
    level.legend()
