"""Sentences about the chapter "future" of the reproduced study."""

from __future__ import annotations

import numpy as np

from identify.output.report.units import spaced
from identify.thesis.aging import Drift
from identify.thesis.future import FutureResult
from identify.thesis.mixtures import Mixture


def future_in_words(result: FutureResult) -> list[str]:
    """The number of elements, data-driven residuals against physics, slow moves, the long run."""
    first, *added, physics = result.beside
    best, slow = result.chosen, result.slow
    off = [np.abs(found / slow.planted - 1.0).max() for found in (slow.mapped, slow.fitted)]
    beside = ", ".join(f"with {spaced(b.name)} {b.test:.3g} N" for b in added)
    return [
        f"the data choose {best.count} elements, the machine has {result.planted}; the test error "
        f"is {best.over_floor:.2f} times the noise floor",
        f"on the test log {first.name} leaves {first.test:.3g} N, {beside}, {spaced(physics.name)} "
        f"{physics.test:.3g} N (noise floor {result.floor:.3g} N)",
        f"near zero speed ({slow.speed.min():g} to {slow.speed.max():g} m/s) the map is up to "
        f"{100.0 * off[0]:.2g} % off the steady friction, the whole law fitted to the same moves "
        f"{100.0 * off[1]:.2g} %",
        f"over {result.aging.level.distance.max():.3g} m the dry friction of the machine that ages "
        f"{_drift_in_words(result.aging.level)}; without aging it "
        f"{_drift_in_words(result.aging.steady)}",
        *(_mixture_in_words(m) for m in result.mixtures),
    ]


def future_headline(result: FutureResult) -> str:
    """Whether the law of the machine leaves less on the test log than data-driven residuals."""
    *others, physics = result.beside
    if physics.test < min(b.test for b in others):
        return "Physics beats the data-driven residual"
    return "A data-driven residual leaves no more than physics"


def _mixture_in_words(found: Mixture) -> str:
    first, second = found.alone
    best = min(found.elements, key=lambda t: t.over_floor)
    said = (
        f"on a machine with {spaced(found.machine)} a mixture of {spaced(first.name)} and "
        f"{spaced(second.name)} leaves {found.both.over_floor:.3g} times the noise floor of the "
        f"test log, {spaced(first.name)} alone {first.over_floor:.3g}, {spaced(second.name)} alone "
        f"{second.over_floor:.3g}, elements at best {best.over_floor:.3g}"
    )
    if found.planted is None or found.half is None:
        return said
    return (
        f"{said}; weight {found.weight:.3f} +- {found.half:.1g} (90 %), planted {found.planted:g}"
    )


def _drift_in_words(drift: Drift) -> str:
    slope, error = drift.slope
    verb = "drifts" if drift.detected else "does not drift"
    return f"{verb} in its second half: {slope:.2g} +- {error:.1g} N/m (standard error)"
