"""The search of an effect's shape: which values are tried, and how many of them."""

from __future__ import annotations

import itertools
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import CATALOGUE, PLAIN, built_dataset, built_fit, fitted

from identify.estimation import variable_projection as search
from identify.estimation.evidence import effective_samples
from identify.estimation.fit import Outcome, finished
from identify.estimation.variable_projection import (
    Start,
    _best,
    _beyond_chance,
    _clipped,
    starts,
    tried_shapes,
    with_what_repeats,
)
from twin.effect import Excitation
from twin.model.machine import Fitted

# The rules as they were decided.
CHANCE, FULL_SHAPES, REFINED_STARTS = 4.0, 4, 2
RESCORED_SHAPES, RESIDUAL_LINES = 12, 6
RNG = np.random.default_rng(3)
SEEN = Excitation(-0.05, 0.07, 0.4, 0.3, 3.0, 1e-3)


@pytest.fixture(scope="module")
def dataset():
    return built_dataset("one", "two")


def test_every_combination_of_the_scanned_values_is_tried_once():
    effect = CATALOGUE["end_stop"]
    scanned = {p.name: list(p.scan(SEEN)) for p in effect.parameters if p.scan}
    assert scanned
    found = [tuple(s.items()) for s in tried_shapes(effect, SEEN)]
    expected = [
        tuple(zip(scanned, values, strict=True)) for values in itertools.product(*scanned.values())
    ]
    assert found == expected
    assert list(tried_shapes(CATALOGUE["constant_force"], SEEN)) == [{}]


def test_a_shape_starts_from_the_data_within_its_bounds():
    effect = CATALOGUE["coulomb_viscous"]
    found = _clipped(effect, replace(SEEN, dry_level=0.37), {"sigma2": -2.0, "Fs": 1e20})
    assert found == {"Fc": 0.37, "Fs": effect.parameter("Fs").upper, "sigma2": 0.0}


def of_size(squared: float, shape=None, fitted=None) -> Start:
    """A start that leaves one test function of that squared error, N^2."""
    left = np.array([np.sqrt(squared)])
    return Start(shape or {}, fitted, left, left)


def test_the_best_tries_come_first_and_no_more_than_asked(monkeypatch):
    errors = [5.0, 1.0, 4.0, 2.0, 3.0]
    tried = [of_size(0.0, {"i": i}) for i in range(5)]
    monkeypatch.setattr(
        search, "_try", lambda g, shape, s: of_size(errors[int(shape["i"])], {**shape, "s": s})
    )
    found = _best(None, tried, "all", 3)
    assert [(s.shape["i"], s.shape["s"]) for s in found] == [(1, "all"), (3, "all"), (4, "all")]
    assert [s.squared_error for s in found] == pytest.approx([1.0, 2.0, 3.0])


