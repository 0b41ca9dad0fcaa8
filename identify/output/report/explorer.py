"""The signals of each axis as report.js reads them: packed into the page, no extreme lost."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from identify.output.numbers import Scale, quantity, spaced, title_case, typeset
from identify.output.report.subject import AxisView, Subject
from identify.results.signals import Signals
from twin.curve import Coordinate
from twin.effect import Effect
from twin.model.units import units_of

Array = NDArray[np.float64]

MOST_VALUES = 950_000  # in a page, of 2 bytes, which are 2.7 characters: 2.5 of at most 3 MB
LARGEST = 32767  # of 16 bits; the number below the least stands for no number
NO_NUMBER = -32768
SMALLEST = 1e-6  # of the largest deviation of a signal: the least that is still told from zero
TO_EXPLAIN = "measured force minus mass x acceleration"
OTHER = "other_axis_"
UNSUITED = ("direction",)  # coordinates of two values, over which no curve can be drawn
NAMES = {"velocity": "Speed", "distance_since_reversal": "Distance since reversal"}


def explored(subject: Subject) -> list[dict[str, Any]]:
    """The signals of all axes, the leading one first."""
    views = [view for view in subject.views if np.isfinite(view.signals.before).any()]
    most = MOST_VALUES // max(sum(len(named_signals(view)) for view in views), 1)
    return [_axis(view, most) for view in views]


def _axis(view: AxisView, most: int) -> dict[str, Any]:
    signals, words = view.signals, view.words
    index, every = shown_of(signals, most)
    ends = np.cumsum([len(log) for log in signals.logs])
    begins = ends - [len(log) for log in signals.logs]
    kept = np.searchsorted(index, [*begins, ends[-1]])
    residuals = ["before", *(["after"] if signals.after is not None else [])]
    coordinates = [n for n in signals.coordinates if n not in UNSUITED]
    left = Scale.of(view.units.force, [3.0 * signals.size])
    return {
        "name": view.name,
        "every": every,
        "index": packed(np.diff(index, prepend=0)),
        "logs": [
            {
                "title": f"{log.motion.name}{f' ({role.value})' if role else ''}",
                "first": int(first),
                "count": int(stop - start),
                "start": float(log.time[0]),
                "step": log.test_function.stride * log.test_function.period,
            }
            for log, role, first, start, stop in zip(
                signals.logs, signals.roles, begins, kept, kept[1:], strict=False
            )
        ],
        "signals": [
            {"name": name, "label": text, "unit": scale.unit, "size": scale.size,
             **_coded(values[index])}
            for name, (text, values, scale) in named_signals(view, left).items()
        ],
        "coordinates": coordinates,
        "residuals": residuals,
        "effects": [f"effect {name}" for name in signals.effects],
        "against": coordinate_of_answer(view, coordinates),
        "floor": float(left(view.axis.floor)),
        "texts": {
            "residual": words("Unexplained force"),
            "force": words("Force"),
            "model_before": f"model without {view.label}" if view.label else "model",
            "model_after": f"model with {view.label}",
            "floor": typeset(quantity(view.axis.floor, view.units.force)),
        },
    }  # fmt: skip


def named_signals(view: AxisView, left: Scale | None = None) -> dict[str, tuple[str, Array, Scale]]:
    """Every signal of a page by its name there: what it is called, its values, and the unit."""
    signals, units, words = view.signals, view.units, view.words
    left = left or Scale.of(units.force, [])
    force = Scale.of(units.force, signals.to_explain)
    without = f"error without {view.label}" if view.label else words("unexplained force")
    named = {
        "to_explain": (
            words(TO_EXPLAIN.replace("mass", units.mass_name)),
            signals.to_explain,
            force,
        ),
        "before": (without, signals.before, left),
    }
    if signals.after is not None:
        named["after"] = (f"error with {view.label}", signals.after, left)
    for name, values in signals.effects.items():
        named[f"effect {name}"] = (spaced(name), values, force)
    for name, values in signals.coordinates.items():
        unit = signals.units[name]
        text = units_of(unit).words(NAMES.get(name, title_case(name)))
        named[name] = (text, values, Scale.of(unit, values))
    return named


def coordinate_of_answer(view: AxisView, known: Sequence[str]) -> str:
    """The coordinate that the answer is about, else that of the worst region."""
    found = view.found
    named = [f.effect for f in found.findings] if found else []
    effects = (
        [f.effect for f in found.final.axis.effects if f.effect.name in named] if found else []
    )
    asked = [_of_effect(effect) for effect in sorted(effects, key=lambda e: named.index(e.name))]
    asked += [found.unexplained.depends_on] if found and found.unexplained else []
    others = any(effect.reads_other_axis for effect in effects)
    asked += [r.coordinate for r in view.axis.worst if others or not r.coordinate.startswith(OTHER)]
    return next((name for name in asked if name in known or name == "time"), known[0])


def _of_effect(effect: Effect) -> str:
    """The coordinate that the force of an effect is a curve over; "" where it is none."""
    if any(p.period for p in effect.parameters):
        return f"{effect.name}_phase"
    over = next((curve.over for curve in effect.curves), None)
    return "" if over is None else {Coordinate.SPEED: "velocity"}.get(over, over.value)


def shown_of(signals: Signals, most: int) -> tuple[NDArray[np.int64], int]:
    """Which test functions (k,) are in the page, about ``most``, and of how many one is always.

    All where they are few; else of every so many the first, which tell the means, and those where
    a residual or the force is largest or least, so that no extreme is lost.
    """
    count = len(signals.time)
    watched = [v for v in (signals.before, signals.after, signals.to_explain) if v is not None]
    if count <= most:
        return np.arange(count), 1
    every = -(-(1 + 2 * len(watched)) * count // most)
    whole = count // every * every
    rows = np.arange(0, whole, every)
    picked = [rows, np.arange(whole, count)]
    for values in watched:
        table = values[:whole].reshape(-1, every)
        for extreme, absent in ((np.argmin, np.inf), (np.argmax, -np.inf)):
            picked.append(rows + extreme(np.where(np.isnan(table), absent, table), axis=1))
    return np.unique(np.concatenate(picked)), every


def packed(values: NDArray[Any]) -> str:
    """Integers of 16 bits as text."""
    return base64.b64encode(np.asarray(values, dtype="<i2").tobytes()).decode("ascii")


def _coded(values: Array) -> dict[str, Any]:
    """A signal in 16 bits: middle + scale * sinh(number * step), so that small values stay exact.

    Beside a spike a hundred thousand times the noise, the noise has still three digits.
    """
    finite = np.isfinite(values)
    middle = float(np.median(values[finite])) if finite.any() else 0.0
    beside = np.where(finite, values - middle, 0.0)
    largest = float(np.abs(beside).max(initial=0.0)) or 1.0
    scale = max(
        float(np.median(np.abs(beside[finite]))) if finite.any() else 0.0, SMALLEST * largest
    )
    step = float(np.arcsinh(largest / scale)) / LARGEST
    coded = np.where(finite, np.rint(np.arcsinh(beside / scale) / step), NO_NUMBER)
    return {"middle": middle, "scale": scale, "step": step, "data": packed(coded)}
