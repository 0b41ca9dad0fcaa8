"""What only the self-test knows: laws, against their equations in NumPy, values and variations."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from machines import CATALOGUE
from machines import PROTON as STAGE

from benchmarks.selftest.laws import BUMPS, CABLES, NOISE, OUTSIDE
from benchmarks.selftest.variations import DAMPING, VARIATIONS, Drawn, drawn_values
from twin.effect import OUT, Effect, Excitation, Kind
from twin.excitation import Repeating
from twin.laws.trials import Array, TrialMotion, trace

Values = dict[str, float]
EFFECTS = {e.name: e for e in (*BUMPS, *CABLES, NOISE, *OUTSIDE.values())}
MOTION = TrialMotion.random(np.random.default_rng(5), samples=300, dt=0.037)
SEEN = Excitation(-0.15, 0.15, 0.2, 0.3, 12.0, 1e-3, repeats=Repeating((7.0,), (0.02,)))
T = MOTION.dt * np.arange(len(MOTION))


def values_of(effect: Effect) -> Values:
    """Strengths that differ, and shapes off their start."""
    return {
        p.name: 0.3 + 0.21 * i if p.strength else p.start * 1.07
        for i, p in enumerate(effect.parameters)
    }


def from_bump(v: Values, x: Array) -> Array:
    """Signed distance from the nearest bump, m."""
    turns = (x - v["phase"]) / v["pitch"]
    return (turns - np.floor(turns + 0.5)) * v["pitch"]


def gaussian(v: Values, m: TrialMotion) -> Array:
    bump = np.exp(-((from_bump(v, m.x) / (0.3 * v["width"])) ** 2))
    height = np.where(m.v > 0.0, v["ahead"], v["behind"])
    return -height * np.tanh(m.v / 2e-4) * bump


def bulging(v: Values, m: TrialMotion) -> Array:
    """The direction follows that of the motion within 60 um, averaged over a whole sample."""
    direction, followed = 0.0, []
    for speed in m.v:
        if speed != 0.0:
            way = abs(speed) * m.dt
            direction += (np.sign(speed) - direction) * (1.0 - np.exp(-way / 6e-5))
        followed.append(direction)
    d = from_bump(v, m.x)
    part = np.where(d < 0.0, -d / (0.25 * v["width"]), d / (0.75 * v["width"]))
    bump = np.where(part < 1.0, np.cos(0.5 * np.pi * part) ** 2, 0.0)
    both, half = v["ahead"] + v["behind"], v["ahead"] - v["behind"]
    return -0.5 * (both * np.array(followed) + half) * bump


REFERENCES: dict[str, Callable[[Values, TrialMotion], Array]] = {
    "gaussian_bumps": gaussian,
    "bulging_bumps": bulging,
    "folding_cable": lambda v, m: -v["offset"] - v["k1"] * v["fold"] * np.tanh(m.x / v["fold"]),
    "tightening_cable": lambda v, m: (
        -v["offset"] - v["k1"] * v["fold"] * (np.exp(m.x / v["fold"]) - 1.0)
    ),
    "chirp": lambda v, m: v["a"] * np.sin(2 * np.pi * (v["f"] * T + 0.5 * v["rate"] * T**2)),
    "cubic_drag": lambda v, m: -v["c"] * m.v**3,
    "lone_bump": lambda v, m: v["a"] * np.exp(-(((m.x - v["place"]) / v["width"]) ** 2)),
    "saturating_drag": lambda v, m: -v["c"] * np.tanh(m.v / v["knee"]),
    "sudden_load": lambda v, m: v["a"] / (1.0 + np.exp(-(T - v["begin"]) / 0.025)),
}


def test_every_law_has_its_equation_here() -> None:
    assert {*REFERENCES, NOISE.name} == set(EFFECTS)


@pytest.mark.parametrize("name", REFERENCES)
def test_a_law_is_its_equation(name: str) -> None:
    effect = EFFECTS[name]
    values = values_of(effect)
    found = trace(effect, values, MOTION, law=effect.law).after[:, OUT]
    wanted = REFERENCES[name](values, MOTION)
    assert np.ptp(wanted) > 0.0
    np.testing.assert_allclose(found, wanted, rtol=1e-9, atol=1e-12)


def test_a_cable_that_tightens_stops_to_tighten_at_ten_folds() -> None:
    """Beyond any travel; a law must give a number there as well."""
    effect = EFFECTS["tightening_cable"]
    values = {"offset": 0.0, "k1": 1.0, "fold": 0.01}
    far = TrialMotion(1e-3, np.array([0.099, 0.1, 0.2, 1e6]), *np.zeros((2, 4)))
    found = -trace(effect, values, far, law=effect.law).after[:, OUT]
    np.testing.assert_allclose(found, 0.01 * np.expm1([9.9, 10.0, 10.0, 10.0]), rtol=1e-9)


def test_noise_has_its_size_its_memory_and_four_uniform_numbers_a_sample() -> None:
    """Park and Miller's numbers: 16807 times the last, modulo 2^31 - 1."""
    values = {"size": 0.4, "memory": 0.02, "seed": 7.0}
    count, dt = 20_000, 1e-3
    still = TrialMotion(dt, *np.zeros((3, count)))
    found = trace(NOISE, values, still, law=NOISE.law).after[:, OUT]
    assert np.std(found) == pytest.approx(0.4, rel=0.1)
    assert abs(np.mean(found)) < 0.1
    lag = 20
    alike = np.corrcoef(found[:-lag], found[lag:])[0, 1]
    assert alike == pytest.approx(np.exp(-lag * dt / 0.02), abs=0.06)
    draw, total = 7, 0.0
    for _ in range(4):
        draw = 16807 * draw % 2147483647
        total += draw / 2147483647 - 0.5
    kept = np.exp(-dt / 0.02)
    assert found[0] == pytest.approx(0.4 * np.sqrt(3.0 * (1.0 - kept**2)) * total)
    other = trace(NOISE, {**values, "seed": 8.0}, still, law=NOISE.law).after[:, OUT]
    assert abs(np.corrcoef(found, other)[0, 1]) < 0.1


