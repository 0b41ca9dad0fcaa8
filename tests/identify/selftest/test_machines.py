"""What a self-test's machines are: drawn beside every scan, and of laws nobody else knows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from built_fits import CATALOGUE

from identify.selftest.case import Case, parse_case
from identify.selftest.drawing import DAMPING, drawn_values
from identify.selftest.laws import BUMPS, CABLES, NOISE, OUTSIDE
from identify.selftest.variations import VARIATIONS, Drawn
from twin.effect import DT, IO_SIZE, OUT, Effect, Excitation, Kind, V, X
from twin.errors import InputError
from twin.model.file import load_model

SEEN = Excitation(-0.15, 0.15, 0.2, 0.3, 12.0, 1e-3, lines=(7.0,), pitches=(0.02,))
STAGE = load_model("proton_xy", CATALOGUE)
FORMS = (*BUMPS, *CABLES)
EVERY_LAW = (*FORMS, NOISE, *OUTSIDE.values())


def rng():
    return np.random.default_rng(6)


# --- a machine's name ------------------------------------------------------------------------


@pytest.mark.parametrize(
    "case",
    [
        Case((), 0.0, 3), Case(("a_b",), 2.5, 1 << 30, "bumps"),
        Case(("a", "b"), 5.0, 7, "plain", known=False),
    ],
    ids=str,
)  # fmt: skip
def test_the_name_of_a_machine_makes_it_again(case) -> None:
    assert parse_case(str(case), {"a", "a_b", "b"}, {"plain", "bumps"}) == case


@pytest.mark.parametrize("text", ["a", "a@5/plain", "c@5/plain/1", "a@5/dull/1", "a@5/plain/1/in"])
def test_a_name_that_is_none_is_one_line(text) -> None:
    with pytest.raises(InputError) as error:
        parse_case(text, {"a"}, {"plain"})
    assert text in str(error.value)
    assert "\n" not in str(error.value)


# --- values ----------------------------------------------------------------------------------


def unscanned(effect: Effect) -> Effect:
    return replace(effect, parameters=tuple(replace(p, scan=None) for p in effect.parameters))


@pytest.mark.parametrize("name", CATALOGUE)
def test_values_are_drawn_without_a_look_at_the_scan(name) -> None:
    effect = CATALOGUE[name]
    drawn = drawn_values(effect, SEEN, rng())
    assert drawn == drawn_values(unscanned(effect), SEEN, rng())
    for p in effect.parameters:
        assert p.lower <= drawn[p.name] <= p.upper
        if p.scan and not p.fixed and p.lower < p.upper:
            assert drawn[p.name] not in p.scan(SEEN)


def test_damping_is_log_uniform_and_drawn_where_a_model_holds_it() -> None:
    draws, source = [], rng()
    for _ in range(400):
        for name in ("flexible_mode", "backlash"):
            draws.append(drawn_values(CATALOGUE[name], SEEN, source)["damping"])
    low, high = np.log(DAMPING)
    parts = np.histogram(np.log(draws), bins=4, range=(low, high))[0]
    assert parts.sum() == 800
    # Four standard deviations of a binomial of 800 and 1/4.
    assert np.abs(parts - 200).max() < 4.0 * np.sqrt(800 * 0.25 * 0.75)


# --- laws that only the self-test knows ------------------------------------------------------


def forces(effect: Effect, values: dict[str, float], x, v, dt=1e-3) -> np.ndarray:
    """Force (n,) N along a motion, one sample after another."""
    p = [{**effect.starts(), **values}[q.name] for q in effect.parameters]
    s, io, out = [0.0] * len(effect.states), [0.0] * IO_SIZE, []
    io[DT] = dt
    for i in range(len(x)):
        io[X], io[V] = x[i], v[i]
        io[1] = i * dt
        effect.law(p, s, io)
        out.append(io[OUT])
    return np.array(out)


TIME = np.arange(8000) * 1e-3
MOTION = 0.1 * np.sin(2.0 * TIME), 0.2 * np.cos(2.0 * TIME)


@pytest.mark.parametrize("effect", EVERY_LAW, ids=lambda e: e.name)
def test_a_law_of_the_self_test_is_in_no_catalogue_and_gone_at_no_strength(effect) -> None:
    assert effect.name not in CATALOGUE
    assert not forces(effect, {p.name: 0.0 for p in effect.strengths}, *MOTION).any()
    there = forces(effect, {p.name: 1.0 for p in effect.strengths}, *MOTION)
    assert np.isfinite(there).all()
    assert there.any()


# --- variations ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", VARIATIONS)
def test_a_variation_changes_the_machine_and_leaves_its_model_the_laws_of_the_stage(name) -> None:
    model = replace(STAGE, axes={"x": STAGE.axes["x"]})
    drawn = VARIATIONS[name](Drawn(model, STAGE), "x", rng())
    own = drawn.model.axes["x"]
    assert own.effects == STAGE.axes["x"].effects
    changed = drawn.true != STAGE
    assert changed is (name != "plain")
    assert drawn.model.sample_rate == drawn.true.sample_rate
    assert own.hardware == drawn.true.axes["x"].hardware
    assert drawn.reshaped <= set(own.names)
    frictions = [f for f in drawn.true.axes["x"].effects if f.effect.kind is Kind.FRICTION]
    assert len(frictions) == 1


def test_each_form_takes_the_place_of_what_the_model_has() -> None:
    drawn = VARIATIONS["everything"](Drawn(STAGE, STAGE), "x", rng())
    assert drawn.reshaped == set(STAGE.axes["x"].names)
    left = set(drawn.true.axes["x"].names) & set(STAGE.axes["x"].names)
    assert left == {"lugre"}
