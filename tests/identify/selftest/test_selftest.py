"""The self-test in small: what is planted is named, and the tally counts what it should."""

import json
from dataclasses import replace

import pytest

from identify.cli import main
from identify.output.plain import plain
from identify.output.selftest import selftest_json
from identify.selftest import (
    Case,
    Design,
    TrialResult,
    confusion,
    coverage,
    draw,
    rates,
    run_all,
)
from identify.selftest.design import plantable
from identify.selftest.trial import FLOOR, STAGE, run
from twin.effects import Catalogue, load_catalogue
from twin.model.file import load_model

SLOW = pytest.mark.slow


@SLOW  # tests/test_hidden_effects.py hides one
@pytest.mark.parametrize(
    "case",
    [
        Case(("cogging",), 5.0, 1),
        Case(("thermal_drift",), 2.0, 2),
        Case(("asymmetric_friction", "axis_coupling"), 5.0, 3),
        # Delays that tie but for the last digits; a play whose basin is narrow; end stops that a
        # cogging stands in for until the rest is known; rounding that is a tone at constant speed.
        Case(("actuator_lag", "asymmetric_friction"), 5.0, 34),
        Case(("axis_coupling", "backlash"), 5.0, 10),
        Case(("asymmetric_friction", "end_stop"), 5.0, 44),
        Case(("encoder_quantization", "end_stop"), 5.0, 42),
    ],
    ids=lambda c: "+".join(c.effects),
)
def test_what_is_planted_is_named(case):
    found = run(case)
    assert found.right
    assert found.left < 1.3 < found.ratio


@SLOW
@pytest.mark.parametrize("seed", [1, 2, 3, 4, 5])
def test_nothing_planted_nothing_named(seed):
    found = run(Case((), 0.0, seed))
    assert found.quiet
    assert found.covered


@pytest.fixture
def small(monkeypatch):
    """Trials on logs of 5 s at a low rate, among five effects beside the stage's own."""
    every = load_catalogue()
    rivals = ("cogging", "quadratic_drag", "actuator_delay", "coulomb_viscous", "wear")
    own = {n for axis in load_model(STAGE, every).axes.values() for n in axis.names}
    few = Catalogue([e for n, e in every.items() if n in own.union(rivals)])
    slower = replace(load_model(STAGE, few), sample_rate=2500.0)
    monkeypatch.setattr("identify.selftest.trial.load_catalogue", lambda: few)
    monkeypatch.setattr("identify.selftest.trial.load_model", lambda name, catalogue: slower)
    monkeypatch.setattr("identify.selftest.cases.DURATION", 5.0)


def test_trials_in_small_name_what_is_planted_and_nothing_else(small):
    """One machine of each kind that the self-test counts; many of each are in the long set."""
    empty = run(Case((), 0.0, 1))
    assert empty.quiet
    assert empty.covered
    # Ten times the floor: far above what a log of 5 s needs, so any seed will do.
    hidden = run(Case(("cogging",), 10.0, 1))
    assert hidden.right
    assert hidden.left < FLOOR < 5.0 < hidden.ratio
    unknown = run(Case(("cogging",), 10.0, 1, known=False))
    assert unknown.verdict == "UNEXPLAINED"
    assert unknown.depends_on == "position"
    assert unknown.honest


@SLOW
@pytest.mark.parametrize(
    ("effect", "seed", "coordinate"),
    [("cogging", 1002, "position"), ("quadratic_drag", 1, "velocity")],
)
def test_an_effect_taken_out_of_the_catalogue_is_unexplained(effect, seed, coordinate):
    found = run(Case((effect,), 5.0, seed, known=False))
    assert found.verdict == "UNEXPLAINED"
    assert found.depends_on == coordinate
    assert found.honest


def test_a_design_plants_every_physical_effect_the_stage_lacks():
    catalogue = load_catalogue()
    names = plantable(catalogue)
    own = load_model(STAGE, catalogue).axes["x"].names
    described = [n for n, e in catalogue.items() if e.is_nonparametric]
    assert sorted([*names, *own, *described]) == list(catalogue)
    cases = Design(strengths=(2.0, 5.0), each=2, empty=3, pairs=4, left_out=1).cases(1)
    assert len(cases) == 3 + 2 * 2 * len(names) + 4 + len(names)
    assert len(set(cases)) == len(cases)


