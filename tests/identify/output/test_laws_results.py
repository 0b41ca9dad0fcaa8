"""Results with a text and a JSON of their own: each number stands behind its own name."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from built_fits import CATALOGUE, PLAIN, axis_of, built, built_dataset, built_fit, fitted
from strict_json import told

from identify.estimation.fit import Outcome
from identify.estimation.open_loop import Beginning
from identify.estimation.simulated_motion import MotionFit
from identify.experiment_design.planting import FORCE, MASS, exemplary_motion, signature
from identify.output.machine import laws_text
from identify.output.numbers import Scale
from identify.output.text import agree_text, simulation_fit_text
from identify.output.words.addition import notes_in_words, step_in_words
from identify.output.words.fit import HELD_OUT_GREW, MOTION_OUTCOMES, motion_fit_in_words
from identify.results.addition import Addition
from identify.results.results import SimulationFit
from identify.selection.confounded import MovedParameter
from identify.validation.agreement import Agreement, AxisAgreement, Cause, Difference
from twin.effect import Kind
from twin.laws import verdict
from twin.model.machine import HistoryStep
from twin.model.parameters import free_parameters, read, write

# --- a fit of simulated motion -------------------------------------------------------------


def motion_fit(outcome: Outcome = Outcome.CONVERGED) -> MotionFit:
    where = free_parameters(PLAIN)
    now = write(PLAIN, where, read(PLAIN, where) * 1.07)
    beginnings = [Beginning(3, 0.011, -0.21, np.zeros(1)), Beginning(5, 0.013, 0.23, np.zeros(1))]
    logs = built_dataset("one", "two").fit
    fit = MotionFit(now, PLAIN, logs, beginnings, outcome, (7.1e-3, 5.3e-3, 9.7e-3))
    fit.__dict__["errors"] = (np.array([3e-3, -4e-3]),)
    fit.__dict__["error_begun"] = 8.5e-3
    return fit


def test_a_motion_fit_in_json() -> None:
    fit = motion_fit()
    result = SimulationFit(
        None, SimpleNamespace(not_fitted=["z"]), {"x": fit}, {"x": (6.1e-3, 4.3e-3)}
    )  # type: ignore[arg-type]
    found = told(result)
    assert (found["objective"], found["not_fitted"]) == ("simulation", ["z"])
    x = found["axes"]["x"]
    rms = 12.5**0.5 * 1e-3
    assert x["position_error"] == pytest.approx(rms)
    assert x["position_error_of_force_fit"] == 8.5e-3
    assert x["holdout_position_error"] == 4.3e-3
    assert x["holdout_position_error_of_force_fit"] == 6.1e-3
    assert x["errors_of_starts"] == [7.1e-3, 5.3e-3, 9.7e-3]
    assert (x["outcome"], x["converged"]) == (MOTION_OUTCOMES[Outcome.CONVERGED], True)
    for c, value in zip(free_parameters(PLAIN), read(PLAIN, free_parameters(PLAIN)), strict=True):
        assert x["parameters"][c.label] == {
            "value": pytest.approx(1.07 * value), "force_fit": pytest.approx(value),
            "unit": c.parameter.unit,
        }  # fmt: skip
    assert x["beginnings"] == {
        "one": {"time": pytest.approx(3e-3), "time_unit": "s", "position": 0.011,
                "position_unit": "m", "velocity": -0.21, "velocity_unit": "m/s"},
        "two": {"time": pytest.approx(5e-3), "time_unit": "s", "position": 0.013,
                "position_unit": "m", "velocity": 0.23, "velocity_unit": "m/s"},
    }  # fmt: skip
    none = replace(result, axes={"x": motion_fit(Outcome.NOT_CONVERGED)}, holdout_error={"x": None})
    x = told(none)["axes"]["x"]
    assert not x["converged"]
    assert x["holdout_position_error"] is None is x["holdout_position_error_of_force_fit"]


def test_a_motion_fit_in_words() -> None:
    first, ended, starts, none = motion_fit_in_words("x", motion_fit(), (6.1e-3, 4.3e-3))
    assert first.startswith("axis x: ")
    assert "position error 8.50 mm with the force fit, 3.54 mm now" in first
    assert first.endswith("; on logs that were not fitted 6.10 mm, 4.30 mm now")
    assert ended == MOTION_OUTCOMES[Outcome.CONVERGED]
    assert "from 3 starts" in starts
    assert starts.endswith("7.10, 5.30, 9.70 mm")
    assert none.startswith("no intervals")
    grown = motion_fit_in_words("x", motion_fit(), (4.3e-3, 6.1e-3))
    assert grown[1] == HELD_OUT_GREW
    assert HELD_OUT_GREW not in motion_fit_in_words("x", motion_fit(), None)
    assert "not fitted" not in motion_fit_in_words("x", motion_fit(), None)[0]
    result = SimulationFit(None, None, {"x": motion_fit()}, {"x": None})  # type: ignore[arg-type]
    rows = [line.split() for line in simulation_fit_text(result).splitlines()[1:]]
    found = {row[0]: row for row in rows if "(force" in row}
    for c, value in zip(free_parameters(PLAIN), read(PLAIN, free_parameters(PLAIN)), strict=True):
        row = found[c.label]
        scale = Scale.of(c.parameter.unit, [1.07 * value])
        assert float(row[1]) == pytest.approx(1.07 * value / scale.size, rel=1e-5)
        assert float(row[-1].rstrip(")")) == pytest.approx(value / scale.size, rel=1e-5)


# --- what a reader should know of an added effect ------------------------------------------


def test_an_added_effect_is_noted_by_what_it_moved_removed_and_replaced() -> None:
    moved = MovedParameter("mass", 5.0, 5.5, "kg", False)
    gone = MovedParameter("constant_force.F0", 0.3, 0.01, "N", True)
    added = built("cogging", fit=built_fit(0.1, axis=axis_of(fitted("cogging"))))
    step = HistoryStep("add", "cogging", "x", 3.0, 2.0, 3.1, 2.1)
    reshaped = replace(step, action="shape", effect="coulomb_viscous")  # which the axis still has

    def notes(candidate, moved=(), gone=(), step=step):
        return notes_in_words(Addition(None, step, candidate, True, None, None, moved, gone))[0]

    plain = notes(added, (moved, gone), ("empirical_map",))
    assert plain == (
        "mass moved from 5.00 to 5.50 kg: more than its uncertainty",
        "constant_force.F0 collapsed from 300 to 10.0 mN: it had taken over the missing effect's "
        "force",
        "empirical_map was removed before cogging was added; add it again for the error that is "
        "left",
    )
    assert notes(added) == ()
    (beside,) = notes(added, step=reshaped)
    assert beside == "cogging is beside the law of coulomb_viscous"
    instead, note = notes(
        added, (moved,), ("empirical_map",), replace(reshaped, effect="roller_spikes")
    )
    assert instead == "cogging is in the place of the law of roller_spikes"
    assert note.startswith("mass moved")
    curve = built("empirical_map", fit=built_fit(0.1, axis=axis_of(fitted("empirical_map"))))
    told, note = notes(curve, (moved,))
    assert told.startswith("empirical_map is a fitted curve, not a physical law")
    assert note.startswith("mass moved")


@pytest.mark.parametrize(
    ("action", "said"),
    [("add", "added wear to axis y"),
     ("shape", "gave wear of axis y the shape that the logs show")],
)  # fmt: skip
def test_a_step_of_a_models_history_is_said(action, said) -> None:
    assert step_in_words(HistoryStep(action, "wear", "y", 3.0, 2.0, None, None)) == said


# --- whether two fits agree ----------------------------------------------------------------


def differences(*ratios: float) -> AxisAgreement:
    """Parameters p0, p1, ... that differ by so many joint standard errors."""
    shown = [
        Difference(f"p{i}", 2.0 + i, 2.0 + i + ratio * (0.1 + 0.01 * i), 0.1 + 0.01 * i, unit, 3.1)
        for i, (ratio, unit) in enumerate(zip(ratios, ("kg", "N", "N s/m"), strict=False))
    ]
    cause = Cause("payload_mass", 0.93)
    return AxisAgreement(shown, (), (), (), (1.02, 1.07), "N", 0.0139, (cause,))


SAME = differences(0.7, -1.9, 2.3)
OTHER = replace(
    differences(11.0, -1.3, -4.7), only_a=("wear",), only_b=("gms", "cogging"),
    not_compared=("p7",), above_floor=(7.3, 1.9),
    causes=(Cause("payload_mass", 0.61, ("constant_force",)), Cause("wear", 0.23)),
)  # fmt: skip


def test_two_fits_in_json() -> None:
    found = told(Agreement({"x": SAME, "y": OTHER}, ("z",)), a="m.toml", b="n.toml")
    assert (found["a"], found["b"]) == ("m.toml", "n.toml")
    assert (found["agree"], found["not_compared"]) == (False, ["z"])
    x, y = found["axes"]["x"], found["axes"]["y"]
    assert (x["agree"], y["agree"]) == (True, False)
    assert y["differing"] == ["p0", "p2"]  # the surest first
    for axis, own in ((x, SAME), (y, OTHER)):
        for d in own.differences:
            assert axis["parameters"][d.label] == {
                "a": d.a, "b": d.b, "difference": pytest.approx(d.ratio * d.standard_error),
                "standard_error": d.standard_error, "unit": d.unit, "limit": d.limit,
                "in_standard_errors": pytest.approx((d.b - d.a) / d.standard_error),
                "differs": abs(d.ratio) > 3.1,
            }  # fmt: skip
    assert (y["only_in_a"], y["only_in_b"]) == (["wear"], ["gms", "cogging"])
    assert (y["not_compared"], y["error_over_noise_floor"]) == (["p7"], [7.3, 1.9])
    assert (y["force"], y["force_unit"]) == (0.0139, "N")
    assert y["causes"] == [
        {"effect": "payload_mass", "share": 0.61, "or": ["constant_force"]},
        {"effect": "wear", "share": 0.23, "or": []},
    ]


def test_two_fits_in_words() -> None:
    lines = agree_text(Agreement({"x": SAME, "y": OTHER}, ("z",))).splitlines()
    assert lines[0].endswith("the fits agree in all 3 parameters that can be compared")
    said = lines[lines.index("axis y: the fits differ in 2 of 3 parameters") :]
    assert said[1].startswith("  p0 differs by 1.10 kg (2.00 and 3.10 kg), 11.0 joint")
    assert said[1].endswith("allowed are 3.10")
    assert said[2].startswith("  p2 differs by -0.564 N·s/m (4.00 and 3.44 N·s/m), 4.70 joint")
    assert said[3:5] == ["  only the first fit has wear", "  only the second fit has gms, cogging"]
    assert "amount to 13.9 mN RMS" in said[5]
    assert said[6].startswith("  payload_mass or constant_force would make 61 % of this")
    assert said[7].startswith("  wear would make 23 %")
    assert "7.3 and 1.9 times the noise floor" in said[8]
    assert said[9].endswith("p7")
    assert said[10] == "axis z: not compared, as it has no intervals"
    bare = agree_text(Agreement({"y": replace(OTHER, causes=(), above_floor=(1.1, 1.0))}))
    assert "no absent effect with linear parameters has such a force" in bare
    assert "noise floor" not in bare


# --- the laws of effects -------------------------------------------------------------------


def test_laws_in_text() -> None:
    held, failed, untried = (
        verdict.Outcome(f"law {i}", holds, fault)
        for i, (holds, fault) in enumerate(((True, ""), (False, "off by 3"), (None, "after that")))
    )
    reports = [verdict.LawReport("a", (held,)), verdict.LawReport("b", (held, failed, untried))]
    assert laws_text(reports).splitlines() == [
        "a: ok: law 0", "b: ok: law 0", "b: FAILED: law 1: off by 3",
        "b: not tried: law 2: after that",
    ]  # fmt: skip


# --- the fingerprint of an effect ----------------------------------------------------------


def test_the_exemplary_motion_is_one_motion_with_the_command_that_it_takes() -> None:
    m = exemplary_motion()
    x, v, u = m.signals
    inner = slice(10, 1480)
    np.testing.assert_allclose(np.gradient(x, m.period)[inner], v[inner], atol=1e-12)
    takes = MASS * np.gradient(v, m.period) + 0.3 * np.sign(v)
    np.testing.assert_allclose(u[inner], takes[inner], atol=1e-9)
    assert (x.min(), x.max()) == pytest.approx((-0.15, 0.15))
    tops = [np.abs(v[part]).max() for part in (slice(0, 2900), slice(3100, 8900), slice(9100, -1))]
    assert tops == pytest.approx([0.15 * np.pi / half for half in (1.5, 3.0, 6.0)], rel=1e-3)
    np.testing.assert_allclose(m.others[1][10:400], np.gradient(m.others[0], m.period)[10:400])
    np.testing.assert_allclose(m.others[2][10:400], np.gradient(m.others[1], m.period)[10:400])


@pytest.mark.parametrize("name", ["quadratic_drag", "constant_force", "lugre"])
def test_a_fingerprint_is_the_force_that_an_effect_adds(name) -> None:
    effect = CATALOGUE[name]
    motion, force = signature(effect, CATALOGUE)
    v = motion.signals[1]
    if effect.kind is Kind.FRICTION:
        assert np.corrcoef(force, v)[0, 1] < -0.3
        return
    assert np.sqrt(np.mean(force**2)) == pytest.approx(FORCE, rel=0.01)
    shape = -v * np.abs(v) if name == "quadratic_drag" else np.ones_like(v)
    assert abs(force @ shape) == pytest.approx(
        np.linalg.norm(force) * np.linalg.norm(shape), rel=1e-6
    )
    assert axis_of().names == ("coulomb_viscous",)
