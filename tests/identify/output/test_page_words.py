"""Numbers, units and sentences as a page has them."""

from __future__ import annotations

from dataclasses import replace

import built_results as made
import pytest
from built_fits import axis_of, built, built_fit, fitted

from identify.dataset.noise_floor import NoiseFloor
from identify.estimation.confounded import MovedParameter
from identify.experiment_design.missing_excitation import Gap
from identify.output.numbers import DisplayUnit, capitalised, quantity, span, typeset
from identify.output.words.findings import role_in_words
from identify.output.words.fit import moved_in_words, noise_in_words, place_in_words
from identify.output.words.next_step import (
    axis_in_words,
    gap_in_words,
    notes_in_words,
)
from identify.results.grown import Addition
from identify.selection.roles import RoleDependent
from twin.experiments.file import in_short
from twin.experiments.kinds import Rests
from twin.model.machine import HistoryStep
from twin.model.units import LINEAR


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (0.02, "N", "20.0 mN"),
        (-3.3e-4, "s", "−330 µs"),
        (1e-9, "m", "1.00 nm"),
        (1.234e-3, "kg", "0.00123 kg"),
        (0.018, "N s/m", "0.0180 N·s/m"),
        (2.0, "1", "2.00"),
        (0.0, "m", "0 m"),
        (9.87e-4, "kg", "9.87×10⁻⁴ kg"),
        (-1.234e7, "N/m^2", "−1.23×10⁷ N/m²"),
        (1234567.0, "N/m^2", "1234567 N/m²"),
        (4e-17, "N s^2/m^2", "4.00×10⁻¹⁷ N·s²/m²"),
        (None, "N", "–"),
        (float("nan"), "N", "–"),
        (float("inf"), "N", "∞ N"),
    ],
)
def test_numbers_with_units(value: float | None, unit: str, text: str) -> None:
    assert typeset(quantity(value, unit)) == text


@pytest.mark.parametrize(
    ("said", "printed"),
    [
        ("open-loop: -0.5 +- 2e-05 m of 4 um", "Open-loop: −0.5 ± 2×10⁻⁵ m of 4 µm."),
        ("sigma0 is off (-3.6e+03 %)", "sigma0 is off (−3.6×10³ %)."),
        ("payload_mass would make 1-2 N.", "payload_mass would make 1-2 N."),
    ],
)
def test_a_sentence_of_the_terminal_is_typeset_on_a_page(said: str, printed: str) -> None:
    assert typeset(capitalised(said)) == printed


@pytest.mark.parametrize("unit", ["N", "kg"])
def test_a_scale_keeps_the_value(unit: str) -> None:
    for value in (3.21e-8, 4.9e-4, 5.1e-4, 0.49, 0.51, 23.0):
        scale = DisplayUnit.of(unit, [value, -value / 3.0])
        assert scale(value) * scale.size == pytest.approx(value)
        prefixed = {1.0: "", 1e-3: "m", 1e-6: "µ", 1e-9: "n"}[scale.size]
        assert scale.unit == prefixed + unit
        assert unit == "kg" or scale(value) >= 0.5
        assert unit == "kg" or scale.size == 1.0 or scale(value) < 500.0
    assert DisplayUnit.of(unit, []).size == 1.0


@pytest.mark.parametrize(
    ("unit", "ends", "values", "printed"),
    [
        ("m", (0.02698, 0.02702), (0.02698, 0.027, 0.02702), ["26.980", "27.000", "27.020"]),
        ("N", (-1.0, 1.0), (-0.01, 1.0), ["0.0", "1.0"]),
        ("N", (1.0, 1.0), (1.0,), ["1.00"]),
        ("kg m^2", (4.740e-6, 4.795e-6), (4.740e-6, 4.768e-6), ["4.740e-06", "4.768e-06"]),
    ],
)
def test_an_interval_has_two_digits_of_its_half_width(unit, ends, values, printed) -> None:
    assert DisplayUnit.of(unit, [values[-1]]).within(*ends, *values) == printed


@pytest.mark.parametrize(
    ("changed", "said"),
    [
        ({"low": 0.0, "high": 1.5}, "moving forwards"),
        ({"low": -1.5, "high": 0.0}, "moving backwards"),
        (
            {"coordinate": "standstill", "low": 0.0, "high": 1.0},
            "in motion",
        ),
        (
            {"coordinate": "standstill", "low": 1.0, "high": 2.0},
            "at standstill",
        ),
        (
            {"coordinate": "position", "coordinate_unit": "m", "low": 0.01131, "high": 0.01157},
            "position between 11.31 and 11.57 mm",
        ),
    ],
)
def test_a_place_is_named_with_the_digits_of_its_width(changed, said):
    _, back = made.comparison_of().worst
    assert place_in_words(replace(back, **changed)) == said


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


@pytest.mark.parametrize(
    ("part", "advice"),
    [
        ("aliasing", "log at the control rate, or the drive's averaged current"),
        ("path", "log at a higher rate, or with a finer encoder"),
    ],
)
@pytest.mark.parametrize(("size", "told"), [(0.038, True), (0.02, False), (0.0, False)])
def test_noise_that_logging_makes_is_told_with_what_to_log_instead(
    part: str, advice: str, size: float, told: bool
) -> None:
    noise = NoiseFloor(0.04, 0.03, 0.05, 0.05, {"sensors": 0.01, part: size})
    said = noise_in_words(noise, LINEAR) or ""
    assert bool(said) is told
    assert ("38.0 mN of the noise floor of 40.0 mN" in said) is told
    assert (advice in said) is told


def test_an_experiment_in_short_has_the_units_of_its_parameters() -> None:
    rests = Rests("y", 0.0021, 0.0043, (0.1, 0.75), effort=0.25)
    assert in_short(rests) == (
        "rests: axis y, effort 0.25, span 0.0021 m, speed 0.0043 m/s, rests 0.1 0.75 s"
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
    assert notes(added, step=reshaped) == (
        "cogging is beside the law of coulomb_viscous; the force is that of both, so do not read "
        "the law's values alone",
    )
    replaced = replace(reshaped, effect="roller_spikes")
    instead, note = notes(added, (moved,), ("empirical_map",), replaced)
    assert instead == "cogging is in the place of the law of roller_spikes"
    assert note.startswith("mass moved")
    curve = built("empirical_map", fit=built_fit(0.1, axis=axis_of(fitted("empirical_map"))))
    told, note = notes(curve, (moved,))
    assert told.startswith("empirical_map is a fitted curve, not a physical law")
    assert note.startswith("mass moved")


def test_by_which_log_a_law_is_proved_is_said_with_its_score() -> None:
    lost = role_in_words(RoleDependent("wear", named=True, part=-0.3, t=-1.27))
    assert lost.endswith("choosing it is not surely proved: it takes 0 % of what is left, t = -1.3")
    by_chance = role_in_words(RoleDependent("wear", named=True, part=0.42, t=4.2, control=0.45))
    assert by_chance.endswith("it takes 42 % of what is left (45 % by chance), t = 4.2")
    gained = role_in_words(RoleDependent("wear", named=False, part=0.12, t=0.8))
    assert "as they are not (it takes 12 % of what is left, t = 0.8)" in gained