# --- the tally, on invented outcomes --------------------------------------------------------

NAMED = TrialResult(Case(("a",), 5.0, 1), "MISSING_EFFECT", (("a",),), ratio=5.0, left=1.0)
TIED = replace(NAMED, verdict="AMBIGUOUS", answers=(("b", "a"),))
WRONG = replace(NAMED, answers=(("b",),))
MISSED = replace(NAMED, verdict="UNEXPLAINED", answers=())
ALARM = TrialResult(Case((), 0.0, 1), "MISSING_EFFECT", (("b",),), covered=(("mass", False),))
QUIET = TrialResult(Case((), 0.0, 2), "NOTHING_MISSING", covered=(("mass", True),))
LOST = TrialResult(
    Case(("a",), 5.0, 1, known=False), "UNEXPLAINED", left=5.0, depends_on="time",
    coordinates=("position",),
)  # fmt: skip


def counts(outcomes):
    return {r.what.split(",")[0]: (r.count, r.trials) for r in rates(outcomes)}


def test_right_ambiguous_wrong_and_missed_are_told_apart():
    assert [o.right for o in (NAMED, TIED, WRONG, MISSED)] == [True, True, False, False]
    found = counts([NAMED, TIED, WRONG, MISSED])
    assert found["named or in a declared ambiguity"] == (2, 4)
    assert found["wrong names given with confidence"] == (1, 4)


def test_false_alarms_and_coverage_are_counted():
    assert counts([ALARM, QUIET])["false alarms"] == (1, 2)
    assert coverage([ALARM, QUIET])["mass"].value == 0.5


def test_an_unexplained_effect_needs_its_own_coordinate_or_the_floor():
    assert not LOST.honest
    assert replace(LOST, depends_on="position").honest
    assert not replace(LOST, verdict="MISSING_EFFECT", answers=(("b",),), left=1.5).honest
    assert replace(LOST, verdict="MISSING_EFFECT", answers=(("b",),), left=1.1).honest


def test_one_of_two_named_is_not_enough():
    both = replace(NAMED, case=Case(("a", "b"), 5.0, 1))
    assert not both.right
    assert replace(both, answers=(("b",), ("c", "a"))).right
    assert not replace(both, answers=(("a", "b"), ("c",))).right
    assert not replace(both, answers=(("a",), ("b",), ("c",))).right


def test_the_picture_shows_every_answer(tmp_path):
    table = confusion([NAMED, TIED, WRONG, MISSED, ALARM, QUIET])
    assert table["a"] == {"a": 0.25, "ambiguous with it": 0.25, "b": 0.25, "unexplained": 0.25}
    assert table["nothing"] == {"b": 0.5, "nothing": 0.5}
    draw([NAMED, TIED, WRONG, MISSED, ALARM, QUIET], tmp_path / "matrix.svg")
    text = (tmp_path / "matrix.svg").read_text(encoding="utf-8")
    assert "<svg" in text


def test_a_failing_machine_is_named():
    with pytest.raises(RuntimeError, match="no such effect"):
        run_all([Case(("no such effect",), 5.0, 1)], workers=1)


def test_bad_input_is_one_line(tmp_path, capsys, monkeypatch):
    for given, said in (
        (["--only", "coging"], "did you mean 'cogging'?"),
        (["-o", str(tmp_path / "no" / "m.png")], "folder does not exist"),
    ):
        monkeypatch.setattr("sys.argv", ["twin", "selftest", *given])
        with pytest.raises(SystemExit) as stopped:
            main()
        assert stopped.value.code == 2
        error = capsys.readouterr().err
        assert said in error
        assert error.count("\n") == 1


def test_the_json_holds_every_trial():

    text = json.dumps(plain(selftest_json([NAMED, QUIET])))
    assert len(json.loads(text)["trials"]) == 2
