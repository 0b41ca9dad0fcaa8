"""Which answers of a trial count as right, and how far the truth lies from a value."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest
from built_fits import CATALOGUE, PLAIN, axis_of, built_dataset, fitted
from built_results import errors, score_of

from benchmarks.selftest.laws import OUTSIDE
from benchmarks.selftest.machines import Case
from benchmarks.selftest.trial import answer_of, held
from identify.estimation.fit import Outcome, finished
from identify.estimation.intervals import half_widths
from identify.selection.findings import Finding, FindingKind
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
    answer = answer_of(finding, built, Case((planted,), 5.0, 1, "plain", known))
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
    ("told", "planted", "right"),
    [
        ("dahl", fitted("dahl", n=1.0), False),
        ("dahl", fitted("dahl", n=0.7), True),
        ("lugre", fitted("dahl", n=0.7), False),
        # A start by the travel, and a strength that is held, make no other law.
        (
            "position_dependent_friction",
            fitted("position_dependent_friction", start=-0.07),
            False,
        ),
        ("coulomb_viscous", fitted("coulomb_viscous", Fs=0.3), False),
    ],
)
def test_what_resembles_is_right_where_the_machine_has_another_exponent(told, planted, right):
    built = SimpleNamespace(planted=(planted,))
    finding = Finding(told, (), 0.9, *errors(2.0, 1.0), "N", {}, SCORE)
    finding = replace(finding, kind=FindingKind.RESEMBLES)
    assert answer_of(finding, built, Case((planted.effect.name,), 5.0, 1)).right is right


def test_the_truth_lies_so_many_half_widths_from_a_value():
    dataset = built_dataset("run")
    fit = finished(PLAIN, PLAIN, dataset.fit, Outcome.CONVERGED)
    half = dict(zip([c.label for c in fit.scaling.where], half_widths(fit), strict=True))
    assert list(half) == ["mass", "coulomb_viscous.Fc", "coulomb_viscous.sigma2"]
    true = replace(fit.axis, mass=fit.axis.mass + 0.5 * half["mass"])
    machine = SimpleNamespace(
        true=SimpleNamespace(axes={"x": true}), reshaped=frozenset({"coulomb_viscous"})
    )
    (mass,) = held(machine, fit)  # a reshaped law has no true values
    assert mass.label == "mass"
    assert mass.off == pytest.approx(0.5, rel=1e-6)
    machine.reshaped = frozenset()
    assert [h.label for h in held(machine, fit)] == list(half)
