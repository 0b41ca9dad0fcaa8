"""Nights of machines that are well, and of such that change, without a log: panels and stores.

A machine's parameter differs from its kind's, scatters from night to night, follows the hall's
temperature (a year, weather, and what only its own corner has) with a coefficient of its own, and
has been run in.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from identify.fleet.nights import Panel
from twin.signals import Array

FIRST_DAY = 20_454.0  # 2026-01-01
YEAR, YEARLY = 365.25, 3.0  # nights; K
WEATHER, MEMORY = 1.0, 5.0  # K RMS, and the nights that it lasts
CORNER = 0.3  # K RMS, of a machine's own place, as long
UNEQUAL = 0.2  # by which the coefficients of machines differ, RMS
RUN_IN, RUN_IN_NIGHTS = 0.003, 100.0  # what is left of it on the first night, and how it goes


@dataclass(frozen=True)
class Usual:
    """What a parameter of the kind is: value, its change by warmth (1/K), scatter, interval (1)."""

    unit: str
    value: float
    warmth: float
    scatter: float
    interval: float


# As the stage's logs show them; the interval is the half width of a fit of one night.
STAGE: Mapping[str, Usual] = {
    "mass": Usual("kg", 12.0, 0.0, 0.0005, 0.0003),
    "lugre.Fc": Usual("N", 0.31, -0.004, 0.008, 0.003),
    "lugre.sigma2": Usual("N s/m", 0.022, -0.012, 0.012, 0.01),
    "lugre.Fs": Usual("N", 0.38, -0.004, 0.012, 0.01),
    "cable_slab.k1": Usual("N/m", 1.7, -0.002, 0.006, 0.004),
    "cable_slab.offset": Usual("N", 0.05, 0.0, 0.01, 0.01),
    "force_error": Usual("N", 0.003, 0.0, 0.08, 0.0),
}


def weather(rng: np.random.Generator, shape: tuple[int, ...], size: float) -> Array:
    """A temperature that remembers, of this RMS, over the last axis."""
    kept = np.exp(-1.0 / MEMORY)
    out = rng.standard_normal(shape)
    for i in range(1, shape[-1]):
        out[..., i] = kept * out[..., i - 1] + np.sqrt(1.0 - kept**2) * out[..., i]
    return size * out


def drawn(
    machines: int, nights: int, rng: np.random.Generator, thermometer: float = 0.0
) -> Iterator[Panel]:
    """A panel of each parameter; thermometer: 1 where the logs tell the temperature, else 0."""
    day = np.arange(float(nights))
    yearly = YEARLY * np.sin(2.0 * np.pi * (day / YEAR + rng.random()))
    hall = yearly + weather(rng, (nights,), WEATHER)
    warm = hall + weather(rng, (machines, nights), CORNER)
    for name, usual in STAGE.items():
        unequal = 1.0 + UNEQUAL * rng.standard_normal((machines, 1))
        value = usual.value * (1.0 + 0.1 * rng.standard_normal((machines, 1)))
        factor = 1.0 + usual.warmth * unequal * warm
        factor += usual.scatter * rng.standard_normal((machines, nights))
        factor += usual.interval / 1.645 * rng.standard_normal((machines, nights))
        factor += RUN_IN * np.exp(-day / RUN_IN_NIGHTS) * (usual.warmth != 0.0)
        within = np.broadcast_to(usual.interval / 1.645 * value, factor.shape)
        yield Panel(
            "stage", "x", name, usual.unit, tuple(f"stage-{i:04d}" for i in range(machines)),
            FIRST_DAY + day, value * factor, within,
            293.0 + warm if thermometer else np.full(factor.shape, np.nan), np.ones(factor.shape),
        )  # fmt: skip


def with_change(panel: Panel, share: float, night: int) -> Panel:
    """The first machine of a panel with a parameter that is larger by a share from a night on."""
    values = panel.values.copy()
    values[0, night:] *= 1.0 + share
    return replace(panel, values=values)
