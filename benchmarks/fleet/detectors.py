"""Other detectors on the same series: one that always alarms, one that never does, textbook ones.

A detector takes a series (n,) of one parameter, relative to its first nights and with what all
machines do taken off, and gives the nights on which it alarms.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Mapping

import numpy as np

from identify.fleet.alarms import FIRST_NIGHTS
from twin.signals import Array

Detector = Callable[[Array], list[int]]


def always(series: Array) -> list[int]:
    """Alarms on every night."""
    return [*range(len(series))]


def never(series: Array) -> list[int]:
    """Alarms on none."""
    return []


def cusum(series: Array) -> list[int]:
    """Two-sided CUSUM, k 0.5 and h 5 of the first nights' scatter (D. C. Montgomery)."""
    slack, limit = 0.5, 5.0
    begun = series[:FIRST_NIGHTS]
    z = (series - begun.mean()) / begun.std(ddof=1)
    out, up, down = [], 0.0, 0.0
    for i, x in enumerate(z):
        up, down = max(up + x - slack, 0.0), max(down - x - slack, 0.0)
        if max(up, down) > limit:
            out.append(i)
            up = down = 0.0
    return out


def _river(name: str, **given: float) -> Detector:
    def run(series: Array) -> list[int]:
        from river import drift

        detector = getattr(drift, name)(**given)
        scale = series[:FIRST_NIGHTS].std(ddof=1)
        out = []
        for i, x in enumerate(series / scale):
            detector.update(float(x))
            if detector.drift_detected:
                out.append(i)
        return out

    return run


DETECTORS: Mapping[str, Detector] = {
    "one that always alarms": always, "one that never does": never, "CUSUM, k 0.5, h 5": cusum,
}  # fmt: skip
OF_RIVER: Mapping[str, Detector] = {
    "river ADWIN": _river("ADWIN"), "river PageHinkley": _river("PageHinkley"),
    "river KSWIN": _river("KSWIN"),
}  # fmt: skip


def detectors() -> Mapping[str, Detector]:
    """Those that can be run here."""
    return {**DETECTORS, **(OF_RIVER if importlib.util.find_spec("river") else {})}


def of_panel(own: Array, detector: Detector) -> list[int]:
    """Alarms of a detector on the series (m, n) of a panel, of each machine that has all nights."""
    return [night for series in own if np.isfinite(series).all() for night in detector(series)]
