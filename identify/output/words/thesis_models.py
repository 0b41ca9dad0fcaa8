"""Sentences about the chapter "models" of the reproduced study."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from identify.output.report.units import spaced
from identify.thesis.models import RIGHT, ModelsResult

CREEPS = 1e-5  # m/s, from which an axis is said to drift
OPEN = 1e-3  # N, from which a loop is said to stay open


def contained(result: ModelsResult) -> list[tuple[str, str]]:
    """Pairs of laws of which the second fits all data of the first: it contains it."""
    fits = result.overall <= RIGHT
    pairs = np.argwhere(fits & ~np.eye(len(result.laws), dtype=bool))
    return [(result.laws[i], result.laws[j]) for i, j in pairs]


def next_nearest(result: ModelsResult) -> tuple[int, int, float]:
    """Machine, the law that comes nearest to it without containing it, and its ratio."""
    others = np.where(result.overall <= RIGHT, np.inf, result.overall)
    i, j = np.unravel_index(int(np.argmin(others)), others.shape)
    return int(i), int(j), float(others[i, j])


def models_in_words(result: ModelsResult) -> list[str]:
    """What fits what, which loops stay open, how sure and how dear each fit is."""
    i, j, ratio = next_nearest(result)
    within = [f"{spaced(a)} is contained in {spaced(b)}" for a, b in contained(result)]
    forget = [spaced(law) for law, loop in result.loops.items() if loop.gap > OPEN]
    fails = [spaced(law) for law, right in zip(result.laws, result.right, strict=True) if right < 1]
    creep = {law: abs(t.drift) for law, t in zip(result.laws, result.traits, strict=False)}
    return [
        f"each friction fits its own data to {result.own.max():.2g} times the noise floor or "
        f"better; the nearest other is {spaced(result.laws[j])} for a machine with "
        f"{spaced(result.laws[i])}, at {ratio:.2g} times"
        + (f"; {' and '.join(within)}, which fits as well" if within else ""),
        f"an inner loop stays open with {', '.join(forget) or 'none'}, so these forget; it closes "
        "with the others",
        *([_creep_in_words(creep)] if creep else []),
        f"of random starts up to three times off {100.0 * result.right.mean():.0f} % end within "
        f"{RIGHT:g} times the noise floor"
        + (f"; not all do with {', '.join(fails)}" if fails else ""),
        f"a fit takes {result.seconds.min():.2g} to {result.seconds.max():.2g} s of CPU time, a "
        f"step of a law {1e9 * result.step.min():.0f} to {1e9 * result.step.max():.0f} ns",
    ]


def _creep_in_words(creep: Mapping[str, float]) -> str:
    moving = [spaced(law) for law, speed in creep.items() if speed > CREEPS]
    still = max((speed for speed in creep.values() if speed <= CREEPS), default=0.0)
    return (
        f"under a small oscillation below the break-away {' and '.join(moving) or 'none'} "
        f"drift{'s' if len(moving) < 2 else ''}, by up to {max(creep.values()):.2g} m/s; the "
        f"others by {still:.2g} m/s at most"
    )
