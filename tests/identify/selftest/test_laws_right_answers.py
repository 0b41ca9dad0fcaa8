"""Which answers count as right: a wrong shape over the coordinate of what has no better name."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest
from built_fits import CATALOGUE, axis_of, fitted
from built_results import errors, score_of

from identify.selection.findings import Finding, FindingKind
from identify.selftest.case import Case
from identify.selftest.laws import OUTSIDE
from identify.selftest.trial import _answer, _is_another
from twin.curve import Coordinate
from twin.model.machine import Fitted

SCORE = score_of(0.613, 7.3, 0.137)
LONE = next(n for n, e in OUTSIDE.items() if {c.over for c in e.curves} == {Coordinate.POSITION})


def is_right(
    planted: str,
    over: Coordinate,
    *,
    told: str = "cable_slab",
    known: bool = True,
    reshaped: tuple[str, ...] = (),
) -> bool:
    """Of the answer that a law of the model has another shape over a coordinate."""
    effect = OUTSIDE.get(planted) or CATALOGUE[planted]
    model = SimpleNamespace(axes={"x": axis_of(fitted("cable_slab"))})
    built = SimpleNamespace(
        model=model, planted=(Fitted.at_start(effect),), reshaped=frozenset(reshaped),
        right=frozenset(),
    )  # fmt: skip
    finding = Finding(told, (), 0.9, *errors(2.0, 1.0), "N", {}, SCORE)
    shape = SimpleNamespace(over=over)
    finding = replace(finding, kind=FindingKind.WRONG_SHAPE, shape=shape)
    answer = _answer(finding, built, Case((planted,), 5.0, 1, "plain", known))
    assert (answer.names, answer.part) == ((told,), finding.score.part)
    return answer.right


@pytest.mark.parametrize(
    ("planted", "over", "known", "right"),
    [
        (LONE, Coordinate.POSITION, True, True),
        (LONE, Coordinate.SPEED, True, False),
        ("cogging", Coordinate.POSITION, True, False),  # it has a name, which should be given
        ("cogging", Coordinate.POSITION, False, True),
        ("cogging", Coordinate.SPEED, False, False),
    ],
)
def test_another_shape_is_right_where_no_better_name_is(planted, over, known, right):
    assert is_right(planted, over, known=known) is right


@pytest.mark.parametrize(
    ("told", "over", "right"),
    [
        ("coulomb_viscous", Coordinate.SPEED, True),
        ("coulomb_viscous", Coordinate.POSITION, False),
        ("cable_slab", Coordinate.SPEED, False),
        ("cable_slab", Coordinate.POSITION, False),
    ],
)
def test_of_another_friction_the_curve_over_speed_of_the_models_own_is_right(told, over, right):
    assert is_right("leuven", over, told=told) is right


def test_another_shape_is_right_where_the_law_of_the_machine_has_one():
    assert is_right("cogging", Coordinate.POSITION, reshaped=("cable_slab",))
    assert not is_right("cogging", Coordinate.POSITION, reshaped=("roller_spikes",))


@pytest.mark.parametrize(
    ("told", "n", "right"),
    [("dahl", 1.0, False), ("dahl", 0.7, True), ("lugre", 0.7, False)],
)
def test_what_resembles_is_right_where_the_machine_has_another_exponent(told, n, right):
    built = SimpleNamespace(planted=(fitted("dahl", n=n),))
    finding = Finding(told, (), 0.9, *errors(2.0, 1.0), "N", {}, SCORE)
    finding = replace(finding, kind=FindingKind.RESEMBLES)
    assert _answer(finding, built, Case(("dahl",), 5.0, 1)).right is right


@pytest.mark.parametrize(
    ("planted", "values"),
    [("position_dependent_friction", {"start": -0.07}), ("coulomb_viscous", {"Fs": 0.3})],
)
def test_a_start_by_the_travel_or_a_held_strength_is_no_other_law(planted, values):
    assert not _is_another(fitted(planted, **values))
