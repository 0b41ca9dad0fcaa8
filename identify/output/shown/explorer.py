"""The signals of each axis: packed into a page, as report.js reads them, or drawn in a notebook."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from identify.dataset.dataset import Role
from identify.output import INKS
from identify.output.numbers import DisplayUnit, packed, quantity, spaced, title_case, typeset
from identify.output.shown.subject import AxisView, Subject
from identify.results.results import Comparison, Diagnosis
from identify.results.signals import Signals, means
from twin.curve import Coordinate
from twin.effect import Effect, Kind
from twin.errors import InputError
from twin.model.units import units_of
from twin.signals import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Named = dict[str, tuple[str, Array, DisplayUnit]]

TO_EXPLAIN = "measured force minus mass × acceleration"
OTHER = "other_axis_"
UNSUITED = ("direction",)  # coordinates of two values, over which no curve can be drawn
NAMES = {"velocity": "Speed", "distance_since_reversal": "Distance since reversal"}


def explored(subject: Subject) -> list[dict[str, Any]]:
    """The signals of all axes, the leading one first."""
    views = [view for view in subject.views if np.isfinite(view.signals.before).any()]
    named = [named_signals(view) for view in views]
    most_values = 950_000  # in a page, of 2 bytes, which are 2.7 characters: 2.5 of at most 3 MB
    most = most_values // max(sum(map(len, named)), 1)
    return [_axis(view, own, most) for view, own in zip(views, named, strict=True)]


def _axis(view: AxisView, named: Named, most: int) -> dict[str, Any]:
    signals, words = view.signals, view.words
    index, every = shown_of(signals, most)
    coordinates = [n for n in signals.coordinates if n not in UNSUITED]
    _, _, left = named["before"]
    floor, of = typeset(quantity(view.axis.floor, view.units.force)), ""
    if view.found is not None:
        of = f" of the {Role.TRAINING.value} logs"
    return {
        "name": view.name,
        "every": every,
        "index": packed(np.diff(index, prepend=0)),
        "logs": _logs(signals, index),
        "signals": [
            {"name": name, "label": text, "unit": scale.unit, "size": scale.size,
             **_coded(values[index])}
            for name, (text, values, scale) in named.items()
        ],
        "coordinates": coordinates,
        "residuals": [name for name in ("before", "after") if name in named],
        "effects": [f"effect {name}" for name in signals.effects],
        "against": coordinate_of_answer(view, coordinates),
        "floor": float(left(view.axis.floor)),
        "texts": {
            "residual": words("Unexplained force"),
            "force": words("Force"),
            "model_before": f"model without {view.label}" if view.label else "model",
            "model_after": f"model with {view.label}",
            "floor": floor,
            "band": f"the noise floor{of}, ±{floor}",
        },
    }  # fmt: skip


def _logs(signals: Signals, index: NDArray[np.int64]) -> list[dict[str, Any]]:
    """Each log: its title, and which of the test functions in the page are its own."""
    begins = np.cumsum([0, *(len(log) for log in signals.logs)])
    kept = np.searchsorted(index, begins)
    return [
        {
            "name": log.motion.name,
            "title": f"{log.motion.name}{f' ({role.value})' if role else ''}",
            "first": int(first),
            "count": int(count),
            "start": float(log.time[0]),
            "step": log.test_function.stride * log.test_function.period,
        }
        for log, role, first, count in zip(
            signals.logs, signals.roles, begins[:-1], np.diff(kept), strict=True
        )
    ]


def named_signals(view: AxisView) -> Named:
    """Every signal of a page by its name there: what it is called, its values, and the unit."""
    signals, units, words = view.signals, view.units, view.words
    left = DisplayUnit.of(units.force, [3.0 * signals.size])
    force = DisplayUnit.of(units.force, signals.to_explain)
    without = f"error without {view.label}" if view.label else words("unexplained force")
    to_explain = words(TO_EXPLAIN.replace("mass", units.mass_name))
    named = {
        "to_explain": (to_explain, signals.to_explain, force),
        "before": (without, signals.before, left),
    }
    if signals.after is not None:
        named["after"] = (f"error with {view.label}", signals.after, left)
    for name, values in signals.effects.items():
        named[f"effect {name}"] = (spaced(name), values, force)
    for name, values in signals.coordinates.items():
        unit = signals.units[name]
        text = units_of(unit).words(NAMES.get(name, title_case(name)))
        named[name] = (text, values, DisplayUnit.of(unit, values))
    return named


def coordinate_of_answer(view: AxisView, known: Sequence[str]) -> str:
    """The coordinate that the answer is about, else that of the worst region."""
    asked, others = [], False
    if found := view.found:
        model = {f.effect.name: f.effect for f in found.final.axis.effects}
        effects = [model[f.effect] for f in found.findings if f.effect in model]
        asked = [_of_effect(effect) for effect in effects]
        asked += [found.unexplained.depends_on] if found.unexplained else []
        others = any(effect.reads_other_axis for effect in effects)
    asked += [r.coordinate for r in view.axis.worst if others or not r.coordinate.startswith(OTHER)]
    return next((name for name in asked if name in known or name == "time"), known[0])


def _of_effect(effect: Effect) -> str:
    """The coordinate that the force of an effect is a curve over; "" where it is none."""
    if effect.repeats:
        return f"{effect.name}_phase"
    if effect.reads("TIME"):
        return "time"
    over = next((curve.over for curve in effect.curves), None)
    if over is None:  # friction that is scaled has the sign of the speed
        scaled = effect.kind is Kind.MODIFIER and not effect.reads_other_axis
        return "velocity" if scaled else ""
    return {Coordinate.SPEED: "velocity"}.get(over, over.value)


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


def _coded(values: Array) -> dict[str, Any]:
    """A signal in 16 bits: middle + scale * sinh(number * step), so that small values stay exact.

    Beside a spike a hundred thousand times the noise, the noise has still three digits.
    """
    finite = np.isfinite(values)
    known = values[finite] if finite.any() else np.zeros(1)
    middle = float(np.median(known))
    beside, sizes = np.where(finite, values - middle, 0.0), np.abs(known - middle)
    largest = float(sizes.max()) or 1.0
    smallest = 1e-6  # of the largest deviation of a signal: the least that is still told from zero
    scale = max(float(np.median(sizes)), smallest * largest)
    # of 16 bits; the number below the least stands for no number
    step = float(np.arcsinh(largest / scale)) / 32767
    coded = np.where(finite, np.rint(np.arcsinh(beside / scale) / step), -32768)
    return {"middle": middle, "scale": scale, "step": step, "data": packed(coded)}


# --- in a notebook ---------------------------------------------------------------------------


def residual(result: Diagnosis | Comparison, coordinate: str | None, axis: str | None) -> Figure:
    """The residual without and with what was found, as dots and as means over a coordinate."""
    import matplotlib.pyplot as plt

    views = {view.name: view for view in Subject("", result).views}
    if axis is not None and axis not in views:
        raise InputError(f"no axis '{axis}' in the result; it has {', '.join(views)}")
    view = views[axis] if axis else next(iter(views.values()))
    signals = view.signals
    name = coordinate or coordinate_of_answer(view, list(signals.coordinates))
    values = signals.over(name)
    shown = named_signals(view)
    _, _, left = shown["before"]
    label, _, along = shown.get(name, ("Time", values, DisplayUnit.of("s", values)))
    figure, place = plt.subplots(figsize=(8.0, 4.0), layout="constrained")
    plt.close(figure)  # a notebook shows what is returned, once
    floor = float(left(view.axis.floor))
    place.axhspan(-floor, floor, color="#dfe4e9", label="noise floor")
    for which, ink in zip(("before", "after"), INKS, strict=True):
        if which in shown:
            title, error, _ = shown[which]
            place.plot(along(values), left(error), ".", markersize=2, alpha=0.25, color=ink)
            place.plot(*means(along(values), left(error)), color=ink, label=f"mean {title}")
    place.set(xlabel=along.label(label), ylabel=left.label(view.words("Unexplained force")))
    place.legend()
    return figure
