"""What decides how a sentence reads: thresholds, singular and plural, digits, what is left out."""

from __future__ import annotations

from dataclasses import replace

import built_results as made
import pytest
from built_fits import axis_of, built, built_fit, fitted

from identify.dataset.noise_floor import NoiseFloor
from identify.estimation.confounded import Change, MovedParameter, Refit
from identify.experiment_design.missing_excitation import Gap
from identify.output.numbers import quantity, span
from identify.output.words.addition import axis_in_words, notes_in_words
from identify.output.words.fit import (
    aliasing_in_words,
    change_in_words,
    moved_in_words,
    refit_in_words,
)
from identify.output.words.plan import gap_in_words
from identify.results.addition import Addition
from twin.experiments.file import in_short
from twin.experiments.kinds import Rests
from twin.model.machine import HistoryStep
from twin.model.units import LINEAR


@pytest.mark.parametrize(
    ("share", "said"),
    [
        (None, "the explanations differ most at"),
        (0.049, "missing motion: speed"),
        (0.051, "no motion is missing"),
    ],
)
def test_a_gap_is_missing_where_few_of_the_data_are(share, said) -> None:
    assert gap_in_words(Gap("speed", "m/s", 0.01, 0.05, share)).startswith(said)


@pytest.mark.parametrize(("folded", "told"), [(0.038, True), (0.02, False), (0.0, False)])
def test_a_thinned_log_is_told_with_what_to_log_instead(folded: float, told: bool) -> None:
    noise = NoiseFloor(0.04, 0.03, 0.05, {"sensors": 0.01, "aliasing": folded})
    said = aliasing_in_words(noise, LINEAR) or ""
    assert bool(said) is told
    assert ("38.0 mN of the noise floor of 40.0 mN" in said) is told
    assert ("log at the control rate, or the drive's averaged current" in said) is told


def test_an_experiment_in_short_has_the_units_of_its_parameters() -> None:
    rests = Rests("y", 0.0021, 0.0043, (0.1, 0.75), effort=0.25)
    assert in_short(rests) == (
        "rests: axis y, effort 0.25 1, span 0.0021 m, speed 0.0043 m/s, rests 0.1 0.75 s"
    )


def test_why_an_axis_was_chosen_is_said() -> None:
    both = ("x", "y")
    assert axis_in_words("wear", "x", ["x"], []) is None
    taken = "axis x has wear already, so it went to axis y"
    assert axis_in_words("wear", "y", both, ["x"]) == taken
    most = "of axes x, y, axis y has the most evidence for it"
    assert axis_in_words("wear", "y", both, []) == most


def test_numbers_that_differ_look_different_and_a_ratio_has_no_unit() -> None:
    moved = moved_in_words(replace(made.MOVED, before=15.2004, after=15.2021))
    assert moved == "mass moved from 15.200 to 15.202 kg: more than its uncertainty"
    assert "from 15.2 to 15.2 kg" in moved_in_words(replace(made.MOVED, before=15.2, after=15.2))
    ratio = replace(made.MOVED, before=0.2261, after=0.201, unit="1", collapsed=False)
    assert " moved from 0.226 to 0.201: more than" in moved_in_words(ratio)
    assert (quantity(0.5, "1"), span(1.0, 2.0, "1")) == ("0.500", "1.00 and 2.00")


def test_a_change_names_what_gives_the_same_force_and_a_good_fit_says_nothing() -> None:
    change = Change("mass", 15.2004, 15.2021, "kg", 0.572, ("payload_mass", "cogging"))
    assert change_in_words(change) == (
        "mass 15.200 -> 15.202 kg changes the force by 0.572 N (payload_mass and cogging give the "
        "same force)"
    )
    assert refit_in_words(Refit(0.913, 0.127, ())) is None


def test_an_added_effect_is_noted_by_what_it_moved_removed_and_replaced() -> None:
    moved = MovedParameter("mass", 5.0, 5.5, "kg", False)
    gone = MovedParameter("constant_force.F0", 0.3, 0.01, "N", True)
    added = built("cogging", fit=built_fit(0.1, axis=axis_of(fitted("cogging"))))
    step = HistoryStep("add", "cogging", "x", 3.0, 2.0, 3.1, 2.1)
    reshaped = replace(step, action="shape", effect="coulomb_viscous")  # which the axis still has

    def notes(candidate, moved=(), gone=(), step=step):
        return notes_in_words(Addition(None, step, candidate, True, None, None, moved, gone))[0]

    assert notes(added, (moved, gone), ("empirical_map",)) == (
        "mass moved from 5.00 to 5.50 kg: more than its uncertainty",
        "constant_force.F0 collapsed from 300 to 10.0 mN: it had taken over the missing effect's "
        "force",
        "empirical_map was removed before cogging was added; add it again for the error that is "
        "left",
    )
    assert notes(added) == ()
    assert notes(added, step=reshaped) == ("cogging is beside the law of coulomb_viscous",)
    replaced = replace(reshaped, effect="roller_spikes")
    instead, note = notes(added, (moved,), ("empirical_map",), replaced)
    assert instead == "cogging is in the place of the law of roller_spikes"
    assert note.startswith("mass moved")
    curve = built("empirical_map", fit=built_fit(0.1, axis=axis_of(fitted("empirical_map"))))
    told, note = notes(curve, (moved,))
    assert told.startswith("empirical_map is a fitted curve, not a physical law")
    assert note.startswith("mass moved")