@pytest.mark.parametrize("effect", EFFECTS.values(), ids=EFFECTS)
def test_a_law_of_the_self_test_is_in_no_catalogue_and_gone_at_no_strength(effect) -> None:
    assert effect.name not in CATALOGUE
    values = values_of(effect)
    absent = {**values, **{p.name: 0.0 for p in effect.strengths}}
    assert not trace(effect, absent, MOTION, law=effect.law).after[:, OUT].any()
    there = trace(effect, values, MOTION, law=effect.law).after[:, OUT]
    assert np.isfinite(there).all()
    assert there.any()


# --- values ----------------------------------------------------------------------------------


def unscanned(effect: Effect) -> Effect:
    return replace(effect, parameters=tuple(replace(p, scan=None) for p in effect.parameters))


@pytest.mark.parametrize("name", CATALOGUE)
def test_values_are_drawn_without_a_look_at_the_scan(name) -> None:
    effect = CATALOGUE[name]
    drawn = drawn_values(effect, SEEN, np.random.default_rng(6))
    assert drawn == drawn_values(unscanned(effect), SEEN, np.random.default_rng(6))
    for p in effect.parameters:
        assert p.lower <= drawn[p.name] <= p.upper
        if p.scan and not p.fixed and p.lower < p.upper:
            assert drawn[p.name] not in p.scan(SEEN)


def test_damping_is_log_uniform_and_drawn_where_a_model_holds_it() -> None:
    draws, source = [], np.random.default_rng(6)
    for _ in range(400):
        for name in ("flexible_mode", "backlash"):
            draws.append(drawn_values(CATALOGUE[name], SEEN, source)["damping"])
    low, high = np.log(DAMPING)
    parts = np.histogram(np.log(draws), bins=4, range=(low, high))[0]
    assert parts.sum() == 800
    # Four standard deviations of a binomial of 800 and 1/4.
    assert np.abs(parts - 200).max() < 4.0 * np.sqrt(800 * 0.25 * 0.75)


# --- variations ------------------------------------------------------------------------------


@pytest.mark.parametrize("name", VARIATIONS)
def test_a_variation_changes_the_machine_and_leaves_its_model_the_laws_of_the_stage(name) -> None:
    model = replace(STAGE, axes={"x": STAGE.axes["x"]})
    drawn = VARIATIONS[name](Drawn(model, STAGE), "x", np.random.default_rng(6))
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
    drawn = VARIATIONS["everything"](Drawn(STAGE, STAGE), "x", np.random.default_rng(6))
    assert drawn.reshaped == set(STAGE.axes["x"].names)
    left = set(drawn.true.axes["x"].names) & set(STAGE.axes["x"].names)
    assert left == {"lugre"}
