"""Sentences about the chapter "dynamic" of the reproduced study."""

from __future__ import annotations

from identify.thesis.dynamic import DynamicResult
from identify.thesis.informed import Informed

EXPLAINED = 0.1  # of the misfit, that may be left where it is explained


def dynamic_in_words(result: DynamicResult) -> list[str]:
    """Why closed-loop reversals fail, what both searches find, and what the beginning explains."""
    shut, opened = result.closed, result.opened
    by_simplex, by_us = result.seconds
    return [
        f"reversals of 4 um in closed loop change the friction by {shut.friction:.2g} N, the noise "
        f"of the measured force is {shut.noise:.2g} N: 90 % intervals of {_intervals(shut)}; the "
        f"open-loop sine changes it by {opened.friction:.2g} N: {_intervals(opened)}",
        *(
            f"{name}: planted {ours.true:g} {ours.unit}; simplex search from rest "
            f"{result.simplex[name].mean:.5g}, fit of simulated motion {ours.mean:.6g} +- "
            f"{ours.sd:.1g} ({100.0 * ours.error:+.3f} %)"
            for name, ours in result.fitted.items()
        ),
        f"in the first period the simulation from rest is {result.first_period[:, 0].max():.2g} m "
        f"RMS off, from the estimated beginning {result.first_period[:, 1].max():.2g} m; "
        f"afterwards {result.afterwards[:, 0].max():.2g} m and "
        f"{result.afterwards[:, 1].max():.2g} m (largest of {len(result.places)} places)",
        f"at one place the simplex search takes {by_simplex:.2g} s, the fit of simulated motion "
        f"with its four starts {by_us:.2g} s, both on compiled laws",
    ]


def _intervals(record: Informed) -> str:
    return ", ".join(f"{n} +- {100.0 * half:.3g} %" for n, half in record.half_widths.items())


def dynamic_headline(result: DynamicResult) -> str:
    """Whether the estimated beginning explains the misfit of the first period."""
    rest, own = result.first_period.max(axis=0)
    if own < EXPLAINED * rest:
        return "The misfit of the first period is where the record begins"
    return "The beginning does not explain the misfit of the first period"
