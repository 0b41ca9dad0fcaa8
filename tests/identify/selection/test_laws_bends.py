"""What bends the law of an added effect: when it is asked for, kept, held again and told."""

from __future__ import annotations

import importlib
from dataclasses import replace

import numpy as np
import pytest
from built_fits import (
    CATALOGUE,
    axis_of,
    built,
    built_dataset,
    built_fit,
    built_machine,
    dataset_stub,
    fitted,
)
from identify.selection.diagnosis import diagnose_axis

from identify.estimation.fit import fit_axis
from identify.output.words.findings import advice, finding_in_words
from identify.selection.bends import Bend, bend_of, held_bends, is_needed, straightened
from identify.selection.findings import FindingKind, found_reshaped
from identify.selection.found_shape import AHEAD
from twin.curve import Coordinate
from twin.effects import Catalogue

module = importlib.import_module("identify.selection.bends")
reshaping = importlib.import_module("identify.selection.reshaping")
DATASET = dataset_stub()
DRAG = fitted("quadratic_drag", c=0.9)
BENT = replace(DRAG, values={**DRAG.values, "n": 3.1}, fixed=DRAG.fixed - {"n"})
HIGH, LOW = built_fit(8.0), built_fit(1.1)  # over a floor of 1 N


def test_a_bend_is_a_parameter_held_by_design_that_is_free() -> None:
    assert held_bends(DRAG) == ("n",)
    assert held_bends(BENT) == ()
    assert bend_of(DRAG) is None
    assert bend_of(BENT) == Bend("n", 2.0, 3.1, "1")
    assert held_bends(fitted("cogging")) == ()
    assert bend_of(fitted("cogging")) is None


@pytest.mark.parametrize(
    ("found", "differs"), [(2.19, False), (2.21, True), (1.81, False), (1.79, True)]
)
def test_a_law_is_still_itself_within_a_tenth_of_its_bend(found: float, differs: bool) -> None:
    assert Bend("n", 2.0, found, "1").differs is differs


@pytest.mark.parametrize(
    ("bic", "t", "after", "plausible", "base", "asked"),
    [
        (11.0, 3.1, 2.0, True, HIGH, True),  # as an effect would be added
        (11.0, 2.9, 2.0, True, HIGH, False),
        (101.0, 0.5, 2.0, True, HIGH, True),  # beyond doubt, and the held-out error falls
        (99.0, 0.5, 2.0, True, HIGH, False),
        (101.0, 0.5, 7.1, True, HIGH, False),
        (101.0, 0.5, 2.0, False, HIGH, False),  # a bend at its bound
        (99.0, 9.0, 2.0, True, LOW, False),  # at the noise floor it needs far more
        (101.0, 9.0, 2.0, True, LOW, True),
    ],
)
def test_a_bend_is_needed_with_support_or_beyond_doubt(bic, t, after, plausible, base, asked):
    with_bend = replace(built(bic=bic, t=t, before=7.0, after=after), plausible=plausible)
    assert is_needed(with_bend, base) is asked


@pytest.mark.parametrize(
    ("name", "given", "bic", "held_again"),
    [
        ("quadratic_drag", (), 9.0, True),
        ("quadratic_drag", (), 500.0, False),
        ("quadratic_drag", ("quadratic_drag",), 9.0, False),  # the user's own
    ],
)
def test_a_bend_goes_that_later_effects_make_needless(monkeypatch, name, given, bic, held_again):
    fit, held = built_fit(2.0, axis=axis_of(BENT)), built_fit(2.1, axis=axis_of(DRAG))

    def again(axis, logs):
        assert axis[name].values["n"] == 2.0
        assert axis[name].fixed == DRAG.fixed
        return held

    monkeypatch.setattr(module, "fit_axis", again)
    monkeypatch.setattr(module, "score", lambda *_: built(bic=bic))
    assert straightened(fit, DATASET, given) is (held if held_again else fit)


@pytest.mark.parametrize(
    ("effects", "given", "rival", "after", "asked"),
    [
        ((DRAG,), (), None, 3.0, ["quadratic_drag"]),
        ((DRAG,), ("quadratic_drag",), None, 3.0, []),  # a law of the model itself
        ((BENT,), (), None, 3.0, []),  # free already
        ((DRAG,), (), 3.0, 2.7, []),  # an absent effect leaves about as little: 0.81 of it
        ((DRAG,), (), 3.0, 2.6, ["quadratic_drag"]),
    ],
)
def test_the_law_of_an_added_effect_is_bent_beside_its_rivals(
    monkeypatch, effects, given, rival, after, asked
):
    fit = built_fit(8.0, axis=axis_of(*effects))
    rivals = [] if rival is None else [built("wear", before=8.0, after=rival)]
    there = built("quadratic_drag", before=8.0, after=after, bic=500.0)
    monkeypatch.setattr(reshaping, "bent", lambda fit, dataset, law, bend: there)
    found = reshaping.bent_in_place(fit, DATASET, rivals, ("coulomb_viscous", *given))
    assert (found is there.fit) is bool(asked)


@pytest.mark.parametrize(
    ("whole", "typical", "better"), [(0.79, 0.79, True), (0.81, 0.5, False), (0.5, 0.81, False)]
)
def test_a_frictions_curve_must_leave_clearly_less_of_the_whole_and_of_a_typical_block(
    whole, typical, better
):
    rival = built(before=8.0, after=4.0, typical=0.2)
    curve = built(bic=9e9, before=8.0, after=4.0 * whole**0.5, typical=0.2 * typical)
    assert reshaping._is_clearly_better(curve, [rival]) is better


