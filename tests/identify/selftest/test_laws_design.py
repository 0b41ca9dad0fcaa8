"""The self-test's cases are drawn from a seed, each sort in its number."""

from __future__ import annotations

from built_fits import CATALOGUE

from identify.selftest import design
from identify.selftest.design import FULL, QUICK, STRONG, WEAK, Design, plantable, release_seed
from identify.selftest.laws import OUTSIDE
from identify.selftest.variations import VARIATIONS
from twin.effect import Kind


def test_a_design_makes_the_same_cases_from_the_same_seed_only():
    drawn = Design(empty=9, strong=90, weak=60, outside=11, pairs=6, left_out=5)
    made = drawn.cases(5)
    assert made == drawn.cases(5)
    assert not set(made) & set(drawn.cases(6))
    assert len(set(made)) == len(made) == 9 + 90 + 60 + 11 + 6 + 5
    names = set(plantable(CATALOGUE))
    assert "lugre" not in names
    assert not any(CATALOGUE[n].is_nonparametric for n in names)
    empty = [c for c in made if not c.effects]
    assert [(c.strength, c.known) for c in empty] == [(0.0, True)] * 9
    assert {c.variation for c in empty} == set(VARIATIONS)  # in turn
    inside = [c for c in made if len(c.effects) == 1 and c.known and c.effects[0] in names]
    for strength, count in ((STRONG, 90), (WEAK, 60)):
        own = [c.effects[0] for c in inside if c.strength == strength]
        assert len(own) == count
        assert set(own) == names  # in turn
    outside = [c.effects[0] for c in made if c.effects and c.effects[0] in OUTSIDE]
    assert (len(outside), set(outside)) == (11, set(OUTSIDE))
    assert sum(len(c.effects) == 2 for c in made) == 6
    assert sum(not c.known for c in made) == 5


def test_a_quick_design_and_the_full_one():
    quick, full = QUICK.cases(1), FULL.cases(1)
    assert len(quick) == 10  # two minutes of one core at twelve seconds each
    assert 200 < len(full) <= 300  # half an hour of two cores
    assert {c.variation for c in full} == set(VARIATIONS)


def test_development_and_release_are_drawn_apart():
    assert release_seed() != design.DEVELOPMENT
    assert release_seed() >= design.FIRST_RELEASE > design.DEVELOPMENT
    assert not set(FULL.cases(release_seed())) & set(FULL.cases(design.DEVELOPMENT))


def test_two_frictions_are_never_planted_together():
    frictions = [n for n in plantable(CATALOGUE) if CATALOGUE[n].kind is Kind.FRICTION]
    assert len(frictions) > 2
    alone = Design(pairs=3).cases(1, frictions)
    assert not any(len(c.effects) == 2 for c in alone)
    mixed = Design(pairs=40).cases(1, [*frictions, "wear"])
    pairs = [c.effects for c in mixed if len(c.effects) == 2]
    assert len(pairs) == 40
    assert all("wear" in pair for pair in pairs)
