"""What other values of the bodies explain is no law of a joint; what they do not explain may be."""

from __future__ import annotations

import pytest
from arms import ARM, arm_log, friction

from identify.analysis.first_model import first_model
from identify.selection.acceptance import Judged
from identify.selection.of_bodies import is_of_bodies
from identify.selection.refusal import Instead
from identify.selection.trying import effect_tried
from identify.workflow import fit
from twin.effects import load_catalogue

CATALOGUE = load_catalogue()


def longer(model):
    """The upper arm's centre, 3 mm further out than its file has it."""
    model.body_ipos[model.body("upper").id, 0] += 0.003


def drag(position, velocity):
    """A force that no body makes."""
    return friction(position, velocity) - [0.0, 0.15 * velocity[1] * abs(velocity[1]), 0.0]


@pytest.mark.parametrize(
    ("planted", "law", "of_bodies"),
    [
        ({"change": longer}, "position_dependent_force_constant", True),
        ({"forces": drag}, "quadratic_drag", False),
    ],
)
def test_a_law_is_judged_beside_the_bodies(planted, law, of_bodies):
    logs = [{str(seed): arm_log(seed, **planted)} for seed in (1, 2)]
    made = fit(first_model(logs[0], "arm", CATALOGUE, ("arm.xml", ARM)), *logs)
    base, dataset = made.fits["shoulder"], made.datasets["shoulder"]
    found = effect_tried(base, dataset, CATALOGUE[law])
    tried, doubt = found.judged, found.candidate.doubt
    assert tried.fit.error < 0.9 * base.error
    assert is_of_bodies(Judged(base, dataset), tried, CATALOGUE[law]) == of_bodies
    assert (doubt is Instead.WEIGHT_OF_BODIES) == of_bodies