def test_a_rival_competes_with_what_bends_its_law_free(monkeypatch) -> None:
    """A Stribeck friction of another exponent, which the friction's free curve holds too."""
    base, law = built_fit(8.0), fitted("stribeck")
    first = built("stribeck", before=8.0, after=4.0)
    asked = []

    def bent(fit, dataset, law, bend):
        asked.append((fit, law.effect.name, bend))
        return built("stribeck", before=4.0, after=1.0)

    def score(fit, again, dataset, effect):
        assert fit is base
        assert effect == law.effect
        return built("stribeck", before=8.0, after=again.error)

    monkeypatch.setattr(reshaping, "bent", bent)
    monkeypatch.setattr(reshaping, "score", score)
    found = reshaping._bent_rivals([first, built("cogging")], base, DATASET)
    assert asked == [(first.fit, "stribeck", "n")]
    assert [c.gain.after for c in found] == [1.0]


@pytest.mark.parametrize(
    ("plausible", "bic", "t", "after", "typical", "level"),
    [
        (False, 40.0, 5.0, 4.4, 0.9, True),  # the curve leaves 4 N: 0.83 of the square
        (False, 40.0, 5.0, 4.6, 0.9, False),
        (False, 40.0, 5.0, 4.6, 0.3, True),  # and 0.25 of a typical block's
        (False, 40.0, 5.0, 4.6, 0.32, False),
        (False, 9.0, 5.0, 4.4, 0.9, False),
        (False, 40.0, 2.9, 4.4, 0.9, False),
        (True, 40.0, 5.0, 4.4, 0.9, False),  # it competes by itself
    ],
)
def test_what_explains_as_much_with_values_hardly_its_own_is_told_beside_a_curve(
    monkeypatch, plausible, bic, t, after, typical, level
):
    """An end stop as soft as a cable: a force of position that only its ends tell apart."""
    gain = built(before=8.0, after=4.0, typical=0.25).gain
    monkeypatch.setattr(reshaping, "gain_held_out", lambda before, fit, dataset: gain)
    soft = replace(
        built("end_stop", bic=bic, t=t, before=8.0, after=after, typical=typical),
        plausible=plausible,
    )
    # One cycle over the travel is any force of position, and no cogging.
    slow = replace(built("cogging", bic=40.0, before=8.0, after=3.0), plausible=False)
    found = reshaping.Reshaped(None, HIGH, LOW)
    told = reshaping._level(found, DATASET, [soft, built("wear"), slow])
    assert told == (("end_stop",) if level else ())


# --- on motions -----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def cubic():
    """A dataset whose machine has a drag with the cube of speed, the fit without any, and law."""
    law = replace(fitted("quadratic_drag", c=4.0, n=3.0, vc=0.2), fixed=frozenset({"vc"}))
    there = built_machine(built_dataset("one", "two", held=("held",)), axis_of(law))
    return there, fit_axis(axis_of(), there.fit)


def test_a_drag_with_the_cube_of_speed_is_told_by_its_exponent(cubic) -> None:
    """Named by the nearest law of the catalogue, with the exponent in place of the law's own."""
    there, base = cubic
    few = Catalogue([CATALOGUE[n] for n in ("quadratic_drag", "coulomb_viscous")])
    found = diagnose_axis(base, there, few)
    (finding,) = found.findings
    assert (finding.effect, finding.kind) == ("quadratic_drag", FindingKind.RESEMBLES)
    assert finding.bend is not None
    assert (finding.bend.parameter, finding.bend.held) == ("n", 2.0)
    assert finding.bend.found == pytest.approx(3.0, abs=0.1)
    assert finding.tested.after < 0.3 * finding.tested.before
    drawn = finding.shape
    assert drawn is not None
    assert (drawn.over, drawn.unit) == (Coordinate.SPEED, "m/s")
    ahead, true = drawn.curves[AHEAD], -4.0 / 0.2 * drawn.coordinate**3
    np.testing.assert_allclose(ahead.found, true, atol=0.03 * abs(true).max())
    assert abs(ahead.assumed - true).max() > 0.1 * abs(true).max()  # the square law, as it fits
    words = finding_in_words(finding)
    assert "resembles quadratic_drag, with n = 3" in words
    assert "in place of n = 2; that law explains" in words
    assert advice(found.findings) == (
        'after `twin add quadratic_drag`, fixed = ["vc"] for quadratic_drag in the model file lets '
        "`twin fit` find its n, which gives the model the shape that the logs show"
    )


def test_a_drag_of_the_model_itself_has_another_shape_by_its_exponent(cubic) -> None:
    there, _ = cubic
    held = axis_of(fitted("quadratic_drag", c=4.0, vc=0.2))
    base = fit_axis(held, there.fit)
    found = reshaping.curve_in_place(base, there, (), held.names)
    assert found is not None
    assert found.shape.effect == "quadratic_drag"
    assert found.fit.axis["quadratic_drag"].values["n"] == pytest.approx(3.0, abs=0.1)
    finding = found_reshaped(found.shape, base, base, found.fit, there)
    assert finding.kind is FindingKind.WRONG_SHAPE
    assert finding.bend is not None
    assert finding.bend.held == 2.0