@pytest.mark.parametrize(
    ("effect", "shapes", "worth", "rounds"),
    [
        ("quadratic_drag", 1, True, [("whole", 1, 1)]),
        ("dahl", FULL_SHAPES, True, [("whole", FULL_SHAPES, 2)]),
        ("backlash", FULL_SHAPES, False, [("whole", FULL_SHAPES, 1)]),
        ("dahl", 5, True, [("head", 5, 2)]),
        ("backlash", 5, True, [("head", 5, 1), ("whole", FULL_SHAPES, 1)]),
        ("backlash", 5, False, [("head", 5, 1), ("whole", 1, 1)]),
        ("cogging", RESCORED_SHAPES, True, [("head", 12, 6), ("whole", 4, 6)]),
        ("cogging", 13, True, [("head", 13, 2), ("head", 12, 6), ("whole", 4, 6)]),
        ("end_stop", 25, True, [("head", 25, None), ("whole", 4, None)]),
    ],
)
def test_many_shapes_are_sifted_on_the_heads_first(monkeypatch, effect, shapes, worth, rounds):
    seen, whole = [], []
    effect = CATALOGUE[effect]

    def best(ground, tried, strengths, count):
        assert all(isinstance(s.fitted, Fitted) and "i" in s.shape for s in tried)
        seen.append((ground, len(tried), len(strengths)))
        return list(tried)[:count]

    def tried_on_all(ground, shape, strengths):
        whole.append(shape["i"])
        assert (ground, len(strengths)) == ("whole", len(effect.strengths))
        return of_size(9.0 - shape["i"], shape)

    monkeypatch.setattr(search, "with_what_repeats", lambda base, dataset: SEEN)
    monkeypatch.setattr(search, "tried_shapes", lambda e, x: ({"i": i} for i in range(shapes)))
    monkeypatch.setattr(search, "_best", best)
    monkeypatch.setattr(search, "_try", tried_on_all)
    monkeypatch.setattr(search, "_beyond_chance", lambda base, start: worth)

    def of(*given, on_heads):
        assert given == ("base", "dataset", effect, SEEN)
        return "head" if on_heads else "whole"

    monkeypatch.setattr(search, "_Ground", SimpleNamespace(of=of))
    found = starts("base", "dataset", effect)
    full = len(effect.strengths)
    wanted = [(g, n, full if k is None else k) for g, n, k in rounds]
    assert seen + ([("whole", len(whole), full)] if whole else []) == wanted
    assert len(found) == min(REFINED_STARTS, rounds[-1][1])
    if whole:  # those on all of the logs by what they leave there, the last of them least
        assert [s.shape["i"] for s in found] == whole[::-1][:REFINED_STARTS]


@pytest.mark.parametrize(("rows", "tries"), [(11, 80), (9, 99)])
def test_of_many_shapes_every_other_is_tried_and_those_beside_the_best(monkeypatch, rows, tries):
    """Unlike powers of two, so that the best lies between the values that are tried first."""
    plays, tones = 1.5 ** np.arange(11.0), 1.25 ** np.arange(float(rows))
    shapes = [{"play": p, "frequency": f} for p in plays for f in tones]
    tried = [of_size(0.0, shape, fitted("backlash")) for shape in shapes]
    asked = []

    def score(ground, shape, strengths):
        asked.append(shape)
        off = np.log(shape["play"] / plays[5]), np.log(shape["frequency"] / tones[3])
        return of_size(float(np.hypot(*off)), shape, fitted("backlash"))

    monkeypatch.setattr(search, "_try", score)
    found = search._scanned(None, tried, ())
    assert found[0].shape == {"play": plays[5], "frequency": tones[3]}
    assert len(asked) == len(found) <= tries
    assert sorted(found, key=lambda s: s.squared_error) == found


def test_more_than_one_shape_deserves_a_try_where_the_gain_is_no_chance():
    noise = RNG.standard_normal(900)
    base = built_fit(0.0, residual=noise, jacobian=np.zeros((900, 1)))
    n, before = effective_samples(noise), float(noise @ noise)
    for effect in ("constant_force", "axis_coupling"):
        free = len(CATALOGUE[effect].strengths)
        for part, worth in ((0.98, False), (1.02, True)):
            left = before * np.exp(-part * CHANCE * free / n)
            assert _beyond_chance(base, of_size(left, {}, fitted(effect))) is worth


def test_a_tone_in_the_residual_is_among_the_first_lines_tried(dataset):
    base = finished(PLAIN, PLAIN, dataset.fit, Outcome.CONVERGED)
    tone = np.concatenate([np.sin(2.0 * np.pi * 7.3 * w.time) for w in dataset.fit])
    loud = replace(base, residual=tone[base.kept])
    known = replace(dataset, covered=lambda: replace(SEEN, lines=(3.21, 4.56)))
    found = with_what_repeats(loud, known)
    assert found.lines[-2:] == (3.21, 4.56)
    assert abs(found.lines[0] - 7.3) < 0.5
    assert len(found.lines) <= RESIDUAL_LINES + 2
    plain = replace(found, lines=(), pitches=(), thrust_pitches=())
    assert plain == replace(known.excitation, lines=())
    assert (found.pitches, found.thrust_pitches) == loud.pitches
