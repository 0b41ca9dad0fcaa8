"""A friction is taken over by an effect where its dry part collapses beside it."""

from __future__ import annotations

from dataclasses import replace

import pytest
from built_fits import (
    PLAIN,
    axis_of,
    fitted,
)
from identify.selection.ranking import took_friction

from twin.model.machine import Fitted

COLLAPSE = 0.3  # of the dry part, as it was decided


def friction(**values: float) -> Fitted:
    own = PLAIN.effects[0]
    return replace(own, values={**own.values, **values})


@pytest.mark.parametrize(
    ("after", "taken"),
    [
        (friction(Fc=0.31 * COLLAPSE + 1e-4), False),
        (friction(Fc=0.31 * COLLAPSE - 1e-4), True),
        (friction(sigma2=0.001), False),
        (friction(Fs=0.001), False),  # held by the fit
    ],
)
def test_a_friction_is_taken_where_its_dry_part_collapses(after, taken):
    assert took_friction(PLAIN, PLAIN.with_effect(after)) is taken


def test_a_friction_that_was_replaced_was_not_taken_over():
    assert not took_friction(PLAIN, PLAIN.with_effect(fitted("lugre")))
    assert not took_friction(replace(PLAIN, effects=()), PLAIN)
    other = fitted("constant_force", F0=2.0)
    gone = fitted("constant_force", F0=1e-3)
    assert not took_friction(axis_of(other), axis_of(gone))
