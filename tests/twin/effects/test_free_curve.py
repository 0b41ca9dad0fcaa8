"""A free curve lies over the coordinate that a law declares, closed where the law repeats."""

from dataclasses import fields, replace

import numpy as np
import pytest
from effect_runs import CATALOGUE
from references import REFERENCES
from test_laws_effects import SINGLE, columns, stepped, values_of

from twin.curve import Coordinate, Curve
from twin.effect import OUT, Effect, Excitation

FREE = next(e for e in CATALOGUE.values() if e.free_shape)
COVERED = Excitation(-0.1, 0.2, 0.25, 0.3, 10.0, 1e-3)
OVER = pytest.mark.parametrize(
    ("over", "period", "ends"),
    [
        (Coordinate.POSITION, None, (-0.1, 0.2)),
        (Coordinate.POSITION, 0.034, (0.0, 0.034)),
        (Coordinate.SPEED, None, (0.0, 0.25)),
    ],
)
CURVED = [(e, c) for e in CATALOGUE.values() for c in e.curves]


def laid(curve: Curve, period: float | None = None, *, lets_go: bool = False) -> dict[str, float]:
    return {**values_of(FREE), **FREE.free_shape.laid(curve, period, COVERED, lets_go)}


@pytest.mark.parametrize("lets_go", [False, True])
@OVER
def test_it_is_its_equation_over_every_coordinate(over, period, ends, lets_go) -> None:
    values = laid(Curve(over, by_direction=True), period, lets_go=lets_go)
    q = columns(0.5, friction=False)
    _, after = stepped(FREE, values, q)
    wanted = REFERENCES[FREE.name].results(values, q)[OUT]
    np.testing.assert_allclose(after[:, OUT], wanted, rtol=1e-9, atol=1e-12)


@OVER
def test_its_knots_are_where_the_law_has_them(over, period, ends) -> None:
    """At a knot, moving for long, the force is that of the knot, both ways."""
    values = laid(Curve(over, by_direction=True), period)
    where, index = FREE.free_shape.knots(values)
    assert (where[0], where[-1]) == pytest.approx(ends)
    assert index[0] == 0
    assert (index[-1] == 0) == (period is not None)
    inner, along = np.array(where[1:-1]), over is Coordinate.POSITION
    place, speed = (inner, 0.1 + inner**2) if along else (0.1 + inner**2, inner)
    for way in (1.0, -1.0):
        q = columns(1.0, friction=False)
        kept = {f.name: getattr(q, f.name)[: len(speed)] for f in fields(q) if f.name not in SINGLE}
        q = replace(q, **{**kept, "x": place, "v": way * speed})
        _, after = stepped(FREE, {**values, "turn": 1e-9}, q)
        wanted = [
            values[f"e_{i + 1}"] + way * values[f"o_{i + 1}"] for i in index[1:-1]
        ]  # fmt: skip
        np.testing.assert_allclose(after[:, OUT], wanted, rtol=1e-6, atol=1e-9)


@pytest.mark.parametrize(("effect", "curve"), CURVED, ids=lambda c: getattr(c, "name", ""))
def test_a_curve_is_declared_over_what_the_law_has(effect: Effect, curve: Curve) -> None:
    assert curve.period is None or effect.parameter(curve.period).period
    assert curve.by_direction or not curve.rubs, "friction turns with the direction"
    assert not effect.is_nonparametric
