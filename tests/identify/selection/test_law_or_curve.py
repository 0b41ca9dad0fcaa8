"""A law is preferred to a free curve that shows as much, and to no curve that shows far more."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from planted_logs import SLIDE, Array, Ride, begun, few, having, logged

from identify.selection.acceptance import Judged
from identify.selection.changes import Reshaped
from identify.selection.findings import findings_of
from identify.selection.law_or_curve import follows, laws_for
from identify.selection.refusal import OutsideKnee, Refusal
from identify.selection.search import Found, Step, search
from identify.selection.trying import Beside, Tried, effect_tried, tried_beside
from twin.model.machine import AxisModel

Force = Callable[[Array, Array], Array]
CABLED = having(SLIDE, "cable_slab")
COGGED = having(CABLED, "cogging", p=0.03, a1=0.3)
KNOWN = few("cogging", "spring")


def folds(x: Array, _: Array) -> Array:
    """Of a cable that folds over at two places, N."""
    return 0.5 * np.tanh((x + 0.02) / 0.008) - 0.35 * np.tanh((x - 0.02) / 0.006)


def waves(x: Array, v: Array) -> Array:
    """Of a cable that is wavy in its middle, N, beside what no law and no curve of place is."""
    wavy = np.clip(1.5 * np.sin(2.0 * np.pi * x / 0.04), -1.0, 1.0) * np.exp(-((x / 0.05) ** 2))
    return 0.3 * wavy + 0.2 * np.sin(v / 0.02)


def tried(true: AxisModel, beside: Force | None) -> tuple[Judged, list[Tried], Tried]:
    """What is tried beside a slide with its cable on logs of another, and the best curve of it."""
    one, two, held = (logged(true, Ride(k), beside) for k in (3, 4, 5))
    fit, dataset = begun(CABLED, {"one": one, "two": two}, {"held": held})
    judged, every, _ = tried_beside(Judged(fit, dataset), Beside(KNOWN))
    curves = (t for t in every if isinstance(t.change, Reshaped))
    return judged, every, max(curves, key=lambda t: t.candidate.part)


@pytest.mark.parametrize(
    ("true", "beside", "preferred"), [(COGGED, None, ["cogging"]), (CABLED, folds, [])]
)
def test_a_law_that_takes_as_much_is_preferred_to_a_curve(true, beside, preferred) -> None:
    judged, every, curve = tried(true, beside)
    laws = laws_for(curve, judged, every)
    assert [t.change.name for t in laws] == preferred
    assert not any(follows(t, curve) for t in laws)
    first = search(judged.fit, judged.dataset, KNOWN).steps[0]
    assert isinstance(first.change, Reshaped) == (not preferred)
    assert first.tied == ()


def test_a_law_that_a_later_curve_makes_is_doubted_where_its_values_became_anothers() -> None:
    """Stops that let half of the travel free: a curve took over, and they are some of its force."""
    law = few("end_stop")["end_stop"]
    true = having(CABLED, "end_stop", low=-0.057, high=0.057, stiffness=1e3)
    one, two = (logged(true, Ride(k)) for k in (3, 5))
    base, dataset = begun(CABLED, {"one": one}, {"two": two})
    stops = effect_tried(base, dataset, law)

    def doubts(**values: float) -> list[Refusal | None]:
        fit = stops.judged.fit
        there = {**fit.axis["end_stop"].values, **values}
        axis = having(CABLED, "end_stop", **there)
        ended = Judged(replace(fit, axis=axis), dataset)
        first, steps = Judged(base, dataset), (Step(stops, held=True),)
        return [f.doubt for f in findings_of(Found(dataset, first, ended, steps, steps, (), ()))]

    assert doubts() == [None]
    (why,) = doubts(low=-0.05, high=0.0)
    assert isinstance(why, OutsideKnee)
    assert why.name == "free travel"


@pytest.mark.slow  # 8 s
def test_a_law_that_a_curve_betters_by_too_little_to_be_found_is_told_as_level_with_it() -> None:
    judged, every, curve = tried(CABLED, waves)
    (law,) = laws_for(curve, judged, every)
    assert follows(law, curve)
    first = search(judged.fit, judged.dataset, KNOWN).steps[0]
    # The curve leads, as it is the form, and more is proved beside it.
    assert (first.change.name, [t.change.name for t in first.tied]) == ("cable_slab", ["cogging"])
